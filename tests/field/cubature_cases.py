"""Maps and regions with their Airy-Kavrayskiy errors: smooth ones, torn ones, and some that end."""

import functools
import math
from collections.abc import Callable
from contextlib import nullcontext
from typing import NamedTuple

import numpy as np
import pytest
from closed_errors import (
    GOODE,
    HALF_PI,
    PROJ_GOODE,
    Field,
    R,
    aitoff,
    albers_box,
    azimuthal,
    azimuthal_globe,
    both_sides,
    conformal_box,
    cylindrical,
    eckert_4,
    equal_earth,
    errors_of,
    gauss,
    goode_parts,
    hammer,
    interrupted,
    joined,
    lambert_conformal_scale,
    m_of,
    mercator_cap,
    mollweide,
    natural_earth,
    oblique_equal_area,
    sinusoidal,
    sphere_box,
    symmetric_globe,
    utm_box,
    winkel_tripel,
)

from projdist import Notice
from projdist.answers.summaries import summarize


class Case(NamedTuple):
    """A projection over a region, its true field, and the error that PROJ's own rounding leaves at any tolerance."""

    id: str
    projection: str
    region: str
    field: Callable[[], Field]
    floor: float = 0.0


def km(angle):
    """The radius in km of a cap of so many degrees."""
    return math.radians(angle) * R / 1000


def cap(lon, lat, angle):
    return f"cap:{lon},{lat},{km(angle)!r}"


def one(x):
    return np.ones_like(x)


def sec(x):
    return 1 / np.cos(x)


def csc(x):
    return 1 / np.sin(x)


AZIMUTHAL = {  # h and k by the distance c from the centre (Snyder 1987, chapters 20 to 25)
    "aeqd": (one, lambda c: c / np.sin(c)),
    "laea": (lambda c: np.cos(c / 2), lambda c: sec(c / 2)),
    "stere": (lambda c: sec(c / 2) ** 2, lambda c: sec(c / 2) ** 2),
    "gnom": (lambda c: sec(c) ** 2, sec),
    "ortho": (np.cos, one),
}


AZIMUTHAL_GLOBE = {  # by c / 2 and its complement
    "aeqd": (lambda a, b: one(a), lambda a, b: np.where(a < b, a, HALF_PI - b) / (np.sin(a) * np.sin(b))),
    "laea": (lambda a, b: np.sin(b), lambda a, b: csc(b)),
    "stere": (lambda a, b: csc(b) ** 2, lambda a, b: csc(b) ** 2),
}

ASPECTS = {"polar": (0, 90), "equatorial": (0, 0), "oblique": (25, 40)}

SMOOTH_GLOBE = {
    "plate-carree": lambda: cylindrical(one, csc),
    "mercator": lambda: cylindrical(csc, csc),
    "lambert-cylindrical": lambda: cylindrical(np.sin, csc),
    "behrmann": lambda: cylindrical(
        lambda c: np.sin(c) / math.cos(math.pi / 6), lambda c: math.cos(math.pi / 6) * csc(c)
    ),
    "gall-isographic": lambda: cylindrical(one, lambda c: math.sqrt(0.5) * csc(c)),
    "miller": lambda: cylindrical(lambda c: sec(0.8 * (HALF_PI - c)), csc),
    "gall-stereographic": lambda: cylindrical(
        lambda c: (1 + math.sqrt(0.5)) / 2 * sec((HALF_PI - c) / 2) ** 2, lambda c: math.sqrt(0.5) * csc(c)
    ),
    "sinusoidal": lambda: both_sides(sinusoidal),
    "mollweide": lambda: both_sides(mollweide),
    "eckert-4": lambda: both_sides(eckert_4),
    "hammer": lambda: symmetric_globe(hammer),
    "aitoff": lambda: symmetric_globe(aitoff),
    "winkel-tripel": lambda: symmetric_globe(winkel_tripel),
    "natural-earth": lambda: symmetric_globe(natural_earth),
    "equal-earth": lambda: symmetric_globe(equal_earth),
}


# PROJ refuses 1 + cos c < 1e-10, and 1e-8 of a radian about the pole opposite a polar aspect.
ANTIPODE = math.pi - math.sqrt(2e-10)


FLOORS = {
    "eckert-4": 1e-6,  # PROJ snaps to the pole line
    "laea-equatorial": 1e-5,  # 1 + cos c loses its digits near the antipode
    "laea-oblique": 1e-5,
    "aeqd-oblique": 1e-7,
    "oblique-sinusoidal": 1e-5,
    "igh": 1e-6,
}


def azimuthal_case(name, aspect):
    """An azimuthal map of the whole globe, as far as PROJ maps it."""
    lon, lat = ASPECTS[aspect]
    make = functools.partial(azimuthal_globe, *AZIMUTHAL_GLOBE[name])
    if name == "stere" and aspect != "polar":
        make = functools.partial(azimuthal, *AZIMUTHAL[name], ANTIPODE)
    case_id = f"{name}-{aspect}"
    return Case(case_id, f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}", "globe", make, FLOORS.get(case_id, 0.0))


