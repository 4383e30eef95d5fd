"""The way back: places on an old map of places in truth."""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.applications.mosaics import check_pixels, open_image
from projdist.applications.oldmaps.field import OldMap, hull_nodes
from projdist.matrices import Affine
from projdist.projections import Projection, projected_crs_of
from projdist.support import check_choice, check_instance, check_number, check_path

_STEPS, _CONVERGED = 30, 1e-8  # of Newton's method; of the extent of the old map's points


def old_places(found: OldMap, new: FloatArray) -> FloatArray:
    """Places (m, 2) on the old map that the fit brings to places in truth; NaN where there are none, or it folds.

    Newton's method from where the affine fit has them.
    """
    fit = found.fit
    old = found.rectifications["affine"].affine.inverse()(new)
    enough = _CONVERGED * float(np.ptp(found.fitted.old, axis=0).max())
    moving = np.arange(len(new))
    for _ in range(_STEPS):
        here = old[moving]
        step = np.linalg.solve(_regular(fit.jacobian(here)), (new[moving] - fit(here))[..., None])[..., 0]
        old[moving] = here + step
        moving = moving[~(np.hypot(*step.T) <= enough)]
        if not moving.size:
            break
    old[moving] = np.nan
    known = np.flatnonzero(np.isfinite(old[:, 0]))
    old[known[np.isnan(found.local_jacobian(old[known])[:, 0, 0])]] = np.nan
    return old


def _regular(J: FloatArray) -> FloatArray:
    """Matrices, the identity for what cannot be inverted."""
    return np.where((np.linalg.det(J) == 0.0)[:, None, None], np.eye(2), J)


# ---- scans ---------------------------------------------------------------------------------------


_BEYOND = 0.05  # of a side: points as far outside are still on a scan that was cut


def scan_extent(found: OldMap, width: int, height: int, invalid: str) -> tuple[float, float, float, float]:
    """The old map's coordinates of the left, right, bottom and top side of a scan in whose pixels its points are.

    Rows are counted downwards, or, where that is not so, upwards, or downwards by negative numbers as QGIS does. Raises
    ValueError, which begins as told, where points are outside.
    """
    old = found.points.old
    if found.is_mirrored:
        extent = 0.0, float(width), float(height), 0.0
    elif old[:, 1].mean() < 0:
        extent = 0.0, float(width), -float(height), 0.0
    else:
        extent = 0.0, float(width), 0.0, float(height)
    share = (old - [extent[0], min(extent[2:])]) / [width, height]
    outside = np.asarray((np.abs(share - 0.5) > 0.5 + _BEYOND).any(axis=1))
    if outside.any():
        name = found.points.names[int(np.argmax(outside))]
        raise ValueError(
            f"{invalid} It has {width} by {height} pixels, and {int(outside.sum())} of {len(outside)} control points "
            f"lie outside, as '{name}'."
        )
    return extent


# ---- rectifying ----------------------------------------------------------------------------------


RECTIFIED_BY = ("fit", "mdt", "affine", "helmert")
"""By the map that was fitted, or by one of the rectifications."""

_MOST_PIXELS = 1e8
_COARSEST = 32  # pixels between the places that are computed; those between are interpolated
_INTERPOLATION = 0.05  # pixels of the scan that this may cost
_AROUND = 0.1  # of the affine fit's sides: farther out no fitted map is drawn
_RIM = 33  # places along a side of the scan, by which the extent is found
_WHOLE = 1e-6  # of a pixel: a side that ends so near to a pixel's edge ends there
_ROWS = 256  # drawn at a time
_DEEP = 257  # 65535 / 255
_GREY = ("1", "L", "LA", "La")


class RectifiedScan(NamedTuple):
    """Rows from north to south of square pixels, `side` metres large, from the corner at `left`, `top` in metres.

    `pixels` (height, width, 2 or 4) of uint8: grey or red, green and blue, and alpha, 0 where the scan is not.
    """

    pixels: AnyArray
    left: float
    top: float
    side: float


