"""Every public function with input of every kind: an answer, or one clear line of projdist's own."""

import inspect
import warnings
from pathlib import Path

import matplotlib
import numpy as np
import pyproj
import pytest
from public_calls import CALLS, CAP, SQUARE, axes, parameters_of
from tables import each

import projdist
from projdist import plots

STRANGE = {
    "None": None,
    "True": True,
    "0": 0,
    "-1.5": -1.5,
    "nan": float("nan"),
    "inf": float("inf"),
    "complex": 1j,
    "empty text": "",
    "text": "nonsense",
    "long text": "n" * 300,
    "bytes": b"robin",
    "path": Path("nonsense.xyz"),
    "list": [],
    "bounds": (8.0, 48.0, 12.0, 52.0),
    "nested": [[1, [2, "x"]], [3]],
    "texts": ["robin", "x"],
    "dict": {},
    "other dict": {"a": 1},
    "set": {1, 2},
    "array": np.array([1.0, 2.0, 3.0]),
    "array of objects": np.array([None, "x"], dtype=object),
    "CRS": pyproj.CRS("EPSG:3857"),
    "Proj": pyproj.Proj("+proj=merc"),
    "geometry": SQUARE,
    "region": CAP,
    "ellipsoid": projdist.SPHERE,
    "object": object(),
    "class": int,
    "function of none": lambda: 0,
    "function": lambda value: value,
}

# A picture takes a moment each time that it is drawn.
FEW = ("-1.5", "nan", "text", "bytes", "list", "bounds", "nested", "dict", "array of objects", "CRS", "object")
TAKES_FUNCTIONS = {
    "projection",
    "projections",
    "measure",
    "measures",
    "criterion",
    "figure",
    "jacobian",
    "map_distance",
    "against",
    "crs",
}


def public_functions() -> dict[str, object]:
    """The functions of `projdist` and `projdist.plots` by name."""
    found = {name: getattr(projdist, name) for name in projdist.__all__}
    found |= {f"plots.{name}": getattr(plots, name) for name in plots.__all__}
    return {name: value for name, value in found.items() if inspect.isfunction(value)}


def complaint(function: object, arguments: dict[str, object]) -> str:
    """What is wrong with how a function takes its arguments; nothing where it answers, or refuses them clearly."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", projdist.Notice)
        try:
            function(**arguments)
        except OSError:
            return ""  # of the system's own words
        except (ValueError, TypeError) as error:
            text = str(error)
            clear = text.startswith("Invalid ") and text.endswith(".") and "\n" not in text and len(text) < 600
            return "" if clear else f"{type(error).__name__}: {text}"
        except Exception as error:  # noqa: BLE001 whatever else it raises is what the test is about
            return f"{type(error).__name__}: {error}"
    return ""


def test_every_public_function_is_tried() -> None:
    """But for those that take nothing."""
    assert set(public_functions()) - {"atlas_names", "projection_names"} == set(CALLS)


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_arguments_of_any_kind(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each argument in turn is given numbers, text, sequences, objects, functions."""
    monkeypatch.setattr("projdist.surfaces.surface._REGION_NODES", 30)  # a fiftieth of the cells
    function, wrong = public_functions()[name], []
    for parameter in parameters_of(name, function):
        for kind in FEW if name.startswith("plots.") else STRANGE:
            value = STRANGE[kind]
            if callable(value) and parameter in TAKES_FUNCTIONS:
                continue  # what a function of the user's raises goes through
            text = complaint(function, CALLS[name]() | {parameter: value})
            if text:
                wrong.append(f"{parameter} = {kind}: {text}")
    assert not wrong, "\n".join(wrong)


# ---- answers and refusals --------------------------------------------------------------------------


BOUNDS = (-10, 35, 30, 70)


@pytest.mark.parametrize("bounds", [BOUNDS, list(BOUNDS), np.array(BOUNDS)], ids=["tuple", "list", "array"])
def test_bounds_are_a_box(bounds: object) -> None:
    """West, south, east, north, as other programs give them."""
    assert projdist.get_region(bounds) == projdist.Box(-10.0, 35.0, 30.0, 70.0)


