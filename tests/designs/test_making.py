"""Maps made to measure against closed forms, theorems, and maps that were published."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely
from tables import each

import projdist
from projdist import Projection, ProjectionError, design, summarize
from projdist.designs import base_maps, fits
from projdist.designs.base_maps import BaseNodes, DesignObjective, design_objective
from projdist.designs.fits import Stage, best_of, needs_exponent, stage_of, stages
from projdist.designs.making import _inverse_error, measure_map
from projdist.designs.plane_maps import ComplexPolynomial
from projdist.earth import SPHERE, WGS84, destination
from projdist.field import nodes_of
from projdist.matrices import EXPONENT
from projdist.regions import get_region

SPHERICAL = "+proj={} +lat_0={} +lon_0={} +R=6371008.7714"
Scale = Callable[[float], float]
Slopes = Callable[[Scale, Scale], BaseNodes]
AZIMUTHAL = {"any": "aeqd", "conformal": "stere", "equal-area": "laea"}

# Airy-Kavrayskiy errors of the best azimuthal maps of caps, the best of all, by the Euler-Lagrange equation (degrees).
CAPS = {10.0: 0.002199607140, 30.0: 0.019884009428, 60.0: 0.080699486621}
# And of the stereographic map, over that: it is the best conformal one.
STEREOGRAPHIC = {10.0: 1.415225, 30.0: 1.423410, 60.0: 1.452342}
CUBATURE = 2e-9  # of `summarize`, at a tolerance of 1e-8 and its own error


def cap(angle: float, lat: float = 0.0) -> str:
    return f"cap:0,{lat:g},{math.radians(angle) * 6371.0087714:.9f}"


@pytest.mark.slow
@pytest.mark.parametrize("angle", CAPS)
def test_caps_by_the_euler_lagrange_equation(angle: float) -> None:
    found = design(cap(angle), degree=9, base=SPHERICAL.format("laea", 0, 0), against=(), background=0.0)
    assert abs(found.airy_kavrayskiy - CAPS[angle]) < CUBATURE
    assert found.overlaps is False
    assert found.inverse_error < 1e-6


@pytest.mark.slow
@each("angle", CAPS)
def test_the_best_conformal_map_of_a_cap(angle: float) -> None:
    """It is stereographic in the best scale, from whatever conformal base, with its origin in the middle."""
    # Scales are c / s, s = cos^2(rho / 2) of the distance rho, of which areas are even: ln c is the mean of ln s.
    region, plain = cap(angle), SPHERICAL.format("stere", 0, 0)
    base = SPHERICAL.format("stere", 3, 2)
    found = design(region, kind="conformal", degree=8, base=base, against=plain, background=0.0)
    assert found.airy_kavrayskiy == pytest.approx(STEREOGRAPHIC[angle] * CAPS[angle], rel=1e-6)
    assert found.notes == ()
    assert np.hypot(*found.projection([0.0], [0.0])) < 1.0  # metre: the middle of the nodes
    rim, beyond = (math.cos(0.5 * math.radians(times * angle)) ** 2 for times in (1.0, 1.15))
    log = (rim - 1.0 - rim * math.log(rim)) / (1.0 - rim)
    square = (2.0 - 2.0 * rim + 2.0 * rim * math.log(rim) - rim * math.log(rim) ** 2) / (1.0 - rim)
    c = math.exp(log)
    assert (found.smallest.value, found.largest.value) == pytest.approx((c, c / rim), rel=1e-5)
    (rival,) = found.rivals
    assert rival.value == pytest.approx(math.sqrt(2.0 * square), rel=1e-6)
    assert rival.gain == pytest.approx(1.0 - math.sqrt(1.0 - log * log / square), rel=1e-5)
    assert found.surroundings.within_km == pytest.approx(0.15 * math.radians(angle) * 6371.0087714, rel=1e-3)
    assert c / rim < found.surroundings.largest_scale <= c / beyond


@pytest.mark.slow
def test_regions_about_a_pole_have_it_for_their_origin() -> None:
    """With Greenwich's meridian up and down, whatever the base's is; if it does not show the pole, the middle."""
    base = SPHERICAL.format("stere", -90, 40)
    found = design("cap:30,-88,1000", kind="conformal", degree=1, base=base, against=())
    x, y = found.projection([0.0, 0.0], [-90.0, -89.99])
    assert np.abs([x[0], y[0], x[1]]).max() < 0.01 < y[1]  # metres; the meridian bends
    none = design("box:-179,60,179,70", degree=3, base="+proj=eqc +lat_ts=65 +R=6371000", against=())
    assert np.isfinite(none.value)


def ellipse(height: float) -> shapely.Polygon:
    """Around a place on the equator, twice as wide as high (half axes in degrees), of 720 chords."""
    t = np.linspace(0.0, 2.0 * np.pi, 721)[:-1]
    azimuth, distance = np.arctan2(2.0 * np.cos(t), np.sin(t)), np.hypot(2.0 * np.cos(t), np.sin(t))
    return shapely.Polygon(np.column_stack(destination(10.0, 0.0, np.degrees(azimuth), height * distance)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["any", "conformal", "equal-area"])
def test_ellipses_by_the_clamped_plate(kind: str) -> None:
    """2 by 1 degrees: 1 / (24 (3/p^4 + 2/(p^2 q^2) + 3/q^4)), and sqrt(2) times the root for the two special kinds."""
    p, q = math.radians(2.0), math.radians(1.0)
    least = math.sqrt(1.0 / (24.0 * (3.0 / p**4 + 2.0 / (p * q) ** 2 + 3.0 / q**4)))
    base = SPHERICAL.format(AZIMUTHAL[kind], 0, 10)
    found = design(ellipse(1.0), kind=kind, degree=4, base=base, against=(), background=0.0)
    theory = least * (1.0 if kind == "any" else math.sqrt(2.0))
    polygon, nodes = 1e-4, 3e-3  # 720 chords, and (2 degrees)^2 / 12; the limit's 2000 nodes read low
    assert found.airy_kavrayskiy == pytest.approx(theory, rel=polygon)
    assert found.limit == pytest.approx(theory, rel=nodes)


@pytest.mark.slow
@pytest.mark.parametrize("km", [100.0, 5.0])
def test_the_least_scale_error_of_an_ellipse(km: float) -> None:
    """Half of the range of ln k, whose Laplacian is the curvature: p^2 q^2 / 4 (p^2 + q^2); also of 0.1 ppm."""
    p, q = km / 6371.0087714, 2.0 * km / 6371.0087714
    options = {"kind": "conformal", "criterion": "max_log_scale", "degree": 4, "against": ()}
    found = design(ellipse(math.degrees(p)), base=SPHERICAL.format("stere", 0, 10), **options)
    assert found.value == pytest.approx(0.25 * (p * q) ** 2 / (p * p + q * q), rel=1e-3)  # 720 chords, ln k to 1e-11


NZ = "country:NZ & box:166,-48,179,-34"


@pytest.mark.slow
def test_new_zealand() -> None:
    """134 ppm at degree 8, where the best oblique Mercator has 591, to 1 %; and better than the Map Grid of 1973."""
    options = {"kind": "conformal", "criterion": "max_scale_error_ppm", "base": OBLIQUE}
    at_its_degree, found = (design(NZ, degree=degree, against="+proj=nzmg", **options) for degree in (5, 8))
    assert (at_its_degree.value, found.value) == pytest.approx((185.0, 134.0), rel=0.01)
    assert found.rivals[0].value > 200.0
    assert found.rivals[0].gain > 0.3
    assert summarize(found.projection, NZ, measures=["omega"]).measures["omega"].max < 1e-7


OBLIQUE = "+proj=omerc +ellps=WGS84 +lat_0=-41.68 +lonc=173.04 +alpha=20.56 +k_0=0.9994"


@pytest.mark.slow
def test_the_largest_scale_error_of_far_islands() -> None:
    """New Zealand with Tokelau, 3000 km away, where a polynomial is steep: scales of chords of a kilometre, by PROJ."""
    # They are those of the coasts' corners and of a grid of a tenth of a degree.
    found = design("country:NZ", kind="conformal", criterion="max_scale_error_ppm", degree=8, against=())
    region = get_region("country:NZ")
    grid = np.stack(np.meshgrid(np.arange(166.0, 180.0, 0.1), np.arange(-48.0, -34.0, 0.1)), axis=-1).reshape(-1, 2)
    lon, lat = np.concatenate([region.edges[:, :2], grid[region.contains(*grid.T)]]).T
    run = pyproj.Transformer.from_crs("OGC:CRS84", found.wkt, always_xy=True).transform
    east, north, _ = pyproj.Geod(ellps="WGS84").fwd(lon, lat, np.full(lon.size, 30.0), np.full(lon.size, 500.0))
    west, south, _ = pyproj.Geod(ellps="WGS84").fwd(lon, lat, np.full(lon.size, 210.0), np.full(lon.size, 500.0))
    scales = np.hypot(*np.subtract(run(east, north), run(west, south))) / 1000.0
    assert found.value == pytest.approx(1e6 * np.abs(scales - 1.0).max(), abs=0.1)
    assert found.error < 0.05
    # That of Fiji is that of the nodes, of which every island has some: they end where ln k is largest.
    found = design("country:FJ", kind="conformal", criterion="max_scale_error_ppm", degree=10, against=())
    assert found.value == pytest.approx(found.degrees[-1].value, rel=1e-3)
    assert found.rivals[0].gain > 0.0


@pytest.mark.slow
def test_equal_area_maps_keep_areas() -> None:
    """To 1e-9, after all of its shears, as PROJ runs them."""
    base = "+proj=laea +lat_0=46.8 +lon_0=8.2 +ellps=GRS80"
    found = design("country:CH", kind="equal-area", degree=3, base=base, against=())
    s = summarize(found.projection, "country:CH", measures=["s"]).measures["s"]
    assert max(abs(s.max - 1.0), abs(s.min - 1.0)) < 1e-9


@pytest.mark.slow
def test_nested_degrees() -> None:
    """At the same nodes and with the same share of the surroundings a degree more is never worse."""
    found = design("country:DE", degree="auto", base="EPSG:3035", background=0.001, against=())
    values = [one.value for one in found.degrees]
    assert all(finer <= coarser * (1.0 + 1e-9) for coarser, finer in itertools.pairwise(values))
    assert {one.share for one in found.degrees} == {0.001}
    assert found.degree in [one.degree for one in found.degrees]
    # The base is forgotten: from two to the same map, but for what the degree cannot undo.
    bases = "EPSG:3035", "+proj=lcc +lat_1=48 +lat_2=53 +lon_0=10 +ellps=GRS80"
    one, other = (design("country:DE", degree=6, base=base, background=0.0, against=()) for base in bases)
    assert one.airy_kavrayskiy == pytest.approx(other.airy_kavrayskiy, rel=1e-2)


@pytest.mark.slow
def test_every_form_is_the_same_map() -> None:
    """The pipeline, both forms of WKT2 and PROJJSON, through pyproj both ways, in authority order, too."""
    found = design("country:CH", degree=3, base="EPSG:3035", datum="EPSG:4258", north=(7.44, 46.95), against=())
    lon, lat = np.array([6.5, 8.0, 10.0]), np.array([46.3, 47.1, 46.7])
    truth = np.array(found.projection(lon, lat))
    for text in (found.proj, found.wkt, found.crs.wkt_derived, found.crs.projjson):
        np.testing.assert_allclose(Projection.from_user_input(text)(lon, lat), truth, rtol=0, atol=1e-8)
    crs = pyproj.CRS.from_wkt(found.wkt)
    assert (crs.is_projected, crs.geodetic_crs.to_epsg()) == (True, 4258)
    transformer = pyproj.Transformer.from_crs("EPSG:4258", crs)
    np.testing.assert_allclose(transformer.transform(lat, lon), truth, rtol=0, atol=1e-8)
    np.testing.assert_allclose(transformer.transform(*truth, direction="INVERSE"), (lat, lon), rtol=0, atol=2e-8)
    # North is up where it shall be, and the origin is there.
    x, y = found.projection([7.44, 7.44], [46.95, 46.9501])
    assert max(abs(x[0]), abs(y[0])) < 1e-6
    assert abs((x[1] - x[0]) / (y[1] - y[0])) < 1e-5


@pytest.mark.slow
@each(("region", "base", "across"), [
    ("country:CH", "EPSG:2056", False), ("cap:0,90,800", "+proj=stere +lat_0=90 +ellps=WGS84", False),
    ("box:170,-20,-170,-10", "+proj=merc +lon_0=180 +ellps=WGS84", True),
])  # fmt: skip
def test_the_area_of_use(region: str, base: str, across: bool) -> None:
    """Every form states the region's box with a margin of 15 % of its radius, across the antimeridian if need be."""
    found = design(region, kind="conformal", degree=2, base=base, against=())
    west, south, east, north = get_region(region).bounds
    area = pyproj.CRS.from_wkt(found.wkt).area_of_use
    assert (area.west > area.east) is across
    margin = found.surroundings.within_km / 111.2  # a degree of a meridian has 110.6 to 111.7 km; boxes end at poles
    parallels = max(south - margin, -90.0), min(north + margin, 90.0)
    assert (area.south, area.north) == pytest.approx(parallels, abs=0.01 * margin, rel=0)
    if north < 80.0:
        corner = north if abs(north) > abs(south) else south
        beside = pyproj.Geod(ellps="sphere").fwd(0.0, corner, 90.0, found.surroundings.within_km * 1000.0)[0]
        meridians = np.mod(np.array([west - beside, east + beside]) + 180.0, 360.0) - 180.0
        assert [area.west, area.east] == pytest.approx(meridians, abs=0.02)
    bounds = found.projection.area_of_use
    assert bounds == (area.west, area.south, area.east, area.north)
    for text in (found.wkt, found.crs.wkt_derived, found.crs.projjson):
        assert Projection.from_user_input(text).area_of_use == bounds
    again = pyproj.CRS.from_json(found.crs.projjson).to_wkt("WKT2_2015")
    assert Projection.from_user_input(again).area_of_use == bounds


