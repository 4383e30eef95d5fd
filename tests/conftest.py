"""What all tests share."""

import functools
import gc
import importlib.util
import os
import signal
import sys
from collections.abc import Iterator

import pytest
import typer.main
import typer.testing
from hypothesis import settings

EXTRAS = ("anywidget", "cartopy", "geopandas", "pandas", "rasterio", "xarray")

# Their examples take half a second and more, and have fast tests beside them.
SLOW_EXAMPLES = """
answers.corrections.correct decisions.optimization.optimize field.field.Field.geometric_median
gis.rasters.measure_arrays decisions.data_checks.estimate_crs decisions.recommendation.recommend
decisions.low_distortion.ldp designs.averaging.mean_map designs.making.design gis.accessors.FrameAccessor
gis.layers.old_map_layers plots.geoaxes.add_heatmap plots.geoaxes.add_tissot plots.geoaxes.to_cartopy
plots.morphs.morph plots.shape_space.space_figure
""".split()

# Tests run in as many processes as there are cores: BLAS's threads would only wait for each other. Before numpy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Tests start many processes, each of which would compile projdist anew, and so would each of pytest's own.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# The same examples every time, and no deadline: a busy machine is no failure.
settings.register_profile("projdist", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("projdist")


def pytest_collection() -> None:
    """What is made while tests are collected stays: looking for garbage among it takes a third of that time."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Nor is it looked through in every test."""
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Examples of docstrings that import an extra are skipped without it, as tests are; slow ones are marked."""
    for item in items:
        if isinstance(item, pytest.DoctestItem):
            if item.name.removeprefix("projdist.") in SLOW_EXAMPLES:
                item.add_marker(pytest.mark.slow)
            text = "".join(example.source for example in item.dtest.examples) if item.dtest else ""
            missing = [name for name in EXTRAS if f"import {name}" in text and importlib.util.find_spec(name) is None]
            if missing:
                item.add_marker(pytest.mark.skip(reason=f"needs {missing[0]}"))


@pytest.fixture
def few_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of regions of a two-hundredth of the cells, where a test asks for what does not hang on them."""
    monkeypatch.setattr("projdist.web.page._NODES", 200)
    monkeypatch.setattr("projdist.surfaces.surface._REGION_NODES", 15)
    monkeypatch.setattr("projdist.surfaces.surface._GLOBE_STEP", 4.0)
    monkeypatch.setattr("projdist.surfaces.regional._GROUND_NODES", 15)


@pytest.fixture(scope="session", autouse=True)
def command_line_made_once() -> Iterator[None]:
    """Typer makes the command line of its functions in 40 ms: once for all tests that run it, not in each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.testing, "_get_command", functools.cache(typer.main.get_command), raising=False)
        yield


@pytest.fixture(scope="session", autouse=True)
def no_progress_in_pipes() -> Iterator[None]:
    """A busy machine is no reason for a line on standard error; who tests the line sets its time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("projdist.cli.errors._MOMENT_IN_A_PIPE", 3600.0)
        yield


@pytest.fixture
def default_signals() -> Iterator[None]:
    """As in a terminal, also where pytest runs under nohup or in the background: processes inherit what is ignored."""
    from projdist.support import signals  # which loads numpy

    kept = {number: signal.getsignal(number) for number in signals._SIGNALS}
    for number in signals._SIGNALS:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    yield
    for number, handler in kept.items():
        signal.signal(number, handler)
