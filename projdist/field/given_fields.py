"""Fields whose Jacobians are given, by arrays or by a function."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.earth import WGS84
from projdist.field.at_nodes import nodes_of
from projdist.field.cubature import Samples
from projdist.field.field import Field
from projdist.regions import RegionLike, get_region
from projdist.support import check_numbers

__all__ = ["field_of"]

_FINE, _COARSE = 10_000, 2_500  # nodes of a region


def field_of(
    jacobian: Any,
    weight: ArrayLike | None = None,
    *,
    lon: ArrayLike | None = None,
    lat: ArrayLike | None = None,
    hessian: ArrayLike | None = None,
    region: RegionLike | None = None,
) -> Field:
    """The field of given Jacobians, or of a function of longitude and latitude that gives them over a region.

    Parameters
    ----------
    jacobian : array_like (n, 2, 2), or callable
        Jacobians; or a function of lon (n,) and lat (n,) in degrees that gives them, with a region.
    weight : array_like (n,), optional
        What each Jacobian counts, not negative; equal ones if there are none. Not with a function.
    lon, lat : array_like (n,), optional
        Where they are in degrees, for the places of extremes. Not with a function.
    hessian : array_like (n, 2, 2, 2), optional
        Second derivatives per radian of the semi-major axis, for measures that need them. Not with a function.
    region : RegionLike, optional
        Anything that `get_region` takes, for a function: it is asked at 10,000 nodes of it, and the figures' errors are
        what 2,500 would change.

    Returns
    -------
    Field
        Of arrays the figures are those of the Jacobians themselves, each extreme the largest of them.

    Raises
    ------
    ValueError
        For arrays of other shapes, weights that are negative or all 0, Jacobians of which none is finite, and a
        function without a region.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the mean distorting
    transformation of any Jacobians.

    Examples
    --------
    >>> import numpy as np
    >>> field = field_of([np.diag([1.1, 1.0]), np.diag([1.2, 1.0])], weight=[3, 1])
    >>> round(field.mean("s").value, 12), field.maximum("s").value
    (1.125, 1.2)
    """
    if not callable(jacobian):
        return _field_of_points(jacobian, weight, lon, lat, hessian)
    if region is None or not (weight is lon is lat is hessian is None):
        raise ValueError("Invalid field. A function of longitude and latitude goes with a region and nothing else.")
    place = get_region(region)
    fine, coarse = (nodes_of(place, WGS84, count) for count in (_FINE, _COARSE))
    fields = [_field_of_points(jacobian(at.lon, at.lat), at.weight, at.lon, at.lat, None) for at in (fine, coarse)]
    return replace(fields[0], _coarser=fields[1])


def _field_of_points(jacobian: Any, weight: Any, lon: Any, lat: Any, hessian: Any) -> Field:
    J = check_numbers("Jacobians", jacobian)
    if J.ndim != 3 or J.shape[1:] != (2, 2) or not len(J):
        raise ValueError(f"Invalid shape {J.shape} of Jacobians. It must be (n, 2, 2) with n at least 1.")
    shapes = {
        "weight": (weight, 1.0, ()),
        "lon": (lon, np.nan, ()),
        "lat": (lat, np.nan, ()),
        "hessian": (hessian, 0.0, (2, 2, 2)),
    }
    arrays = {name: _of_shape(name, given, (len(J), *rest), usual) for name, (given, usual, rest) in shapes.items()}
    w = arrays["weight"]
    if not (w.min() >= 0.0 and 0.0 < w.sum() < np.inf):
        raise ValueError("Invalid weights. They must be finite and not negative, and not all 0.")
    H = None if hessian is None else arrays["hessian"]
    samples = Samples.of_points(arrays["lon"], arrays["lat"], w, J, H, doubt=np.zeros(len(J)), evaluations=0)
    if samples is None:
        raise ValueError("Invalid Jacobians. None of those with a weight is finite.")
    return Field(projection=None, region=None, measures={}, _samples=samples)


def _of_shape(name: str, given: Any, shape: tuple[int, ...], usual: float) -> FloatArray:
    if given is None:
        return np.full(shape, usual)
    values = check_numbers(name, given)
    if values.shape != shape:
        raise ValueError(f"Invalid shape {values.shape} of {name}. It must be {shape}.")
    return values
