"""Which maps the images of a mosaic need: affine ones or homographies."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.applications.mosaics.bundle import Link, transfers
from projdist.applications.mosaics.pairs import refined
from projdist.applications.mosaics.projective import ENTRIES, LEAST, MODELS

__all__ = ["ModelFit", "Shared", "compare_models"]

_NOISE = 0.05  # pixels of what is looked at: no point is found better
_WRONG = 4.0  # of a squared error over the noise's: 2 for each of two dimensions, as Torr has it


class ModelFit(NamedTuple):
    """How a model fits all pairs of images: the RMS of the symmetric transfer error in pixels, and its GRIC.

    The geometric robust information criterion is the less the better: squared errors over the noise's, and a price for
    the numbers that a model has (P. H. S. Torr 1998, "Geometric motion segmentation and model selection", section 4).
    """

    rms_pixels: float
    gric: float


class Shared(NamedTuple):
    """The points of two images, those that agree on a map of either model, and a pixel of what is looked at."""

    link: Link
    agree: BoolArray
    pixel: float


def compare_models(pairs: Iterable[Shared], unit: float) -> dict[str, ModelFit]:
    """How either model fits the points of pairs, each pair with a map of its own. `unit`: in pixels.

    The noise is that of the homographies, which have all that affine maps have.
    """
    squares, points, gric = dict.fromkeys(MODELS, 0.0), 0, dict.fromkeys(MODELS, 0.0)
    for link, agree, pixel in pairs:
        xi, xj = link.xi[agree], link.xj[agree]
        count = len(xi)
        if count <= LEAST["homography"]:
            continue
        maps = {model: refined(xi, xj, model) for model in MODELS}
        if any(S is None for S in maps.values()):
            continue
        errors = {model: _squares(S, xi, xj) for model, S in maps.items() if S is not None}
        freedom = 2 * count - len(ENTRIES["homography"])
        noise = max(errors["homography"].sum() / (4.0 * freedom), (_NOISE * pixel) ** 2)
        points += count
        for model, both in errors.items():
            squares[model] += float(both.sum())
            # Moved by half to meet in the middle, both points of a pair are off by half of what is transferred.
            gric[model] += float(np.minimum(both / (4.0 * noise), _WRONG).sum())
            gric[model] += len(ENTRIES[model]) * math.log(4.0 * count) + 2.0 * count * math.log(4.0)
    if not points:
        return {}
    return {model: ModelFit(unit * math.sqrt(squares[model] / (2.0 * points)), gric[model]) for model in MODELS}


def _squares(S: FloatArray, xi: FloatArray, xj: FloatArray) -> FloatArray:
    """The sum of both squared distances of each pair of points."""
    there, back = transfers(S, xi, xj)
    return there**2 + back**2
