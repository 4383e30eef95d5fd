"""Frames: what a page draws and tells of a map, decoded here as a page decodes it."""

import base64
import functools
import zlib

import numpy as np
import pyproj
import pytest
import shapely
from live_pages import decoded, geographic

import projdist
from projdist.surfaces import surface_of
from projdist.web import draw_maps
from projdist.web.frames import Grid, _as_bytes, _rings_around, _simplified, interpolated


class Decoded:
    """A frame by the description of its format."""

    def __init__(self, text: str) -> None:
        self.header, self.arrays = decoded(zlib.decompress(base64.b64decode(text)))
        self.shape = tuple(self.header["shape"])
        count = self.shape[0] * self.shape[1]
        self.whole, self.cubic = (
            np.unpackbits(self.arrays[name])[:count].reshape(self.shape).astype(bool) for name in ("whole", "cubic")
        )

    def at(self, row: int, column: int, s: float, t: float) -> tuple[float, float, np.ndarray]:
        """u, v and the four numbers at shares of a cell, by polynomials through the nodes around it."""
        u, v, steps = self.arrays["u"], self.arrays["v"], range(-1, 3) if self.cubic[row, column] else range(2)
        columns, rows = [column + step for step in steps], [row + step for step in steps]
        width, here = u.size, steps.index(0)
        us, vs = [u[k % width] + 360.0 * (k // width) for k in columns], v[rows]
        place = us[here] + s * (us[here + 1] - us[here]), vs[here] + t * (vs[here + 1] - vs[here])
        fields = self.arrays["fields"][:, : self.shape[0] * width].astype(float).reshape(4, *self.shape)
        table = fields[:, rows][:, :, [k % width for k in columns]].copy()
        table[1] = np.unwrap(np.unwrap(table[1], axis=0), axis=1)
        return *place, np.array([through(us, through(vs, one, place[1]), place[0]) for one in table])


@functools.cache
def drawn(given: str, region: str) -> Decoded:
    return Decoded(draw_maps([given], titles=["A"], region=region).frames[0])


def through(nodes: list[float], values: np.ndarray, place: float) -> np.ndarray:
    """Neville's scheme along the first axis: not the weights that the page has."""
    values = [np.asarray(value, dtype=float) for value in values]
    for level in range(1, len(nodes)):
        for k in range(len(nodes) - level):
            low, high = nodes[k], nodes[k + level]
            values[k] = ((place - high) * values[k] - (place - low) * values[k + 1]) / (low - high)
    return values[0]


def factors_of(four: np.ndarray) -> dict[str, float]:
    """h, k, a, b and omega by way of the matrix."""
    log, turn, re, im = four
    p = np.exp(log + 1j * turn)
    q = p * (re + 1j * im)
    J = np.array([[(p + q).real, (q - p).imag], [(p + q).imag, (p - q).real]])
    a, b = np.linalg.svd(J, compute_uv=False)
    omega = np.degrees(2.0 * np.arcsin((a - b) / (a + b)))
    return {"h": np.hypot(*J[:, 1]), "k": np.hypot(*J[:, 0]), "a": a, "b": b, "omega": omega}


# With the share of the area where the stated error is below 1e-3: all but beside poles, cuts and kinks.
CASES = [
    ("EPSG:3035", "country:DE", 1.0),
    *(("winkel-tripel", "globe", 0.94), ("mercator", "globe", 0.95), ("stereographic@90,0", "globe", 0.95)),
    *(("mollweide+lon_0=100", "globe", 0.95), ("ortho@30,100", "globe", 0.9), ("isea", "globe", 0.2)),
    *(("goode-homolosine", "globe", 0.8), ("EPSG:2056", "country:CH", 1.0), ("EPSG:2048", "box:16,-35,22,-30", 1.0)),
]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* outside its area of use")
@pytest.mark.parametrize(("given", "region", "share"), CASES)
def test_figures_are_those_of_the_map(given: str, region: str, share: float) -> None:
    """At random places in cells, within the error that the frame states there."""
    frame = drawn(given, region)
    rng = np.random.default_rng(5)
    rows, columns = np.nonzero(frame.whole)
    areas = np.cos(np.radians(frame.arrays["v"][rows]))
    chosen = rng.choice(rows.size, 300, p=areas / areas.sum())
    probed = [frame.at(rows[n], columns[n], *rng.random(2)) for n in chosen]
    true = projdist.factors(given, *geographic(frame.header, *np.array([(u, v) for u, v, _ in probed]).T))
    stated = 10.0 ** (-0.1 * frame.arrays["error"][rows[chosen], columns[chosen]].astype(float))
    found = [factors_of(four) for _, _, four in probed]
    for name in ("h", "k", "a", "b"):
        off = np.abs(np.array([one[name] for one in found]) / getattr(true, name) - 1.0)
        assert (off <= stated)[stated < 0.1].all()
    assert (stated < 1e-3).mean() >= share
    # sin(omega / 2) is |q / p|.
    steepness = 2.0 / np.cos(np.radians(0.5 * true.omega))
    off = np.abs(np.radians([one["omega"] for one in found] - true.omega))
    assert (off <= steepness * stated)[stated < 0.1].all()


@pytest.mark.slow
@pytest.mark.parametrize("given", ["healpix", "igh", "peirce_q"])
def test_figures_beside_cuts_are_those_of_the_map(given: str) -> None:
    """Between the corners of triangles of torn cells that are more than a line, within the error stated there."""
    frame = Decoded(draw_maps([given], titles=["A"], region="globe").frames[0])
    arrays, (count, width) = frame.arrays, frame.shape
    starts = np.cumsum([0, *arrays["cutSizes"][:-1]])
    sized = zip(starts, arrays["cutSizes"], strict=True)
    steps = [[start, start + k, start + k + 1] for start, size in sized for k in range(1, size - 1)]
    corners = arrays["cut"][np.array(steps)]
    assert len(corners) == len(arrays["cutError"])
    u = np.concatenate([np.tile(arrays["u"], count), arrays["imageU"]])[corners]
    v = np.concatenate([np.repeat(arrays["v"], width), arrays["imageV"]])[corners]
    fields = arrays["fields"].astype(float).T[corners]
    shares = np.random.default_rng(4).dirichlet([1, 1, 1], len(corners))
    u, fields[..., 1] = np.unwrap(u, period=360.0), np.unwrap(fields[..., 1])
    areas = (u[:, 1] - u[:, 0]) * (v[:, 2] - v[:, 0]) - (u[:, 2] - u[:, 0]) * (v[:, 1] - v[:, 0])
    large = np.abs(areas) > 1e-3  # square degrees; those that are less lie on the cut itself
    found = np.array([factors_of(four) for four in np.einsum("nj,njk->nk", shares, fields)])
    lon, lat = geographic(frame.header, (u * shares).sum(axis=1), (v * shares).sum(axis=1))
    true = projdist.factors(given, lon, lat)
    large &= np.isfinite(true.a)  # but for the pole itself
    assert np.isfinite(true.a).mean() > 0.99
    stated = 10.0 ** (-0.1 * arrays["cutError"].astype(float))
    for name in ("h", "k", "a", "b"):
        off = np.abs(np.array([one[name] for one in found]) / getattr(true, name) - 1.0)
        assert (off <= stated)[large & (stated < 0.5)].all()
    assert (large & (stated < 0.1)).mean() > 0.3


@pytest.mark.slow
@pytest.mark.parametrize("given", ["winkel-tripel", "EPSG:2048"])
def test_places_are_those_of_the_map(given: str) -> None:
    region = "globe" if given == "winkel-tripel" else "box:16,-35,22,-30"
    frame = drawn(given, region)
    rows, columns = np.nonzero(frame.whole)
    lon, lat = geographic(frame.header, frame.arrays["u"][columns], frame.arrays["v"][rows])
    x, y = projdist.Projection.from_user_input(given)(lon, lat)
    west, south, step = frame.header["grid"]
    node = rows * frame.shape[1] + columns
    assert np.abs(west + step * frame.arrays["x"][node] - x).max() <= 0.51 * step
    assert np.abs(south + step * frame.arrays["y"][node] - y).max() <= 0.51 * step


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_scales_are_on_the_ground() -> None:
    """By the elevation factor R / (R + h) of a sphere, which is 1 / 1.0001 at a ten-thousandth of its radius."""
    made = [draw_maps(["+proj=merc +R=6000000"], titles=["A"], region="box:0,0,9,9", height=h) for h in (0.0, 600.0)]
    low, high = (Decoded(one.frames[0]).arrays["fields"] for one in made)
    assert np.allclose(high[0] - low[0], -np.log(1.0001), atol=2e-7)
    assert np.array_equal(high[1:], low[1:])


@pytest.mark.usefixtures("few_cells")
def test_marks_are_where_they_are() -> None:
    """Rings and lines of geometries, in collections, too, with a name in the middle of the longest."""
    square, line = shapely.box(2, 2, 6, 6), shapely.LineString([(1, 1), (1, 3)])
    marks = {"A": shapely.GeometryCollection([shapely.MultiPolygon([square]), line])}
    frame = Decoded(draw_maps(["+proj=eqc +R=6371000"], titles=["A"], region="box:0,0,9,9", marks=marks).frames[0])
    *origin, step = frame.header["grid"]
    degrees = np.degrees((np.array(origin) + step * frame.arrays["marks"]) / 6371000.0)
    assert sorted(frame.arrays["marksSizes"]) == [2, 5]
    for corner in ((2, 2), (6, 2), (6, 6), (2, 6), (1, 1), (1, 3)):
        assert np.abs(degrees - corner).max(axis=1).min() < 1e-3
    ((name, x, y),) = frame.header["names"]
    assert name == "A"
    assert np.degrees((np.array(origin) + step * np.array([x, y])) / 6371000.0) == pytest.approx([4.0, 4.0], abs=1e-3)


@pytest.mark.slow
def test_conformal_and_mirrored_maps_are_told() -> None:
    """q / p vanishes, so that omega is 0 wherever one points; numbers of a mirror image are those of the map."""
    assert np.nanmax(np.abs(drawn("mercator", "globe").arrays["fields"][2:])) < 1e-6
    given = ("+proj=moll +R=6371000", "+proj=pipeline +step +proj=moll +R=6371000 +step +proj=affine +s11=-1")
    plain, turned = (Decoded(draw_maps([one], titles=["A"]).frames[0]) for one in given)
    assert (plain.header["mirrored"], turned.header["mirrored"]) == (False, True)
    fields = [one.arrays["fields"][:, : one.shape[0] * one.shape[1]] for one in (plain, turned)]
    assert np.allclose(*fields, atol=1e-5, equal_nan=True)


@pytest.mark.slow
def test_lines_and_areas_hold_what_they_say() -> None:
    """Sizes add up; the region's area on an equal-area map is that of the country."""
    frame = drawn("EPSG:3035", "country:DE")
    for name in ("graticule", "outline", "border", "coast", "borders", "region", "land", "sea"):
        assert frame.arrays[f"{name}Sizes"].sum() == len(frame.arrays[name])
    points = frame.arrays["region"].astype(float) * frame.header["grid"][2]
    rings = np.split(points, np.cumsum(frame.arrays["regionSizes"])[:-1])
    area = sum(0.5 * (x[:-1] @ y[1:] - y[:-1] @ x[1:]) for x, y in (ring.T for ring in rings))
    assert abs(area) / 1e6 == pytest.approx(projdist.get_region("country:DE").area_km2, rel=5e-3)


@pytest.mark.slow
def test_sea_ends_with_the_map() -> None:
    """Robinson's edge is 180 degrees from its middle, as PROJ has it; the picture of New Zealand goes on."""
    frame = drawn("robin", "country:NZ@main")
    west, south, step = frame.header["grid"]
    x, y = (frame.arrays["sea"] * step + [west, south]).T
    robinson = pyproj.Proj("+proj=robin +R=6371008.7714")
    edge, _ = robinson(np.full(y.size, 180.0), robinson(np.zeros(y.size), y, inverse=True)[1])
    assert frame.header["view"][1] > edge.min()
    assert -2.0 * step < (edge - x).min() < 2.0 * step


def test_errors_are_never_stated_too_small() -> None:
    """Twice what is found, and what float32 leaves, rounded up to a tenth of a decade; the last byte is no error."""
    errors = np.append(0.0, np.logspace(-9, 0.5, 200))
    found = _as_bytes(errors)
    stated, wanted = 10.0 ** (-0.1 * found.astype(float)), np.minimum(2.0 * errors + 2e-7, 1.0)
    assert found.max() < 255
    assert (stated >= wanted * (1.0 - 1e-12)).all()
    assert (stated <= wanted * 10.0**0.1 * (1.0 + 1e-12)).all()


def test_lagrange_weights_are_exact_for_cubics() -> None:

    def fields(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.stack([u**3 - v**2 * u, u * v / 1e3, v**3, u + v], axis=-1)

    surface, place = surface_of("mercator", "box:0,0,20,20", 1.0), np.array([[4.1, 9.3], [2.9, 8.0]])
    rows, columns, is_cubic = np.array([3, 8]), np.array([4, 9]), np.array([True, True])
    found = interpolated(surface, fields(surface.u, surface.v), rows, columns, *place, is_cubic)
    assert np.allclose(found, fields(*place), rtol=1e-11)


def rings_around(squares: list[np.ndarray]) -> tuple[list[np.ndarray], int]:
    """Rings, which are closed, and the number of their steps."""
    rings = list(_rings_around(squares, Grid(0.0, 0.0, 1.0)))
    assert all((ring[0] == ring[-1]).all() for ring in rings)
    return rings, sum(len(ring) - 1 for ring in rings)


def test_rings_are_around_what_polygons_cover() -> None:
    """Squares of a chessboard with holes, that touch at edges and corners and turn either way: GEOS's union of them."""
    rng = np.random.default_rng(3)
    corners = np.argwhere(rng.random((30, 30)) < 0.6).astype(float)
    squares = [corner + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[:: rng.choice([-1, 1])] for corner in corners]
    rings, steps = rings_around(squares)
    union = shapely.union_all([shapely.polygons(square) for square in squares])
    assert steps == shapely.length(union)
    # By even and odd, as a page fills it; a ring that touches itself is made valid so.
    by_parity = functools.reduce(shapely.symmetric_difference, [shapely.make_valid(shapely.polygons(r)) for r in rings])
    assert shapely.area(shapely.symmetric_difference(by_parity, union)) == 0.0


def test_what_lies_upon_each_other_has_closed_rings() -> None:
    """A square that is there twice beside one that is not: an edge between them is left, and two about the former."""
    squares = [np.array([[x, 0], [x + 1, 0], [x + 1, 1], [x, 1]], dtype=float) for x in (0.0, 0.0, 1.0)]
    assert rings_around(squares)[1] == 2 * 3 + 1 + 3


def test_the_smallest_islands_are_dots() -> None:
    """A line of no length is not drawn: what is smaller than a quarter of a pixel keeps some."""
    ring = 500.0 + np.array([[0, 0], [5, 0], [5, 5], [0, 0]])
    (line,) = _simplified([ring], Grid(0.0, 0.0, 1.0), shapely.box(0, 0, 1000, 1000))
    assert 0.0 < np.ptp(line, axis=0).max() <= 5.0
