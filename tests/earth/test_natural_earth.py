"""The shipped land: decoded, cut at the antimeridian, of the right area."""

import numpy as np
import pytest
import shapely

from projdist.earth.natural_earth import RESOLUTIONS, coastlines, land

LAND_AREA = 148.94 / 510.07  # million km2, CIA World Factbook; without Natural Earth's ice shelves 1 % less


def spherical_share(area: shapely.MultiPolygon) -> float:
    """Share of the unit sphere: the integral of sin(lat) dlon round the rings, with short steps."""
    total = 0.0
    for polygon in area.geoms:
        for ring, sign in [(polygon.exterior, 1.0), *((hole, -1.0) for hole in polygon.interiors)]:
            lon, lat = np.radians(shapely.get_coordinates(shapely.segmentize(ring, 0.2))).T
            sin = np.sin(lat)
            total += sign * abs(float(np.sum(np.diff(lon) * (sin[1:] + sin[:-1]) / 2)))
    return total / (4.0 * np.pi)


@pytest.mark.parametrize(("resolution", "tolerance"), [("110m", 0.03), ("50m", 0.02)])
def test_land_area(resolution: str, tolerance: float) -> None:
    """The land is 29 % of the Earth."""
    assert spherical_share(land(resolution)) == pytest.approx(LAND_AREA, rel=tolerance)


@pytest.mark.parametrize("resolution", RESOLUTIONS)
def test_land_is_valid_and_within_the_globe(resolution: str) -> None:
    """The polygons are valid, and no longitude is beyond 180."""
    area = land(resolution)
    assert area.is_valid
    west, south, east, north = area.bounds
    assert (west, south, east) == (-180.0, -90.0, 180.0)
    assert 83.0 < north < 84.0


@pytest.mark.parametrize("resolution", RESOLUTIONS)
def test_known_places(resolution: str) -> None:
    """Places on land and at sea, also at the pole, at the antimeridian and in the Caspian Sea."""
    dry = np.array([(2.35, 48.85), (-58.4, -34.9), (0.0, -89.5), (179.0, 67.0), (-179.0, 67.0), (134.0, -25.0)])
    wet = np.array([(0.0, 0.0), (-150.0, 0.0), (0.0, 90.0), (51.0, 42.0), (180.0, 0.0), (60.0, -30.0)])
    assert shapely.contains_xy(land(resolution), *dry.T).all()
    assert not shapely.contains_xy(land(resolution), *wet.T).any()


@pytest.mark.parametrize("resolution", RESOLUTIONS)
def test_coastlines_have_no_cuts(resolution: str) -> None:
    """No step is long, none runs along the antimeridian or round the pole."""
    for line in coastlines(resolution):
        steps = np.abs(np.diff(line, axis=0))
        assert steps.max() < 10.0
        on_cut = np.abs(np.abs(line[:, 0]) - 180.0) < 1e-6
        assert not (on_cut[1:] & on_cut[:-1]).any()
        assert np.abs(line[:, 1]).max() < 89.9


def test_coast_is_the_edge_of_the_land() -> None:
    """Every point of the coastline lies on the boundary of the land."""
    points = np.concatenate(coastlines("110m"))
    points[:, 0] = np.mod(points[:, 0] + 180.0, 360.0) - 180.0
    distance = shapely.distance(shapely.boundary(land("110m")), shapely.points(points))
    assert distance.max() < 1e-9  # degrees


def test_unknown_resolution() -> None:
    """An unknown resolution is refused with the known ones."""
    with pytest.raises(ValueError, match=r"Invalid resolution '10m'. It must be one of 110m, 50m."):
        land("10m")
