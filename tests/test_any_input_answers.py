"""Input in other forms: bounds, geometries, single names and colour maps have their answers, the rest one line."""

import matplotlib
import numpy as np
import pyproj
import pytest
from public_calls import CAP, SQUARE, axes
from tables import each

import projdist
from projdist import plots

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
