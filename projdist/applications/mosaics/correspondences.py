"""Corresponding points of images: read from tables, and found in pictures as SIFT features."""

import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from projdist._typing import AnyArray, AnyPath, FloatArray, IntArray
from projdist.applications.mosaics.bundle_adjustment import Link, estimate
from projdist.applications.mosaics.homographies import CHOICES, places
from projdist.applications.mosaics.images import Picture, opencv
from projdist.support import check_choice, comma_hint, number_of, read_text, rows_of_text

_COLUMNS = ("model", "i", "j", "xi", "yi", "xj", "yj")
_CODES = {"0": "affine", "1": "homography", "affine": "affine", "homography": "homography"}
# "image sizes h x w: [(565, 800), ...]", or in the other order.
_SIZES = re.compile(r"sizes\s*\(?\s*([wh])\s*x\s*([wh])\s*\)?\s*:(.*)", re.IGNORECASE)
_PAIR = re.compile(r"(\d+)\s*[,x]\s*(\d+)")
_LARGEST = 1e7  # pixels
_SAME_SHAPE = 0.01  # largest difference of shape, as a reduced image has whole pixels


@dataclass(frozen=True, kw_only=True)
class Correspondences:
    """Corresponding points of images, in pixels, x to the right and y down; an image covers 0 to its width and height.

    Raises ValueError, with the number of the row, for invalid numbers of images, images paired with themselves, and
    infinite values.
    """

    i: IntArray  #: (n,), numbers of images, from 0
    j: IntArray  #: (n,), numbers of the images paired with them
    xi: FloatArray  #: (n, 2), points of the images i
    xj: FloatArray  #: (n, 2), the corresponding points of the images j
    sizes: FloatArray  #: (N, 2), widths and heights of all images
    names: tuple[str, ...] | None = None  #: of all images
    reductions: FloatArray | None = None  #: (n,), factors by which images were reduced to find the points, by default 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "i", np.asarray(self.i, dtype=int))
        object.__setattr__(self, "j", np.asarray(self.j, dtype=int))
        for name in ("xi", "xj", "sizes"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float).reshape(-1, 2))
        reductions = np.ones(len(self.i)) if self.reductions is None else np.asarray(self.reductions, dtype=float)
        object.__setattr__(self, "reductions", reductions)
        count = len(self.sizes)
        if not len(self.i) == len(self.j) == len(self.xi) == len(self.xj):
            raise ValueError("Invalid correspondences. There must be as many i and j as points of either image.")
        if len(reductions) != len(self.i) or not (reductions >= 1).all():
            raise ValueError("Invalid reductions of correspondences. There must be one per point, 1 or more.")
        if not count or not ((self.sizes >= 1) & (self.sizes <= _LARGEST)).all():
            raise ValueError("Invalid sizes of images. They must be given, in pixels, such as 800x600.")
        if self.names is not None and len(self.names) != count:
            raise ValueError(f"Invalid names of images. There are {len(self.names)}; there must be {count}, as sizes.")
        outside = (np.minimum(self.i, self.j) < 0) | (np.maximum(self.i, self.j) >= count)
        self._refuse(outside, f"Its images must be numbers from 0 to {count - 1}, as there are sizes of {count}.")
        self._refuse(self.i == self.j, "It pairs an image with itself.")
        finite = np.isfinite(np.hstack([self.xi, self.xj])).all(axis=1)
        self._refuse(np.asarray(~finite), "Its coordinates must be finite.")

    def _refuse(self, wrong: AnyArray, reason: str) -> None:
        """Raise ValueError for the first wrong row."""
        if wrong.any():
            raise ValueError(f"Invalid correspondence {int(np.flatnonzero(wrong)[0]) + 1}. {reason}")

    @property
    def unit(self) -> float:
        """Half of the longest side of the images, the unit of coordinates in which they are registered."""
        return float(self.sizes.max()) / 2.0

    def name(self, image: int) -> str:
        """The name of an image, or its number."""
        return str(image) if self.names is None else self.names[image]

    def names_of(self, images: Iterable[int]) -> list[str]:
        """The names of images, or their numbers."""
        return [self.name(image) for image in images]


