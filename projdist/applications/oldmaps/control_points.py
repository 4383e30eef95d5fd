"""Control points of old maps: places on the old map and their true places."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist import projections
from projdist._typing import AnyPath, BoolArray, FloatArray
from projdist.support import check_path, comma_hint, is_number, number_of, read_text, rows_of_text, tell

# Names of columns without blanks and underscores: our own, QGIS's (its `mapX` is the true place) and ArcGIS's.
_COLUMNS = {
    "id": ("id", "name", "no", "nr", "point", "label", "link"),
    "x_old": ("xold", "oldx", "sourcex", "xsource", "pixelx", "pixel", "column", "col", "px"),
    "y_old": ("yold", "oldy", "sourcey", "ysource", "pixely", "row", "line", "py"),
    "x_new": ("xnew", "newx", "mapx", "xmap", "easting", "east", "e", "lon", "longitude"),
    "y_new": ("ynew", "newy", "mapy", "ymap", "northing", "north", "n", "lat", "latitude"),
    "enable": ("enable", "enabled"),
}
_NUMBERS = ("x_old", "y_old", "x_new", "y_new")
_LINK_TABLE = ("id", *_NUMBERS, "residual x", "residual y", "residual")  # of ArcGIS
_CRS_LINE = re.compile(r"\s*#\s*CRS\s*:(.*)", re.IGNORECASE)
_GCP = ("-gcp", "--gcp")
_STATED_BY = ("-a_srs", "-s_srs")  # of gdal_translate and gdalwarp: the CRS of the points
_LEAST = 3
_FARTHEST = 1e15  # in any unit; there doubles are 0.1 apart, and squares of far larger ones are infinite
_DEGREES = (180.0, 90.0)  # the largest longitude and latitude
_THIN = 1e-9  # of their length: points within a strip this narrow lie on one line


@dataclass(frozen=True, eq=False)
class ControlPoints:
    """Places on an old map and in truth; raises ValueError for fewer than three points, and for points on one line."""

    old: FloatArray  #: (n, 2), on the old map, in any unit
    new: FloatArray  #: (n, 2), true places, in metres of a plane with x east and y north
    names: tuple[str, ...] = ()  #: unique; by default numbers
    note: str = ""  #: remark on doubtful points
    crs: projections.Projection | None = None  #: of the true places, if known

    def __post_init__(self) -> None:
        old, new = np.asarray(self.old, dtype=float), np.asarray(self.new, dtype=float)
        if old.ndim != 2 or old.shape != new.shape or old.shape[1] != 2 or len(old) < _LEAST:
            shapes = f"{old.shape} and {new.shape}"
            raise ValueError(f"Invalid control points of shapes {shapes}. Both must be (n, 2), n at least 3.")
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
        return replace(self, old=self.old[which], new=self.new[which], names=names)


def read_control_points(path: AnyPath, *, crs: projections.ProjectionLike | None = None) -> ControlPoints:
    """Read control points from a table separated by commas, semicolons, tabs or spaces, or from GDAL's `-gcp`.

    Without a header the columns are x and y on the old map and true x and y, optionally with an id before them, and
    residuals after them as in a link table of ArcGIS. With a header they have any usual names (x_old, y_old, x_new,
    y_new; QGIS's sourceX, sourceY, mapX, mapY), or, for true places, lon and lat. Points not enabled are left out,
    with a notice. Any number of `-gcp pixel line easting northing [elevation]` may stand on a line, or in a command.

    Parameters
    ----------
    path : str or path
        A text file of three points or more.
    crs : projections.ProjectionLike, optional
        The CRS of the true places: anything that a `Projection` is made from. By default it is the CRS stated in the
        file, by QGIS's line `#CRS:` or GDAL's `-a_srs`; if both are given and differ, this one is used, with a notice.
        If the header says so, or most points are within 180 and 90, the true places are longitudes and latitudes in
        degrees and are projected; otherwise they are coordinates of the CRS, in its unit.

    Returns
    -------
    ControlPoints
        Places (n, 2) on the old map, in any unit, and true places in metres; the points' names, and their CRS.

    Raises
    ------
    ValueError
        For files that cannot be read, headers that lack a column, rows without numbers, longitudes and latitudes
        without a CRS, fewer than three points, and points on one line.
    ProjectionError
        For the CRS.

    References
    ----------
    QGIS User Guide, Georeferencer, whose files of points may be given; GDAL, gdal_translate, option -gcp.

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
    projection = None if crs is None else projections.Projection.from_user_input(crs)
    path = check_path("points file", path)
    text = f"Invalid points file '{path}'."
    content = read_text(path, text)
    table = _gcps(content, text) if set(_GCP) & set(content.split()) else _table(content, text)
    names: list[str] = []
    values: list[list[float]] = []
    disabled = 0
    for number, row in table.rows:
        cells = dict(zip(table.columns, row, strict=False))
        if cells.get("enable", "1").strip() in ("0", "false"):
            disabled += 1
            continue
        try:
            values.append([number_of(cells[name]) for name in _NUMBERS])
        except (KeyError, ValueError) as error:
            numbers = f"must have numbers for {', '.join(_NUMBERS)}.{comma_hint(row)}"
            raise ValueError(f"{text} Line {number} {numbers}") from error
        names.append(cells.get("id", "").strip() or str(len(names) + 1))
    if disabled:
        tell(f"{disabled} control point(s) of '{path}' are not enabled and are left out.")
    places = np.array(values).reshape(-1, 4)
    if len(places) < _LEAST:
        raise ValueError(f"{text} It has {len(places)} control points; there must be at least {_LEAST}.")
    try:
        new, plane, note = _in_plane(places[:, 2:], table, projection, path)
        return ControlPoints(places[:, :2], new, tuple(names), note, plane)
    except projections.ProjectionError:
        raise
    except ValueError as error:
        raise ValueError(f"{text} {error}") from error


class _PointTable(NamedTuple):
    """A table of control points."""

    columns: list[str]  # names
    is_degrees: bool  # True if the true places are named lon and lat
    rows: list[tuple[int, list[str]]]  # with the numbers of their lines
    crs: str  # as stated, or ""


def _in_plane(
    new: FloatArray, table: _PointTable, given: projections.Projection | None, path: Path
) -> tuple[FloatArray, projections.Projection | None, str]:
    """True places in metres, the CRS of their plane, and a remark on doubtful ones; raises ValueError."""
    # Messages of errors lack their beginning, which names the file.
    try:
        stated = projections.crs_of(table.crs) if table.crs else None
        if stated is not None and not stated.is_geographic:
            plane = projections.Projection.from_user_input(table.crs)
    except ValueError as error:
        if given is None:
            raise ValueError(f"It states a CRS that is not a plane of the Earth; name another. {error}") from error
        stated = None
    if stated is not None and not stated.is_geographic:
        if given is None:
            projections.tell_of_degrees(stated, np.hstack([new, new]), f"'{path}'", "control point")
            return _in_metres(new, plane, table.is_degrees), plane, ""
        own, other = projections.projected_crs_of(given), projections.projected_crs_of(plane)
        is_same = own is not None and other is not None and np.array_equal(own.to_metres, other.to_metres)
        if not (is_same and other is not None and projections.same_map(given, other.wkt) is not None):
            tell(f"'{path}' states the CRS {stated.name}; its coordinates are taken as those of {given.label}.")
    elif stated is not None and given is not None and _are_mostly_degrees(new):
        return np.stack(given(*projections.data_crs_of(given, stated).degrees(*new.T)), axis=-1), given, ""
    if given is not None:
        return _in_metres(new, given, table.is_degrees), given, ""
    if table.is_degrees or stated is not None:
        raise ValueError("Its truth is longitudes and latitudes; a CRS is needed that makes a plane of them.")
    if (np.abs(new) <= _DEGREES).all():
        return new, None, "The truth is within 180 and 90: if these are degrees, and not metres, a CRS is needed."
    return new, None, ""


def _are_mostly_degrees(new: FloatArray) -> bool:
    """True if most places are within 180 and 90."""
    return bool((np.abs(new) <= _DEGREES).all(axis=1).mean() > 0.5)


def _in_metres(new: FloatArray, projection: projections.Projection, is_degrees: bool) -> FloatArray:
    """True places in metres of a projection's plane, from degrees or from coordinates of the CRS."""
    if is_degrees or _are_mostly_degrees(new):
        return np.stack(projection(*projections.check_degrees(*new.T)), axis=-1)
    plane = projections.projected_crs_of(projection)
    with np.errstate(over="ignore", invalid="ignore"):  # points that are not finite are refused later, by name
        return new if plane is None else np.asarray(new @ plane.to_metres.T)


def _table(content: str, text: str) -> _PointTable:
    """The rows of a table with or without a header."""
    rows = rows_of_text(content, text)
    first = rows[0][1]
    stated = next((match[1].strip() for line in content.splitlines() if (match := _CRS_LINE.match(line))), "")
    crs = "" if stated.lower() == "none" else stated
    if not is_number(first[-1]):
        found = [re.sub(r"[\s_]", "", word.lower()) for word in first]
        usual = {column: next((name for name in names if name in found), None) for column, names in _COLUMNS.items()}
        if missing := [name for name in _NUMBERS if usual[name] is None]:
            need = "x_old, y_old, x_new and y_new"
            raise ValueError(f"{text} Its header must name {need}; it has no {', '.join(missing)}.")
        ours = {found.index(name): column for column, name in usual.items() if name is not None}
        columns = [ours.get(place, f"other {place}") for place in range(len(found))]
        return _PointTable(columns, str(usual["x_new"]).startswith("lon"), rows[1:], crs)
    allowed = {4: _NUMBERS, 5: ("id", *_NUMBERS), len(_LINK_TABLE): _LINK_TABLE}
    if len(first) not in allowed:
        must = f"it must have 4 columns, {', '.join(_NUMBERS)}, or 5, an id first, or 8, with residuals last"
        raise ValueError(f"{text} Without a header {must}; it has {len(first)}.")
    if len(first) == len(_LINK_TABLE) and all(cell.strip().lstrip("+-").isdigit() for _, row in rows for cell in row):
        message = f"{text} It has 8 columns of whole numbers. With decimal commas, semicolons must separate columns."
        raise ValueError(message)
    return _PointTable([*allowed[len(first)]], False, rows, crs)


def _gcps(content: str, text: str) -> _PointTable:
    """The numbers after each `-gcp` of a text, and the CRS of an option `-a_srs` or `-s_srs`."""
    rows: list[tuple[int, list[str]]] = []
    words: list[tuple[int, str]] = []
    crs = ""
    for number, line in enumerate(content.splitlines(), start=1):
        try:
            found = shlex.split(line.strip().removesuffix("\\").removesuffix("^"), comments=True)
        except ValueError as error:  # an open quotation mark
            raise ValueError(f"{text} Line {number} has a quotation mark that does not end on the line.") from error
        for word in found:
            # GDAL's newer commands write the numbers of a point as one word, 100,-150,500187,3999702.
            numbers = word.split(",")
            are_parts = len(numbers) >= len(_NUMBERS) and all(map(is_number, numbers))
            words += [(number, part) for part in (numbers if are_parts else [word])]
    for place, (number, word) in enumerate(words):
        if word in _GCP:
            behind = [one for _, one in words[place + 1 : place + 6]]
            count = next((k for k, one in enumerate(behind) if not is_number(one)), len(behind))
            if count < len(_NUMBERS):
                raise ValueError(f"{text} Line {number} must have -gcp pixel line easting northing [elevation].")
            rows.append((number, behind[: len(_NUMBERS)]))
        elif word in _STATED_BY and place + 1 < len(words):
            crs = words[place + 1][1]
    return _PointTable([*_NUMBERS], False, rows, crs)
