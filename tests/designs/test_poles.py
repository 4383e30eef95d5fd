"""Poles around a region: the map that they make, known least ranges, and what pyproj alone finds."""

import math
from types import SimpleNamespace

import numpy as np
import pyproj
import pytest
import shapely
from refusals import refuses
from tables import each

from projdist import design, get_region
from projdist.designs.fits import Poles, _composed
from projdist.designs.plane_maps import ComplexPolynomial

rng = np.random.default_rng(7)
ORIGIN, SIZE = 3e5 + 2e5j, 4e5
Z = ORIGIN + SIZE * np.sqrt(rng.uniform(size=300)) * np.exp(2j * np.pi * rng.uniform(size=300))
PLACES = 1.1 * np.exp(1j * np.array([0.1, 0.15, 2.0, 4.0, 5.0]))
FACTORS = 1e-4 * (rng.normal(size=(5, 2)) + 1j * rng.normal(size=(5, 2)))
POLES = Poles(PLACES, np.full(5, 0.1), FACTORS)
LAST = ComplexPolynomial(ORIGIN + 5e4, 9e4, np.array([2.0 + 1j, 9e4, 30.0j]))
SECOND_ORDER = 5e-7  # squares of the sums of factors
ROUNDING, BACK = 1e-8, 1e-7  # metres
DEGREES = 1e-10  # there and back: PROJ's stereographic map finds latitudes by iteration, to 1e-10 rad


def test_each_pole_adds_its_functions() -> None:
    """f' - 1 is the sum of c (d / (z - p))^n, to first order; a polynomial may follow; PROJ runs it, and back."""
    found = _composed(SimpleNamespace(origin=ORIGIN, size=SIZE), POLES)
    w, slope = found.value(Z)
    ratio = 0.1 / ((Z - ORIGIN)[:, None] / SIZE - PLACES)
    truth = ratio**2 @ FACTORS[:, 0] + ratio**3 @ FACTORS[:, 1]
    assert np.abs(truth).max() > 1e-4
    np.testing.assert_allclose(slope - 1.0, truth, rtol=0.0, atol=SECOND_ORDER)
    both = found.then(LAST)
    np.testing.assert_allclose(both.value(Z)[0], LAST.value(w)[0], rtol=0.0, atol=ROUNDING)
    transformer = pyproj.Transformer.from_pipeline("+proj=pipeline " + " ".join(f"+step {one}" for one in both.steps))
    x, y = transformer.transform(Z.real, Z.imag)
    np.testing.assert_allclose(x + 1j * y, both.value(Z)[0], rtol=0.0, atol=ROUNDING)
    back = transformer.transform(x, y, direction="INVERSE")
    np.testing.assert_allclose(back, (Z.real, Z.imag), rtol=0.0, atol=BACK)
    ahead, behind = both.at(Z.real + 10.0, Z.imag), both.at(Z.real - 10.0, Z.imag)
    np.testing.assert_allclose(ahead[2][:, 0, 0], (ahead[0] - behind[0]) / 20.0, atol=1e-6)


TURN = 2.0 * np.pi * (np.arange(401) % 400) / 400
A, B = 0.2 * math.radians(1.0), 0.1 * math.radians(1.0)
KNOWN = {
    # J. Milnor 1969: from 1 to 1 / cos^2(r / 2) on a cap; Mercator's map of a strip, whose ends matter by e^(-4 pi);
    # the torsion function.
    "cap:10,50,400": -2.0 * math.log(math.cos(0.5 * 400.0 / 6371.0)),
    "box:-8,-1,8,1": -math.log(math.cos(math.radians(1.0))),
    "ellipse": A * A * B * B / (2.0 * (A * A + B * B)),
}


@pytest.mark.slow
@each("name", KNOWN)
def test_known_least_ranges(name: str) -> None:
    """On the sphere, from a base that is far from the best map; none is beaten by more than the polygon's 2e-4."""
    ring = np.column_stack([20.0 + 0.2 * np.cos(TURN), 0.1 * np.sin(TURN)])
    region = get_region(shapely.Polygon(ring) if name == "ellipse" else name)
    base = "+proj=stere +lat_0=40 +lon_0=15 +R=6371000"
    options = {"kind": "conformal", "criterion": "max_log_scale", "degree": 12, "poles": 8}
    found = design(region, base=base, against=(), **options)
    assert 0.9998 < 2.0 * found.value / KNOWN[name] < 1.01


@pytest.mark.slow
@each(("region", "lon", "lat", "most"), [("country:CH", 8.2, 46.8, 29.0), ("country:DE", 10.3, 51.1, 285.0)])
def test_pyproj_alone_runs_them(region: str, lon: float, lat: float, most: float) -> None:
    """The range of scales along the border and within, by differences of coordinates and pyproj's geodesics."""
    base = f"+proj=stere +lat_0={lat} +lon_0={lon} +ellps=WGS84"
    options = {"kind": "conformal", "criterion": "max_scale_error_ppm", "degree": 20, "poles": 24}
    found = design(region, base=base, against=(), **options)
    assert found.proven < found.value < most
    assert found.error < 0.1  # the poles outside do not disturb the measurement
    crs = pyproj.CRS.from_wkt(found.wkt)
    run = pyproj.Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
    area = get_region(region)
    edges = np.array([edge[:2] for edge in area.edges])
    west, south, east, north = area.bounds
    grid = np.column_stack(
        [one.ravel() for one in np.meshgrid(np.linspace(west, east, 60), np.linspace(south, north, 60))]
    )
    lon, lat = np.concatenate([edges[:: 1 + len(edges) // 4000], grid[area.contains(*grid.T)]]).T
    ends = [
        crs.get_geod().fwd(lon, lat, np.full(lon.size, azimuth), np.full(lon.size, 50.0))[:2]
        for azimuth in (45.0, 225.0)
    ]
    (x, y), (x2, y2) = (run.transform(*end) for end in ends)
    k = np.hypot(x2 - x, y2 - y) / 100.0
    ppm = 1e6 * max(k.max() - 1.0, 1.0 - k.min())
    assert ppm == pytest.approx(found.value, rel=0.01)
    back = run.transform(*run.transform(lon, lat), direction="INVERSE")
    np.testing.assert_allclose(back, (lon, lat), rtol=0.0, atol=DEGREES)


@each(("options", "message"), [
    ({"poles": 97}, "Invalid poles '97'. It must be auto, or a whole number from 0 to 96."),
    ({"poles": "many"}, "Invalid poles 'many'. It must be auto, or a whole number"),
    ({"criterion": "airy_kavrayskiy"}, "They are for conformal maps by max_scale_error_ppm"),
    ({"symmetric": "meridian"}, "They are for regions with an area, and not for symmetric maps."),
])  # fmt: skip
def test_refusals(options: dict[str, object], message: str) -> None:
    wanted = {"kind": "conformal", "criterion": "max_log_scale", "poles": 8, **options}
    refuses(message, design, "box:5,45,10,50", **wanted)
