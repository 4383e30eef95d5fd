"""Mosaics: images in one plane by their common points, and the frames that it may have."""

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray
from projdist.applications.mosaics import bundle_adjustment, canvases, homographies
from projdist.applications.mosaics.bundle_adjustment import Chart, Link, ModelFit, Pair, adjust
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.homographies import MODELS, behind, corners, field_of, places
from projdist.matrices import ROTATIONS, Rotation, axes_shift, check_weights, mdt, mean_rotation
from projdist.support import Answer, check_choice, listed, plain

_SHOWN = 10  # names in one message


class Match(NamedTuple):
    """Two images, the numbers of points that they share and that agree on a map, and the reason if none do."""

    i: int
    j: int
    points: int
    agree: int
    reason: str
    false_alarms: float  #: decimal logarithm of the expected number of chance maps as good, over all pairs, or NaN


@dataclass(frozen=True, eq=False)
class ConnectedImages:
    """A group of images that common points connect."""

    images: list[int]  # their numbers
    components: list[list[int]]  # all groups of two or more connected images, the largest first
    left_out: list[int]  # numbers of the other images
    matches: list[Match]  # of all pairs

    @property
    def shared(self) -> tuple[list[int], list[list[int]], list[int], list[Match]]:
        """The four fields, for groups of other types."""
        return self.images, self.components, self.left_out, self.matches


@dataclass(frozen=True, eq=False)
class ImageRegistration(ConnectedImages):
    """The maps of connected images into the plane of the first one, in pixels."""

    model: str
    matrices: FloatArray  #: (n, 3, 3)
    sizes: FloatArray
    rms_pixels: float  #: RMS of the symmetric transfer error
    models: dict[str, ModelFit]  #: how well each model fits the pairs


@dataclass(frozen=True, eq=False)
class Cameras(ConnectedImages):
    """The cameras of connected images that were taken by turning a camera."""

    rotations: FloatArray  #: (n, 3, 3), from each camera's right, down and forward to the first one's
    focals: FloatArray  #: (n,), pixels
    focal_errors: FloatArray  #: their standard deviations
    rms_pixels: float  #: RMS of the symmetric transfer error
    rms_homographies: float  #: the same with a homography for each pair of images, which also allows a moving camera


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImageAnswer(Answer):
    """Base class of mosaics and panoramas: a group of images connected by common points."""

    points: Correspondences

    @property
    @abstractmethod
    def _found(self) -> ConnectedImages:
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
        return self.points.names_of(self._found.left_out)

    @property
    def alone(self) -> list[str]:
        """The names or numbers of the images that are connected with no other."""
        grouped = {image for group in self._found.components for image in group}
        return self.points.names_of(image for image in self._found.left_out if image not in grouped)

    @property
    def notes(self) -> list[str]:
        """Remarks on the result; usually none."""
        return self.messages()

    def _left_out_note(self, *, others: bool) -> str:
        """The remark on images left out; groups of connected ones are named together, and only with `others`."""
        left_out = set(self._found.left_out)
        groups = [group for group in self._found.components if others and set(group) <= left_out]
        parts = [", ".join(self.alone)] if self.alone else []
        parts += [listed(self.points.names_of(group), "and") + ", which belong together" for group in groups]
        return f"Left out: {'; '.join(parts)}. Nothing connects them with the other images." if parts else ""

    def _of_all(self, values: FloatArray) -> list[Any]:
        """A value for each image, None for those left out."""
        of_image = dict(zip(self.images, values.tolist(), strict=True))
        return [of_image.get(image) for image in range(len(self.points.sizes))]

    def _shared_parts(self) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
        """The parts of the report that all such answers have: the images, their groups, and their pairs and notes."""
        name, found = self.points.name, self._found
        pairs = [
            m._asdict() | {"i": name(m.i), "j": name(m.j), "false_alarms": plain(m.false_alarms)} for m in found.matches
        ]
        return (
            {"images": self.points.names_of(range(len(self.points.sizes))), "sizes": self.points.sizes.tolist()},
            {"left_out": self.left_out, "components": [self.points.names_of(group) for group in found.components]},
            {"pairs": pairs, "notes": self.notes},
        )


