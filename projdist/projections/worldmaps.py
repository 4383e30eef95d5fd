"""World maps that PROJ lacks, each a short function from longitude and latitude in degrees to metres.

They are textbook maps on the sphere of the Earth's mean radius, as all bare names, and examples of a custom map for
projdist: copy and change any of these functions. `WORLD_MAPS` lists them by name.
"""

from collections.abc import Callable

import numpy as np

from projdist._typing import AnyArray, FloatArray
from projdist.earth import MEAN_EARTH_RADIUS, wrapped

XY = tuple[FloatArray, FloatArray]

_STRETCH = 1.18  # of Gott & Mugnolo's map
_ANGLES = np.arange(16) * (np.pi / 8)  # dense enough for one minimum of the path over the edge in each interval
_HALVINGS = 24
_NEWTON_STEPS = 6  # the start is exact at the poles and 0.9 of the solution at the equator


def gott_elliptical(lon: FloatArray, lat: FloatArray) -> XY:
    """Gott's equal-area elliptical map: true in all directions on the central meridian.

    The globe with halved longitudes fills a hemisphere, whose longitudes from the equator's poles are halved
    again; that part of a transverse Mollweide map is stretched. Gott, Mugnolo & Colley 2007, page 4.
    """
    phi, half = np.radians(lat), np.radians(wrapped(lon)) / 2
    ahead = np.cos(phi) * np.cos(half)
    sine, cosine = _mollweide(np.cos(phi) * np.sin(half), np.hypot(np.sin(phi), ahead))
    turn = np.arctan2(np.sin(phi), ahead)
    return 8 / np.pi * MEAN_EARTH_RADIUS * sine, MEAN_EARTH_RADIUS * turn * cosine


def gott_mugnolo_elliptical(lon: FloatArray, lat: FloatArray) -> XY:
    """Gott's elliptical map stretched by 1.18 in height and compressed as much in width, for smaller distance errors.

    The factor is from a program that draws the map; so applied it gives the .348 that the authors print.
    """
    x, y = gott_elliptical(lon, lat)
    return x / _STRETCH, y * _STRETCH


def gott_wagner(lon: FloatArray, lat: FloatArray) -> XY:
    """Gott's variant of Wagner IX: a part of an equatorial equidistant map, with its longitudes doubled.

    Two thirds of the latitude and 1 / sqrt(12) of the longitude. Gott, Goldberg & Vanderbei 2021, "Flat maps
    that improve on the Winkel Tripel" (arXiv 2102.08176), after a program that implements it: its score, as
    they define it, computes to 4.55, where they print 4.497, so that a detail may differ.
    """
    return _equidistant(np.radians(wrapped(lon)) / np.sqrt(12), np.radians(lat) * 2 / 3, 2.0, 1.0)


def briesemeister(lon: FloatArray, lat: FloatArray) -> XY:
    """Hammer's map about 10 east, 45 north, in an ellipse of the same area whose axes are as 7 to 4.

    Snyder & Voxland 1989, "An Album of Map Projections" (USGS Professional Paper 1453). In PROJ it
    is +proj=ob_tran +o_proj=hammer +o_lat_p=45 +lon_0=10, and +proj=affine with s11 = sqrt(7/8), s22 = sqrt(8/7).
    """
    lam, phi, tilt = np.radians(lon - 10.0), np.radians(lat), np.radians(45.0)
    ahead = np.cos(phi) * np.cos(lam)
    half = np.arctan2(np.cos(phi) * np.sin(lam), ahead * np.cos(tilt) + np.sin(phi) * np.sin(tilt)) / 2
    north = np.sin(phi) * np.cos(tilt) - ahead * np.sin(tilt)
    east = np.sqrt(np.maximum(1.0 - north**2, 0.0))
    scale = MEAN_EARTH_RADIUS * np.sqrt(2 / (1.0 + east * np.cos(half)))
    return np.sqrt(7 / 2) * scale * east * np.sin(half), np.sqrt(8 / 7) * scale * north


def francula_1(lon: FloatArray, lat: FloatArray) -> XY:
    """Francula's first map: meridians are cosines, parallels equally spaced, the pole line is .4329 of the equator.

    Francula 1971, "Die vorteilhaftesten Abbildungen in der Atlaskartographie".
    """
    share = np.arccos(0.4329) / (np.pi / 2)
    middle = np.radians(63.0)
    width = np.cos(middle) / np.cos(share * middle)
    phi = np.radians(lat)
    return MEAN_EARTH_RADIUS * width * np.radians(wrapped(lon)) * np.cos(share * phi), MEAN_EARTH_RADIUS * phi


def francula_2(lon: FloatArray, lat: FloatArray) -> XY:
    """Francula's second map: meridians are parts of ellipses, parallels equally spaced. As the first."""
    phi = np.radians(lat)
    ellipse = np.sqrt(1.0 - (83.0769 / 90 * 2 / np.pi * phi) ** 2)
    return MEAN_EARTH_RADIUS * 0.621462 * np.radians(wrapped(lon)) * ellipse, MEAN_EARTH_RADIUS * phi


def wagner_9(lon: FloatArray, lat: FloatArray) -> XY:
    """Wagner's ninth map: a part of an equatorial equidistant map, with new numbers at its lines.

    7/9 of the latitude and 5/18 of the longitude, stretched by the inverses: the equator and the central meridian
    have their true lengths. Wagner 1949, "Kartographische Netzentwürfe".
    """
    return _equidistant(np.radians(wrapped(lon)) * 5 / 18, np.radians(lat) * 7 / 9, 18 / 5, 9 / 7)


