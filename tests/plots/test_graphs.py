"""Graphs: distributions and profiles."""

import numpy as np
import pytest
import shapely

from projdist import plots, profile, sample
from projdist.plots.graphs import areas, overlaps, pareto_front


def curve(figure: object, k: int = 0) -> tuple[np.ndarray, np.ndarray]:
    line = figure.axes[0].get_lines()[k]  # type: ignore[attr-defined]
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def test_cumulative_curve_of_mercator() -> None:
    """Its scale is at most K where cos(lat) >= 1 / K: on the sphere a share sqrt(1 - 1 / K^2)."""
    figure = plots.distribution_figure("+proj=merc +R=6371000", "cumulative", measure="k", region="globe")
    k, share = curve(figure)
    inside = (k > 1.01) & (k < 5.0)
    assert inside.sum() > 100
    # The lattice has 200,000 points: shares are good to some of them.
    np.testing.assert_allclose(share[inside], 100.0 * np.sqrt(1.0 - 1.0 / k[inside] ** 2), atol=0.03)


def test_histogram_of_a_scale() -> None:
    """Bins have their closed form, and with what lies beyond them they sum to all of the area."""
    figure = plots.distribution_figure("+proj=merc +R=6371000", measure="k", region="globe")
    steps = figure.axes[0].patches[0]
    shares, edges, _ = steps.get_data()
    below = np.sqrt(1.0 - 1.0 / np.maximum(edges, 1.0) ** 2)
    np.testing.assert_allclose(shares, 100.0 * np.diff(below), atol=0.05)
    (text,) = figure.axes[0].get_legend().get_texts()
    assert text.get_text().endswith(f"({100.0 * (1.0 - below[-1]):.2g} % beyond)")


@pytest.mark.parametrize("name", ["robin", "mercator", "moll", "laea"])
def test_areas_and_angles_make_the_error(name: str) -> None:
    """The squares of both parts sum to that of the scaled Airy-Kavrayskiy error."""
    field = sample(name, "globe", tolerance=1e-5)
    angles, areas = field.angles_and_areas
    assert np.hypot(angles, areas) == pytest.approx(field.airy_kavrayskiy.scaled, rel=1e-4)
    assert (angles < 1e-4) == (name == "mercator")
    assert (areas < 5e-3) == (name in ("moll", "laea"))


def test_the_front() -> None:
    """What none is below in both, from the left; ties are one."""
    points = np.array([[0.0, 3.0], [1.0, 2.0], [1.5, 2.5], [2.0, 1.0], [2.2, 1.0 - 1e-6], [2.5, 0.5]])
    assert pareto_front(points, 1e-3) == [0, 1, 3, 5]
    assert pareto_front(points, 1e-9) == [0, 1, 3, 4, 5]


def test_what_labels_hide() -> None:
    """What boxes have in common, and outside of a frame, is as large as shapely has it; corners touch in none."""
    boxes = [(0.0, 0.0, 2.0, 1.0), (1.0, -3.0, 5.0, 0.25), (2.0, 1.0, 3.0, 3.0), (-1.0, -1.0, 4.0, 4.0)]
    common = overlaps(np.array(boxes), np.array(boxes))
    outside = areas(np.array(boxes))[:, None] - common
    for k, one in enumerate(boxes):
        for n, other in enumerate(boxes):
            assert common[k, n] == shapely.box(*one).intersection(shapely.box(*other)).area
            assert outside[k, n] == shapely.box(*one).difference(shapely.box(*other)).area


@pytest.mark.slow
def test_labels_do_not_overlap() -> None:
    """Each map of the trade has its name, and none hides another."""
    maps = ["robin", "moll", "mercator", "eqearth", "eck4", "wag4", "hammer", "kav7", "winkel-tripel", "natearth"]
    figure = plots.distribution_figure(maps, "pareto", region="globe")
    boxes = [text.get_window_extent().extents for text in figure.axes[0].texts]
    assert len(boxes) == len(maps)
    for k, (west, south, east, north) in enumerate(boxes):
        for other in boxes[:k]:
            assert other[0] >= east or other[2] <= west or other[1] >= north or other[3] <= south


def test_curves_are_the_profile() -> None:
    """A panel for the scale, one for heights, one a measure; parts per million at the right are off 1."""
    found = profile("EPSG:32632", [(9, 48, 300), (10, 48, 500), (12, 49, 400)], measures=["convergence", "omega"])
    figure = plots.profile_figure(found)
    scale, ppm, height, convergence, _ = figure.axes
    curves = scale.get_lines()
    np.testing.assert_array_equal(curves[0].get_xdata(), found.distance_km)
    np.testing.assert_array_equal(curves[0].get_ydata(), found.scale)
    np.testing.assert_array_equal(height.get_lines()[0].get_ydata(), found.height)
    np.testing.assert_array_equal(convergence.get_lines()[0].get_ydata(), found.measures["convergence"])
    np.testing.assert_allclose(ppm.get_ylim(), 1e6 * (np.array(scale.get_ylim()) - 1.0))
    assert f"mean {found.mean_scale:.7g}" in scale.get_legend().get_texts()[0].get_text()


def test_curves_end_where_the_map_is_torn() -> None:
    """No line is drawn across the antimeridian, where Robinson's map is cut."""
    figure = plots.profile_figure(profile("robin", [(170, 10), (-170, 30)]))
    values = figure.axes[0].get_lines()[0].get_ydata()
    assert np.isnan(values).sum() == 1
    plain = plots.profile_figure(profile("robin", [(150, 10), (170, 30)]))
    assert not np.isnan(plain.axes[0].get_lines()[0].get_ydata()).any()