@pytest.mark.slow
def test_designs_tell_of_their_datum_and_of_places_outside_their_area() -> None:
    """As any CRS does: in memory, from WKT2, and as a mean of maps."""
    # Else programs would take coordinates on CH1903+ for such on WGS 84; a PROJ string has no datum.
    made = design("country:CH", degree=2, base="EPSG:2056", against=())
    assert pyproj.CRS.from_wkt(made.wkt).geodetic_crs.to_epsg() == 4150
    assert "Unknown" in design("country:CH", degree=2, base="+proj=somerc +ellps=bessel", against=()).wkt
    mean = projdist.mean_map(["EPSG:2056", "EPSG:21781"], region="country:CH", degree=2, name="Two")
    assert pyproj.CRS.from_wkt(mean.crs.wkt).name == "Two"
    for given in (made.projection, made.wkt, made.crs.projjson, mean.crs.wkt):
        with pytest.warns(projdist.support.Notice, match=r"where nothing of box:135,35,136,36 lies"):
            summarize(given, "box:135,35,136,36", tolerance=1e-2)
        summarize(given, "box:7,46,9,47", tolerance=1e-2)  # a warning would be an error


@pytest.mark.slow
def test_no_margin_where_the_map_folds() -> None:
    """A map that is not whole around its region is for the region alone."""
    found = design("country:NZ", kind="conformal", degree=8, background=0.0, base="+proj=tmerc +lon_0=173", against=())
    around, bounds = found.surroundings, found.projection.area_of_use
    assert around.folded > 0.0 or around.smallest_scale < 0.5 or around.largest_scale > 2.0
    west, south, east, north = get_region("country:NZ").bounds
    assert bounds == pytest.approx((west, south, east - 360.0, north), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("region", "kind", "criterion"), [
    ("country:AQ", "any", "airy_kavrayskiy"), ("country:AQ", "conformal", "airy_kavrayskiy"),
    ("country:AQ", "conformal", "max_scale_error_ppm"), ("country:AQ", "equal-area", "airy_kavrayskiy"),
    ("cap:0,-90,2000", "equal-area", "airy_kavrayskiy"), ("box:-180,60,180,90", "equal-area", "airy_kavrayskiy"),
    ("ocean@110m & box:-180,-90,180,-60", "equal-area", "airy_kavrayskiy"),
])  # fmt: skip
def test_regions_around_a_pole(region: str, kind: str, criterion: str) -> None:
    """A map that is whole, no worse than the polar one of its base's method, and the same from all meridians."""
    # What its kind keeps is seen in small squares about the pole, by pyproj: equal-area maps keep their areas,
    # conformal ones their angles.
    found = design(region, kind=kind, criterion=criterion, degree=2, against=())
    pole = -90.0 if get_region(region).bounds[1] < -80.0 else 90.0
    plain = Projection.from_user_input(f"+proj={AZIMUTHAL[kind]} +lat_0={pole:g} +ellps=WGS84")
    plain = measure_map(plain, get_region(region), design_objective(kind, criterion), scaled=kind != "equal-area")
    assert found.value <= plain.value * (1.0 + 1e-6)
    assert found.overlaps is False
    run = pyproj.Transformer.from_crs("OGC:CRS84", found.wkt, always_xy=True).transform
    rounding = 1.0  # m: the root of 1e-16, of the radius, is 6 cm, and that in PROJ's laea is a few of these
    assert np.ptp(np.array(run(np.linspace(-180.0, 180.0, 37), np.full(37, pole))), axis=1).max() < rounding
    side, curved = 20e3, 1e-5  # (20 km / R)^2, of a plane square
    corners = pyproj.Geod(ellps="WGS84").fwd([40.0] * 4, [pole] * 4, [0.0, 90.0, 180.0, 270.0], [side] * 4)[:2]
    square = shapely.Polygon(np.column_stack(run(*corners)))
    if kind == "equal-area":
        assert square.area == pytest.approx(2.0 * side**2, rel=curved)
    if kind == "conformal":
        diagonals = np.diff(np.array(square.exterior.coords)[[0, 2, 1, 3]], axis=0)[::2]
        assert np.hypot(*diagonals[0]) == pytest.approx(np.hypot(*diagonals[1]), rel=curved)


