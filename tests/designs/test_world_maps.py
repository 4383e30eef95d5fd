"""World maps made to measure: better than known figures, symmetric, smooth, one-sided, and what PROJ runs."""

import functools
import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer
from refusals import refuses
from tables import each, some

import projdist
from projdist.designs import WorldMap, world_map
from projdist.designs.spline_sheets import get_cut
from projdist.designs.world_maps import get_world_spec

PACIFIC = [(-180.0, -70.0), (-172.0, 37.0)]
BENT = [(-169.0, -90.0), (-169.0, 60.0), (-150.0, 75.0)]
CUTS = {"antimeridian": 180.0, "Bering": -169.0, "oblique": PACIFIC, "bent": BENT}
SAME, SAME_TURNED = 1e-8, 1e-6  # metres: rounding of coordinates, and of longitudes near the frame's poles
FINEST_KNOWN = 0.34340, 0.32903  # energy and AK on 4608 triangles of a quarter of the sphere
BEST_KNOWN = 0.3409, 0.326  # extrapolated from four such meshes
CHEBYSHEV = 0.300328  # |lat| <= 85, 50 coefficients
AREAS = 1e-3  # of the mean of ln s: 24 by 90 points, and kinks at poles
LAND = {0.1: 0.1422, 0.02: 0.1145}  # of maps on 8192 triangles, measured on real land

rng = np.random.default_rng(5)
LON, LAT = rng.uniform(-180, 180, 300), np.degrees(np.arcsin(rng.uniform(-1, 1, 300)))


@pytest.fixture(scope="module")
def world() -> WorldMap:
    return world_map(against=["winkel-tripel", "robinson"])


@functools.cache
def coarse(name: str) -> WorldMap:
    return world_map(cut=CUTS[name], cells=8, against=[])


@pytest.mark.slow
def test_the_world_beats_known_maps(world: WorldMap) -> None:
    """Below the finest triangles, at what they extrapolate to; every refinement is lower; measured, not at nodes."""
    energies = [one.energy for one in world.refinements]
    assert energies == sorted(energies, reverse=True)
    assert energies[-1] < FINEST_KNOWN[0]
    assert world.airy_kavrayskiy < FINEST_KNOWN[1]
    assert (energies[-1], world.airy_kavrayskiy) == pytest.approx(BEST_KNOWN, rel=2e-3)
    assert world.error_estimate < 1e-5
    assert (world.mirrored, world.coverage) == pytest.approx((0.0, 1.0), abs=1e-9)
    found = projdist.summarize(world.projection, tolerance=1e-5)  # the scale is the best
    assert found.airy_kavrayskiy == pytest.approx(found.airy_kavrayskiy_scaled, abs=2e-5)


@pytest.mark.slow
def test_the_world_is_symmetric(world: WorldMap) -> None:
    """To rounding, about the equator and the middle meridian; the poles are points."""
    x, y = world.projection(LON, LAT)
    for i, j in ((-1, 1), (1, -1), (-1, -1)):
        assert np.allclose(world.projection(i * LON, j * LAT), (i * x, j * y), rtol=0, atol=1e-6)
    poles = np.array(world.projection([-180.0, 0.0, 77.0, 180.0], [90.0] * 4))
    assert np.ptp(poles, axis=1) == pytest.approx(0.0, abs=1e-6)
    # Others are measured as ever.
    assert [one.name for one in world.standings] == ["Winkel Tripel", "Robinson"]
    assert world.standings[0].airy_kavrayskiy == pytest.approx(0.385718, abs=1e-5)


@pytest.mark.slow
def test_no_and_half_symmetries() -> None:
    """Of an even world the best map is symmetric by itself, and as good; maps of land have the half that is asked."""
    free, tied = (world_map(cells=8, symmetric=how, against=[]) for how in ("none", "both"))
    assert free.refinements[-1].energy == pytest.approx(tied.refinements[-1].energy, abs=1e-9)
    assert free.refinements[-1].unknowns > 3 * tied.refinements[-1].unknowns
    assert np.allclose(free.projection(LON, LAT), tied.projection(LON, LAT), rtol=0, atol=1.0)
    for symmetric, i, j in (("meridian", -1, 1), ("equator", 1, -1)):
        found = world_map("land", cells=8, symmetric=symmetric, against=[]).projection
        assert np.allclose(found(i * LON, j * LAT), np.multiply([[i], [j]], found(LON, LAT)), rtol=0, atol=1e-6)


@pytest.mark.slow
def test_another_meridian_is_the_same_map_turned() -> None:
    """An even world does not know where it is cut: not along which meridian, nor which half of a great circle."""
    plain, turned, oblique = (coarse(name).projection for name in ("antimeridian", "Bering", "oblique"))
    lon = np.mod(LON - 11.0 + 180.0, 360.0) - 180.0
    assert np.allclose(turned(LON, LAT), plain(lon, LAT), rtol=0, atol=1e-6)
    energies = {coarse(name).refinements[-1].energy for name in ("antimeridian", "Bering", "oblique")}
    assert max(energies) == pytest.approx(min(energies), abs=1e-12)
    assert np.all(np.isfinite(oblique(LON, LAT)))


