# Two commands: `make demo` shows what projdist does, `make test` shows that it works.
# The virtual environment is .venv; it is made anew when pyproject.toml changes.

PYTHON ?= python3
BIN := .venv/bin
DEMO := robinson mollweide winkel-tripel equal-earth mercator

.PHONY: demo test test-slow lint types notebooks gallery world-maps benchmarks clean

demo: .venv/installed
	@mkdir -p demo
	$(BIN)/projdist compare $(DEMO)
	$(BIN)/projdist tissot $(DEMO) -o demo/tissot.png --overwrite
	$(BIN)/projdist heatmap $(DEMO) --measure omega -o demo/omega.png --overwrite
	@echo "Pictures: $(CURDIR)/demo/tissot.png $(CURDIR)/demo/omega.png"

test: .venv/installed-test
	$(BIN)/python -m pytest -m "not slow" -n auto

test-slow: .venv/installed-test
	$(BIN)/python -m pytest -m slow -n auto

lint: .venv/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: .venv/installed-test
	$(BIN)/mypy

notebooks: .venv/installed-notebook
	$(BIN)/python notebooks/run.py

gallery: .venv/installed
	$(BIN)/python docs/make_gallery.py

world-maps: .venv/installed
	$(BIN)/python docs/make_world_maps.py

benchmarks: .venv/installed-test
	$(BIN)/python benchmarks/run.py
	$(BIN)/python benchmarks/means.py
	$(BIN)/python benchmarks/recommend.py

clean:
	rm -rf .venv demo

.venv/bin/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "projdist needs Python 3.11 or newer.")'
	$(PYTHON) -m venv .venv

.venv/installed: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

.venv/installed-test: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	@touch $@ .venv/installed

.venv/installed-notebook: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[notebook]'
	@touch $@ .venv/installed