@pytest.mark.slow
@each(("base", "middle", "degree"), [
    ("+proj=laea +lat_0=51 +lon_0=10 +ellps=GRS80", 10.0, 5), ("EPSG:3035", 10.0, 3), ("EPSG:25832", 9.0, 3),
])  # fmt: skip
def test_symmetric_maps(base: str, middle: float, degree: int) -> None:
    """About the base's own meridian, wherever its coordinates begin, which is straight up without a word."""
    found = design("country:DE", degree=degree, base=base, symmetric="meridian", against=())
    lon, lat = np.array([1.0, 2.0, 4.0]), np.array([48.0, 50.0, 54.0])
    x, y = np.array(found.projection(middle + lon, lat)), np.array(found.projection(middle - lon, lat))
    np.testing.assert_allclose(x, [[-1.0], [1.0]] * y, rtol=0, atol=1e-6 if degree == 5 else 1e-5)


@pytest.mark.slow
def test_far_islands_get_the_degrees_that_they_need() -> None:
    """Two caps a quarter of the world apart have the error of one, r^2 / sqrt(192); degrees 3 and 4 gain nothing."""
    # Conformal ones have sqrt(2) times that. About the equator the best cone is one of which PROJ's arithmetic leaves
    # nothing conformal: another base is taken.
    alone, region = (500.0 / 6371.0) ** 2 / math.sqrt(192.0), "cap:0,0,500 + cap:90,0,500"
    found = design(region, base="+proj=eqc +lat_ts=2.25 +lon_0=45 +ellps=WGS84", background=0.0, against=())
    assert found.airy_kavrayskiy == pytest.approx(alone, rel=0.02)
    conformal = design(region, kind="conformal", background=0.0, against=())
    assert conformal.airy_kavrayskiy == pytest.approx(math.sqrt(2.0) * alone, rel=0.02)