def register(points: Correspondences, *, model: str = "affine", tolerance: float = 4.0) -> ImageRegistration:
    """Register images by their common points.

    `model`: affine maps, homographies, or "auto" for the model that suits the points. `tolerance`: pixels, of the
    reduced images if points were found in such; points of a pair of images farther off the pair's map are wrong. Pairs
    with more points in agreement than chance would give in all pairs together are chained, strongest first, and the
    chains are the start of a bundle adjustment. Raises ValueError if no two images are connected, and for mirrors.
    """
    return register_groups(points, model=model, tolerance=tolerance, most=1)[0]


def register_groups(
    points: Correspondences, *, model: str = "affine", tolerance: float = 4.0, most: int | None = None
) -> list[ImageRegistration]:
    """Register each group of connected images, the largest first, at most `most`. Raises as `register`."""
    check_choice("model", model, homographies.CHOICES)
    links = links_of(points, tolerance)
    found = {name: [estimated(points, link, tolerance, name) for link in links] for name in MODELS}
    # The points that agree on a map by either model.
    agree = [np.logical_or(*(pair.agree for pair in both)) for both in zip(*found.values(), strict=True)]
    models = bundle_adjustment.compare_models(zip(links, agree, strict=True), points.unit)
    if model == "auto":
        model = min(models, key=lambda name: models[name].gric, default=MODELS[0])
    unit, registrations = points.unit, []
    for group in connected(points, links, found[model])[:most]:
        sizes = points.sizes[group.images]
        refuse_mirrors(points, group)
        maps, rms, _ = adjust(Chart(model), group.chain, [link.chosen(at) for link, at in group.agreeing])
        to_unit = np.tile(np.eye(3), (len(sizes), 1, 1))
        to_unit[:, :2] /= unit
        to_unit[:, :2, 2] = -0.5 * sizes / unit
        to_pixels = np.diag([unit, unit, 1.0])
        to_pixels[:2, 2] = 0.5 * sizes[0]
        matrices = to_pixels @ maps @ to_unit
        if model == "homography":
            matrices /= np.cbrt(np.linalg.det(matrices))[:, None, None]
        registrations.append(ImageRegistration(*group.shared, model, matrices, sizes, rms * unit, models))
    return registrations


@dataclass(frozen=True, eq=False)
class MatchedImages(ConnectedImages):
    """Connected images and the maps between them."""

    links: list[Link]
    pairs: list[Pair]  # the map of each link
    chain: FloatArray  # (n, 3, 3), maps into the first image, to start from

    @property
    def agreeing(self) -> list[tuple[Link, BoolArray]]:
        """The links, with flags of the points that agree on the map of their pair."""
        return [(link, pair.agree) for link, pair in zip(self.links, self.pairs, strict=True)]


def connected(points: Correspondences, links: Sequence[Link], pairs: Sequence[Pair]) -> list[MatchedImages]:
    """The groups of images that pairs connect, the largest first; raises ValueError if no pair has a map."""
    both = list(zip(links, pairs, strict=True))
    matches = [
        Match(link.i, link.j, len(link.xi), int(pair.agree.sum()), pair.reason, pair.false_alarms)
        for link, pair in both
    ]
    good = [(link, pair) for link, pair in both if pair.S is not None]
    components = components_of((link.i, link.j) for link, _ in good)
    if not components:
        reasons = [f"{points.name(m.i)} and {points.name(m.j)}, {m.reason}" for m in matches[:3]]
        more = "; ..." if len(matches) > 3 else ""
        raise ValueError(f"Invalid correspondences. No two images match: {'; '.join(reasons)}{more}.")
    groups = []
    for images in components:
        number = {image: place for place, image in enumerate(images)}
        own = [link._replace(i=number[link.i], j=number[link.j]) for link, _ in good if link.i in number]
        found = [pair for link, pair in good if link.i in number]
        left_out = sorted(set(range(len(points.sizes))) - set(images))
        groups.append(MatchedImages(images, components, left_out, matches, own, found, chained(own, found)))
    return groups


