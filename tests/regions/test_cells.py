"""Cells of polygons: areas and middles against clipped polygons, sums of areas, seams and poles."""

import numpy as np
import pytest
import shapely
from tables import each

from projdist.earth import GEOS_ARITHMETIC, SPHERE, WGS84
from projdist.regions import cells_of, get_region
from projdist.regions.region import patch_chart, tightened

# The edges of GEOS's clips in pieces of so many degrees. Halved, the areas come nearer by a factor of four: to 1.5e-7.
_PIECE = 0.003


@GEOS_ARITHMETIC
def clipped(region, cells, i):
    """The polygons' part of a cell by GEOS, in longitude and sine of latitude, where areas are those of the sphere."""
    west, east, *ends = cells.rectangle[i]
    south, north = np.sort(patch_chart(cells.patch[i], np.zeros(2), np.array(ends)).lat)
    box = shapely.box(west, south, east, north)
    turned = shapely.transform(region.geometry, lambda p: p + np.array([360.0, 0.0]))
    parts = [shapely.intersection(geometry, box) for geometry in (region.geometry, turned)]
    dense = shapely.segmentize(shapely.union_all(parts), _PIECE)
    return shapely.transform(dense, lambda p: np.column_stack([np.radians(p[:, 0]), np.sin(np.radians(p[:, 1]))]))


@pytest.mark.parametrize("name", ["country:CH", "country:FJ", "country:AQ@110m", "country:NZ"])
def test_cells_are_what_geos_clips(name: str) -> None:
    """Areas to 2e-7, middles in longitude to 2e-7 of a cell's width."""
    region = get_region(name)
    cells = cells_of(region, SPHERE, 200)
    for i in range(0, cells.area.size, 7):
        truth, width = clipped(region, cells, i), np.ptp(cells.rectangle[i, :2])
        assert cells.area[i] == pytest.approx(SPHERE.a**2 * truth.area, rel=2e-7)
        assert cells.u[i] == pytest.approx(np.degrees(truth.centroid.x), abs=2e-7 * width)
        if cells.patch[i] == 0:
            low, high = np.degrees(np.arcsin(np.array(truth.bounds)[[1, 3]]))
            # The mean of the latitude is the latitude of the mean sine but for its variance, times its tangent / 2.
            away = np.radians(high - low) * (high - low)
            assert cells.v[i] == pytest.approx(np.degrees(np.arcsin(truth.centroid.y)), abs=away)


@each("count", [50, 2000])
@each("name", ["country:CA", "country:FJ", "country:AQ", "country:CL", "land@110m", "ocean@110m"])
def test_areas_add_up(name: str, count: int) -> None:
    """To the region's area, nothing lost at poles and the antimeridian; and there are about as many as asked for."""
    region = get_region(name)
    cells = cells_of(region, WGS84, count)
    assert cells.area.sum() / 1e6 == pytest.approx(region.area_km2, rel=1e-9)
    assert count / 2 < cells.area.size < 4 * count + 40 * np.sqrt(count)
    assert cells.area.min() > 0.0
    u0, u1, v0, v1 = cells.rectangle.T
    assert ((u0 <= cells.u) & (cells.u <= u1) & (v0 <= cells.v) & (cells.v <= v1)).all()


@pytest.mark.parametrize("name", ["country:MC", "country:KY"])
def test_areas_of_small_countries(name: str) -> None:
    """Many cells of a few corners, some of which touch a cell in one point only."""
    region = get_region(name)
    assert cells_of(region, WGS84, 5000).area.sum() / 1e6 == pytest.approx(region.area_km2, rel=1e-7)


def test_what_is_of_no_height_is_tightened() -> None:
    """To its latitude, as on a side between cells; also where no number is between its ends."""
    assert tightened(43.0, 44.0, 43.0, 43.0) == (43.0, 43.0)
    assert tightened(43.0, 44.0, 43.7, 43.7) == (43.7, 43.7)
    above = float(np.nextafter(43.0, 44.0))
    assert tightened(43.0, 44.0, 43.0, above) == (43.0, above)


def test_a_box_of_edges() -> None:
    """Two islands and a lake whose edges lie along the sides of panels and cells: areas in closed form."""
    shell = [[0.0, 0.0], [16.0, 0.0], [16.0, 80.0], [0.0, 80.0], [0.0, 0.0]]
    lake = [[4.0, 20.0], [4.0, 40.0], [8.0, 40.0], [8.0, 20.0], [4.0, 20.0]]
    other = [[40.0, 81.0], [44.0, 81.0], [44.0, 90.0], [40.0, 90.0], [40.0, 81.0]]
    region = get_region({"type": "MultiPolygon", "coordinates": [[shell, lake], [other]]})
    cells = cells_of(region, SPHERE, 300)
    s0, s20, s40, s80, s81, s90 = np.sin(np.radians([0.0, 20.0, 40.0, 80.0, 81.0, 90.0]))
    polar = cells.patch == 1
    per_degree = np.radians(1.0) * SPHERE.a**2
    assert cells.area[polar].sum() == pytest.approx(per_degree * 4 * (s90 - s81), rel=1e-12)
    assert cells.area[~polar].sum() == pytest.approx(per_degree * (16 * (s80 - s0) - 4 * (s40 - s20)), rel=1e-12)


def test_a_far_island_has_its_place() -> None:
    """An island of a kilometre beside a continent is one cell, where it is."""
    land = [[0.0, 0.0], [40.0, 0.0], [40.0, 30.0], [0.0, 30.0], [0.0, 0.0]]
    island = [[70.0, -20.01], [70.01, -20.01], [70.01, -20.0], [70.0, -20.0], [70.0, -20.01]]
    region = get_region({"type": "MultiPolygon", "coordinates": [[land], [island]]})
    cells = cells_of(region, SPHERE, 100)
    (far,) = np.flatnonzero(cells.u > 50.0)
    assert (cells.u[far], cells.v[far]) == pytest.approx((70.005, -20.005), abs=1e-6)
    area = SPHERE.a**2 * np.radians(0.01) * np.ptp(np.sin(np.radians([20.0, 20.01])))
    assert cells.area[far] == pytest.approx(area, rel=1e-9)