def test_scales_beyond_all_numbers(capfd, monkeypatch: pytest.MonkeyPatch, slopes: Slopes) -> None:
    """Of 10^-477 beside a region, as for Europe at degree 9, nothing is fitted; no library writes into the terminal."""
    z = np.linspace(0.0, 1.0, 50) + 1j * np.linspace(0.0, 1.0, 50) ** 2
    with pytest.raises(ValueError, match="beyond all numbers"):
        fits._fitted(np.array([0.0, -1100.0]), z, np.full(50, 0.02))
    # Of 1e160, whose square is none, maps fold in silence: z + 5e59 z^2 at 1e100.
    z = ComplexPolynomial(0j, 1.0, np.array([0.0, 1.0, 5e59]))
    base_nodes = replace(slopes(lambda _: 1.0, lambda _: 1.0), x=np.array([0.0, 1e-70, 1e100]))
    monkeypatch.setattr(fits, "conformal_map", lambda *_: z)
    found = stage_of(base_nodes, at_own_scale(), 2)
    assert found.around[:2] == pytest.approx((1e160, 1e160))
    assert found.value < 1e-9
    assert found.share > 0.0  # whatever share keeps them whole, it is not the first
    assert capfd.readouterr() == ("", "")


@each(("first", "values", "best"), [(8, (3.3, 3.0, 3.3), 9), (1, (1.0, 1.0, 1.0, 0.95, 0.945, 0.94), 4)])
def test_the_degree_is_that_after_which_none_pays(first: int, values: tuple[float, ...], best: int) -> None:
    """Where the last degree is worse than one before, as its surroundings need more, the best one is taken."""
    # A gain of 5 % at the fourth degree pays for three that gain nothing, whatever the next ones gain.
    same = {"share": 0.0, "plane_map": ComplexPolynomial(0j, 1.0, np.array([0.0, 1.0])), "around": (1.0, 1.0, 0.0)}
    same["objective"] = design_objective("conformal", "airy_kavrayskiy")
    tried = [Stage(degree=degree, value=value, **same) for degree, value in enumerate(values, first)]
    assert best_of(tried).degree == best


