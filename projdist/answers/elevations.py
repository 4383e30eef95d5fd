"""The elevation factor: distances at a height, reduced to the ellipsoid."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.support import check_degrees, check_instance, check_numbers

__all__ = ["elevation_factor"]


def elevation_factor(lat: ArrayLike, height: ArrayLike, ellipsoid: Ellipsoid) -> FloatArray:
    """R_G / (R_G + h), by which distances at a height h are reduced to the ellipsoid.

    R_G = sqrt(M N) is the Gaussian mean radius of curvature.

    Parameters
    ----------
    lat : array_like (...)
        Latitudes in degrees.
    height : array_like (...)
        Ellipsoidal heights in metres (not orthometric ones, which are lower by the geoid's height).
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray (...)
        A ratio, below 1 above the ellipsoid.

    Raises
    ------
    ValueError
        For values that are no numbers, or no ellipsoid, and shapes that do not go together.

    References
    ----------
    J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5: grid and elevation factors.

    Examples
    --------
    Station CBL 0 at Limon, Colorado, as its NGS data sheet KJ0588 has it:

    >>> from projdist import WGS84
    >>> round(float(elevation_factor(39.2, 1610.152, WGS84)), 8)
    0.99974744
    """
    check_instance("ellipsoid", ellipsoid, Ellipsoid, "an Ellipsoid of projdist")
    lat, height = check_degrees(check_numbers("latitudes", lat), check_numbers("heights", height))
    meridian, vertical = ellipsoid.radii(lat)
    radius = np.sqrt(meridian * vertical)
    return np.asarray(radius / (radius + height))
