"""OpenCV, which finds and draws what images have in common, and what is said where it is missing."""

from __future__ import annotations

from typing import Any

import numpy as np

from projdist._typing import AnyArray

__all__ = ["as_array", "opencv"]


def opencv() -> Any:
    """The library; raises ImportError in one line. It is slow to load, and points that are given do without it."""
    try:
        import cv2
    except ImportError as error:
        text = "Invalid images. To match and draw them takes OpenCV: pip install 'projdist[mosaic]'."
        raise ImportError(text, name="cv2") from error
    return cv2


def as_array(one: Any) -> AnyArray:
    """What the library answers, which has arrays of its own in some places."""
    return np.asarray(one.get() if hasattr(one, "get") else one)