def at_own_scale(**words: Any) -> DesignObjective:
    """The objective of conformal maps that stay as they are fitted."""
    objective = design_objective("conformal", "airy_kavrayskiy")
    return replace(objective, kind=replace(objective.kind, free_scale=False, **words))


@pytest.fixture
def slopes(monkeypatch: pytest.MonkeyPatch) -> Slopes:
    """Makes base nodes, three, the last beside the region, whose maps enlarge either by what is given."""
    base = Projection.from_user_input(SPHERICAL.format("stere", 0, 0))
    x, none, J = np.array([0.0, 0.0, 1.0]), np.zeros(3), np.tile(np.eye(2), (3, 1, 1))
    weight, around = np.array([0.5, 0.5, 0.0]), np.array([0.0, 0.0, 1.0])

    def made(inside: Scale, beside: Scale) -> BaseNodes:
        def fit(_: BaseNodes, degree: int, __: float, share: float) -> ComplexPolynomial:
            one, other = inside(degree), beside(share)  # z f' + (g' - f') z^2 / 2
            return ComplexPolynomial(0j, 1.0, np.array([0.0, one, 0.5 * (other - one)]))

        monkeypatch.setattr(fits, "conformal_map", fit)
        return BaseNodes(base=base, lon=none, lat=none, weight=weight, around=around, x=x, y=none, J=J)

    return made


