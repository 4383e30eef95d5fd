"""Old maps: control points against the truth, the field of distortion, and what an affine map can mend of it."""

from projdist.applications.oldmaps.field import LOCAL_MEASURES, OUTLIERS, OldMap, Rectification, old_map
from projdist.applications.oldmaps.fits import MODELS, Fit, affine_fit, fit, helmert_fit
from projdist.applications.oldmaps.points import ControlPoints, read_control_points

__all__ = [
    "LOCAL_MEASURES",
    "MODELS",
    "OUTLIERS",
    "ControlPoints",
    "Fit",
    "OldMap",
    "Rectification",
    "affine_fit",
    "fit",
    "helmert_fit",
    "old_map",
    "read_control_points",
]
