"""Maps of images into one plane from their common points, and the frames to choose from."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.mosaics.bundle_adjustment import (
    Link,
    ModelFit,
    Pair,
    Shared,
    adjust,
    compare_models,
    estimate,
)
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.homographies import (
    MODELS,
    behind,
    check_model,
    corners,
    field_of,
    least_distorting,
    places,
)
from projdist.matrices import Rotation, axes_shift, mdt, mean_rotation
from projdist.support import Answer, listed, plain

_SHOWN = 10  # names in one message


class Match(NamedTuple):
    """Two images, the number of points they share and of those that agree on a map; if none do, the reason.

    `false_alarms`: decimal logarithm of the expected number of chance maps as good, over all pairs; NaN if no map was
    tried.
    """

    i: int
    j: int
    points: int
    agree: int
    reason: str
    false_alarms: float


class ImageRegistration(NamedTuple):
    """The maps of a group of connected images into the plane of the first one, in pixels.

    `images`: their numbers; `matrices`: their maps (n, 3, 3). `components`: all groups of two or more connected images,
    the largest first. `left_out`: numbers of the other images. `rms_pixels`: RMS of the symmetric transfer error.
    `matches`: of all pairs. `models`: how well each model fits the pairs.
    """

    model: str
    images: list[int]
    matrices: FloatArray
    sizes: FloatArray
    rms_pixels: float
    components: list[list[int]]
    left_out: list[int]
    matches: list[Match]
    models: dict[str, ModelFit]


class Cameras(NamedTuple):
    """The cameras of a group of connected images that were taken by turning a camera.

    `rotations`: from each camera's right, down and forward to the first one's (n, 3, 3); `focals`: pixels (n,), with
    standard deviations `focal_errors`. `rms_pixels`: RMS of the symmetric transfer error; `rms_homographies`: the same
    with a homography for each pair of images, which also allows a moving camera. Others as in `ImageRegistration`.
    """

    images: list[int]
    rotations: FloatArray
    focals: FloatArray
    focal_errors: FloatArray
    rms_pixels: float
    rms_homographies: float
    components: list[list[int]]
    left_out: list[int]
    matches: list[Match]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImageAnswer(Answer):
    """Base class of mosaics and panoramas: a group of images connected by common points."""

    points: Correspondences

    @property
    @abstractmethod
    def _found(self) -> ImageRegistration | Cameras:
        """The group of images."""

    @abstractmethod
    def messages(self, *, others: bool = True) -> list[str]:
        """Remarks on the result; without `others` none on other groups of images, which have answers of their own."""

    @property
    def images(self) -> list[int]:
        """The numbers of the images in the answer."""
        return self._found.images

    @property
    def left_out(self) -> list[str]:
        """The names or numbers of the images that are not connected with the others."""
        return [self.points.name(image) for image in self._found.left_out]

    @property
    def alone(self) -> list[str]:
        """The names or numbers of the images that are connected with no other."""
        grouped = {image for group in self._found.components for image in group}
        return [self.points.name(image) for image in self._found.left_out if image not in grouped]

    @property
    def notes(self) -> list[str]:
        """Remarks on the result; usually none."""
        return self.messages()

    def _left_out_note(self, *, others: bool) -> str:
        """The remark on images left out; connected ones are listed together, and only with `others`."""
        left_out, name = set(self._found.left_out), self.points.name
        groups = [group for group in self._found.components if others and set(group) <= left_out]
        parts = [", ".join(self.alone)] if self.alone else []
        parts += [listed([name(image) for image in group], "and") + ", which hang together" for group in groups]
        return f"Left out: {'; '.join(parts)}. Nothing connects them with the other images." if parts else ""

    def _of_all(self, values: FloatArray) -> list[Any]:
        """A value for each image, None for those left out."""
        rows: list[Any] = [None] * len(self.points.sizes)
        for image, value in zip(self.images, values.tolist(), strict=True):
            rows[image] = value
        return rows

    def _pairs(self) -> list[dict[str, Any]]:
        """The matches of all pairs, with names or numbers of images."""
        name = self.points.name
        return [
            m._asdict() | {"i": name(m.i), "j": name(m.j), "false_alarms": plain(m.false_alarms)}
            for m in self._found.matches
        ]


def register(points: Correspondences, *, model: str = "affine", tolerance: float = 4.0) -> ImageRegistration:
    """Register images by their common points.

    `model`: affine maps, homographies, or "auto" for the model that suits the points. `tolerance`: pixels, of the
    reduced images if points were found in such; points of a pair of images farther off the pair's map are wrong. Pairs
    with more points in agreement than chance would give in all pairs together are chained, strongest first, and the
    chains are the start of a bundle adjustment. Raises ValueError if no two images are connected, and if some images
    mirror others.
    """
    return register_groups(points, model=model, tolerance=tolerance, most=1)[0]


def register_groups(
    points: Correspondences, *, model: str = "affine", tolerance: float = 4.0, most: int | None = None
) -> list[ImageRegistration]:
    """Register each group of connected images, the largest first, at most `most`. Raises as `register`."""
    check_model(model)
    check_tolerance(tolerance)
    # Coordinates from the middle of each image, in halves of the longest side.
    unit = float(points.sizes.max()) / 2.0
    links = list(links_of(points, unit))
    found = {
        name: [estimated(link, reduction * tolerance / unit, points, unit, name) for link, reduction in links]
        for name in MODELS
    }
    models = compare_models(_shared(links, found, unit), unit)
    if model == "auto":
        model = min(models, key=lambda name: models[name].gric, default=MODELS[0])
    good, components, matches = connected(points, [link for link, _ in links], found[model])
    return [_registered(points, good, model, images, components, matches, models) for images in components[:most]]


MatchedPairs = dict[tuple[int, int], tuple[Link, Pair]]
"""The points and the map of pairs of images, by their numbers."""


def connected(
    points: Correspondences, links: Sequence[Link], pairs: Sequence[Pair]
) -> tuple[MatchedPairs, list[list[int]], list[Match]]:
    """The pairs of images that have a map, the groups that they connect, and the matches of all pairs.

    Raises ValueError if no pair has a map.
    """
    both = list(zip(links, pairs, strict=True))
    matches = [
        Match(link.i, link.j, len(link.xi), int(pair.agree.sum()), pair.reason, pair.false_alarms)
        for link, pair in both
    ]
    good = {(link.i, link.j): (link, pair) for link, pair in both if pair.S is not None}
    components = components_of(good)
    if not components:
        reasons = [f"{points.name(m.i)} and {points.name(m.j)}, {m.reason}" for m in matches[:3]]
        more = "; ..." if len(matches) > 3 else ""
        raise ValueError(f"Invalid correspondences. No two images match: {'; '.join(reasons)}{more}.")
    return good, components, matches


def check_tolerance(tolerance: float) -> None:
    """Raise ValueError for a tolerance that is not above 0."""
    if not tolerance > 0:
        raise ValueError(f"Invalid tolerance {tolerance}. It must be a number of pixels above 0.")


def _shared(links: Sequence[tuple[Link, float]], found: dict[str, list[Pair]], unit: float) -> Iterator[Shared]:
    """The pairs of images that have a map by either model."""
    for number, (link, reduction) in enumerate(links):
        agree = np.logical_or(*(pairs[number].agree for pairs in found.values()))
        if agree.any():
            yield Shared(link, agree, reduction / unit)


def _registered(
    points: Correspondences,
    good: MatchedPairs,
    model: str,
    images: list[int],
    components: list[list[int]],
    matches: list[Match],
    models: dict[str, ModelFit],
) -> ImageRegistration:
    """The registration of a group of images."""
    unit = float(points.sizes.max()) / 2.0
    number = {image: place for place, image in enumerate(images)}
    own = {(i, j): both for (i, j), both in good.items() if i in number}
    chain = chained(images, {key: pair for key, (_, pair) in own.items()})
    refuse_mirrors(points, images, chain)
    links = [
        Link(number[i], number[j], link.xi[pair.agree], link.xj[pair.agree]) for (i, j), (link, pair) in own.items()
    ]
    maps, rms = adjust(chain, links, model)
    to_unit = np.tile(np.eye(3), (len(images), 1, 1))
    to_unit[:, :2] /= unit
    to_unit[:, :2, 2] = -0.5 * points.sizes[images] / unit
    to_pixels = np.diag([unit, unit, 1.0])
    to_pixels[:2, 2] = 0.5 * points.sizes[images[0]]
    left_out = sorted(set(range(len(points.sizes))) - set(images))
    matrices = to_pixels @ maps @ to_unit
    if model == "homography":
        matrices /= np.cbrt(np.linalg.det(matrices))[:, None, None]
    return ImageRegistration(
        model,
        images,
        matrices,
        points.sizes[images],
        rms * unit,
        components,
        left_out,
        matches,
        models,
    )


def estimated(link: Link, tolerance: float, points: Correspondences, unit: float, model: str) -> Pair:
    """The map of two images, tested against chance in all possible pairs."""
    area = float(points.sizes[[link.i, link.j]].prod(axis=1).min()) / unit**2
    tests = len(points.sizes) * (len(points.sizes) - 1) // 2
    return estimate(link.xi, link.xj, model, tolerance, area=area, tests=tests)


def links_of(points: Correspondences, unit: float) -> Iterator[tuple[Link, float]]:
    """For each pair of images i < j the common points, in coordinates from the images' middles, and the reduction."""
    reductions = np.asarray(points.reductions)
    swap = points.i > points.j
    i, j = np.where(swap, points.j, points.i), np.where(swap, points.i, points.j)
    first = np.where(swap[:, None], points.xj, points.xi)
    second = np.where(swap[:, None], points.xi, points.xj)
    keys, places = np.unique(np.stack([i, j], axis=1), axis=0, return_inverse=True)
    for number, (a, b) in enumerate(keys.tolist()):
        chosen = places.reshape(-1) == number
        xi, xj = (first[chosen] - 0.5 * points.sizes[a]) / unit, (second[chosen] - 0.5 * points.sizes[b]) / unit
        yield Link(a, b, xi, xj), float(reductions[chosen].max())


