"""Closed forms against differences of PROJ's coordinates, and what they leave to differences."""

import mpmath
import numpy as np
import pytest
from jacobians import ACCURACY
from tables import each

from projdist.field.at_points import derivatives
from projdist.field.stencils import hessian
from projdist.projections import Projection, ProjectionError, closed_forms, crs_records

# By method, about 10 degrees east: ellipsoids and spheres, both hemispheres, all forms of their parameters.
FORMS = [
    "+proj=merc +lat_ts=40 +ellps=GRS80",
    "+proj=merc +k_0=0.9 +R=6371000",
    "+proj=webmerc +ellps=WGS84",
    "+proj=lcc +lat_1=30 +lat_2=60 +ellps=GRS80",
    "+proj=lcc +lat_1=-30 +lat_0=-30 +k_0=0.99 +ellps=intl",
    "+proj=lcc +lat_1=40.7 +lat_2=41 +R=6371000",
    "+proj=aea +lat_1=-10 +lat_2=-50 +ellps=clrk66",
    "+proj=aea +lat_1=20 +lat_2=60 +R=6371000",
    "+proj=cea +lat_ts=30 +ellps=WGS84",
    "+proj=eqc +lat_ts=30 +R=6371000",
    "+proj=utm +zone=32 +ellps=GRS80",
    "+proj=tmerc +k=1.1 +lat_0=-20 +R=6371000",
    "+proj=somerc +lat_0=46.95 +k_0=0.99 +ellps=bessel",
    "+proj=sterea +lat_0=52 +k=0.9999 +ellps=bessel",
    "+proj=stere +lat_0=-30 +k=0.99 +ellps=GRS80",
    "+proj=stere +lat_0=90 +lat_ts=70 +ellps=GRS80",
    "+proj=stere +lat_0=-90 +k=0.994 +ellps=GRS80",
    "+proj=omerc +lat_0=4 +alpha=53.3 +gamma=53.1 +ellps=evrstSS",
    "+proj=omerc +lat_0=-40 +gamma=-30 +ellps=GRS80",
    "+proj=omerc +lat_0=40 +alpha=89 +R=6371000",
    "+proj=laea +lat_0=52 +ellps=GRS80",
    "+proj=laea +lat_0=-90 +ellps=GRS80",
    "+proj=laea +lat_0=0 +R=6371000",
    "+proj=sinu +R=6371000",
    "+proj=moll +ellps=WGS84",
    "+proj=eck4 +ellps=GRS80",
    "+proj=eck6 +R=6371000",
    "+proj=eqearth +ellps=WGS84",
]
FORMS = [f"{form} {'+lonc=10' if '=omerc' in form else '' if 'zone' in form else '+lon_0=10'}" for form in FORMS]
# What formulas do not know, or know otherwise; PROJ must have no coordinates of theirs, or the same.
UNKNOWN = [
    "+proj=tmerc +a=6378137 +rf=20",  # as flat as Saturn: PROJ's series leave 0.8 mm
    "+proj=eqc +lat_ts=30 +ellps=WGS84",  # that of the ellipsoid from PROJ 9.8 on
    "+proj=tmerc +approx +lon_0=3",
    "+proj=merc +pm=paris",
    "+proj=lcc +lat_1=40 +axis=wsu",
    "+proj=laea +lat_0=40 +R_A +ellps=GRS80",
    "+proj=omerc +lat_0=40 +alpha=30 +no_rot",
    "+proj=omerc +lat_1=40 +lon_1=0 +lat_2=50 +lon_2=20",
    "+proj=omerc +lat_0=0.001 +alpha=30",
    "+proj=stere +lat_0=90 +lat_ts=-70",
    "+proj=lcc +lat_1=49.8333339 +lat_2=51.1666672333333 +lat_0=90 +lon_0=4d22'2.952\"E",
    "+proj=eqc +lat_ts=20 +lat_0=10 +units=us-ft",
    "+proj=krovak +ellps=bessel",
    "+proj=sinu +ellps=WGS84",
    "+proj=robin",
]
# Of a sphere PROJ takes the arc cosine of a number near 1, and loses three digits at the equator; the formula has the
# scale 1 / sqrt(1 - B^2) to rounding there (Snyder 1987, 8-4).
NOISE = 5.0
# H of differences is good to 1e-9 of its natural size, the inverse of the radius, times how quickly maps bend.
BENDS = 1e-8


def both(definition: str, lon: np.ndarray, lat: np.ndarray):
    """The map, and the same as a function, of which nothing is known."""
    projection = Projection.from_user_input(definition)
    return projection, Projection.from_function(projection, ellipsoid=projection.ellipsoid)


def places(n: int = 200) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    return rng.uniform(-45.0, 65.0, n), rng.uniform(-80.0, 80.0, n)


def gaps(definition: str, lon: np.ndarray, lat: np.ndarray) -> np.ndarray:
    """Differences of J between formulas and differences, in units of what these promise."""
    found, truth = (derivatives(projection, lon, lat) for projection in both(definition, lon, lat))
    assert (found.quality == truth.quality).all()
    size = np.abs(truth.jacobian).sum(axis=(1, 2))
    return np.abs(found.jacobian - truth.jacobian).sum(axis=(1, 2)) / size / (ACCURACY + found.error + truth.error)