SMOOTH = [
    *(Case(name, name, "globe", make, FLOORS.get(name, 0.0)) for name, make in SMOOTH_GLOBE.items()),
    *(azimuthal_case(name, aspect) for name in AZIMUTHAL_GLOBE for aspect in ASPECTS),
    *(
        Case(
            f"{name}-{aspect}-cap",
            f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}",
            cap(lon, lat, 70),
            functools.partial(azimuthal, *scales, math.radians(70)),
        )
        for name, scales in AZIMUTHAL.items()
        for aspect, (lon, lat) in ASPECTS.items()
    ),
    Case("mercator-cap", "mercator", cap(10, 50, 20), lambda: mercator_cap(50, 20, False)),
    Case("mercator-wgs84-cap", "EPSG:3395", cap(-170, 50, 20), lambda: mercator_cap(50, 20, True)),
    Case(
        "mercator-wgs84-box", "EPSG:3395", "box:-20,35,40,70", lambda: conformal_box(lambda phi: 1 / m_of(phi), 35, 70)
    ),
    Case(
        "lcc-wgs84-box",
        "+proj=lcc +lat_1=33 +lat_2=45 +lat_0=39 +lon_0=-96 +ellps=WGS84",
        "box:-125,25,-65,50",
        lambda: conformal_box(lambert_conformal_scale, 25, 50),
    ),
    Case(
        "albers-wgs84-box",
        "+proj=aea +lat_1=29.5 +lat_2=45.5 +lat_0=37.5 +lon_0=-96 +ellps=WGS84",
        "box:-125,25,-65,50",
        lambda: albers_box(-29, 25, 31, 50),
    ),
    Case("utm-box", "EPSG:32631", "box:0,0,6,84", lambda: utm_box(-3, 0, 3, 84)),
    Case("utm-wide-box", "EPSG:32631", "box:-9,40,7,60", lambda: utm_box(-12, 40, 4, 60)),
    Case("winkel-tripel-box", "winkel-tripel", "box:60,20,150,75", lambda: sphere_box(winkel_tripel, 60, 20, 150, 75)),
    Case(
        "hammer-antimeridian-box",
        "+proj=hammer +lon_0=180 +R=6371008.7714",
        "box:150,-60,-120,10",
        lambda: sphere_box(hammer, -30, -60, 60, 10),
    ),
    Case("sinusoidal-box", "sinusoidal", "box:20,10,100,60", lambda: sinusoidal_box(20, 10, 100, 60)),
    Case(
        "laea-box",
        f"+proj=laea +lon_0=10 +lat_0=52 +R={R}",
        "box:-25,34,45,72",
        lambda: sphere_box(oblique_equal_area, -25, 34, 45, 72),
    ),
]


def sinusoidal_box(west, south, east, north):
    lam, w = gauss(math.radians(west), math.radians(east))
    return sinusoidal(lam[:, None], w[:, None], math.radians(south), math.radians(north))


def oblique(name, lat_p=35.0):
    return f"+proj=ob_tran +o_proj={name} +o_lat_p={lat_p:g} +o_lon_p=20 +lon_0=-15 +R={R}"


# Seams or an end of the map cross the region.
TORN = [
    Case(
        "goode",
        "goode-homolosine",
        "globe",
        lambda: both_sides(lambda lam, w: joined(*(f(lam, w) for f in goode_parts(PROJ_GOODE)))),
    ),
    Case("igh", "interrupted-goode-homolosine", "globe", lambda: interrupted(*goode_parts(GOODE)), FLOORS["igh"]),
    Case("imoll", "interrupted-mollweide", "globe", lambda: interrupted(mollweide)),
    Case("oblique-plate-carree", oblique("eqc"), "globe", SMOOTH_GLOBE["plate-carree"]),
    Case("oblique-mercator", oblique("merc"), "globe", SMOOTH_GLOBE["mercator"]),
    Case("oblique-mollweide", oblique("moll"), "globe", SMOOTH_GLOBE["mollweide"]),
    Case(
        "oblique-sinusoidal", oblique("sinu", 60.0), "globe", SMOOTH_GLOBE["sinusoidal"], FLOORS["oblique-sinusoidal"]
    ),
    Case("transverse-hammer", oblique("hammer", 0.0), "globe", SMOOTH_GLOBE["hammer"]),
]


@functools.cache
def truth_of(case_id):
    return errors_of(next(case for case in SMOOTH + TORN if case.id == case_id).field())


@functools.cache
def summary_of(case_id, tolerance):
    case = next(case for case in SMOOTH + TORN if case.id == case_id)
    told = pytest.warns(Notice, match="outside its area of use") if case.id == "utm-wide-box" else nullcontext()
    with told:
        return summarize(case.projection, case.region, tolerance=tolerance)


def triple(summary):
    """The raw, scaled and affine errors of a summary."""
    return summary.airy_kavrayskiy, summary.airy_kavrayskiy_scaled, summary.airy_kavrayskiy_affine


# ---- the errors and their estimates -----------------------------------------------------------

TOLERANCES = [1e-4, 1e-6, 1e-8]