class _Scan(NamedTuple):
    """Pixels (height, width, 1 or 3) and where places on the old map have them: 0, 0 in the middle of the first."""

    pixels: AnyArray
    size: tuple[int, int]
    place: Affine


class _Inverse(NamedTuple):
    """The way from truth to the pixels of a scan."""

    found: OldMap
    by: str
    scan: _Scan

    def __call__(self, new: FloatArray) -> FloatArray:
        """Pixels (m, 2); NaN where the fit has none, or folds."""
        if self.by == "fit":
            return self.scan.place(old_places(self.found, new))
        return self.scan.place(self.found.rectifications[self.by].affine.inverse()(new))


def rectify(
    found: OldMap, image: str | os.PathLike[str], *, by: str = "fit", resolution: float | None = None
) -> RectifiedScan:
    """The scan of an old map as a picture of the true plane, north up.

    Parameters
    ----------
    found : OldMap
        The old map, whose control points are in pixels of the scan.
    image : str or path
        The scan, in any format that Pillow reads; deep colours become 8 bits.
    by : str
        "fit": by the map that was fitted, which brings control points to their places as well as it does and bends all
        between; "mdt", "affine" or "helmert": by that linear rectification, which keeps what is straight straight.
    resolution : float, optional
        Metres of a pixel's side; by default two digits of what a pixel of the scan has on average.

    Returns
    -------
    RectifiedScan

    Raises
    ------
    ValueError
        For what is no image, points outside of it, an unknown `by`, and too many pixels.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from PIL import Image
    >>> from projdist.applications.oldmaps import ControlPoints
    >>> from projdist import old_map
    >>> points = ControlPoints([[0, 0], [8, 0], [0, 4], [8, 4]], [[0, 40], [80, 40], [0, 0], [80, 0]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "scan.png")
    ...     Image.fromarray(np.arange(32, dtype=np.uint8).reshape(4, 8)).save(path)
    ...     sheet = rectify(old_map(points, model="affine"), path)
    >>> sheet.pixels[..., 0].tolist() == np.arange(32).reshape(4, 8).tolist(), sheet.side
    (True, 10.0)
    """
    check_instance("old map", found, OldMap, "an OldMap")
    check_choice("rectification", by, RECTIFIED_BY)
    if resolution is not None and not 0.0 < check_number("resolution", resolution) < np.inf:
        raise ValueError(f"Invalid resolution '{resolution:g}'. It must be positive.")
    scale = float(found.rectifications["mdt"].parts.scale)
    side = float(f"{scale:.2g}") if resolution is None else float(resolution)
    scan = _read(check_path("image", image), found, max(int(side / scale), 1))
    inverse = _Inverse(found, by, scan)
    west, south, east, north = _bounds(found, by, scan)
    first, last = np.floor(west / side + _WHOLE), np.ceil(north / side - _WHOLE)
    columns, rows = int(np.ceil(east / side - _WHOLE) - first), int(last - np.floor(south / side + _WHOLE))
    if columns * rows > _MOST_PIXELS:
        raise ValueError(f"Invalid resolution '{side:g}'. It makes {columns * rows:.3g} pixels; {_MOST_PIXELS:g} do.")
    left, top = float(first * side), float(last * side)

    def places(step: float, shift: float = 0.0) -> FloatArray:
        """Pixels of the scan (2, rows, columns) at every so many pixels of the picture, the first in the middle."""
        u, v = np.meshgrid(*(0.5 + step * (np.arange(np.ceil(n / step) + 1) + shift) for n in (columns, rows)))
        found = inverse(np.stack([left + side * u.ravel(), top - side * v.ravel()], axis=-1))
        return np.moveaxis(found.reshape(*u.shape, 2), -1, 0)

    step = _COARSEST
    while True:
        lattice = places(step)
        middles = 0.25 * (lattice[:, 1:, 1:] + lattice[:, :-1, 1:] + lattice[:, 1:, :-1] + lattice[:, :-1, :-1])
        away = np.hypot(*(places(step, 0.5)[:, :-1, :-1] - middles))
        if step == 1 or not np.nanmax(away, initial=0.0) > _INTERPOLATION:
            return RectifiedScan(_drawn(scan.pixels, lattice, step, (rows, columns)), left, top, side)
        step //= 2


