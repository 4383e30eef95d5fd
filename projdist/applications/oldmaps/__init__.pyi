from .control_points import ControlPoints, read_control_points
from .field import LOCAL_MEASURES, OUTLIERS, RECTIFICATIONS, OldMap, Rectification, isolines, old_map
from .fits import MODELS, Fit, affine_fit, fit, helmert_fit
from .rectifying import RECTIFIED_BY, CommonGround, RectifiedScan, common_ground, rectify, scan_extent

__all__ = [
    "LOCAL_MEASURES",
    "MODELS",
    "OUTLIERS",
    "RECTIFICATIONS",
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
