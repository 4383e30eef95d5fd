"""Measures of one map against another's, at the same places."""

import numpy as np
import pytest

from projdist import Projection, get_measure, plots
from projdist.plots.figures import field_against
from projdist.surfaces import surface_of


def test_a_scale_is_divided() -> None:
    """Areal scales: 1 / cos(lat) of the plate carree over 1 / cos(lat)^2 of Mercator is cos(lat)."""
    surface = surface_of("plate-carree", "box:-60,-50,60,70")
    values = field_against(surface, get_measure("s"), Projection.from_user_input("mercator"))
    lat = surface.lonlat()[1][: surface.nodes]
    inside = np.isfinite(values[: surface.nodes]) & (np.abs(lat) < 85)
    np.testing.assert_allclose(values[: surface.nodes][inside], np.cos(np.radians(lat[inside])), rtol=1e-8)


def test_others_are_subtracted() -> None:
    """Of Mercator omega is 0: the plate carree's own is left, and its negative the other way round."""
    measure = get_measure("omega")
    for one, other, sign in (("plate-carree", "mercator", 1.0), ("mercator", "plate-carree", -1.0)):
        surface = surface_of(one, "box:-60,-50,60,70")
        values = field_against(surface, measure, Projection.from_user_input(other))[: surface.nodes]
        k = 1.0 / np.cos(np.radians(surface.lonlat()[1][: surface.nodes]))
        omega = np.degrees(2.0 * np.arcsin((k - 1.0) / (k + 1.0)))
        inside = np.isfinite(values)
        np.testing.assert_allclose(values[inside], sign * omega[inside], atol=1e-5)  # conformality is good to 1e-7 rad


@pytest.mark.usefixtures("few_cells")
def test_differences_of_directions_go_the_shorter_way() -> None:
    """None is more than half a turn: of polar maps convergences are lon - lon_0, and theirs differ by lon_0."""
    surface = surface_of("+proj=stere +lat_0=90", "box:-180,50,180,85")
    for meridian in (90.0, -90.0):
        other = Projection.from_user_input(f"+proj=stere +lat_0=90 +lon_0={meridian}")
        values = field_against(surface, get_measure("convergence"), other)
        np.testing.assert_allclose(values[np.isfinite(values)], meridian, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("maps", "measure", "label"),
    [
        (["robin"], "omega", "Angular distortion omega (degrees): Robinson less Mollweide"),
        (["robin", "eqearth"], "s", "Areal scale: each map over Mollweide"),
    ],
)
def test_the_bar_says_what_is_compared(maps: list[str], measure: str, label: str) -> None:
    """One map by its name, and what it is compared with."""
    figure = plots.heatmap_figure(maps, measure=measure, against="moll", region="box:0,0,40,40")
    place = "0° to 40°E, 0° to 40°N"  # above the only map, else at the foot
    assert figure.axes[-1].get_xlabel() == label + (f", over {place}" if len(maps) > 1 else "")
