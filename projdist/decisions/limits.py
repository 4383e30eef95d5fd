"""How little a map of a region can distort: the limit by which all maps of it can be judged.

To first order in the curvature, the best conformal and the best equal-area map of a small region both have sqrt(2)
times the Airy-Kavrayskiy error of the best map of all, whose square is the squared curvature times the mean deflection
of a clamped plate of the region's shape. The best conformal map is a linear problem, so that the limit of all kinds is
known at once; for large ragged regions it is a prediction to some per cent, and no bound.
"""

from __future__ import annotations

import functools

import numpy as np

from projdist.decisions.extents import extent_of
from projdist.decisions.families import ellipsoid_text
from projdist.earth import WGS84, Ellipsoid
from projdist.field import Figure, nodes_of
from projdist.numerics import fit_harmonic
from projdist.projections import Projection
from projdist.regions import Place

__all__ = ["LIMITED", "least_error", "limit_of"]

LIMITED = ("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine")
"""The figures whose limit is known."""

_NODES = 2000
_WIDEST = 100.0  # degrees from the middle: beyond, the polynomials of the stereographic plane do not reach


@functools.lru_cache(maxsize=32)
def least_error(region: Place, purpose: str = "any", ellipsoid: Ellipsoid = WGS84, degree: int = 8) -> float | None:
    """The Airy-Kavrayskiy error of the best map of a region for a purpose; None for regions that are too wide.

    For conformal and equal-area maps it is that of the best conformal map whose ln k is a polynomial of the degree, for
    other purposes 1/sqrt(2) of it.
    """
    extent = extent_of(region)
    if extent.radius > _WIDEST:
        return None
    text = f"+proj=stere +lat_0={extent.lat!r} +lon_0={extent.lon!r} {ellipsoid_text(ellipsoid)}"
    base, nodes = Projection.from_user_input(text), nodes_of(region, ellipsoid, _NODES)
    x, y = base(nodes.lon, nodes.lat)
    log_scale, z = np.log(nodes.meridional_scale(base)), x + 1j * y
    known = np.isfinite(log_scale) & (nodes.weight > 0.0)
    try:
        fit = fit_harmonic(z[known] / np.abs(z[known]).max(), log_scale[known], nodes.weight[known], degree)
    except ValueError:  # of a few points
        return None
    mean = float(np.sum(nodes.weight[known] * fit.rest**2) / np.sum(nodes.weight[known]))
    return float(np.sqrt(mean * (2.0 if purpose in ("conformal", "equal-area") else 1.0)))


def limit_of(figure: Figure, region: Place, purpose: str = "any", ellipsoid: Ellipsoid = WGS84) -> float | None:
    """The limit of a figure over a region; None where it is not known, or no more than rounding."""
    if not figure.is_airy_kavrayskiy:
        return None
    found = least_error(region, purpose, ellipsoid)
    return found if found is not None and found > figure.rounding else None