def read_correspondences(
    path: AnyPath,
    *,
    model: str = "affine",
    sizes: Sequence[Sequence[float]] | None = None,
    names: Sequence[str] | None = None,
) -> Correspondences:
    """Read the rows for a model from a CSV file `model,i,j,xi,yi,xj,yj`, also with semicolons or tabs.

    The column model is 0 or `affine`, 1 or `homography`; "auto" reads the rows of both. `sizes`: widths and heights,
    one pair per image, or one for all images, each of which must then have a row; by default they are read from a
    comment line, as `# image sizes h x w: [(600, 800), (600, 800)]`. Raises ValueError.
    """
    columns, stated, images = _read(Path(path), model)
    given = stated if sizes is None else [(float(w), float(h)) for w, h in sizes]
    if given is None:
        like = "'# image sizes h x w: [(600, 800), (600, 800)]'"
        must = f"The sizes of the images must be given, or stand in a comment line, as {like}."
        raise ValueError(f"Invalid correspondences '{path}'. {must}")
    if len(given) == 1 and sizes is not None:
        count = len(images) if names is None else len(names)
        # Each image must occur, as one wrong number could mean millions of images.
        if names is None and images != set(range(count)):
            has = f"Its {count} images are numbered {min(images)} to {max(images)}"
            must = f"they must be 0 to {count - 1}, or the size of every image must be given"
            raise ValueError(f"Invalid correspondences '{path}'. {has}; {must}.")
        given = given * count
    return Correspondences(**columns, sizes=np.array(given), names=None if names is None else tuple(names))


def correspondences_of(pictures: Sequence[Picture], path: AnyPath, *, model: str = "affine") -> Correspondences:
    """Read the rows of such a file for pictures, numbered in their order.

    If a comment line has other sizes, the points are in reduced or enlarged images. Raises ValueError.
    """
    columns, stated, _ = _read(Path(path), model)
    sizes = np.array([picture.size for picture in pictures], dtype=float)
    given = Correspondences(**columns, sizes=np.array(stated or sizes))
    if len(sizes) != len(given.sizes):
        raise ValueError(f"Invalid images. There are {len(sizes)}; the correspondences are for {len(given.sizes)}.")
    ratio = sizes / given.sizes
    for picture, (across, down) in zip(pictures, ratio, strict=True):
        if abs(across / down - 1.0) > _SAME_SHAPE:
            raise ValueError(f"Invalid image '{picture.name}'. Its shape is not that of the correspondences.")
    names = tuple(picture.name for picture in pictures)
    return replace(given, xi=given.xi * ratio[given.i], xj=given.xj * ratio[given.j], sizes=sizes, names=names)


def _read(path: Path, model: str) -> tuple[dict[str, Any], list[tuple[float, float]] | None, set[int]]:
    """The columns of a model's rows, the sizes in a comment line, and the numbers of images in rows of any model."""
    check_choice("model", model, CHOICES)
    text = f"Invalid correspondences '{path}'."
    content = read_text(path, text)
    stated: list[tuple[float, float]] | None = None
    for line in content.splitlines():
        found = _SIZES.search(line) if line.lstrip().startswith("#") else None
        if found is not None and {found[1].lower(), found[2].lower()} == {"w", "h"}:
            pairs = [(float(a), float(b)) for a, b in _PAIR.findall(found[3])]
            stated = ([(b, a) for a, b in pairs] if found[1].lower() == "h" else pairs) or stated
    rows, models, images = [], set[str](), set[int]()
    for number, words in rows_of_text(content, text):
        cells = [cell.strip() for cell in words]
        if tuple(cell.lower() for cell in cells) == _COLUMNS:
            continue
        row = _row(cells)
        if row is None:
            must = f"{','.join(_COLUMNS)}: the model 0 or 1, the numbers of two images, and pixels"
            raise ValueError(f"{text} Line {number} must be {must}.{comma_hint(cells)}")
        models.add(row[0])
        images |= {int(row[1]), int(row[2])}
        if model in (row[0], "auto"):
            rows.append(row[1:])
    if not rows:
        has = f"It has rows of the model {models.pop()}" if models else "It has no rows"
        raise ValueError(f"{text} {has}; it must have some of the model {model}.")
    table = np.array(list(dict.fromkeys(rows)) if model == "auto" else rows)
    i, j = table[:, :2].T.astype(int)
    return {"i": i, "j": j, "xi": table[:, 2:4], "xj": table[:, 4:6]}, stated, images