def _read(path: str | os.PathLike[str], found: OldMap, coarser: int) -> _Scan:
    """The scan, its pixels by so many together."""
    from PIL import Image  # slow to load, and few need it

    text = f"Invalid image '{path}'."
    with open_image(path, text) as image:
        check_pixels(image)
        size = image.size
        if image.mode.startswith("I"):
            image = Image.fromarray(np.clip(np.asarray(image).astype(np.int64) // _DEEP, 0, 255).astype(np.uint8))
        plain = image.convert("L" if image.mode in _GREY else "RGB")
        pixels = np.asarray(plain.reduce(coarser))
    left, right, bottom, top = scan_extent(found, *size, text)
    spread = np.array([size[0] / (right - left), size[1] / (bottom - top)]) / coarser
    return _Scan(np.atleast_3d(pixels), size, Affine(np.diag(spread), -0.5 - spread * [left, top]))


def _bounds(found: OldMap, by: str, scan: _Scan) -> tuple[float, float, float, float]:
    """West, south, east and north of the scan in truth; of a fit not far beyond what the affine fit has."""
    height, width = scan.pixels.shape[:2]
    u, v = np.meshgrid(*(np.linspace(-0.5, n - 0.5, _RIM) for n in (width, height)))
    old = scan.place.inverse()(np.stack([u.ravel(), v.ravel()], axis=-1))
    affine = found.rectifications["affine" if by == "fit" else by].affine(old)
    low, high = affine.min(axis=0), affine.max(axis=0)
    if by == "fit":
        new = found.fit(old)[~np.isnan(found.local_jacobian(old)[:, 0, 0])]
        around = _AROUND * (high - low)
        low, high = np.maximum(new.min(axis=0), low - around), np.minimum(new.max(axis=0), high + around)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _drawn(scan: AnyArray, lattice: FloatArray, step: int, shape: tuple[int, int]) -> AnyArray:
    """The picture, whose pixels lie in the scan as the lattice says; bilinear, some rows at a time."""
    from scipy.ndimage import map_coordinates  # slow to load, and few need it

    rows, columns = shape
    height, width = scan.shape[:2]
    drawn = np.zeros((rows, columns, scan.shape[2] + 1), np.uint8)
    for first in range(0, rows, _ROWS):
        last = min(first + _ROWS, rows)
        grid = np.meshgrid(np.arange(first, last) / step, np.arange(columns) / step, indexing="ij")
        u, v = (map_coordinates(values, grid, order=1, mode="nearest") for values in lattice)
        with np.errstate(invalid="ignore"):
            inside = (np.abs(u - 0.5 * (width - 1)) <= 0.5 * width) & (np.abs(v - 0.5 * (height - 1)) <= 0.5 * height)
        at = np.stack([v[inside], u[inside]])
        for band in range(scan.shape[2]):
            values = map_coordinates(scan[..., band], at, np.float32, order=1, mode="nearest")
            drawn[first:last, :, band][inside] = np.rint(values).astype(np.uint8)
        drawn[first:last, :, -1][inside] = 255
    return drawn


# ---- several old maps -----------------------------------------------------------------------------


_SAME_PLACE = 0.01  # metres: zones in feet have their origins rounded to 0.1 mm
_COMMON_ROWS = 50  # of places, and places in a row
_BY = ("mdt", "affine", "helmert")


class CommonGround(NamedTuple):
    """Places x, y (n,) in metres of the true plane, Jacobians (k, n, 2, 2) of k maps, and what each place counts."""

    x: FloatArray
    y: FloatArray
    jacobians: FloatArray
    area: FloatArray


def common_ground(maps: Sequence[OldMap], *, by: str = "mdt") -> CommonGround:
    """Several old maps over the ground that all of them show: what `mean_plane_map` takes.

    Each is a map of the same true plane, in its own unit, turned and stretched as its paper is. So each is taken after
    its own rectification, which has the scale 1 on average; what is left is the distortion that no affine map mends.
    The mean of these fields is the map that is nearest to all the old ones: what they have in common, as maps that were
    copied from one another, or surveyed in the same way, do. Its own distortion is the common part, its mean distance
    from them what each has for itself.

    Parameters
    ----------
    maps : sequence of OldMap
        Two or more, whose control points' truth is in one plane.
    by : str
        The rectification that each is taken after: "mdt", "affine" or "helmert", which leaves a stretch as it is.

    Returns
    -------
    CommonGround
        x, y, jacobians and area, by area in truth, where the hulls of all maps' control points overlap and none folds.

    Raises
    ------
    ValueError
        For fewer than two maps, an unknown rectification, truth in planes that are not the same, and maps that have no
        ground in common.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the mean of linear maps.

    Examples
    --------
    Two sheets of which one grows to the east and one to the north; their mean grows half as fast to both.

    >>> import numpy as np
    >>> from projdist.applications.oldmaps import ControlPoints
    >>> from projdist import mean_plane_map, old_map
    >>> x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9))
    >>> true = np.stack([x.ravel(), y.ravel()], axis=-1)
    >>> east, north = (np.stack(m, axis=-1) for m in ((np.exp(0.4 * true[:, 0]), true[:, 1]),
    ...                                               (true[:, 0], np.exp(0.4 * true[:, 1]))))
    >>> ground = common_ground([old_map(ControlPoints(old, true), model="polynomial3") for old in (east, north)])
    >>> mean = mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area, degree=4)
    >>> J = mean.jacobian([0.1, 0.9], [0.5, 0.5])
    >>> round(float(np.log(J[1, 0, 0] / J[0, 0, 0]) / 0.8), 1)
    0.2
    """
    check_choice("rectification", by, _BY)
    for one in maps:
        check_instance("old map", one, OldMap, "an OldMap")
    if len(maps) < 2:
        raise ValueError(f"Invalid old maps. There must be two or more, not {len(maps)}.")
    _check_one_plane(maps)
    places, weights, _ = min((hull_nodes(one.fitted.new, _COMMON_ROWS) for one in maps), key=lambda found: found[2])
    inside = np.all([_is_within(places, one.fitted.new) for one in maps], axis=0)
    places, weights = places[inside], weights[inside]
    fields = np.array([one.corrected(one.local_jacobian(old_places(one, places)), by) for one in maps])
    known = np.isfinite(fields).all(axis=(0, 2, 3))
    if not known.any():
        raise ValueError("Invalid old maps. There is no ground that all of them show.")
    x, y = places[known].T
    return CommonGround(x, y, fields[:, known], weights[known] / weights[known].sum())


def _check_one_plane(maps: Sequence[OldMap]) -> None:
    """Raise ValueError where the control points are in CRSs in which the same ground is elsewhere, in metres."""
    known = [(one.points.new, one.points.crs) for one in maps if one.points.crs is not None]
    for (new, crs), (_, other) in itertools.pairwise(known):
        if not _is_same_ground(new, crs, other):
            both = f"{crs.label} and {other.label}"
            raise ValueError(f"Invalid old maps. Their truth is in {both}; it must be in one plane (--crs, crs=).")


def _is_same_ground(new: FloatArray, crs: Projection, other: Projection) -> bool:
    """Whether places in metres of the plane of a CRS have the same in that of another."""
    plane = projected_crs_of(crs)
    if crs.definition == other.definition or plane is None or not plane.has_inverse:
        return True
    u, v = np.linalg.solve(plane.to_metres, new.T)
    x, y = other(*plane.inverse(u, v, np.inf))
    return bool((np.hypot(x - new[:, 0], y - new[:, 1]) <= _SAME_PLACE).all())


def _is_within(places: FloatArray, points: FloatArray) -> BoolArray:
    """Which places lie in the convex hull of points."""
    from scipy.spatial import ConvexHull  # slow to load, and few need it

    hull = ConvexHull(points)
    rounding = 1e-9 * float(np.ptp(points))
    return np.asarray((places @ hull.equations[:, :2].T + hull.equations[:, 2] <= rounding).all(axis=1))
