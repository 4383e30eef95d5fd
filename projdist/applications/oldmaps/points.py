"""Control points of old maps: where places stand on the old map, and where they are in truth."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.projections import Projection, ProjectionLike, check_degrees, plane_of
from projdist.support import check_path, is_number, number_of, numbered_rows, tell

__all__ = ["ControlPoints", "read_control_points"]

# Beside our own names those of QGIS, whose `mapX` is the truth.
_COLUMNS = {
    "id": ("id", "name", "no", "nr", "point", "label"),
    "x_old": ("x_old", "old_x", "xold", "oldx", "sourcex", "pixelx", "column", "col", "px"),
    "y_old": ("y_old", "old_y", "yold", "oldy", "sourcey", "pixely", "row", "line", "py"),
    "x_new": ("x_new", "new_x", "xnew", "newx", "mapx", "easting", "east", "e", "lon", "longitude"),
    "y_new": ("y_new", "new_y", "ynew", "newy", "mapy", "northing", "north", "n", "lat", "latitude"),
    "enable": ("enable", "enabled"),
}
_NUMBERS = ("x_old", "y_old", "x_new", "y_new")
_LEAST = 3
_FARTHEST = 1e15  # in any unit; there doubles stand 0.1 apart, and far beyond their squares are infinite
_THIN = 1e-9  # of their length: points within a strip as narrow lie on one line


@dataclass(frozen=True, eq=False)
class ControlPoints:
    """Points (n, 2) on the old map, in any unit, and in truth, in metres of a plane with x east and y north.

    `names` tells them apart; `note` says what is doubtful. Raises ValueError for fewer than three points, and for
    points on one line.
    """

    old: FloatArray
    new: FloatArray
    names: tuple[str, ...] = ()
    note: str = ""

    def __post_init__(self) -> None:
        old, new = np.asarray(self.old, dtype=float), np.asarray(self.new, dtype=float)
        if old.ndim != 2 or old.shape != new.shape or old.shape[1] != 2 or len(old) < _LEAST:
            raise ValueError(
                f"Invalid control points of shapes {old.shape} and {new.shape}. Both must be (n, 2), n at least 3."
            )
        names = self.names or tuple(str(number) for number in range(1, len(old) + 1))
        if len(names) != len(old):
            raise ValueError(f"Invalid names of control points. There are {len(names)} for {len(old)} points.")
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"Invalid names of control points. There are two '{twice}'.")
        wrong = ~(np.isfinite(old) & np.isfinite(new)).all(axis=1)
        if wrong.any():
            raise ValueError(f"Invalid control point '{names[int(np.argmax(wrong))]}'. Its places must be finite.")
        for places, where in ((old, "on the old map"), (new, "in truth")):
            far = np.abs(places).max(axis=1) > _FARTHEST
            if far.any():
                name = names[int(np.argmax(far))]
                raise ValueError(f"Invalid control point '{name}'. It must lie within {_FARTHEST:g} {where}.")
            scales = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
            if scales[0] * _FARTHEST < 1.0:
                raise ValueError(f"Invalid control points. They must not be in one place, as they are {where}.")
            if not scales[1] > _THIN * scales[0]:
                raise ValueError(f"Invalid control points. They must not lie on one line, as they do {where}.")
        for field, value in (("old", old), ("new", new), ("names", tuple(names))):
            object.__setattr__(self, field, value)

    def chosen(self, which: BoolArray) -> ControlPoints:
        """Some of the points."""
        if which.all():
            return self
        names = tuple(name for name, one in zip(self.names, which, strict=True) if one)
        return ControlPoints(self.old[which], self.new[which], names, self.note)


def read_control_points(path: str | os.PathLike[str], *, crs: ProjectionLike | None = None) -> ControlPoints:
    """The control points of a table with commas, semicolons, tabs or spaces between its columns.

    Without a header these are x and y on the old map, and x and y in truth, perhaps with an id before them. With a
    header they have any usual names (x_old, y_old, x_new, y_new; QGIS's sourceX, sourceY, mapX, mapY), or, for the
    truth, lon and lat. What is not enabled is left out, and told.

    Parameters
    ----------
    path : str or path
        A text file of three points or more.
    crs : ProjectionLike, optional
        Anything that a `Projection` is made from: the plane of the truth. Most of the points within 180 and 90, or a
        header that says so, are longitudes and latitudes in degrees, to be projected with it; else they are its
        coordinates, in its unit.

    Returns
    -------
    ControlPoints
        Places (n, 2) on the old map, in any unit, and in truth, in metres; and the points' names.

    Raises
    ------
    ValueError
        For files that cannot be read, headers that lack a column, rows without numbers, longitudes and latitudes
        without a CRS, fewer than three points, and points on one line.
    ProjectionError
        For the CRS.

    References
    ----------
    QGIS User Guide, Georeferencer, whose files of points may be given.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "points.csv")
    ...     np.savetxt(path, [[0, 0, 600000, 200000], [9, 0, 600900, 200000], [0, 5, 600000, 200500]], delimiter=",")
    ...     read_control_points(path).new
    array([[600000., 200000.],
           [600900., 200000.],
           [600000., 200500.]])
    """
    projection = None if crs is None else Projection.from_user_input(crs)
    path = check_path("points file", path)
    text = f"Invalid points file '{path}'."
    header, is_degrees, rows = _table(Path(path), text)
    names: list[str] = []
    values: list[list[float]] = []
    disabled = 0
    for number, row in rows:
        cells = dict(zip(header, row, strict=False))
        if cells.get("enable", "1").strip() in ("0", "false"):
            disabled += 1
            continue
        try:
            values.append([number_of(cells[name]) for name in _NUMBERS])
        except (KeyError, ValueError) as error:
            raise ValueError(f"{text} Line {number} must have numbers for {', '.join(_NUMBERS)}.") from error
        names.append(cells.get("id", "").strip() or str(len(names) + 1))
    if disabled:
        tell(f"{disabled} control point(s) of '{path}' are not enabled and are left out.")
    places = np.array(values).reshape(-1, 4)
    if len(places) < _LEAST:
        raise ValueError(f"{text} It has {len(places)} control points; there must be at least {_LEAST}.")
    old, new, note = places[:, :2], places[:, 2:], ""
    if projection is not None:
        new = _in_metres(new, projection, is_degrees)
    elif is_degrees:
        raise ValueError(f"{text} Its truth is longitudes and latitudes; a CRS is needed that makes a plane of them.")
    elif (np.abs(new) <= [180.0, 90.0]).all():
        note = "The truth is within 180 and 90: if these are degrees, and not metres, a CRS is needed."
    try:
        return ControlPoints(old, new, tuple(names), note)
    except ValueError as error:
        raise ValueError(f"{text} {error}") from error


def _in_metres(new: FloatArray, projection: Projection, is_degrees: bool) -> FloatArray:
    """The truth in metres of a projection's plane, of degrees or of coordinates of the CRS."""
    if is_degrees or (np.abs(new) <= [180.0, 90.0]).all(axis=1).mean() > 0.5:
        return np.stack(projection(*check_degrees(*new.T)), axis=-1)
    plane = plane_of(projection)
    return new if plane is None else np.asarray(new @ plane.to_metres.T)


