"""From the points that images have in common to the maps of all images into one plane."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
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
from projdist.support import listed

_SHOWN = 10  # names in one message


class Match(NamedTuple):
    """Two images, how many points they share and how many agree on a map; where none does, the reason.

    `false_alarms`: decimal logarithm of how many maps chance would make as good, over all pairs; NaN where none was
    tried.
    """

    i: int
    j: int
    points: int
    agree: int
    reason: str
    false_alarms: float


class ImageRegistration(NamedTuple):
    """The maps of images into a plane that means nothing: that of the first image, in pixels.

    `images`: numbers of those that hang together, the most that do; `matrices`: their maps (n, 3, 3). `components`: all
    groups of two images or more, the largest first. `left_out`: the images beside `images`. `rms_pixels`: of the
    symmetric transfer error. `matches`: of all pairs. `models`: how either model fits the pairs.
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


def register(points: Correspondences, *, model: str = "affine", tolerance: float = 4.0) -> ImageRegistration:
    """Register images by the points that they have in common.

    `model`: affine maps, homographies, or "auto": those that the points ask for. `tolerance`: pixels, of the reduced
    images where points were found in such; points of a pair of images that are farther off the pair's map are wrong.
    Pairs of which so many points agree as chance in all pairs together would not bring are chained, strongest first,
    and the chains are the start of a bundle adjustment. Raises ValueError where no two images hang together, and where
    some images mirror others.
    """
    return register_groups(points, model=model, tolerance=tolerance, most=1)[0]


def register_groups(
    points: Correspondences, *, model: str = "affine", tolerance: float = 4.0, most: int | None = None
) -> list[ImageRegistration]:
    """Register each group of images that hang together, the largest first; at most so many. Raises as `register`."""
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
    pairs = {(link.i, link.j): (link, pair) for (link, _), pair in zip(links, found[model], strict=True)}
    matches = [match_of(link, pair) for link, pair in pairs.values()]
    good = {pair: both for pair, both in pairs.items() if both[1].S is not None}
    components = components_of(good)
    if not components:
        raise ValueError("Invalid correspondences. No two images match: " + why_none(points, matches) + ".")
    return [_registered(points, good, model, images, components, matches, models) for images in components[:most]]


def check_tolerance(tolerance: float) -> None:
    """Raise ValueError for no number of pixels."""
    if not tolerance > 0:
        raise ValueError(f"Invalid tolerance {tolerance}. It must be a number of pixels above 0.")


def left_out_note(points: Correspondences, components: Sequence[list[int]], left_out: list[int], others: bool) -> str:
    """What is said of images left out, of those that hang together as one; without `others` of single ones only."""
    groups = [group for group in components if others and set(group) <= set(left_out)]
    single = [points.name(image) for image in alone(components, left_out)]
    parts = [", ".join(single)] if single else []
    parts += [listed([points.name(image) for image in group], "and") + ", which hang together" for group in groups]
    return f"Left out: {'; '.join(parts)}. Nothing connects them with the other images." if parts else ""


def alone(components: Sequence[list[int]], left_out: Sequence[int]) -> list[int]:
    """The images that hang together with no other."""
    grouped = {image for group in components for image in group}
    return [image for image in left_out if image not in grouped]


def match_of(link: Link, pair: Pair) -> Match:
    """What is told of two images."""
    return Match(link.i, link.j, len(link.xi), int(pair.agree.sum()), pair.reason, pair.false_alarms)


def _shared(links: Sequence[tuple[Link, float]], found: dict[str, list[Pair]], unit: float) -> Iterator[Shared]:
    """The pairs of images that have a map of either model."""
    for number, (link, reduction) in enumerate(links):
        agree = np.logical_or(*(pairs[number].agree for pairs in found.values()))
        if agree.any():
            yield Shared(link, agree, reduction / unit)


def _registered(
    points: Correspondences,
    good: dict[tuple[int, int], tuple[Link, Pair]],
    model: str,
    images: list[int],
    components: list[list[int]],
    matches: list[Match],
    models: dict[str, ModelFit],
) -> ImageRegistration:
    """The maps of a group of images."""
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
    """The map of two images, among as many pairs as there may be."""
    area = float(points.sizes[[link.i, link.j]].prod(axis=1).min()) / unit**2
    tests = len(points.sizes) * (len(points.sizes) - 1) // 2
    return estimate(link.xi, link.xj, model, tolerance, area=area, tests=tests)


