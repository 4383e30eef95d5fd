"""The region of maps for which none was named."""

import functools
import math

import numpy as np
import pyproj
import pytest
from refusals import refuses
from region_texts import square
from tables import each

import projdist
from projdist import Notice, Projection, compare, indices, sample, summarize
from projdist.earth import SPHERE, WGS84, Ellipsoid
from projdist.projections import ProjectionError
from projdist.regions import GLOBE, Box, Cap, get_region, region_for


def maps(*names):
    return [Projection.from_user_input(name) for name in names]


# EPSG:3035 and EPSG:32632 as EPSG's registry has them; others are of other areas.
@each(("names", "area"), [
    *((["robin"], GLOBE), ([], GLOBE), (["EPSG:3035", "EPSG:2056"], GLOBE), (["EPSG:3035", "robin"], GLOBE)),
    *((["EPSG:3035"], Box(-35.58, 24.6, 44.83, 84.73)), (["EPSG:32632", "EPSG:32632"], Box(6, 0, 12, 84))),
])  # fmt: skip
def test_the_area_of_use_that_all_have_else_the_globe(names, area):
    assert (region_for(None, maps(*names)), region_for("cap:0,0,10", maps(*names)).name) == (area, "cap:0,0,10")


def test_every_answer_has_the_same_default():
    """Of a CRS alone it is its area of use; what fails has none."""
    utm, coarse = "EPSG:32632", {"tolerance": 1e-3}
    answers = [summarize(utm, **coarse), sample(utm, **coarse), indices(utm, names="airy", **coarse)]
    answers += [compare(maps, **coarse) for maps in (utm, [utm, "nonsense"])]
    assert [answer.region.name for answer in answers] == ["box:6,0,12,84"] * 5
    assert answers[0].airy_kavrayskiy == summarize(utm, "box:6,0,12,84", **coarse).airy_kavrayskiy
    with pytest.warns(Notice, match=r"^EPSG:3035 is for box:-35.58,24.6,44.83,84.73, where 6\.5 % of globe lies"):
        assert compare(["EPSG:3035", "robin"], tolerance=1e-2).region == GLOBE


# ---- bodies ---------------------------------------------------------------------------------
MARS = "IAU_2015:49910"  # a sphere of 3396.19 km
MARS_ELLIPSOID, MOON = "IAU_2015:49911", "IAU_2015:30110"  # 3396.19 and 3376.20 km; 1737.4 km
R_MARS, R_MOON = 3396.19, 1737.4
SPHERES = ["robin", "+proj=moll +R=1", "+proj=laea +R=6371", "+proj=laea +a=6370997"]  # of the Earth


def zone(radius: float, km: float) -> float:
    """Square kilometres of a cap of a sphere."""
    return 2.0 * math.pi * radius**2 * (1.0 - math.cos(km / radius))


def polygon(lat: float, **figure: object) -> float:
    """Those of a cap of 1000 km by GeographicLib: 20,000 points at the distance hold 2e-8 less than the circle."""
    geod, places = pyproj.Geod(**figure), np.zeros(20_000)
    lons, lats, _ = geod.fwd(places, places + lat, 0.018 * np.arange(20_000), places + 1e6)
    return abs(geod.polygon_area_perimeter(lons, lats)[0]) / 1e6


@each(("names", "region", "area"), [
    *(([MARS], None, 4.0 * math.pi * R_MARS**2), ([MARS], "cap:0,0,1000", zone(R_MARS, 1000.0))),
    ([MARS, "+proj=moll +R=3389500"], "cap:20,40,1000", zone(R_MARS, 1000.0)),  # another figure of Mars
    (["+proj=moll +R=3396190", MARS_ELLIPSOID], "cap:0,90,1000", polygon(90, a=3396190.0, b=3376200.0)),
    ([MOON], "cap:10,-30,2000", zone(R_MOON, 2000.0)),
    ([MOON], "box:0,0,90,90", math.pi / 2.0 * R_MOON**2),
    ([MOON], "box:0,0,45,90 + box:45,0,90,90", math.pi / 2.0 * R_MOON**2),
    ([MOON], {"type": "Polygon", "coordinates": [square(0, 0, 9, 90)]}, math.radians(9.0) * R_MOON**2),
    (["+proj=eqc +R=71492000"], "cap:0,0,150000", zone(71492.0, 150_000.0)),
    *((SPHERES, "cap:5,5,900", zone(6371.0087714, 900.0)), (["robin"], None, 510_065_621.724)),
    (["robin", "EPSG:3857", "EPSG:31467"], "cap:0,0,1000", polygon(0, ellps="WGS84")),
    ([], "cap:0,0,1000", polygon(0, ellps="WGS84")),
])  # fmt: skip
def test_regions_are_on_the_body_of_the_maps(names, region, area):
    """Areas by closed forms of spheres, by GeographicLib on ellipsoids; of the Earth's globe that of WGS 84."""
    assert region_for(region, maps(*names)).area_km2 == pytest.approx(area, rel=3e-8)