def _row(cells: list[str]) -> tuple[str, float, float, float, float, float, float] | None:
    """The model and the six numbers of a row; None for an invalid row."""
    try:
        model, (i, j, xi, yi, xj, yj) = _CODES[cells[0].lower()], (number_of(cell) for cell in cells[1:])
    except (KeyError, ValueError):
        return None
    whole = i.is_integer() and j.is_integer() and max(abs(i), abs(j)) < _LARGEST
    return (model, i, j, xi, yi, xj, yj) if whole else None


def parse_sizes(text: str) -> list[tuple[float, float]]:
    """Widths and heights in a text like `800x600`, or several separated by commas; raises ValueError.

    >>> parse_sizes("800x600,640x480")
    [(800.0, 600.0), (640.0, 480.0)]
    """
    found = [re.fullmatch(r"\s*(\d+)\s*x\s*(\d+)\s*", word) for word in text.split(",")]
    pairs = [(float(match[1]), float(match[2])) for match in found if match]
    if len(pairs) < len(found):
        message = f"Invalid sizes '{text}'. They must be WIDTHxHEIGHT in pixels, such as 800x600, one for all or each."
        raise ValueError(message)
    return pairs


# ---- features ------------------------------------------------------------------------------------

# Pixels of an image in which features are searched, and the number of the clearest that are kept. The clearest of a
# large photo are leaves and grass: common ones are found on small images, then on larger ones near the expected places.
_COARSE, _FINE = 6e5, 2.4e6
_COARSE_FEATURES, _FINE_FEATURES = 3000, 8000
_TOLERANCE = 4.0  # pixels of the small images
_AROUND = 6.0  # pixels of the small images: search radius about the expected place on the larger ones
_CONTRAST = 0.02  # smallest contrast of a feature: half of Lowe's, for small and pale images
# The nearest feature must be nearer than the second by this (D. Lowe 2004, "Distinctive image features from
# scale-invariant keypoints", section 7.1).
_RATIO = 0.8
_FEWEST = 6  # common points: fewer are no evidence
_ALL_PAIRS = 11  # images
# Of more images, each is matched with those that most of its clearest features resemble (M. Brown & D. G. Lowe 2007,
# "Automatic panoramic image stitching using invariant features", section 3.1), and with the previous and the next one.
_CLEAREST, _NEAREST, _RESEMBLING = 200, 4, 8
_Item = TypeVar("_Item")


class _Features(NamedTuple):
    """Features of an image."""

    places: FloatArray  # (n, 2), in pixels of the full image
    descriptors: AnyArray  # (n, 128)
    reduction: float  # factor by which the image was reduced to find them


