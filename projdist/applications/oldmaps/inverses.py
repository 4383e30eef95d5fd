"""The way back: places on an old map of places in truth."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.oldmaps.field import OldMap

__all__ = ["old_places"]

_STEPS, _CONVERGED = 30, 1e-8  # of Newton's method; of the extent of the old map's points


def old_places(found: OldMap, new: FloatArray) -> FloatArray:
    """Places (m, 2) on the old map that the fit brings to places in truth; NaN where there are none, or it folds.

    Newton's method from where the affine fit has them.
    """
    fit = found.fit
    old = found.rectifications["affine"].affine.inverse()(new)
    enough = _CONVERGED * float(np.ptp(found.fitted.old, axis=0).max())
    moving = np.arange(len(new))
    for _ in range(_STEPS):
        here = old[moving]
        step = np.linalg.solve(_regular(fit.jacobian(here)), (new[moving] - fit(here))[..., None])[..., 0]
        old[moving] = here + step
        moving = moving[~(np.hypot(*step.T) <= enough)]
        if not moving.size:
            break
    old[moving] = np.nan
    known = np.flatnonzero(np.isfinite(old[:, 0]))
    old[known[np.isnan(found.local_jacobian(old[known])[:, 0, 0])]] = np.nan
    return old


def _regular(J: FloatArray) -> FloatArray:
    """Matrices, the identity for what cannot be inverted."""
    return np.where((np.linalg.det(J) == 0.0)[:, None, None], np.eye(2), J)
