"""The points that pictures have in common, by what is around them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from projdist._typing import AnyArray, FloatArray, IntArray
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.images import Picture
from projdist.applications.mosaics.libraries import opencv

__all__ = ["match"]

_MOST_PIXELS = 2e6  # of an image in which features are looked for
_MOST_FEATURES = 3000  # of an image, the clearest
_CONTRAST = 0.02  # the least of a feature: half of Lowe's, for small and pale images
# The nearest feature must be nearer than the second by this (D. Lowe 2004, "Distinctive image features from
# scale-invariant keypoints", section 7.1).
_RATIO = 0.8
_FEWEST = 8  # points in common: fewer are chance
_ALL_PAIRS = 40  # images
# Of more images, each is matched with those that most of its clearest features resemble (M. Brown & D. G. Lowe 2007,
# "Automatic panoramic image stitching using invariant features", section 3.1), and with those before and behind it.
_CLEAREST, _NEAREST, _RESEMBLING = 200, 4, 8


class _Features(NamedTuple):
    """Places (n, 2) in pixels of the whole image, and what is around them (n, 128), the clearest first."""

    places: FloatArray
    descriptors: AnyArray


def match(pictures: Sequence[Picture]) -> Correspondences:
    """Points that pictures have in common, some of them wrong: what `mosaic` takes.

    Features are SIFT's, of images reduced to two million pixels. Two belong together where either is nearest to the
    other, by far. Raises ValueError where no two images have anything in common or an image is broken, and ImportError
    without OpenCV.
    """
    if len(pictures) < 2:
        raise ValueError(f"Invalid images. There must be two or more, not {len(pictures)}.")
    features = [_features(picture) for picture in pictures]
    columns: list[list[AnyArray]] = [[], [], [], []]
    for i, j in _candidates(features):
        first, second = _matched(features[i].descriptors, features[j].descriptors)
        both = np.hstack([features[i].places[first], features[j].places[second]])
        both = np.unique(both, axis=0)  # a feature with two directions is there twice
        if len(both) >= _FEWEST:
            for column, values in zip(
                columns, (np.full(len(both), i), np.full(len(both), j), both[:, :2], both[:, 2:]), strict=True
            ):
                column.append(values)
    if not columns[0]:
        raise ValueError("Invalid images. No two of them have anything in common.")
    first, second, xi, xj = (np.concatenate(column) for column in columns)
    sizes = np.array([picture.size for picture in pictures], dtype=float)
    return Correspondences(
        i=first, j=second, xi=xi, xj=xj, sizes=sizes, names=tuple(picture.name for picture in pictures)
    )


def _features(picture: Picture) -> _Features:
    cv2 = opencv()
    colours, mask = picture.read()
    grey = cv2.cvtColor(colours, cv2.COLOR_RGB2GRAY)
    height, width = grey.shape
    share = min(1.0, float(np.sqrt(_MOST_PIXELS / (width * height))))
    if share < 1.0:
        small = max(1, round(width * share)), max(1, round(height * share))
        grey = cv2.resize(grey, small, interpolation=cv2.INTER_AREA)
        mask = cv2.resize(mask, small, interpolation=cv2.INTER_NEAREST)
    # Without the precise upscale places are off by a quarter of a pixel.
    sift = cv2.SIFT_create(nfeatures=_MOST_FEATURES, contrastThreshold=_CONTRAST, enable_precise_upscale=True)
    points, descriptors = sift.detectAndCompute(grey, mask)
    if descriptors is None:
        return _Features(np.zeros((0, 2)), np.zeros((0, 128), np.float32))
    order = np.argsort([-point.response for point in points], kind="stable")
    # OpenCV counts from the middle of the first pixel.
    places = (np.array([point.pt for point in points]) + 0.5) * [width / grey.shape[1], height / grey.shape[0]]
    return _Features(places[order], descriptors[order])


def _nearest(a: AnyArray, b: AnyArray, count: int) -> tuple[FloatArray, IntArray]:
    """Distances of each a from the nearest b, and which these are, (n, count)."""
    cv2 = opencv()
    distances, numbers = cv2.batchDistance(a, b, cv2.CV_32F, normType=cv2.NORM_L2, K=count)
    return distances, numbers


def _matched(a: AnyArray, b: AnyArray) -> tuple[IntArray, IntArray]:
    """The features of two images that belong together, by their numbers."""
    if min(len(a), len(b)) < _FEWEST:
        return np.zeros(0, int), np.zeros(0, int)
    distances, numbers = _nearest(a, b, 2)
    clear = np.flatnonzero(distances[:, 0] < _RATIO * distances[:, 1])
    if not clear.size:
        return clear, clear
    there = numbers[clear, 0]
    back = _nearest(b[there], a, 1)[1][:, 0]
    return clear[back == clear], there[back == clear]


def _candidates(features: Sequence[_Features]) -> Iterable[tuple[int, int]]:
    """The pairs of images that are worth matching: all of a few, of many those that look alike or are neighbours."""
    count = len(features)
    if count <= _ALL_PAIRS:
        return itertools.combinations(range(count), 2)
    clearest = [one.descriptors[:_CLEAREST] for one in features]
    everything = np.concatenate(clearest)
    owner = np.repeat(np.arange(count), [len(one) for one in clearest])
    pairs = {(k, k + 1) for k in range(count - 1)}
    for k, own in enumerate(clearest):
        others = owner != k
        if len(own) and others.sum() >= _NEAREST:
            found = owner[others][_nearest(own, everything[others], _NEAREST)[1]]
            votes = np.bincount(found.reshape(-1), minlength=count)
            alike = np.argsort(-votes, kind="stable")[:_RESEMBLING].tolist()
            pairs |= {(min(k, other), max(k, other)) for other in alike}
    return sorted(pairs)