def test_a_map_that_ends() -> None:
    """As good as 50 Chebyshev coefficients with about as many unknowns; the energy at exponent 0 is AK."""
    found = world_map(until=85.0, exponent=0.0, cells=8, against=[])
    assert found.refinements[-1].energy == pytest.approx(CHEBYSHEV, abs=5e-6)
    assert found.airy_kavrayskiy == pytest.approx(CHEBYSHEV, abs=2e-5)
    assert np.isnan(found.projection([0.0], [86.0])[0]).all()
    assert np.isfinite(found.projection([180.0, -180.0], [85.0, -85.0])).all()


def test_what_counts_elsewhere() -> None:
    """A region by its area; points by 1 all together, to which elsewhere is the share of the whole Earth."""
    points = projdist.PointSet(np.array([20.0, -130.0]), np.array([45.0, -6.0]), np.array([1.0, 2.0]))
    for region in ("box:-180,0,180,90", points):
        spec = get_world_spec(region, 180.0, 0.25, 90.0, "auto", 0.125)
        sheet = spec.sheet(8)
        latitudes, found = np.degrees(sheet.nodes(4)[1]), spec.weights(sheet, 0.25)
        if region is points:
            assert found.sum() == pytest.approx(1.25)
            assert found[latitudes > 40.0].max() > 1.0 / 3.0
            assert found[latitudes < 0.0].max() > 2.0 / 3.0
        else:  # the weights of Gauss nodes of parts of cosine, to 1e-9
            halves = [found[side * latitudes > 0.0].sum() for side in (1, -1)]
            assert halves == pytest.approx([2.0 * np.pi, 0.5 * np.pi], rel=1e-6)


@pytest.mark.slow
def test_areas_are_as_often_large_as_small() -> None:
    """In the best scale the mean of ln s over the globe is 0: by Gauss's rule along meridians, away from the cut."""
    sines, weights = np.polynomial.legendre.leggauss(24)
    lon, lat = np.meshgrid(np.arange(-178.0, 180.0, 4.0), np.degrees(np.arcsin(sines)))
    s = projdist.factors(coarse("antimeridian").projection, lon, lat).s
    assert 0.5 * weights @ np.log(s).mean(axis=1) == pytest.approx(0.0, abs=AREAS)


@pytest.mark.slow
@pytest.mark.parametrize("elsewhere", some(LAND, 2))
def test_land(elsewhere: float) -> None:
    """Better than triangles that are land or not, measured on real coasts, with half as many cells as usual."""
    found = world_map("land", elsewhere=elsewhere, cells=32, against=[])
    assert found.airy_kavrayskiy < LAND[elsewhere]
    assert found.mirrored == 0.0
    again = projdist.summarize(found.projection, "land", tolerance=1e-4)
    assert again.airy_kavrayskiy == pytest.approx(found.airy_kavrayskiy, abs=2e-4)


@each("name", CUTS)
def test_cuts_unroll_the_globe(name: str) -> None:
    cut = get_cut(CUTS[name])
    u, v = cut.unrolled(LON, LAT)
    assert np.abs(u).max() <= np.pi
    assert np.allclose(cut.rolled(u, v), (LON, LAT), rtol=0, atol=1e-9)
    points = np.array(CUTS[name], dtype=float) if np.ndim(CUTS[name]) else np.array([[CUTS[name], 10.0]])
    assert np.abs(cut.unrolled(*points[-1:].T)[0]) == pytest.approx(np.pi)


def test_the_map_is_smooth() -> None:
    """Second differences of splines of the third degree halve with the step; the values are those of their knots."""
    sheet = coarse("antimeridian").sheet
    knot = sheet.u.breaks[3]
    for step in (1e-3, 1e-4):
        at = knot + step * np.array([-2.0, -1.0, 1.0, 2.0, 0.0])
        x, _ = sheet.on_sheet(at, np.full(5, 0.4))
        left, right = x[0] - 2 * x[1] + x[4], x[4] - 2 * x[2] + x[3]
        assert abs(left - right) / step**2 < 60.0 * step * abs(x[4])


@pytest.mark.slow
@pytest.mark.parametrize("name", CUTS)
def test_proj_runs_the_triangles(name: str, tmp_path: Path) -> None:
    """PROJ equals numpy inside the triangles, and at their corners the map itself; and there and back."""
    made = coarse(name)
    path = tmp_path / "world map.json"
    proj = Transformer.from_pipeline(made.write_tinshift(path, step=5.0))
    x, y = proj.transform(LON, LAT)
    plain = made.cut.frame is None
    (lon, lat), same = ((LON, LAT), SAME) if plain else (made.cut.frame.of(LON, LAT), SAME_TURNED)
    assert np.allclose((x, y), interpolated(json.loads(path.read_text()), lon, lat), rtol=0, atol=same)
    back = proj.transform(x, y, direction="INVERSE")
    assert np.allclose(back[1], LAT, rtol=0, atol=1e-9)
    assert np.allclose((back[0] - LON) * np.cos(np.radians(LAT)), 0.0, rtol=0, atol=1e-9)
    corners = np.array(json.loads(path.read_text())["vertices"])
    corners = corners[(np.abs(corners[:, 0]) < 179.0) & (np.abs(corners[:, 1]) < 89.0)]
    there = corners[:, :2].T if plain else made.cut.frame.back(*corners[:, :2].T)
    edge = np.abs(made.cut.unrolled(*there)[0]) > np.pi - 1e-6
    assert np.allclose(np.array(made.projection(*there))[:, ~edge], corners[~edge, 2:].T, rtol=0, atol=1e-5)
    assert np.isfinite(proj.transform([0.0, 0.0, 180.0, -180.0], [90.0, -90.0, 10.0, 10.0])).all()


