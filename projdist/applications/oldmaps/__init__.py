"""Old maps: control points against the truth, the field of distortion, and what an affine map can mend of it."""

from projdist.applications.oldmaps.field import LOCAL_MEASURES, OUTLIERS, OldMap, Rectification, isolines, old_map
from projdist.applications.oldmaps.fits import MODELS, Fit, affine_fit, fit, helmert_fit
from projdist.applications.oldmaps.points import ControlPoints, read_control_points
from projdist.applications.oldmaps.rectifying import (
    RECTIFIED_BY,
    CommonGround,
    RectifiedScan,
    common_ground,
    rectify,
    scan_extent,
)

__all__ = [
    "LOCAL_MEASURES",
    "MODELS",
    "OUTLIERS",
    "RECTIFIED_BY",
    "CommonGround",
    "ControlPoints",
    "Fit",
    "OldMap",
    "Rectification",
    "RectifiedScan",
    "affine_fit",
    "common_ground",
    "fit",
    "helmert_fit",
    "isolines",
    "old_map",
    "read_control_points",
    "rectify",
    "scan_extent",
]