def match(pictures: Sequence[Picture], *, progress: Callable[[int, int], object] | None = None) -> Correspondences:
    """Common points of pictures, some of them wrong, for `mosaic` or `panorama`.

    SIFT features of images reduced to 0.6 million pixels correspond if each is clearly the nearest of the other. Larger
    images that match are matched again at 2.4 million pixels, each feature with those near its expected place.
    `progress` is called with the numbers of steps done and of all. Raises ValueError, and ImportError without OpenCV.
    """
    if len(pictures) < 2:
        raise ValueError(f"Invalid images. At least two are needed, not {len(pictures)}.")
    steps = _Steps(progress)
    features = [_features(picture, _COARSE, _COARSE_FEATURES) for picture in steps.of(pictures)]
    pairs = steps.of(_candidates(features))
    found = [common for i, j in pairs if (common := _common(i, j, features[i], features[j])) is not None]
    if not found:
        raise ValueError("Invalid images. No two of them have anything in common.")
    found = _refined(pictures, found, steps)
    counts = [len(one.xi) for one in found]
    return Correspondences(
        i=np.repeat([one.i for one in found], counts),
        j=np.repeat([one.j for one in found], counts),
        xi=np.concatenate([one.xi for one in found]),
        xj=np.concatenate([one.xj for one in found]),
        sizes=np.array([picture.size for picture in pictures], dtype=float),
        names=tuple(picture.name for picture in pictures),
        reductions=np.repeat([one.reduction for one in found], counts),
    )


class _Steps:
    """A counter of steps that reports to a callback."""

    def __init__(self, progress: Callable[[int, int], object] | None) -> None:
        self._progress, self._total, self._done = progress, 0, 0

    def of(self, items: Sequence[_Item]) -> Iterator[_Item]:
        """The items; each is a further step, counted when it is done."""
        self._total += len(items)
        for item in items:
            yield item
            self._done += 1
            if self._progress is not None:
                self._progress(self._done, self._total)


def _features(picture: Picture, most_pixels: float, most_features: int) -> _Features:
    """The clearest features of a picture reduced to at most so many pixels."""
    cv2 = opencv()
    colours, mask = picture.read()
    grey = cv2.cvtColor(colours, cv2.COLOR_RGB2GRAY)
    height, width = grey.shape
    share = min(1.0, float(np.sqrt(most_pixels / (width * height))))
    if share < 1.0:
        small = max(1, round(width * share)), max(1, round(height * share))
        grey = cv2.resize(grey, small, interpolation=cv2.INTER_AREA)
        mask = cv2.resize(mask, small, interpolation=cv2.INTER_NEAREST)
    # Without the precise upscale places are off by a quarter of a pixel.
    sift = cv2.SIFT_create(nfeatures=most_features, contrastThreshold=_CONTRAST, enable_precise_upscale=True)
    points, descriptors = sift.detectAndCompute(grey, mask)
    if descriptors is None:
        return _Features(np.zeros((0, 2)), np.zeros((0, 128), np.float32), 1.0 / share)
    order = np.argsort([-point.response for point in points], kind="stable")
    # OpenCV counts from the middle of the first pixel.
    there = (np.array([point.pt for point in points]) + 0.5) * [width / grey.shape[1], height / grey.shape[0]]
    return _Features(there[order], descriptors[order], 1.0 / share)


def _common(i: int, j: int, a: _Features, b: _Features) -> Link | None:
    """The features of two images that are clearly the nearest of each other; None if there are too few."""
    if min(len(a.places), len(b.places)) < _FEWEST:
        return None
    distances, numbers = _nearest(a.descriptors, b.descriptors, 2)
    clear = np.flatnonzero(distances[:, 0] < _RATIO * distances[:, 1])
    if not clear.size:
        return None
    there = numbers[clear, 0]
    mutual = _nearest(b.descriptors[there], a.descriptors, 1)[1][:, 0] == clear
    return _unique(i, j, a, b, clear[mutual], there[mutual])


def _unique(i: int, j: int, a: _Features, b: _Features, first: IntArray, second: IntArray) -> Link | None:
    """The distinct places of corresponding features, by their numbers; None if there are too few."""
    both = np.unique(np.hstack([a.places[first], b.places[second]]), axis=0)  # a feature with two directions is double
    if len(both) < _FEWEST:
        return None
    return Link(i, j, both[:, :2], both[:, 2:], max(a.reduction, b.reduction))


