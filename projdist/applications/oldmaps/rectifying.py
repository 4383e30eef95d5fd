"""From true places back to old maps: rectified scans, and several old maps on their common ground."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from projdist._typing import AnyArray, AnyPath, FloatArray
from projdist.applications.mosaics import check_pixels, open_image
from projdist.applications.oldmaps.field import RECTIFICATIONS, OldMap, hull_nodes
from projdist.matrices import Affine
from projdist.projections import projected_crs_of
from projdist.support import check_choice, check_instance, check_number, check_path

_STEPS, _CONVERGED = 30, 1e-8  # of Newton's method: their number, and the last, of the extent of the old map's points


def old_places(found: OldMap, new: FloatArray) -> FloatArray:
    """Places (m, 2) on the old map that the fit maps to true places; NaN if there are none, and on folds."""
    # By Newton's method, starting from the affine fit.
    fit = found.fit
    old = found.rectifications["affine"].affine.inverse()(new)
    enough = _CONVERGED * float(np.ptp(found.fitted.old, axis=0).max())
    moving = np.arange(len(new))
    for _ in range(_STEPS):
        here = old[moving]
        J = fit.jacobian(here)
        J[np.linalg.det(J) == 0.0] = np.eye(2)
        step = np.linalg.solve(J, (new[moving] - fit(here))[..., None])[..., 0]
        old[moving] = here + step
        moving = moving[~(np.hypot(*step.T) <= enough)]
        if not moving.size:
            break
    old[moving] = np.nan
    known = np.flatnonzero(np.isfinite(old[:, 0]))
    old[known[np.isnan(found.local_jacobian(old[known])[:, 0, 0])]] = np.nan
    return old


_BEYOND = 0.05  # of a side: points may be this far outside, as scans are cropped


def scan_extent(found: OldMap, width: int, height: int, invalid: str) -> tuple[float, float, float, float]:
    """Coordinates of the left, right, bottom and top side of a scan, for control points in its pixels."""
    # Rows are counted downwards if the map is mirrored, else upwards, or downwards by negative numbers as in QGIS.
    # Raises ValueError, whose message begins with `invalid`, for points outside.
    old = found.points.old
    bottom, top = (height, 0) if found.is_mirrored else (-height, 0) if old[:, 1].mean() < 0 else (0, height)
    extent = 0.0, float(width), float(bottom), float(top)
    share = (old - [extent[0], min(extent[2:])]) / [width, height]
    outside = np.asarray((np.abs(share - 0.5) > 0.5 + _BEYOND).any(axis=1))
    if outside.any():
        name = found.points.names[int(np.argmax(outside))]
        some = f"{int(outside.sum())} of {len(outside)} control points lie outside, as '{name}'"
        raise ValueError(f"{invalid} It has {width} by {height} pixels, and {some}.")
    return extent


# ---- rectifying ----------------------------------------------------------------------------------

RECTIFIED_BY = ("fit", *RECTIFICATIONS)
"""By the fitted map, or by one of the rectifications."""

_MOST_PIXELS = 1e8
_COARSEST = 32  # pixels between the places that are computed; those between are interpolated
_INTERPOLATION = 0.05  # pixels of the scan: largest error of this interpolation
_AROUND = 0.1  # of the affine fit's sides: a fitted map is not drawn farther out
_RIM = 33  # places along a side of the scan, by which the extent is found
_WHOLE = 1e-6  # of a pixel: a side that ends this near to a pixel's edge ends there
_ROWS = 256  # of the picture, drawn at a time
_GREY = ("1", "L", "LA", "La")


class RectifiedScan(NamedTuple):
    """Rows from north to south of square pixels, `side` metres large, from the corner at `left`, `top` in metres."""

    pixels: AnyArray  #: (height, width, 2 or 4) of uint8: grey or colours, and alpha, 0 where the scan is not
    left: float
    top: float
    side: float


def rectify(found: OldMap, image: AnyPath, *, by: str = "fit", resolution: float | None = None) -> RectifiedScan:
    """The scan of an old map as a picture of the true plane, north up.

    Parameters
    ----------
    found : OldMap
        The old map, whose control points are in pixels of the scan.
    image : str or path
        The scan, in any format that Pillow reads; colours of more than 8 bits are reduced to 8.
    by : str
        "fit": by the fitted map, which moves control points near their true places and bends lines; "mdt", "affine" or
        "helmert": by that linear rectification, which keeps lines straight.
    resolution : float, optional
        Side of a pixel in metres; by default the mean side of a pixel of the scan, to two digits.

    Returns
    -------
    RectifiedScan

    Raises
    ------
    ValueError
        For a file that is not an image, points outside it, an unknown `by`, and too many pixels.

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
    pixels, to_pixels = _read(check_path("image", image), found, max(int(side / scale), 1))
    west, south, east, north = _bounds(found, by, pixels.shape, to_pixels)
    first, last = np.floor(west / side + _WHOLE), np.ceil(north / side - _WHOLE)
    columns, rows = int(np.ceil(east / side - _WHOLE) - first), int(last - np.floor(south / side + _WHOLE))
    if columns * rows > _MOST_PIXELS:
        raise ValueError(f"Invalid resolution '{side:g}'. It makes {columns * rows:.3g} pixels; {_MOST_PIXELS:g} do.")
    left, top = float(first * side), float(last * side)

    def places(step: float, shift: float = 0.0) -> FloatArray:
        """Pixels of the scan (2, rows, columns) at every `step` pixels of the picture, from the first one's middle."""
        u, v = np.meshgrid(*(0.5 + step * (np.arange(np.ceil(n / step) + 1) + shift) for n in (columns, rows)))
        new = np.stack([left + side * u.ravel(), top - side * v.ravel()], axis=-1)
        old = old_places(found, new) if by == "fit" else found.rectifications[by].affine.inverse()(new)
        return np.moveaxis(to_pixels(old).reshape(*u.shape, 2), -1, 0)

    step = _COARSEST
    while True:
        lattice = places(step)
        middles = 0.25 * (lattice[:, 1:, 1:] + lattice[:, :-1, 1:] + lattice[:, 1:, :-1] + lattice[:, :-1, :-1])
        away = np.hypot(*(places(step, 0.5)[:, :-1, :-1] - middles))
        if step == 1 or not np.nanmax(away, initial=0.0) > _INTERPOLATION:
            return RectifiedScan(_drawn(pixels, lattice, step, (rows, columns)), left, top, side)
        step //= 2