@each(("beside", "share"), [
    (lambda share: 2.5 - 100.0 * share, 0.01),  # the first of 0, 1e-4, 3e-4, ... by which it is at most 2
    (lambda share: 0.3 + 100.0 * share, 0.003),  # and at least 1/2
    (lambda _: 1.9, 0.0),
])  # fmt: skip
def test_surroundings_get_the_least_share_that_keeps_them_whole(slopes: Slopes, beside: Scale, share: float) -> None:
    """Scales there are within 1/2 and 2 then."""
    found = stage_of(slopes(lambda _: 1.0, beside), at_own_scale(idle=3), 2)
    assert found.share == share
    assert found.around == pytest.approx((beside(share), beside(share), 0.0))


@each(("errors", "tried"), [
    ((1.0, 0.9, 0.895, 0.892, 0.89, 0.1), 5), ((1.0, 0.999, 0.998, 0.9, 0.899, 0.91, 0.92, 0.1), 7),
    ((1.0, 0.98, 0.96, 0.94, 0.92), 5),
])  # fmt: skip
def test_degrees_are_tried_until_three_in_a_row_do_not_pay(slopes: Slopes, errors: tuple, tried: int) -> None:
    """Each of which gains less than 1 % of the least so far."""
    nodes = slopes(lambda degree: math.exp(errors[degree - 1]), lambda _: 1.0)
    objective = at_own_scale(idle=3, degrees=range(1, len(errors) + 1))
    assert [one.degree for one in stages(nodes, objective, 0.0)] == list(range(1, tried + 1))


def test_energies_that_are_not_elliptic_at_a_node_that_counts() -> None:
    """ln^2 a bends down along a where a is above e, and nowhere near 1."""
    J, objective = np.array([np.eye(2), 3.0 * np.eye(2)]), design_objective("any", "airy_kavrayskiy")
    assert needs_exponent(J, np.array([0.5, 0.5]), objective)
    assert not needs_exponent(J, np.array([1.0, 0.0]), objective)
    assert not needs_exponent(J, np.array([0.5, 0.5]), replace(objective, exponent=EXPONENT))