def estimated(points: Correspondences, link: Link, tolerance: float, model: str) -> Pair:
    """The map of two images, tested against chance in all possible pairs; `tolerance` in pixels of reduced images."""
    area = float(points.sizes[[link.i, link.j]].prod(axis=1).min()) / points.unit**2
    tests = len(points.sizes) * (len(points.sizes) - 1) // 2
    within = link.reduction * tolerance / points.unit
    return bundle_adjustment.estimate(link.xi, link.xj, model, within, area=area, tests=tests)


def links_of(points: Correspondences, tolerance: float) -> list[Link]:
    """The common points of each pair of images i < j, counted from the images' middles in `points.unit`."""
    if not tolerance > 0:
        raise ValueError(f"Invalid tolerance {tolerance}. It must be a number of pixels above 0.")
    links: list[Link] = []
    unit, reductions = points.unit, np.asarray(points.reductions)
    swap = points.i > points.j
    i, j = np.where(swap, points.j, points.i), np.where(swap, points.i, points.j)
    first = np.where(swap[:, None], points.xj, points.xi)
    second = np.where(swap[:, None], points.xi, points.xj)
    keys, places = np.unique(np.stack([i, j], axis=1), axis=0, return_inverse=True)
    for number, (a, b) in enumerate(keys.tolist()):
        chosen = places.reshape(-1) == number
        xi, xj = (first[chosen] - 0.5 * points.sizes[a]) / unit, (second[chosen] - 0.5 * points.sizes[b]) / unit
        links.append(Link(a, b, xi, xj, float(reductions[chosen].max())))
    return links