def double_sided_equidistant(lon: FloatArray, lat: FloatArray) -> XY:
    """The northern and the southern hemisphere as discs, equidistant from the poles, side by side.

    They touch at 90 east, the north on the left. Gott, Goldberg & Vanderbei 2021 print them on the two sides
    of one disc, so that nothing is cut and distances run over the edge: `distance_around_edge`.
    """
    return _double_sided(lon, lat, np.radians(90.0 - np.abs(lat)), np.pi / 2)


def double_sided_equal_area(lon: FloatArray, lat: FloatArray) -> XY:
    """The hemispheres side by side as in `double_sided_equidistant`, each after Lambert's equal-area map."""
    return _double_sided(lon, lat, 2 * np.sin(np.radians(90.0 - np.abs(lat)) / 2), np.sqrt(2.0))


def _double_sided(lon: FloatArray, lat: FloatArray, radius: FloatArray, edge: float) -> XY:
    side = np.where(lat < 0.0, -1.0, 1.0)
    lam = np.radians(lon)
    return (MEAN_EARTH_RADIUS * side * (radius * np.sin(lam) - edge), -MEAN_EARTH_RADIUS * radius * np.cos(lam))


def distance_around_edge(x0: FloatArray, y0: FloatArray, x1: FloatArray, y1: FloatArray, edge: float) -> FloatArray:
    """Distances on a double-sided map: straight on a side, else by the shortest way over the edge.

    The sides lie left and right of x = 0, discs of the radius `edge` that touch there. To 1e-7 of the radius.
    """
    x0, y0, x1, y1 = np.broadcast_arrays(x0, y0, x1, y1)
    distance = np.asarray(np.hypot(x0 - x1, y0 - y1))
    over = (x0 < 0.0) != (x1 < 0.0)
    # Both on one disc of radius 1, as the sides of a sheet lie upon each other.
    px, py, qx, qy = (1.0 - np.abs(x0[over]) / edge, y0[over] / edge, 1.0 - np.abs(x1[over]) / edge, y1[over] / edge)

    def way(angle: AnyArray | float) -> FloatArray:
        x, y = np.cos(angle), np.sin(angle)
        return np.hypot(x - px, y - py) + np.hypot(x - qx, y - qy)

    ways = np.stack([way(angle) for angle in _ANGLES.tolist()])
    angle, step = _ANGLES[np.argmin(ways, axis=0)], _ANGLES[1]
    for _ in range(_HALVINGS):
        x, y = np.cos(angle), np.sin(angle)
        with np.errstate(invalid="ignore"):  # at a point on the edge, where any direction will do
            # How the way falls as the angle grows: its slope, times minus one.
            falls = (py * x - px * y) / np.hypot(x - px, y - py) + (qy * x - qx * y) / np.hypot(x - qx, y - qy)
        step *= 0.5
        angle = angle + np.copysign(step, falls)
    distance[over] = edge * np.minimum(way(angle), ways.min(axis=0))
    return distance


def _equidistant(lam: FloatArray, phi: FloatArray, across: float, along: float) -> XY:
    """The equatorial equidistant map of radians, stretched."""
    east, north = np.cos(phi) * np.sin(lam), np.sin(phi)
    sine = np.hypot(east, north)
    distance = np.arctan2(sine, np.cos(phi) * np.cos(lam))
    scale = MEAN_EARTH_RADIUS * np.divide(distance, sine, out=np.ones_like(sine), where=sine > 0)
    return across * scale * east, along * scale * north


def _mollweide(sine: FloatArray, cosine: FloatArray) -> XY:
    """Sine and cosine of the angle theta of Mollweide's map, of those of the latitude."""
    # 2 theta + sin 2 theta = pi sin phi (Snyder 1987, equation 31-3), solved for u = pi - 2 |theta|, so that nothing
    # cancels at the poles: u - sin u = pi (1 - |sin phi|), by Newton's method from u^3 / 6.
    rest = np.pi * cosine**2 / (1.0 + np.abs(sine))
    u = np.cbrt(6.0 * rest)
    for _ in range(_NEWTON_STEPS):
        slope = 2.0 * np.sin(u / 2) ** 2
        u = u - np.divide(_less_sine(u) - rest, slope, out=np.zeros_like(u), where=slope > 0.0)
    return np.copysign(np.cos(u / 2), sine), np.sin(u / 2)


def _less_sine(u: FloatArray) -> FloatArray:
    """u - sin u without cancellation, u >= 0."""
    square = u * u
    series = np.zeros_like(u)
    for k in range(19, 2, -2):
        series = (1.0 - series) * square / (k * (k - 1))
    return np.where(u < 1.0, series * u, u - np.sin(u))


_MAPS: tuple[Callable[[FloatArray, FloatArray], XY], ...] = (
    *(briesemeister, double_sided_equal_area, double_sided_equidistant, francula_1, francula_2),
    *(gott_elliptical, gott_mugnolo_elliptical, gott_wagner, wagner_9),
)
WORLD_MAPS = {function.__name__.replace("_", "-"): function for function in _MAPS}
__all__ = ["WORLD_MAPS", "distance_around_edge", *(function.__name__ for function in _MAPS)]