def test_a_geometry_is_a_region() -> None:
    """Of shapely, by what it says of itself: a square has the area of its box."""
    area = projdist.get_region(SQUARE).area_km2
    assert area == pytest.approx(projdist.Box(8, 48, 12, 52).area_km2, rel=1e-8)  # as areas of polygons are


@each(
    "one",
    [
        "robin",
        pyproj.CRS("EPSG:3857"),
        3857,
        ("EPSG", 3857),
        {"proj": "moll"},
        projdist.Projection.from_user_input("moll"),
    ],
)
def test_a_single_projection_is_one(one: object) -> None:
    """And not its letters: the result is that of a list with it alone."""
    results, listed = (projdist.compare(value, CAP, tolerance=1e-3).results for value in (one, [one]))
    assert [result.airy_kavrayskiy for result in results] == [result.airy_kavrayskiy for result in listed]
    assert len(results) == 1


def test_a_single_measure_is_one() -> None:
    """By its name, as a Measure and as a function."""
    for measure in ("omega", projdist.get_measure("omega"), projdist.MEASURES["angular_distortion"].function):
        found = projdist.summarize("merc", CAP, measures=measure, tolerance=1e-3).measures
        assert [value.max < 1e-6 for value in found.values()] == [True]  # conformal
    assert list(projdist.factors("robin", 10, 50, measures="airy").extra) == ["airy"]
    assert not projdist.factors("robin", 10, 50, measures=None).extra


def test_fields_take_names_and_text() -> None:
    """The areal scale of the plate carree is 1 / cos(lat), whose mean over the globe is pi / 2."""
    found = projdist.sample("plate-carree", "globe", measures="s")
    for measure in ("s", projdist.get_measure("s"), projdist.MEASURES["areal_scale"].function):
        assert found.mean(measure).value == pytest.approx(np.pi / 2, rel=1e-6)


@pytest.mark.slow
def test_a_colour_map_of_matplotlib_goes_wherever_a_name_does() -> None:
    """The same colours as by its name."""
    by_name, by_map = (
        plots.heatmap(axes(), "robin", region=CAP, cmap=given).colours
        for given in ("magma", matplotlib.colormaps["magma"])
    )
    np.testing.assert_array_equal(by_name(np.linspace(0, 1, 9)), by_map(np.linspace(0, 1, 9)))


@each(
    ("call", "message"),
    [
        (lambda: projdist.summarize("robin", True), r"^Invalid region 'True'\. It must be globe, "),
        (lambda: projdist.summarize("robin", [1, 2, 3]), r"^Invalid region '\[1, 2, 3\]'\. It must be globe, "),
        (
            lambda: projdist.summarize("robin", CAP, tolerance="small"),
            r"^Invalid tolerance 'small'\. It must be a number",
        ),
        (lambda: projdist.summarize("robin", CAP, measures=5), r"^Invalid measure '5'\. It must be one of fisher, "),
        (lambda: projdist.factors("robin", "here", 50), r"^Invalid longitudes 'here'\. They must be numbers\.$"),
        (lambda: projdist.factors("robin", [1, 2], [1, 2, 3]), r"^Invalid points\. .* shapes \(2,\) and \(3,\)"),
        (lambda: projdist.correct("robin", CAP, constraint=["affine"]), r"^Invalid constraint \"?'\['affine'\]'"),
        (lambda: plots.tissot(5, "robin"), r"^Invalid axes '5'\. It must be Axes of matplotlib\.$"),
        (lambda: plots.heatmap(axes(), "robin", region=CAP, cmap=5), r"^Invalid colour map '5'\. It must be a name "),
        (
            lambda: plots.tissot_figure("robin", region=CAP, size="big"),
            r"^Invalid size 'big'\. They must be numbers\.$",
        ),
    ],
)
def test_wrong_kinds_are_refused_in_one_line(call: object, message: str) -> None:
    """What no function takes is said with its value."""
    with pytest.raises(ValueError, match=message):
        call()