def test_how_far_points_miss_themselves_there_and_back(slopes: Slopes) -> None:
    """The worst of all nodes of the region, on the ground; those beside it do not count."""
    base_nodes = replace(slopes(lambda _: 1.0, lambda _: 1.0), lon=np.array([10.0, 11.0, 12.0]), lat=np.full(3, 50.0))
    missed = np.array([0.0, 1e-7, 1.0])

    def inverse(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return base_nodes.lon[: x.size], base_nodes.lat[: x.size] + missed[: x.size]

    crs = SimpleNamespace(inverse=inverse, projection=base_nodes.base)
    assert _inverse_error(crs, base_nodes) == pytest.approx(math.radians(1e-7) * 6371008.7714, rel=1e-3)
    missed[0] = np.nan
    assert _inverse_error(crs, base_nodes) == math.inf


def test_the_base_is_the_best_of_the_families(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of conformal maps of a cap that is the stereographic one."""
    members = {"lcc": "+lat_1=45 +lat_2=55 +lon_0=10 +ellps=WGS84", "omerc": "+lonc=10 +alpha=40 +ellps=WGS84"}
    members |= dict.fromkeys(("stere", "tmerc"), "+lon_0=10 +ellps=WGS84")
    members = {name: Projection.from_user_input(f"+proj={name} +lat_0=50 {text}") for name, text in members.items()}
    monkeypatch.setattr(base_maps.decisions, "best_member", lambda name, *_: (members[name], {}))
    region, objective = get_region("cap:10,50,800"), design_objective("conformal", "airy_kavrayskiy")
    found = base_maps.best_base(region, objective, nodes_of(region, WGS84, 300), "none")
    assert found is members["stere"]


@pytest.mark.slow
def test_families_that_are_given_up_early_are_not_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    """The base is the one that is found when all families are searched to the end."""
    region, objective = get_region("country:VN"), design_objective("conformal", "airy_kavrayskiy")
    nodes = nodes_of(region, WGS84, 300)
    found = base_maps.best_base(region, objective, nodes, "none")
    monkeypatch.setattr("projdist.decisions.family_search._ROUGHLY", math.inf)
    assert base_maps.best_base(region, objective, nodes, "none").definition == found.definition


@pytest.mark.slow
@each("k", [1.0, 0.999])
def test_the_largest_error_of_scales(k: float) -> None:
    """Gauss's map of a sphere has k / cos(longitude) on the equator, which is the largest; the best scale halves it."""
    projection = Projection.from_user_input(f"+proj=tmerc +k_0={k} {SPHERICAL.split()[-1]}")
    region, a = projdist.get_region("box:-3,0,3,10"), k / math.cos(math.radians(3.0))
    truth = {
        ("max_scale_error_ppm", False): 1e6 * max(a - 1.0, 1.0 - k),
        ("max_scale_error_ppm", True): 1e6 * (a - k) / (a + k),
        ("max_log_scale", False): max(math.log(a), -math.log(k)),
        ("max_log_scale", True): 0.5 * math.log(a / k),
    }
    for (name, scaled), value in truth.items():
        found = measure_map(projection, region, design_objective("conformal", name), scaled=scaled)
        assert found.value == pytest.approx(value, rel=1e-5)


@pytest.mark.slow
def test_wide_regions() -> None:
    """Members of families that show nothing of one are passed over in silence; an exponentiated energy is told."""
    assert design("cap:0,0,9000", degree=2, against=()).airy_kavrayskiy < 0.16
    found = design(cap(99.0), degree=2, base=SPHERICAL.format("stere", 0, 0), against=(), background=0.0)
    assert (found.exponent > 0.0) == any("exponentiated" in note for note in found.notes)


@pytest.mark.slow
def test_balance_and_norm() -> None:
    """More weight on areas keeps areas better, and angles worse; the ends are near the special kinds."""
    base = SPHERICAL.format("laea", 0, 0)
    errors = []
    for balance in (0.05, 0.5, 0.95):
        found = design(cap(20.0), degree=5, base=base, balance=balance, background=0.0, against=())
        measured = summarize(found.projection, cap(20.0), measures=["log_areal_scale", "log_anisotropy"]).measures
        errors.append((measured["log_areal_scale"].rms, measured["log_anisotropy"].rms))
    areas, angles = zip(*errors, strict=True)
    assert areas[0] > areas[1] > areas[2]
    assert angles[0] < angles[1] < angles[2]
    assert areas[1] == pytest.approx(angles[1], rel=0.05)  # at the optimum both have the same share
    # A higher norm lowers the largest and raises the mean error.
    options = {"kind": "conformal", "degree": 4, "base": OBLIQUE, "against": (), "background": 0.0}
    found = [design(NZ, norm=norm, **options) for norm in (2.0, 8.0, 32.0)]
    largest = [max(one.largest.value - 1.0, 1.0 - one.smallest.value) for one in found]
    assert largest[0] > largest[1] > largest[2]
    assert found[0].airy_kavrayskiy < found[1].airy_kavrayskiy < found[2].airy_kavrayskiy


@pytest.mark.slow
def test_points_with_weights() -> None:
    """A set of points is a region, too; whether its image covers itself is not asked."""
    nodes = nodes_of(projdist.get_region("country:CH"), SPHERE, 300)
    places = projdist.PointSet(nodes.lon, nodes.lat, nodes.weight, "mine")
    found = design(places, degree=3, base="EPSG:3035", against="recommend")
    assert (found.overlaps, found.rivals) == (None, ())
    over = design("country:CH", degree=3, base="EPSG:3035", against=())
    assert found.airy_kavrayskiy == pytest.approx(over.airy_kavrayskiy, rel=0.02)  # of 300 points


def points(*places: tuple[float, float]) -> projdist.PointSet:
    return projdist.PointSet(*np.array(places).T, np.ones(len(places)), "few")


@pytest.mark.slow
@each(("words", "error", "message"), [
    ({"kind": "nice"}, ValueError, "Invalid kind 'nice'"), ({"degree": 21}, ValueError, "Invalid degree '21'"),
    ({"criterion": "max_log_scale"}, ValueError, "Invalid criterion 'max_log_scale' for maps of kind any"),
    ({"degree": 0}, ValueError, "Invalid degree '0'. It must be auto, or a whole number from 1 to 20"),
    ({"balance": 1.0}, ValueError, "Invalid balance '1.0'. It must be a number above 0 and below 1"),
    ({"kind": "conformal", "norm": 1.0}, ValueError, "Invalid norm '1.0'. It must be a number from 2 to 64"),
    ({"norm": 4.0}, ValueError, "Invalid norm '4.0' for maps of kind any"),
    ({"background": 0.7}, ValueError, "Invalid background '0.7'"),
    ({"symmetric": "left"}, ValueError, "Invalid symmetry 'left'"),
    ({"datum": "EPSG:3035"}, ValueError, "Invalid geographic CRS"),
    ({"datum": "EPSG:4807"}, ValueError, "Invalid geographic CRS 'EPSG:4807'. Its longitudes must be from Greenwich"),
    ({"name": "two\nlines"}, ValueError, "It must be one line of text"),
    ({"region": "globe"}, ValueError, "It reaches 180 degrees from its middle, and must reach at most 100"),
    ({"region": points((7, 46), (8, 47), (9, 46.5)), "degree": 5}, ValueError, "Invalid degree '5' for region 'few'"),
    ({"region": points((7, 46))}, ValueError, "It is a point: all maps are right there"),
    ({"kind": "conformal"}, ProjectionError, "for conformal maps. It must be conformal itself"),
    ({"base": "EPSG:3857", "kind": "equal-area"}, ProjectionError,
     "for equal-area maps. It must be equal-area at scale 1"),
    ({"base": lambda lon, lat: (lon, lat)}, ProjectionError, "It must be a projection with a PROJ string"),
    ({"base": "+proj=gnom +lat_0=-46.8 +lon_0=188.2 +ellps=WGS84"}, ProjectionError, "of the region"),
    ({"base": "+proj=lcc +lat_1=40 +lat_2=50 +lon_0=-171.8"}, ProjectionError, "It is cut within country:CH"),
])  # fmt: skip
def test_what_is_refused(words: dict, error: type[ValueError], message: str) -> None:
    """In one line, before anything is computed; bases that tear the region, or are not of the kind."""
    with pytest.raises(error, match=r"^Invalid ") as caught:
        design(**{"region": "country:CH", "base": "EPSG:3035", "degree": 3, "against": ()} | words)
    assert message in str(caught.value)