def components_of(pairs: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Groups of images connected by pairs, the largest first."""
    group: dict[int, set[int]] = {}
    for i, j in pairs:
        merged = group.get(i, {i}) | group.get(j, {j})
        group.update(dict.fromkeys(merged, merged))
    return sorted(
        {tuple(sorted(images)): sorted(images) for images in group.values()}.values(), key=lambda g: (-len(g), g)
    )


def chained(images: Sequence[int], pairs: dict[tuple[int, int], Pair]) -> FloatArray:
    """Maps (n, 3, 3) of images into the first one, along a spanning tree of the pairs with the most points."""
    maps = {images[0]: np.eye(3)}
    strongest = sorted(pairs, key=lambda key: -int(pairs[key].agree.sum()))
    while len(maps) < len(images):
        i, j = next(key for key in strongest if (key[0] in maps) != (key[1] in maps))
        S: Any = pairs[i, j].S
        if j in maps:
            maps[i] = maps[j] @ S
        else:
            maps[j] = maps[i] @ np.linalg.inv(S)
    return np.stack([maps[image] for image in images])


def refuse_mirrors(points: Correspondences, images: Sequence[int], chain: FloatArray) -> None:
    """Raise ValueError if images mirror the others, naming the smaller group."""
    mirrors = np.linalg.det(chain) < 0
    if mirrors.any():
        few = mirrors if mirrors.mean() <= 0.5 else ~mirrors
        names = [points.name(image) for image, odd in zip(images, few, strict=True) if odd]
        more = [f"{len(names) - _SHOWN} more"] if len(names) > _SHOWN else []
        raise ValueError(
            f"Invalid orientation of {listed(names[:_SHOWN] + more, 'and')}. They mirror the others; all must agree."
        )


# ---- frames --------------------------------------------------------------------------------------


class Frame(NamedTuple):
    """A plane that all images are mapped into, in pixels.

    `reference`: number of the image whose plane it is, None for that of the MDT. `matrices`: from the pixels of the
    images into it (n, 3, 3). `distortions`: Dist_F of each image, (n,), for a homography its RMS over the image.
    `figure`: the (weighted) sum of their squares, for homographies the mean.
    """

    reference: int | None
    matrices: FloatArray
    distortions: FloatArray
    figure: float


def frame_of_image(found: ImageRegistration, image: int, weights: FloatArray) -> Frame | None:
    """The plane of a registered image; None if another image reaches infinity in it."""
    own = found.images.index(image)
    matrices = np.linalg.solve(found.matrices[own], found.matrices)
    matrices[own] = np.eye(3)
    return None if behind(matrices, found.sizes).any() else _measured(found, image, matrices, weights)


class CommonFrames(NamedTuple):
    """The frames `first`, `last`, `central`, `best` and `mdt`, None if impossible.

    `impossible`: numbers of the images in whose planes others reach infinity. `rotation`: that of the MDT's frame.
    """

    frames: dict[str, Frame | None]
    impossible: list[int]
    rotation: Rotation


def common_frames(found: ImageRegistration, weights: FloatArray, rotation: str) -> CommonFrames:
    """All frames. Raises ValueError if some image reaches infinity in every plane.

    The central image has its middle nearest to the mean of all middles in the MDT's frame; the best has the least
    figure.
    """
    mean, turn = _mdt_frame(found, weights, rotation)
    of_image = {image: frame_of_image(found, image, weights) for image in found.images}
    possible = [frame for frame in of_image.values() if frame is not None]
    frames = {
        "first": of_image[found.images[0]],
        "last": of_image[found.images[-1]],
        "central": of_image[_central(found, mean)],
        "best": min(possible, key=lambda frame: frame.figure, default=None),
        "mdt": mean,
    }
    return CommonFrames(frames, [image for image, frame in of_image.items() if frame is None], turn)


def _central(found: ImageRegistration, mean: Frame) -> int:
    """Number of the central image."""
    middles = places(mean.matrices, 0.5 * found.sizes[:, None])[:, 0]
    return found.images[int(np.hypot(*(middles - middles.mean(axis=0)).T).argmin())]


def _mdt_frame(found: ImageRegistration, weights: FloatArray, rotation: str) -> tuple[Frame, Rotation]:
    """The frame of the MDT, rotated by the mean rotation and shifted to the axes."""
    H = found.matrices if found.model == "affine" else least_distorting(found.matrices, found.sizes, weights)
    if H is None:
        raise ValueError("Invalid images for one plane. Every plane sends some of them through infinity.")
    J, w = _jacobians(found, H)
    J, each = J.reshape(-1, 2, 2), np.outer(weights, w).reshape(-1)
    T = mdt(J, each).T
    turn = mean_rotation(J, each, T=T, method=rotation)
    G = np.eye(3)
    G[:2, :2] = turn.q @ np.linalg.inv(T)
    H = G @ H
    shift = axes_shift(places(H, corners(found.sizes)).reshape(-1, 2))
    H[:, :2] += shift[:, None] * H[:, 2:]
    return _measured(found, None, H, weights), turn


def _jacobians(found: ImageRegistration, H: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Jacobians (n, m, 2, 2) of the images at nodes, and the nodes' weights; an affine map has one node."""
    if found.model == "affine":
        return H[:, None, :2, :2], np.ones(1)
    J, _, w = field_of(H, found.sizes)
    return J, w


def _measured(found: ImageRegistration, reference: int | None, H: FloatArray, weights: FloatArray) -> Frame:
    """A frame with the distortions of the images."""
    J, w = _jacobians(found, H)
    squares = (np.log(np.linalg.svd(J, compute_uv=False)) ** 2).sum(axis=-1) @ w
    # With equal weights the figure of affine maps is the plain sum.
    figure = float(weights @ squares) * (len(squares) if found.model == "affine" else 1.0)
    return Frame(reference, H, np.sqrt(squares), figure)