def _table(path: Path, text: str) -> tuple[list[str], bool, list[tuple[int, list[str]]]]:
    """What the columns are, whether the truth is named in degrees, and the rows with the numbers of their lines."""
    rows = numbered_rows(path, text)
    first = rows[0][1]
    if is_number(first[-1]):
        if len(first) not in (4, 5):
            raise ValueError(
                f"{text} Without a header it must have 4 columns, {', '.join(_NUMBERS)}, or 5, an id first; it has "
                f"{len(first)}."
            )
        return ["id", *_NUMBERS][-len(first) :], False, rows
    return *_header(first, text), rows[1:]


def _header(words: list[str], text: str) -> tuple[list[str], bool]:
    """Our names of the columns of a header, and whether the truth is in degrees."""
    found = [word.strip().lower() for word in words]
    ours = {}
    for column, names in _COLUMNS.items():
        place = next((found.index(name) for name in names if name in found), None)
        if place is not None:
            ours[place] = column
    missing = [name for name in _NUMBERS if name not in ours.values()]
    if missing:
        raise ValueError(f"{text} Its header must name x_old, y_old, x_new and y_new; it has no {', '.join(missing)}.")
    is_degrees = any(found[place].startswith("lon") for place, column in ours.items() if column == "x_new")
    return [ours.get(place, f"other {place}") for place in range(len(found))], is_degrees
