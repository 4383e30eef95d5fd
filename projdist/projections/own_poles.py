"""The poles about which maps are simple: the centres of azimuthal ones, and those of transverse and oblique ones."""

from __future__ import annotations

import functools
from typing import NamedTuple

from projdist.earth import SMOOTH, Breaks
from projdist.projections.breaks import known_breaks, numbers_of
from projdist.projections.operations import Pipeline
from projdist.projections.projection import Projection

__all__ = ["OwnPole", "own_pole_of"]

_AZIMUTHAL = frozenset("laea aeqd stere ortho gnom airy nsper".split())  # about lon_0, lat_0
_ENDLESS = frozenset("stere merc webmerc cc lcc".split())  # they leave the plane at a pole
_TRANSVERSE = frozenset("tmerc cass tcea".split())  # cylinders about the point 90 degrees east of lon_0
_ON_ELLIPSOIDS = frozenset(["laea", "ortho"])  # others have rounding about their poles there that graded panels see
_SHIFTING = frozenset(["pm", "over", "axis"])
_QUARTER = 90.0  # degrees about a centre in which sines and cosines of the azimuth are resolved


class OwnPole(NamedTuple):
    """A pole in degrees, and the map's breaks in longitudes and latitudes about it, from its meridian to the south.

    `widest` is how many degrees about the pole are resolved at once. Maps that grow without bound towards the pole or
    its antipode are `graded` there; in others nodes so near would see how PROJ snaps to these points.
    """

    lon: float
    lat: float
    breaks: Breaks
    widest: float
    graded: bool


def own_pole_of(projection: Projection) -> OwnPole | None:
    """The pole of a map in PROJ's words; None where it is the Earth's, or not known."""
    function = projection.function
    return _of_text(function.pipeline, projection.ellipsoid.is_sphere) if isinstance(function, Pipeline) else None


@functools.lru_cache(maxsize=256)
def _of_text(pipeline: str, sphere: bool) -> OwnPole | None:
    values = numbers_of(pipeline)
    if values.keys() & _SHIFTING or not (sphere or values.get("proj") in _ON_ELLIPSOIDS):
        return None
    name, lon, lat = values.get("proj"), values.get("lon_0", 0.0), values.get("lat_0", 0.0)
    if not isinstance(lon, float) or not isinstance(lat, float):
        return None
    if name in _AZIMUTHAL:
        return OwnPole(lon, lat, SMOOTH, _QUARTER, name in _ENDLESS) if abs(lat) < 90.0 else None
    if name in _TRANSVERSE:
        return OwnPole(lon + 90.0, 0.0, SMOOTH, _QUARTER, True)
    if name == "ob_tran":
        return _oblique(values, lon)
    return None


def _oblique(values: dict[str, float | str], lon: float) -> OwnPole | None:
    """The pole that ob_tran states; its own longitudes are less by a half turn than those to the south of it."""
    base, lat, turn = values.get("o_proj"), values.get("o_lat_p"), values.get("o_lon_p", 0.0)
    plain = {"proj", "o_proj", "o_lat_p", "o_lon_p", "lon_0", "R", "a", "b", "ellps", "units", "x_0", "y_0", "no_defs"}
    if not values.keys() <= plain or not isinstance(lat, float) or not isinstance(turn, float) or abs(lat) >= 90.0:
        return None
    if not isinstance(base, str) or base in _AZIMUTHAL | _TRANSVERSE | _ENDLESS:
        return None
    return OwnPole(lon + 180.0, lat, known_breaks(base, 180.0 - turn), 180.0, False)