def links_of(points: Correspondences, unit: float) -> Iterator[tuple[Link, float]]:
    """The points of each pair of images i < j, in coordinates from the images' middles, and their reduction."""
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
    """Groups of images that pairs connect, the largest first."""
    group: dict[int, set[int]] = {}
    for i, j in pairs:
        merged = group.get(i, {i}) | group.get(j, {j})
        group.update(dict.fromkeys(merged, merged))
    return sorted(
        {tuple(sorted(images)): sorted(images) for images in group.values()}.values(), key=lambda g: (-len(g), g)
    )


def chained(images: Sequence[int], pairs: dict[tuple[int, int], Pair]) -> FloatArray:
    """The maps of images into the first one, by the pairs with the most points (a maximal spanning tree)."""
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
    """Raise ValueError where images mirror the others, naming the fewer."""
    mirrors = np.linalg.det(chain) < 0
    if mirrors.any():
        few = mirrors if mirrors.mean() <= 0.5 else ~mirrors
        names = [points.name(image) for image, odd in zip(images, few, strict=True) if odd]
        more = [f"{len(names) - _SHOWN} more"] if len(names) > _SHOWN else []
        raise ValueError(
            f"Invalid orientation of {listed(names[:_SHOWN] + more, 'and')}. They mirror the others; all must agree."
        )


def why_none(points: Correspondences, matches: Sequence[Match]) -> str:
    """Reasons of the first pairs."""
    reasons = [f"{points.name(m.i)} and {points.name(m.j)}, {m.reason}" for m in matches[:3]]
    return "; ".join(reasons) + ("; ..." if len(matches) > 3 else "")


# ---- frames --------------------------------------------------------------------------------------


class Frame(NamedTuple):
    """A plane that all images are brought into, in pixels.

    `reference`: the number of the image whose plane it is, or None for the MDT's. `matrices`: from the pixels of the
    images into it (n, 3, 3). `distortions`: Dist_F of each image, (n,), of a homography the root of its mean square
    over the image. `figure`: the sum of their squares, of homographies the mean; with weights, by the weights.
    """

    reference: int | None
    matrices: FloatArray
    distortions: FloatArray
    figure: float


def frame_of_image(found: ImageRegistration, image: int, weights: FloatArray) -> Frame | None:
    """The plane of an image that was registered; None where it has no room for another image."""
    own = found.images.index(image)
    matrices = np.linalg.solve(found.matrices[own], found.matrices)
    matrices[own] = np.eye(3)
    return None if behind(matrices, found.sizes).any() else _measured(found, image, matrices, weights)


class CommonFrames(NamedTuple):
    """The frames `first`, `last`, `central`, `best` and `mdt`, None where impossible.

    `impossible`: the images in whose planes others reach infinity. `rotation`: that of the MDT's frame.
    """

    frames: dict[str, Frame | None]
    impossible: list[int]
    rotation: Rotation


def common_frames(found: ImageRegistration, weights: FloatArray, rotation: str) -> CommonFrames:
    """All frames. Raises ValueError where every plane sends some image through infinity.

    Central is the image whose middle is nearest to the mean of all middles in the MDT's frame, best the one with the
    least figure.
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
    middles = places(mean.matrices, 0.5 * found.sizes[:, None])[:, 0]
    return found.images[int(np.hypot(*(middles - middles.mean(axis=0)).T).argmin())]


def _mdt_frame(found: ImageRegistration, weights: FloatArray, rotation: str) -> tuple[Frame, Rotation]:
    """The MDT's frame: its shape by the MDT, turned by the mean rotation, shifted to the axes."""
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
    """Jacobians (n, m, 2, 2) of the images at their nodes, and the nodes' weights; one node of an affine map."""
    if found.model == "affine":
        return H[:, None, :2, :2], np.ones(1)
    J, _, w = field_of(H, found.sizes)
    return J, w


def _measured(found: ImageRegistration, reference: int | None, H: FloatArray, weights: FloatArray) -> Frame:
    J, w = _jacobians(found, H)
    squares = (np.log(np.linalg.svd(J, compute_uv=False)) ** 2).sum(axis=-1) @ w
    # With equal weights the figure of affine maps is the plain sum.
    figure = float(weights @ squares) * (len(squares) if found.model == "affine" else 1.0)
    return Frame(reference, H, np.sqrt(squares), figure)