def test_a_cap_is_one_for_all_maps_of_the_earth():
    """Of maps of spheres and of ellipsoids it is that on WGS 84, for each of them, and for many regions, too."""
    sphere = "+proj=aeqd +lat_0=90 +R=6371008.7714"
    both = compare([sphere, "EPSG:3575"], "cap:0,90,3000", sort="given", tolerance=1e-6)
    assert both.region == Cap(0, 90, 3000, WGS84)
    assert [one.region for one in both.results] == [both.region] * 2
    assert compare([sphere], "cap:0,90,3000", tolerance=1e-6).region == Cap(0, 90, 3000, SPHERE)
    given = compare(["robin"], Cap(0, 90, 3000, WGS84), tolerance=1e-3)  # a figure that is given stays
    assert given.region.ellipsoid == WGS84


REFUSED = {
    ("robin", MARS): r"^Invalid maps '\+proj=robin .*' and 'IAU_2015:49910'. They are of the Earth and of Mars; ",
    (MARS, MOON): r"They are of Mars and of the Moon; maps that are compared must be of one body.$",
    ("+proj=moll +R=1188300", MOON): r"They are of a body of radius 1188.3 km and of the Moon; ",
    # Ariel and Umbriel differ by 0.6 %, and are told apart by their names.
    ("IAU_2015:70110", "IAU_2015:70210"): r"They are of Ariel and of Umbriel; ",
}


@each(("names", "words"), REFUSED.items())
def test_maps_of_different_bodies_are_refused(names, words):
    batch = functools.partial(projdist.batch, summarize, ["box:0,0,10,10"])
    for call in (compare, batch, projdist.mean_map):
        with pytest.raises(ProjectionError, match=words):
            call(list(names))


@each("region", [
    *("country:CH", "state:CA", "continent:Africa@110m", "land@110m", "ocean@110m", "crs:EPSG:3035"),
    "box:20,-5,25,0 & country:CD@110m",
])  # fmt: skip
def test_places_of_the_earth_are_not_on_other_bodies(region):
    for given in (region, get_region(region)):
        refuses(r"^Invalid region '.*'\. It is on the Earth, not on Mars\.$", summarize, MARS, given)
    said = r"^Invalid region '.*'. It is on the Earth, not on a .* 1737.4 km.$"
    refuses(said, get_region, region, Ellipsoid(1737400.0))


def test_the_radius_of_a_cap_is_at_most_half_the_body():
    """10,669 km on Mars; on Jupiter the Earth's largest is a small one."""
    said = r"^Invalid cap '0,0,15000'. .* at most 10669 km, half the body's c"
    refuses(said, summarize, MARS, "cap:0,0,15000")
    refuses(
        r"not be flatter than 0.2, for distances to be right.$", summarize, "IAU_2015:200043311", "cap:0,0,1"
    )  # Eros


@pytest.mark.slow
def test_decisions_are_the_earths():
    """Maps of other bodies are no rivals, and their regions not the Earth's."""
    cap, said = "cap:0,0,900", "It is of {}, and must be of the Earth.$"
    refuses(said.format("Mars"), projdist.optimize, "laea", cap, against=MARS)
    refuses(said.format("Mars"), projdist.design, cap, degree=2, base="mercator", against=[MARS])
    refuses("not on the Earth.$", projdist.recommend, region_for(cap, maps(MARS)))
    refuses(said.format("the Moon"), projdist.ldp, "box:0,0,1,1", height=0.0, against=[MOON])