def _nearest(a: AnyArray, b: AnyArray, count: int) -> tuple[FloatArray, IntArray]:
    """Distances of each a from its nearest b, and the numbers of these, both (n, count)."""
    squares = (a * a).sum(axis=1)[:, None] + (b * b).sum(axis=1) - 2.0 * (a @ b.T)
    rows = np.arange(len(a))
    distances, numbers = np.zeros((len(a), count)), np.zeros((len(a), count), int)
    for column in range(count):
        numbers[:, column] = squares.argmin(axis=1)
        distances[:, column] = np.sqrt(np.maximum(squares[rows, numbers[:, column]], 0.0))
        squares[rows, numbers[:, column]] = np.inf
    return distances, numbers


def _candidates(features: Sequence[_Features]) -> list[tuple[int, int]]:
    """The pairs of images to match: all pairs of a few images, similar and neighbouring ones of many."""
    count = len(features)
    if count <= _ALL_PAIRS:
        return list(itertools.combinations(range(count), 2))
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
            pairs |= {(min(k, other), max(k, other)) for other in alike if other != k}
    return sorted(pairs)


def _refined(pictures: Sequence[Picture], found: Sequence[Link], steps: _Steps) -> list[Link]:
    """The common points, those of matching pairs found again on larger images."""
    maps = [_map_of(one, pictures) if one.reduction > 1.0 else None for one in found]
    larger = {image for one, S in zip(found, maps, strict=True) if S is not None for image in (one.i, one.j)}
    fine = {image: _features(pictures[image], _FINE, _FINE_FEATURES) for image in steps.of(sorted(larger))}
    both = zip(found, maps, strict=True)
    return [one if S is None else _guided(one, S, fine[one.i], fine[one.j]) or one for one, S in both]


def _map_of(one: Link, pictures: Sequence[Picture]) -> FloatArray | None:
    """The homography from image i to image j in pixels; None if the points agree on none."""
    sizes = np.array([pictures[one.i].size, pictures[one.j].size], dtype=float)
    unit = float(sizes.max()) / 2.0
    into = [np.array([[1.0 / unit, 0, -w / unit / 2], [0, 1.0 / unit, -h / unit / 2], [0, 0, 1.0]]) for w, h in sizes]
    xi, xj = (places(M[None], x[None])[0] for M, x in zip(into, (one.xi, one.xj), strict=True))
    area = float(sizes.prod(axis=1).min()) / unit**2
    pair = estimate(xi, xj, "homography", _TOLERANCE * one.reduction / unit, area=area, tests=1)
    return None if pair.S is None else np.asarray(np.linalg.solve(into[1], pair.S @ into[0]))


def _guided(one: Link, S: FloatArray, a: _Features, b: _Features) -> Link | None:
    """Corresponding features of larger images within a few pixels of the places that the map S predicts."""
    # Of those near, they are clearly the nearest of each other; None if there are fewer than on the small images.
    from scipy.spatial import KDTree  # scipy is slow to load, and few need it

    predicted = places(S[None], a.places[None])[0]
    numbers = np.flatnonzero((np.abs(predicted) < 1e6).all(axis=1))
    around = KDTree(b.places).query_ball_point(predicted[numbers], _AROUND * one.reduction)
    first = np.repeat(numbers, [len(those) for those in around])
    second = np.array([other for those in around for other in those], dtype=int)
    gaps = np.linalg.norm(a.descriptors[first] - b.descriptors[second], axis=1)
    best = gaps == _least(first, gaps, len(a.places))[first]
    clear = best & (gaps < _RATIO * _least(first, np.where(best, np.inf, gaps), len(a.places))[first])
    kept = clear & (gaps == _least(second, gaps, len(b.places))[second])
    common = _unique(one.i, one.j, a, b, first[kept], second[kept])
    return None if common is None or len(common.xi) < len(one.xi) else common


def _least(owner: IntArray, gaps: FloatArray, count: int) -> FloatArray:
    """The smallest gap of each of `count` owners, infinite for those without gaps."""
    least = np.full(count, np.inf)
    np.minimum.at(least, owner, gaps)
    return least
