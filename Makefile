# Two commands: `make demo` shows what projdist does, `make test` shows that it works.
# The virtual environment is .venv, that of `make test PYTHON=python3.13` is .venv-3.13; they follow pyproject.toml.

PYTHON ?= python3
VENV := .venv$(if $(findstring command,$(origin PYTHON)),-$(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])'))
BIN := $(VENV)/bin
DEMO := robinson mollweide winkel-tripel equal-earth mercator

# The oldest versions have wheels for this Python, and not for newer ones.
OLDEST_PYTHON ?= python3.11
OLD := .venv-oldest

.PHONY: demo test test-slow test-oldest test-wheel coverage lint types docs notebooks notebooks-check atlas atlas-pages gallery world-maps reference-factors benchmarks benchmarks-check benchmarks-record browser clean

demo: $(VENV)/installed
	@mkdir -p demo
	$(BIN)/projdist compare $(DEMO)
	$(BIN)/projdist tissot $(DEMO) -o demo/tissot.png --overwrite
	$(BIN)/projdist heatmap $(DEMO) --measure omega -o demo/omega.png --overwrite
	@echo "Pictures: $(CURDIR)/demo/tissot.png $(CURDIR)/demo/omega.png"

test: $(VENV)/installed-test
	$(BIN)/python -m pytest -m "not slow" -n auto --dist worksteal

test-slow: $(VENV)/installed-test
	$(BIN)/python -m pytest -m slow -n auto --dist worksteal

# What some tests need besides Python.
debian:
	.ci/install-debian

# What the fast tests do not run, line by line and branch by branch.
coverage: $(VENV)/installed-test
	$(BIN)/python -m pytest -m "not slow" -n auto --cov --cov-report=term

# Old libraries use what newer ones of those that they use will drop.
test-oldest: $(OLD)/installed
	$(OLD)/bin/python -m pytest -m "not slow" -n auto --dist worksteal -W ignore::DeprecationWarning -W ignore::PendingDeprecationWarning

test-wheel:
	PYTHON=$(PYTHON) .ci/test-wheel

lint: $(VENV)/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/installed-test
	$(BIN)/mypy

# The notebooks with their outputs, anew; and whether they still run and say the same.
notebooks: $(VENV)/installed-notebook
	$(BIN)/python notebooks/run.py

notebooks-check: $(VENV)/installed-notebook
	$(BIN)/python notebooks/run.py --check

gallery: $(VENV)/installed
	$(BIN)/python tools/draw_gallery.py
	$(BIN)/python tools/draw_guides.py

world-maps: $(VENV)/installed
	$(BIN)/python tools/measure_world_maps.py

reference-factors: $(VENV)/installed-test
	$(BIN)/python tools/make_reference_factors.py

# An hour and a half on two cores; it goes on where it was stopped.
atlas: $(VENV)/installed-test
	$(BIN)/python tools/measure_atlas.py
	$(BIN)/python tools/atlas_pages.py

# The page and the pictures of the atlas from its data.
atlas-pages: $(VENV)/installed-test
	$(BIN)/python tools/atlas_pages.py

benchmarks: $(VENV)/installed-test
	$(BIN)/python benchmarks/run.py
	$(BIN)/python benchmarks/means.py
	$(BIN)/python benchmarks/recommend.py

# What has become slower by a tenth; `make benchmarks-record` adds to benchmarks/history.csv.
benchmarks-check: $(VENV)/installed-test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python benchmarks/check.py

benchmarks-record: $(VENV)/installed-test
	OPENBLAS_NUM_THREADS=1 $(BIN)/python benchmarks/check.py --record

# The site: docs/_build/html/index.html.
docs: $(VENV)/installed-docs
	$(BIN)/python -m sphinx -W --keep-going -j auto -q docs docs/_build/html

clean:
	rm -rf .venv .venv-* demo docs/_build docs/made

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "projdist needs Python 3.11 or newer.")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(VENV)/installed-test: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	@touch $@ $(VENV)/installed

$(OLD)/installed: pyproject.toml .ci/oldest.py
	rm -rf $(OLD)
	$(OLDEST_PYTHON) -m venv $(OLD)
	$(OLDEST_PYTHON) .ci/oldest.py > $(OLD)/constraints.txt
	$(OLD)/bin/python -m pip install --quiet --disable-pip-version-check -c $(OLD)/constraints.txt -e '.[test]'
	@touch $@

$(VENV)/installed-docs: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	@touch $@ $(VENV)/installed

$(VENV)/installed-notebook: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[notebook]'
	@touch $@ $(VENV)/installed