@each("definition", FORMS)
def test_formulas_have_the_derivatives_of_the_coordinates(definition: str) -> None:
    """J and H, within the region in which maps of the method are used and far beyond."""
    lon, lat = places()
    projection, function = both(definition, lon, lat)
    good = np.isfinite(projection.closed_form.plane(lon, lat)[1])
    lon, lat = lon[good], lat[good]
    assert good.mean() > 0.5
    assert np.nanmax(gaps(definition, lon, lat)) < (NOISE if "tmerc" in definition else 1.0)
    H, truth = hessian(projection, lon, lat), hessian(function, lon, lat)
    assert np.nanmax(np.abs(H - truth) / (1.0 + np.abs(truth).max(axis=(1, 2, 3), keepdims=True))) < BENDS


@each("definition", UNKNOWN)
def test_what_formulas_do_not_know_is_left_to_differences(definition: str) -> None:
    """No parameter changes a number: there is no formula, or it has the coordinates."""
    definition = definition if "ellps" in definition or "R=" in definition else f"{definition} +ellps=GRS80"
    assert np.nanmax(gaps(definition, *places(40))) < 1.0


@each("definition", [*FORMS[::4], "+proj=lcc +lat_1=40 +lon_0=10 +ellps=GRS80"])
def test_seams_poles_and_what_is_outside_are_as_before(definition: str) -> None:
    """At the meridian opposite the central one, at the poles and beside them."""
    lon, lat = (
        part.ravel() for part in np.meshgrid([10.0, 189.95, 190.0, -170.0, -169.99], [-90.0, -88.5, 0.0, 89.9, 90])
    )
    found = gaps(definition, lon, lat)
    assert np.nanmax(found, initial=0.0) < 1.0


def test_conformal_formulas_hold_beside_the_pole() -> None:
    """The scale of the polar stereographic map by Snyder's 15-9 and 21-33 in forty digits, from 88 to 89.98 degrees."""
    lat, e = np.array([88.1, 89.0, 89.9, 89.98]), mpmath.sqrt(2 / mpmath.mpf("298.25") - 1 / mpmath.mpf("298.25") ** 2)
    found = derivatives("+proj=stere +lat_0=90 +a=6378137 +rf=298.25", 30.0, lat)
    size = 2.0 / mpmath.sqrt((1.0 + e) ** (1.0 + e) * (1.0 - e) ** (1.0 - e))
    for degrees, J, error in zip(lat.tolist(), found.jacobian, found.error, strict=True):
        with mpmath.workdps(40):
            phi = mpmath.radians(degrees)
            x = e * mpmath.sin(phi)
            t = mpmath.tan(mpmath.pi / 4 - phi / 2) * ((1 + x) / (1 - x)) ** (e / 2)
            k = size * t * mpmath.sqrt(1 - x * x) / mpmath.cos(phi)
        assert abs(np.hypot(*J[:, 0]) / k - 1.0) < 1e-14 < error < 2e-12


def test_a_formula_that_is_off_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not by 1e-12 of the scale, nor where PROJ has other coordinates at some of the points that are asked for."""
    exact = closed_forms._METHODS["tmerc"]
    definition = "+proj=tmerc +lon_0=10 +ellps=GRS80 +k_0=0.98"

    def off(stated: closed_forms.Stated) -> closed_forms.Formula:
        formula = exact(stated)
        return lambda place: formula(place)._replace(w=(1.0 + 1e-12) * formula(place).w)

    monkeypatch.setitem(closed_forms._METHODS, "tmerc", off)
    assert Projection.from_user_input(definition).closed_form is None
    closed_forms._form_of.cache_clear()
    monkeypatch.setitem(closed_forms._METHODS, "tmerc", exact)
    form = Projection.from_user_input(definition).closed_form
    lon, lat = np.array([9.0, 11.0]), np.array([50.0, 50.0])
    x, y = Projection.from_user_input(definition)(lon, lat)
    moved = x + np.array([0.0, 1e-5])
    assert np.isnan(form.checked(lon, lat, moved, y)[1]).tolist() == [False, True]


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_crss_of_the_database(part: int) -> None:
    """One in ten; in their areas of use; nearly all of them have a closed form."""
    rng, formed, count = np.random.default_rng(part), 0, 0
    for record in crs_records(["EPSG", "ESRI", "IGNF"], deprecated=True)[10 * part :: 40]:
        try:
            projection = Projection.from_user_input(record.code)
        except ProjectionError:
            continue
        west, south, east, north = record.area_of_use
        lon, lat = rng.uniform(west, east + 360.0 * (east < west), 8), rng.uniform(south, north, 8)
        count += 1
        if projection.closed_form is not None:
            formed += 1
            found = derivatives(projection, lon, lat)
            truth = derivatives(Projection.from_function(projection, ellipsoid=projection.ellipsoid), lon, lat)
            size = np.abs(truth.jacobian).sum(axis=(1, 2))
            gap = np.abs(found.jacobian - truth.jacobian).sum(axis=(1, 2)) / size
            assert (np.isnan(found.jacobian) == np.isnan(truth.jacobian)).all(), record.code
            assert not (gap > 2.0 * ACCURACY + 3.0 * (found.error + truth.error)).any(), record.code
    assert formed > 0.9 * count > 0