def components_of(pairs: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Groups of images connected by pairs, the largest first."""
    group: dict[int, set[int]] = {}
    for i, j in pairs:
        merged = group.get(i, {i}) | group.get(j, {j})
        group.update(dict.fromkeys(merged, merged))
    distinct = {tuple(sorted(images)) for images in group.values()}
    return sorted(map(list, distinct), key=lambda images: (-len(images), images))


def chained(links: Sequence[Link], pairs: Sequence[Pair]) -> FloatArray:
    """Maps (n, 3, 3) of images into the first one, along a spanning tree of the pairs with the most points."""
    maps = {0: np.eye(3)}
    count = 1 + max(max(link.i, link.j) for link in links)
    strongest = sorted(zip(links, pairs, strict=True), key=lambda both: -int(both[1].agree.sum()))
    while len(maps) < count:
        link, pair = next(both for both in strongest if (both[0].i in maps) != (both[0].j in maps))
        S: Any = pair.S
        if link.j in maps:
            maps[link.i] = maps[link.j] @ S
        else:
            maps[link.j] = maps[link.i] @ np.linalg.inv(S)
    return np.stack([maps[image] for image in range(count)])


def refuse_mirrors(points: Correspondences, group: MatchedImages) -> None:
    """Raise ValueError if images of a group mirror the others, naming the smaller part."""
    mirrors = np.linalg.det(group.chain) < 0
    if mirrors.any():
        few = mirrors if mirrors.mean() <= 0.5 else ~mirrors
        names = points.names_of(np.array(group.images)[few].tolist())
        more = [f"{len(names) - _SHOWN} more"] if len(names) > _SHOWN else []
        shown = listed(names[:_SHOWN] + more, "and")
        raise ValueError(f"Invalid orientation of {shown}. They mirror the others; all must agree.")


# ---- frames --------------------------------------------------------------------------------------


class Frame(NamedTuple):
    """A plane that all images are mapped into, in pixels."""

    reference: int | None  #: number of the image whose plane it is, None for that of the MDT
    matrices: FloatArray  #: (n, 3, 3), from the pixels of the images into it
    distortions: FloatArray  #: (n,), Dist_F of each image, for a homography its RMS over the image
    figure: float  #: the (weighted) sum of their squares, for homographies the mean


def frame_of_image(found: ImageRegistration, image: int, weights: FloatArray) -> Frame | None:
    """The plane of a registered image; None if another image reaches infinity in it."""
    own = found.images.index(image)
    matrices = np.linalg.solve(found.matrices[own], found.matrices)
    matrices[own] = np.eye(3)
    return None if behind(matrices, found.sizes).any() else _measured(found, image, matrices, weights)


class CommonFrames(NamedTuple):
    """The frames `first`, `last`, `central`, `best` and `mdt`, None if impossible."""

    frames: dict[str, Frame | None]
    impossible: list[int]  # images in whose planes others reach infinity
    rotation: Rotation  # that of the MDT's frame


def common_frames(found: ImageRegistration, weights: FloatArray, rotation: str) -> CommonFrames:
    """All frames; raises ValueError if some image reaches infinity in every plane."""
    # That of the MDT is rotated by the mean rotation and shifted to the axes; the central image is nearest its middle.
    H: FloatArray | None = found.matrices
    if found.model == "homography":
        H = homographies.least_distorting(found.matrices, found.sizes, weights)
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
    mean = _measured(found, None, H, weights)
    of_image = {image: frame_of_image(found, image, weights) for image in found.images}
    possible = [frame for frame in of_image.values() if frame is not None]
    middles = places(mean.matrices, 0.5 * found.sizes[:, None])[:, 0]
    frames = {
        "first": of_image[found.images[0]],
        "last": of_image[found.images[-1]],
        "central": of_image[found.images[int(np.hypot(*(middles - middles.mean(axis=0)).T).argmin())]],
        "best": min(possible, key=lambda frame: frame.figure, default=None),
        "mdt": mean,
    }
    return CommonFrames(frames, [image for image, frame in of_image.items() if frame is None], turn)


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


# ---- answers -------------------------------------------------------------------------------------

FRAMES = ("mdt", "first", "last", "central", "best")
_SEVERAL = 2.0  # times: homographies that fit better by this give a note
_MOST_PIXELS = 1e8  # of a canvas: 300 MB of colours


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Mosaic(ImageAnswer):
    """Images in a common frame, with the figures of other frames."""

    registration: ImageRegistration
    common: CommonFrames  #: the frames to choose from
    frame_name: str  #: as requested
    frame: Frame
    most_pixels: float = _MOST_PIXELS  #: limit of the canvas

    @property
    def frames(self) -> dict[str, Frame | None]:
        """`first`, `last`, `central`, `best` and `mdt`; None if some image reaches infinity in that plane."""
        return self.common.frames

    @property
    def _found(self) -> ImageRegistration:
        return self.registration

    @property
    def matrices(self) -> FloatArray:
        """From the pixels of `images` to the frame, (n, 3, 3)."""
        return self.frame.matrices

    def messages(self, *, others: bool = True) -> list[str]:
        """Remarks on the result; without `others` none on other groups of images, which have their own mosaics."""
        said = [self._left_out_note(others=others)]
        fits = self.registration.models
        if self.registration.model == "affine" and fits and fits["affine"].gric > fits["homography"].gric:
            affine, homography = (fits[model].rms_pixels for model in MODELS)
            if affine >= _SEVERAL * homography:
                said.append(
                    f"Homographies fit the pairs to {homography:.3g} pixels RMS, affine maps to {affine:.3g}: the "
                    "model should be homography."
                )
        return [note for note in (*said, self.common.rotation.note, self.canvas().note) if note]

    def canvas(self, *, most_pixels: float | None = None) -> canvases.Canvas:
        """The picture that holds all images, of at most `most_pixels`."""
        rims = places(self.matrices, corners(self.registration.sizes)).reshape(-1, 2)
        most = self.most_pixels if most_pixels is None else most_pixels
        width, height, scale, note = canvases.canvas_size(np.ptp(rims, axis=0), most)
        to_canvas = np.diag([scale, scale, 1.0])
        to_canvas[:2, 2] = -scale * rims.min(axis=0)
        return canvases.Canvas(width, height, to_canvas @ self.matrices, scale, note)

    def _line(self) -> str:
        return f"{len(self.images)} images in the frame {self.frame_name}"

    def to_dict(self) -> dict[str, Any]:
        """The report. Lists are for all images in their order, with None for those left out."""
        found, canvas, frames = self.registration, self.canvas(), self.frames
        references = {key: frame.reference for key, frame in frames.items() if frame and frame.reference is not None}
        images, groups, end = self._shared_parts()
        return {
            "model": found.model,
            **images,
            "frame": self.frame_name,
            "frames": {key: frame and plain(frame.figure) for key, frame in frames.items()},
            "references": {key: self.points.name(image) for key, image in references.items()},
            "impossible": self.points.names_of(self.common.impossible),
            "distortions": {key: frame and self._of_all(frame.distortions) for key, frame in frames.items()},
            "matrices": self._of_all(self.matrices),
            "rms_pixels": found.rms_pixels,
            "models": {key: fit._asdict() for key, fit in found.models.items()},
            "resultant_length": float(self.common.rotation.mean_resultant_length),
            **groups,
            "canvas": {"width": canvas.width, "height": canvas.height, "scale": canvas.scale},
            **end,
        }

    def _table(self) -> dict[str, Any]:
        """A row per image with its Dist_F in each frame."""
        none = np.full(len(self.images), np.nan)
        distortions = {key: none if frame is None else frame.distortions for key, frame in self.frames.items()}
        return {"image": self.points.names_of(self.images)} | distortions


def check_frame(frame: str | int, count: int) -> str | int:
    """The name of a frame, or the number of one of `count` images; raises ValueError for others."""
    if isinstance(frame, str) and frame.isdecimal():
        frame = int(frame)
    if not (frame in FRAMES or (isinstance(frame, int) and 0 <= frame < count)):
        allowed = f"{', '.join(FRAMES)}, or the number of an image, 0 to {count - 1}"
        raise ValueError(f"Invalid frame '{frame}'. It must be {allowed}.")
    return frame


def mosaic(
    points: Correspondences,
    *,
    model: str = "affine",
    frame: str | int = "mdt",
    weights: ArrayLike | None = None,
    rotation: str = "chordal",
    tolerance: float = 4.0,
    most_pixels: float = _MOST_PIXELS,
    registration: ImageRegistration | None = None,
) -> Mosaic:
    """Bring images into a common frame by their common points.

    `model`: affine maps, homographies, or "auto" for the model that suits the points. `frame`: "mdt", in which the
    images are distorted least, or the plane of an image: "first", "last", "central", "best" of all, or a number.
    `weights`: of the images, by default equal. `rotation`: as `method` of `mean_rotation`. `tolerance`: pixels, as in
    `register`. `most_pixels`: limit of the canvas. `registration`: that of a group of images, by default of the
    largest, by `model` and `tolerance`. Raises ValueError as `register`, and for frames that reach infinity.
    """
    frame = check_frame(frame, len(points.sizes))
    check_choice("rotation", rotation, ROTATIONS)
    all_weights = check_weights(weights, (len(points.sizes),))
    found = registration or register(points, model=model, tolerance=tolerance)
    own_weights = check_weights(all_weights[found.images], (len(found.images),))
    common = common_frames(found, own_weights, rotation)
    if isinstance(frame, str):
        chosen = common.frames[frame]
    elif frame in found.images:
        chosen = frame_of_image(found, frame, own_weights)
    else:
        raise ValueError(f"Invalid frame '{frame}'. Nothing connects image {points.name(frame)} with the others.")
    if chosen is None:
        raise ValueError(f"Invalid frame '{frame}'. Its plane sends other images through infinity; mdt does not.")
    return Mosaic(
        points=points, registration=found, common=common, frame_name=str(frame), frame=chosen, most_pixels=most_pixels
    )


def mosaics_of_groups(
    points: Correspondences,
    *,
    model: str = "affine",
    frame: str | int = "mdt",
    weights: ArrayLike | None = None,
    rotation: str = "chordal",
    tolerance: float = 4.0,
    most_pixels: float = _MOST_PIXELS,
    most: int | None = None,
) -> list[Mosaic]:
    """A `mosaic` of each group of connected images, largest first, at most `most`; for 1 `frame` may be a number."""
    if not isinstance(check_frame(frame, len(points.sizes)), str) and most != 1:
        raise ValueError(f"Invalid frame '{frame}'. An image is in one group only; it must be {', '.join(FRAMES)}.")
    check_choice("rotation", rotation, ROTATIONS)
    check_weights(weights, (len(points.sizes),))
    groups = register_groups(points, model=model, tolerance=tolerance, most=most)
    same: dict[str, Any] = {"frame": frame, "weights": weights, "rotation": rotation, "most_pixels": most_pixels}
    return [mosaic(points, registration=group, **same) for group in groups]
