"""Corresponding points of images, and the tables that they are read from."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from projdist._typing import AnyArray, FloatArray, IntArray
from projdist.applications.mosaics.homographies import check_model
from projdist.applications.mosaics.images import Picture
from projdist.support import comma_hint, number_of, read_text, rows_of_text

_COLUMNS = ("model", "i", "j", "xi", "yi", "xj", "yj")
_CODES = {"0": "affine", "1": "homography", "affine": "affine", "homography": "homography"}
# "image sizes h x w: [(565, 800), ...]", or in the other order.
_SIZES = re.compile(r"sizes\s*\(?\s*([wh])\s*x\s*([wh])\s*\)?\s*:(.*)", re.IGNORECASE)
_PAIR = re.compile(r"(\d+)\s*[,x]\s*(\d+)")
_LARGEST = 1e7  # pixels
_SAME_SHAPE = 0.01  # of a ratio: a reduced image has whole pixels


@dataclass(frozen=True, kw_only=True)
class Correspondences:
    """Points `xi` of images i, shape (n, 2), and the corresponding points `xj` of images j.

    In pixels, x to the right and y down; an image covers 0 to its width and 0 to its height. `i`, `j`: numbers of
    images, from 0. `sizes`: widths and heights of all images, shape (N, 2). `names`: of all images, or None.
    `reductions`: for points found in reduced images the factor of reduction, (n,), by default 1. Raises ValueError,
    with the number of the row, for invalid numbers of images, images paired with themselves, and infinite values.
    """

    i: IntArray
    j: IntArray
    xi: FloatArray
    xj: FloatArray
    sizes: FloatArray
    names: tuple[str, ...] | None = None
    reductions: FloatArray | None = None

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
            raise ValueError("Invalid reductions of correspondences. There must be one a point, 1 or more.")
        if not count or not ((self.sizes >= 1) & (self.sizes <= _LARGEST)).all():
            raise ValueError("Invalid sizes of images. There must be some, in pixels, as 800x600.")
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

    def resized(self, sizes: Sequence[Sequence[float]], names: Sequence[str]) -> Correspondences:
        """The same points in images of other sizes and names; raises ValueError for different proportions."""
        new = np.array(sizes, dtype=float)
        if len(new) != len(self.sizes):
            raise ValueError(f"Invalid images. There are {len(new)}; the correspondences are for {len(self.sizes)}.")
        ratio = new / self.sizes
        for name, (across, down) in zip(names, ratio, strict=True):
            if abs(across / down - 1.0) > _SAME_SHAPE:
                raise ValueError(f"Invalid image '{name}'. Its shape is not that of the correspondences.")
        return Correspondences(
            i=self.i, j=self.j, xi=self.xi * ratio[self.i], xj=self.xj * ratio[self.j], sizes=new, names=tuple(names)
        )

    def name(self, image: int) -> str:
        """The name of an image, or its number."""
        return str(image) if self.names is None else self.names[image]


def read_correspondences(
    path: str | os.PathLike[str],
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
    table, stated, images = _read(Path(path), check_model(model))
    i, j = table[:, 0].astype(int), table[:, 1].astype(int)
    given = stated if sizes is None else [(float(w), float(h)) for w, h in sizes]
    if given is None:
        raise ValueError(
            f"Invalid correspondences '{path}'. The sizes of the images must be given, or stand in a comment line, as "
            "'# image sizes h x w: [(600, 800), (600, 800)]'."
        )
    if len(given) == 1 and sizes is not None:
        given = given * (len(names) if names is not None else _count(Path(path), images))
    return Correspondences(
        i=i,
        j=j,
        xi=table[:, 2:4],
        xj=table[:, 4:6],
        sizes=np.array(given),
        names=None if names is None else tuple(names),
    )


def _count(path: Path, images: set[int]) -> int:
    """Number of images, each of which must occur, as one wrong number could mean millions of images."""
    count = len(images)
    if images != set(range(count)):
        raise ValueError(
            f"Invalid correspondences '{path}'. Its {count} images are numbered {min(images)} to {max(images)}; they "
            f"must be 0 to {count - 1}, or the size of every image must be given."
        )
    return count


def correspondences_of(
    pictures: Sequence[Picture], path: str | os.PathLike[str], *, model: str = "affine"
) -> Correspondences:
    """Read the rows of such a file for pictures, numbered in their order.

    If a comment line has other sizes, the points are in reduced or enlarged images. Raises ValueError.
    """
    table, stated, _ = _read(Path(path), check_model(model))
    sizes, names = [picture.size for picture in pictures], tuple(picture.name for picture in pictures)
    i, j = table[:, 0].astype(int), table[:, 1].astype(int)
    points = Correspondences(i=i, j=j, xi=table[:, 2:4], xj=table[:, 4:6], sizes=np.array(stated or sizes))
    return points.resized(sizes, names)


def _read(path: Path, model: str) -> tuple[FloatArray, list[tuple[float, float]] | None, set[int]]:
    """The rows for a model (n, 6), the sizes in a comment line, and the numbers of the images in rows of any model."""
    text = f"Invalid correspondences '{path}'."
    content = read_text(path, text)
    stated = None
    for line in content.splitlines():
        if line.lstrip().startswith("#"):
            stated = _stated_sizes(line) or stated
    rows, models = [], set()
    images: set[int] = set()
    for number, words in rows_of_text(content, text):
        cells = [cell.strip() for cell in words]
        if tuple(cell.lower() for cell in cells) == _COLUMNS:
            continue
        row = _row(cells)
        if row is None:
            raise ValueError(
                f"{text} Line {number} must be {','.join(_COLUMNS)}: the model 0 or 1, the numbers of two images, and "
                f"pixels.{comma_hint(cells)}"
            )
        models.add(row[0])
        images |= {int(row[1]), int(row[2])}
        if model in (row[0], "auto"):
            rows.append(row[1:])
    if not rows:
        has = f"It has rows of the model {models.pop()}" if models else "It has no rows"
        raise ValueError(f"{text} {has}; it must have some of the model {model}.")
    return np.array(list(dict.fromkeys(rows)) if model == "auto" else rows), stated, images


def _stated_sizes(line: str) -> list[tuple[float, float]] | None:
    """Widths and heights in a comment line, None without them."""
    found = _SIZES.search(line)
    if found is None or {found[1].lower(), found[2].lower()} != {"w", "h"}:
        return None
    pairs = [(float(a), float(b)) for a, b in _PAIR.findall(found[3])]
    return [(b, a) for a, b in pairs] if found[1].lower() == "h" else pairs


def _row(cells: list[str]) -> tuple[str, float, float, float, float, float, float] | None:
    """The model and six numbers of a row, None for an invalid one."""
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
        raise ValueError(
            f"Invalid sizes '{text}'. They must be WIDTHxHEIGHT in pixels, as 800x600, one or one an image."
        )
    return pairs