def interpolated(given: dict, lon: np.ndarray, lat: np.ndarray) -> np.ndarray:
    """Linear in the triangle that a point is in."""
    corners, triangles = np.array(given["vertices"]), np.array(given["triangles"])
    a, b, c = (corners[triangles[:, k], :2] for k in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    x, y, area = lon[:, None] - a[:, 0], lat[:, None] - a[:, 1], ux * vy - vx * uy
    of_b, of_c = (x * vy - vx * y) / area, (ux * y - x * uy) / area
    shares = np.stack([1.0 - of_b - of_c, of_b, of_c])  # of the corners, by points and triangles
    inside = shares.min(axis=0).argmax(axis=1)
    return np.einsum("kn,nkd->dn", shares[:, np.arange(lon.size), inside], corners[triangles[inside], 2:])


@pytest.mark.slow
def test_triangles_come_near_the_map(tmp_path: Path) -> None:
    """With the square of the step; also where the map is steep, a degree around the poles."""
    made, rng = coarse("Bering"), np.random.default_rng(3)
    steep_lon = rng.uniform(-180.0, 180.0, 4000)
    steep = steep_lon, np.copysign(90.0 - 10.0 ** rng.uniform(-3.0, 0.0, 4000), steep_lon)
    errors = []
    for step in (4.0, 2.0, 1.0):
        proj = Transformer.from_pipeline(made.write_tinshift(tmp_path / f"{step}.json", step=step))
        off = [np.subtract(proj.transform(*points), made.projection(*points)) for points in ((LON, LAT), steep)]
        errors.append((np.median(np.hypot(*off[0])), np.hypot(*off[1]).max()))
    usual, steepest = np.array(errors).T
    assert usual[2] < 200.0
    assert usual[:2] / usual[1:] == pytest.approx(4.0, rel=0.3)
    assert steepest[:2] / steepest[1:] == pytest.approx(4.0, rel=0.4)


@pytest.mark.slow
def test_answers(tmp_path: Path) -> None:
    """A line, a dictionary, a table; maps can be pickled; other files than JSON and too many triangles are refused."""
    found = coarse("Bering")
    assert repr(found).startswith("WorldMap(World map, cut at -169: AK 0.3")
    assert json.loads(found.to_json())["refinements"][0]["cells"] == 8
    assert [row["name"] for row in found._table()] == ["this"]
    again = pickle.loads(pickle.dumps(found.projection))
    assert np.array_equal(again(LON, LAT), found.projection(LON, LAT))
    refuses("Invalid file", found.write_tinshift, tmp_path / "x.txt", step=2.0)
    refuses("Invalid step", found.write_tinshift, tmp_path / "x.json", step=0.01)


@each(("options", "message"), [
    ({"cut": "x"}, "Invalid cut 'x'. It must be a number"),
    ({"cut": 400.0}, "Invalid cut '400.0'. Its longitude must be within -360 and 360"),
    ({"cut": [(0.0, 10.0)]}, "Invalid cut. It must be a longitude, or two or more points"),
    ({"cut": [(0.0, 10.0), (0.0, 10.0)]}, "must be farther from the first than those before"),
    ({"cut": [(0.0, 95.0), (0.0, 10.0)]}, "Invalid cut. Latitudes must be within -90 and 90"),
    ({"elsewhere": 0.0}, "Invalid weight elsewhere '0.0'. It must be a number from 0.0001 to 1"),
    ({"until": 5.0}, "Invalid end '5.0'. It must be a number from 10 to 90"),
    ({"exponent": -1.0}, "Invalid exponent '-1.0'"),
    ({"cells": 9}, "Invalid number of cells '9'. It must be even, within 8 and 128"),
    ({"cells": 200}, "Invalid number of cells '200'"), ({"symmetric": "pole"}, "Invalid symmetry 'pole'"),
    ({"symmetric": "both", "cut": BENT}, "Where it is bent there is none"),
    ({"until": 80.0, "cut": PACIFIC}, "Invalid end '80.0' for the cut"),
    ({"region": "country:Nowhere"}, "Invalid country 'Nowhere'"),
    ({"region": "cap:0,0,1"}, "It is too small for a map of the world of 64 cells"),
    ({"region": "box:-180,80,180,90", "until": 70.0}, "or is not on it"),
])  # fmt: skip
def test_bad_input_is_told_in_a_line(options: dict, message: str) -> None:
    refuses(rf"^[^\n]*{re.escape(message)}[^\n]*$", world_map, **options)