def _read(path: AnyPath, found: OldMap, coarser: int) -> tuple[AnyArray, Affine]:
    """The pixels (height, width, 1 or 3) of a scan, reduced by a whole factor, and the map from the old map to them."""
    # The middle of the first pixel is at 0, 0.
    from PIL import Image  # slow to load, and few need it

    text = f"Invalid image '{path}'."
    with open_image(path, text) as image:
        check_pixels(image)
        size = image.size
        if image.mode.startswith("I"):
            image = Image.fromarray(np.clip(np.asarray(image).astype(np.int64) // 257, 0, 255).astype(np.uint8))
        pixels = np.asarray(image.convert("L" if image.mode in _GREY else "RGB").reduce(coarser))
    left, right, bottom, top = scan_extent(found, *size, text)
    spread = np.array([size[0] / (right - left), size[1] / (bottom - top)]) / coarser
    return np.atleast_3d(pixels), Affine(np.diag(spread), -0.5 - spread * [left, top])


def _bounds(found: OldMap, by: str, shape: tuple[int, ...], to_pixels: Affine) -> tuple[float, float, float, float]:
    """True west, south, east and north of the scan, by a fit at most somewhat beyond those by the affine fit."""
    height, width = shape[:2]
    u, v = np.meshgrid(*(np.linspace(-0.5, n - 0.5, _RIM) for n in (width, height)))
    old = to_pixels.inverse()(np.stack([u.ravel(), v.ravel()], axis=-1))
    affine = found.rectifications["affine" if by == "fit" else by].affine(old)
    low, high = affine.min(axis=0), affine.max(axis=0)
    if by == "fit":
        new = found.fit(old)[~np.isnan(found.local_jacobian(old)[:, 0, 0])]
        around = _AROUND * (high - low)
        low, high = np.maximum(new.min(axis=0), low - around), np.minimum(new.max(axis=0), high + around)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _drawn(scan: AnyArray, lattice: FloatArray, step: int, shape: tuple[int, int]) -> AnyArray:
    """The picture: the scan's pixels at places interpolated from the lattice, linearly, some rows at a time."""
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

_SAME_PLACE = 0.01  # metres; origins of zones in feet are rounded to 0.1 mm
_COMMON_ROWS = 50  # of places, and places in a row


class CommonGround(NamedTuple):
    """Places x, y (n,) in metres of the true plane, Jacobians (k, n, 2, 2) of k maps, and weights of the places."""

    x: FloatArray
    y: FloatArray
    jacobians: FloatArray
    area: FloatArray


def common_ground(maps: Sequence[OldMap], *, by: str = "mdt") -> CommonGround:
    """Jacobian fields of several old maps over the ground that all of them show, as `mean_plane_map` takes them.

    Each is a map of the same true plane, in its own unit, rotated and stretched like its paper. Each is therefore taken
    after its own rectification, with scale 1 on average; what remains is the distortion that no affine map removes.
    The mean of these fields is the map nearest to all of them. Its distortion is what they have in common, as maps that
    were copied from each other or surveyed in the same way have; its mean distance from them is what they do not.

    Parameters
    ----------
    maps : sequence of OldMap
        Two or more, with true places in one plane.
    by : str
        The rectification after which each is taken: "mdt", "affine" or "helmert", which keeps a stretch.

    Returns
    -------
    CommonGround
        Places where the hulls of all maps' control points overlap and none folds, weighted by true area.

    Raises
    ------
    ValueError
        For fewer than two maps, an unknown rectification, true places in different planes, no common ground.

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
    from scipy.spatial import ConvexHull  # slow to load, and few need it

    check_choice("rectification", by, RECTIFICATIONS)
    for one in maps:
        check_instance("old map", one, OldMap, "an OldMap")
    if len(maps) < 2:
        raise ValueError(f"Invalid old maps. At least two are needed, not {len(maps)}.")
    known = [(one.points.new, one.points.crs) for one in maps if one.points.crs is not None]
    for (new, crs), (_, other) in itertools.pairwise(known):
        # The same ground must have the same place in metres in both planes.
        plane = projected_crs_of(crs)
        if crs.definition == other.definition or plane is None or not plane.has_inverse:
            continue
        u, v = np.linalg.solve(plane.to_metres, new.T)
        x, y = other(*plane.inverse(u, v, np.inf))
        if not (np.hypot(x - new[:, 0], y - new[:, 1]) <= _SAME_PLACE).all():
            both = f"{crs.label} and {other.label}"
            raise ValueError(f"Invalid old maps. Their truth is in {both}; it must be in one plane (--crs, crs=).")
    places, weights, _ = min((hull_nodes(one.fitted.new, _COMMON_ROWS) for one in maps), key=lambda found: found[2])
    for one in maps:
        hull = ConvexHull(one.fitted.new)
        rounding = 1e-9 * float(np.ptp(one.fitted.new))
        inside = (places @ hull.equations[:, :2].T + hull.equations[:, 2] <= rounding).all(axis=1)
        places, weights = places[inside], weights[inside]
    fields = np.array([one.corrected(one.local_jacobian(old_places(one, places)), by) for one in maps])
    finite = np.isfinite(fields).all(axis=(0, 2, 3))
    if not finite.any():
        raise ValueError("Invalid old maps. There is no ground that all of them show.")
    x, y = places[finite].T
    return CommonGround(x, y, fields[:, finite], weights[finite] / weights[finite].sum())
