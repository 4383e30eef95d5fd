"""Where map sheets lie in the coordinates of a CRS, and where their mosaic does."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.mosaics.canvases import Canvas
from projdist.applications.mosaics.homographies import corners
from projdist.applications.mosaics.projective import places
from projdist.support import replacing

__all__ = ["Georeference", "MeanGeoreference", "mean_georeference", "read_world_file", "world_file", "write_world_file"]

_MIDDLE = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])  # of the first pixel, which world files have


class Georeference(NamedTuple):
    """The affine map from pixels to coordinates, (3, 3), and the CRS as WKT, "" where nobody says."""

    matrix: FloatArray
    crs: str


class MeanGeoreference(NamedTuple):
    """The affine map from the pixels of a mosaic that brings the corners of its sheets nearest to their coordinates.

    `rms`: of the distances that are left, in the unit of the coordinates; `sheets`: how many have any.
    """

    matrix: FloatArray
    crs: str
    rms: float
    sheets: int


def mean_georeference(
    canvas: Canvas, sizes: FloatArray, sheets: Sequence[Georeference | None]
) -> MeanGeoreference | None:
    """By least squares over the corners of all sheets that have a georeference, None where none has.

    The mosaic stays as it is: it is no rectification, and `rms` says how far the sheets' own coordinates are from what
    the mosaic has. Raises ValueError for sheets of different CRSs.
    """
    known = [number for number, sheet in enumerate(sheets) if sheet is not None]
    given = [sheet for sheet in sheets if sheet is not None]
    if not given:
        return None
    names = {sheet.crs for sheet in given if sheet.crs}
    if len(names) > 1:
        raise ValueError("Invalid georeferences. The sheets are in different CRSs.")
    rims = corners(sizes[known])
    here = places(canvas.matrices[known], rims).reshape(-1, 2)
    there = places(np.stack([sheet.matrix for sheet in given]), rims).reshape(-1, 2)
    # Coordinates of a CRS are large: from their means.
    middle, target = here.mean(axis=0), there.mean(axis=0)
    A = np.linalg.lstsq(here - middle, there - target, rcond=None)[0].T
    gaps = there - target - (here - middle) @ A.T
    matrix = np.eye(3)
    matrix[:2, :2], matrix[:2, 2] = A, target - A @ middle
    rms = float(np.sqrt((gaps**2).sum(axis=1).mean()))
    return MeanGeoreference(matrix, names.pop() if names else "", rms, len(given))


# ---- world files ----------------------------------------------------------------------------


def world_file(path: str | os.PathLike[str]) -> Path:
    """The name of a picture's world file: x.pgw of x.png."""
    path = Path(path)
    letters = path.suffix.lstrip(".")
    return path.with_suffix(f".{letters[0]}{letters[-1]}w" if letters else ".wld")


def read_world_file(path: str | os.PathLike[str]) -> Georeference | None:
    """What a picture's world file says, as .pgw, .pngw or .wld, None where there is none; raises ValueError."""
    path = Path(path)
    for candidate in (world_file(path), path.with_name(path.name + "w"), path.with_suffix(".wld")):
        if not candidate.is_file():
            continue
        try:
            a, d, b, e, c, f = (float(word) for word in candidate.read_text(encoding="ascii").split())
        except (OSError, ValueError) as error:
            raise ValueError(f"Invalid world file '{candidate}'. It must have six numbers.") from error
        matrix = np.array([[a, b, c], [d, e, f], [0.0, 0.0, 1.0]])
        if not np.isfinite(matrix).all() or np.linalg.det(matrix) == 0:
            raise ValueError(f"Invalid world file '{candidate}'. Its numbers must be of a map of the plane.")
        return Georeference(matrix @ np.linalg.inv(_MIDDLE), "")
    return None


def write_world_file(path: Path, matrix: FloatArray, *, overwrite: bool = True) -> None:
    """Write the six numbers of a map from pixels to coordinates; raises FileExistsError, OSError."""
    numbers = (matrix @ _MIDDLE)[:2].T.reshape(-1)
    with replacing(path, overwrite=overwrite) as new:
        new.write_text("".join(f"{value!r}\n" for value in numbers.tolist()), encoding="ascii")
