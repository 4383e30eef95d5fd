"""Canvases that hold all images of a mosaic, in a plane or on a map of the sphere, and georeferences of mosaics."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist._typing import AnyPath, BoolArray, FloatArray
from projdist.applications.mosaics.homographies import corners, jacobians, places
from projdist.applications.mosaics.images import Box, Piece, Pixels, opencv, reduced, shift
from projdist.projections import ProjectedCrs
from projdist.support import replacing

_BACK = 1e-6  # radii: how closely a map and its inverse must return to a place
_LATTICE, _PASSES = 300, 3  # cells a side of the grid that finds the visible part of a map, in ever finer passes
_AROUND = 0.05  # margin, of the extent of the images' points
# Directions are interpolated between pixels this far apart, in radians: the error is at most its square over eight, in
# radii, a fiftieth of a pixel of a picture with 1500 per radian.
_STEP, _LARGEST_STEP = 0.01, 16
_UNBENT = 1e-3  # by which the square of an interpolated unit vector may be below 1; across a cut it is far below


def canvas_size(extent: FloatArray, most_pixels: float) -> tuple[int, int, float, str]:
    """Width and height of a canvas of at most so many pixels, its scale, and a note if that is below 1."""
    scale = min(1.0, float(np.sqrt(most_pixels / np.prod(extent))))
    width, height = (max(1, int(np.ceil(round(scale * side, 6)))) for side in extent)
    full = f"{extent[0]:.0f} x {extent[1]:.0f}"
    note = f"The canvas would have {full} pixels: it is drawn at {100 * scale:.3g} %." if scale < 1.0 else ""
    return width, height, scale, note


class Canvas(NamedTuple):
    """A picture that holds all images."""

    width: int  #: pixels
    height: int
    matrices: FloatArray  #: (n, 3, 3), from the images' pixels into it
    scale: float  #: ratio of pixels to those of the frame, below 1 if the frame has too many; then `note` says so
    note: str

    def bounds(self, number: int, size: Sequence[float]) -> Box:
        """The box of an image on the canvas."""
        rim = places(self.matrices[number][None], corners(np.array([size], dtype=float)))[0]
        left, top = np.floor(rim.min(axis=0) + 1e-6).astype(int).tolist()
        right, bottom = np.ceil(rim.max(axis=0) - 1e-6).astype(int).tolist()
        return left, top, right, bottom

    def warped(self, pixels: Pixels, number: int, box: Box) -> Piece:
        """An image drawn in a box of the canvas."""
        cv2 = opencv()
        H, (height, width) = self.matrices[number], pixels.mask.shape
        J = jacobians(H[None], corners(np.array([[float(width), float(height)]])))[1]
        pixels, factor = reduced(pixels, float(np.linalg.svd(J, compute_uv=False).max()))
        H = H @ np.diag([*(1.0 / factor), 1.0])
        # OpenCV counts from the middle of the first pixel.
        to_box = shift(-box[0] - 0.5, -box[1] - 0.5) @ H @ shift(0.5, 0.5)
        shape = box[2] - box[0], box[3] - box[1]
        smooth = {"flags": cv2.INTER_CUBIC, "borderMode": cv2.BORDER_REFLECT_101}
        colours = cv2.warpPerspective(pixels.colours, to_box, shape, **smooth)
        mask = cv2.warpPerspective(pixels.mask, to_box, shape, flags=cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
        return Piece(box[:2], Pixels(colours, mask))

    def cropped(self, box: Box) -> Canvas:
        """The canvas cut to a box."""
        left, top, right, bottom = box
        return self._replace(width=right - left, height=bottom - top, matrices=shift(-left, -top) @ self.matrices)


class Camera(NamedTuple):
    """A camera on the sphere."""

    rotation: FloatArray  # (3, 3), from the camera's right, down and forward
    focal: float  # pixels
    size: tuple[float, float]  # width and height in pixels

    def directions(self, x: FloatArray) -> FloatArray:
        """Vectors (..., 3) towards pixels (..., 2)."""
        centred = (x - 0.5 * np.array(self.size)) / self.focal
        return np.asarray(np.concatenate([centred, np.ones((*x.shape[:-1], 1))], axis=-1) @ self.rotation.T)

    def pixels(self, directions: FloatArray) -> FloatArray:
        """Pixels (..., 2) of vectors (..., 3); NaN behind the camera."""
        seen = directions @ self.rotation
        with np.errstate(divide="ignore", invalid="ignore"):
            x = self.focal * seen[..., :2] / seen[..., 2:] + 0.5 * np.array(self.size)
        return np.where(seen[..., 2:] > 0, x, np.nan)

    def sees(self, directions: FloatArray) -> BoolArray:
        """True for vectors (..., 3) inside the image."""
        x = self.pixels(directions)
        return np.asarray(((x >= 0) & (x <= np.array(self.size))).all(axis=-1))


def angles_of(directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Longitudes, to the right, and latitudes, up, in degrees, of vectors (right, down, forward)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.degrees(np.arctan2(x, z)), np.degrees(np.arctan2(-y, np.hypot(x, z)))


def directions_of(lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Unit vectors (right, down, forward) of longitudes and latitudes in degrees."""
    lam, phi = np.radians(lon), np.radians(lat)
    return np.stack([np.cos(phi) * np.sin(lam), -np.sin(phi), np.cos(phi) * np.cos(lam)], axis=-1)


@dataclass(frozen=True, eq=False)
class SphereCanvas:
    """A picture of a map of the sphere that holds all images of cameras; lengths are in the map's unit."""

    width: int
    height: int
    cameras: tuple[Camera, ...]
    plane: ProjectedCrs
    radius: float  #: of the sphere
    origin: tuple[float, float]  #: coordinates of the upper left corner
    pixel: float  #: side of a pixel
    scale: float  #: ratio of pixels to those of the images, below 1 if these are too many; then `note` says so
    note: str

    def bounds(self, number: int, size: Sequence[float]) -> Box:
        """The box of an image on the canvas."""
        step, rays = self._lattice
        seen = self.cameras[number].sees(rays)
        # A thin image may lie between the nodes, so its own points count, too.
        own = self.places(self.cameras[number].directions(_nodes(size)))
        own = own[np.asarray(np.isfinite(own).all(axis=1))].astype(int)
        nodes = [np.flatnonzero(np.asarray(seen.any(axis=axis))) * step for axis in (0, 1)]
        left, top = (min([*known[:1] - step, *mine]) for known, mine in zip(nodes, own.T, strict=True))
        right, bottom = (max([*known[-1:] + step, *mine]) + 1 for known, mine in zip(nodes, own.T, strict=True))
        return max(int(left), 0), max(int(top), 0), min(int(right), self.width), min(int(bottom), self.height)

    def places(self, directions: FloatArray) -> FloatArray:
        """Pixels (n, 2) of the canvas for vectors (n, 3); not finite off the map."""
        u, v = self.plane.operation.native(*angles_of(directions))
        return np.stack([u - self.origin[0], self.origin[1] - v], axis=-1) / self.pixel

    def warped(self, pixels: Pixels, number: int, box: Box) -> Piece:
        """An image drawn in a box of the canvas."""
        cv2 = opencv()
        pixels, factor = reduced(pixels, self.scale)
        x = self.cameras[number].pixels(self._rays(box)) * factor
        known = np.asarray(np.isfinite(x).all(axis=-1))
        places = np.where(known[..., None], x, -1e4).astype(np.float32)
        # OpenCV counts from the middle of the first pixel.
        across, down = places[..., 0] - np.float32(0.5), places[..., 1] - np.float32(0.5)
        colours = cv2.remap(pixels.colours, across, down, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
        mask = cv2.remap(pixels.mask, across, down, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
        return Piece(box[:2], Pixels(colours, mask))

    def cropped(self, box: Box) -> SphereCanvas:
        """The canvas cut to a box."""
        left, top, right, bottom = box
        origin = self.origin[0] + left * self.pixel, self.origin[1] - top * self.pixel
        return replace(self, width=right - left, height=bottom - top, origin=origin)

    def _exact(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Unit vectors of places on the canvas; NaN off the map."""
        u, v = self.origin[0] + x * self.pixel, self.origin[1] - y * self.pixel
        return directions_of(*self.plane.inverse(u, v, _BACK * self.radius))

    @functools.cached_property
    def _lattice(self) -> tuple[int, FloatArray]:
        """Spacing of nodes in pixels, and the unit vectors of nodes that cover the canvas."""
        step = int(np.clip(_STEP * self.radius / self.pixel, 1, _LARGEST_STEP))
        x, y = np.meshgrid(np.arange(0, self.width + 2 * step, step), np.arange(0, self.height + 2 * step, step))
        return step, self._exact(x.astype(float), y.astype(float))

    def _rays(self, box: Box) -> FloatArray:
        """Unit vectors of the middles of pixels in a box, NaN off the map."""
        step, nodes = self._lattice
        left, top, right, bottom = box
        x, y = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
        row, column = (y[:, 0] // step).astype(int), (x[0] // step).astype(int)
        down, across = (y[:, 0] / step - row)[:, None, None], (x[0] / step - column)[None, :, None]
        above, below = nodes[row], nodes[row + 1]
        rays = (above[:, column] * (1 - across) + above[:, column + 1] * across) * (1 - down)
        rays += (below[:, column] * (1 - across) + below[:, column + 1] * across) * down
        bent = ~(np.einsum("...i,...i->...", rays, rays) > 1.0 - _UNBENT)
        rays[bent] = self._exact(x[bent], y[bent])
        return rays


AnyCanvas = Canvas | SphereCanvas


def sphere_canvas(cameras: Sequence[Camera], plane: ProjectedCrs, radius: float, most_pixels: float) -> SphereCanvas:
    """The canvas of a map with all cameras' images, its pixels as large; raises ValueError if it shows none of them."""
    rays = np.concatenate([camera.directions(_nodes(camera.size)) for camera in cameras])
    u, v = plane.operation.native(*angles_of(rays))
    shown = np.isfinite(u) & np.isfinite(v)
    if not shown.any():
        raise ValueError("Invalid projection for these images. It shows nothing of what they show.")
    low, high = _extent(u[shown], v[shown], cameras, plane, radius)
    # The median scale in the directions of the cameras: the square root of the areal scale.
    h, ratios = 1e-4, []
    for middle in (camera.rotation[:, 2] for camera in cameras):
        axes = np.linalg.svd(middle[None])[2][1:]
        x, y = plane.operation.native(*angles_of(np.array([middle, middle + h * axes[0], middle + h * axes[1]])))
        ratios.append(abs((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])) / (h * radius) ** 2)
    usual = float(np.sqrt(np.nanmedian(np.where(np.isfinite(ratios), ratios, np.nan))))
    usual = usual if np.isfinite(usual) and usual > 0 else 1.0
    pixel = radius * usual / float(np.median([camera.focal for camera in cameras]))
    width, height, scale, note = canvas_size(np.maximum((high - low) / pixel, 1.0), most_pixels)
    return SphereCanvas(width, height, tuple(cameras), plane, radius, (low[0], high[1]), pixel / scale, scale, note)


def _nodes(size: Sequence[float]) -> FloatArray:
    """Pixels (n, 2) spread over an image, including its rim."""
    along = np.linspace(0.0, 1.0, 25)
    return np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2) * size


def _extent(
    u: FloatArray, v: FloatArray, cameras: Sequence[Camera], plane: ProjectedCrs, radius: float
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest coordinates of the visible part of a map."""
    # The images' own points may miss the outermost places next to a cut of the map, so cells of the map are tested.
    points = np.column_stack([u, v])
    low, high = points.min(axis=0), points.max(axis=0)
    low, high = low - _AROUND * (high - low), high + _AROUND * (high - low)
    for _ in range(_PASSES):
        x, y = (np.linspace(low[axis], high[axis], _LATTICE + 1) for axis in (0, 1))
        rays = directions_of(*plane.inverse(*np.meshgrid(x, y), _BACK * radius))
        seen = np.asarray(np.any([camera.sees(rays) for camera in cameras], axis=0))
        if not seen.any():
            break
        columns, rows = np.flatnonzero(seen.any(axis=0)), np.flatnonzero(seen.any(axis=1))
        cell = (high - low) / _LATTICE
        low, high = (np.array([x[columns[k]], y[rows[k]]]) + way * cell for k, way in ((0, -1.0), (-1, 1.0)))
    return low, high


# ---- georeference --------------------------------------------------------------------------------

_MIDDLE = shift(0.5, 0.5)  # to the middle of the first pixel, at which world files begin


class Georeference(NamedTuple):
    """The affine map from pixels to coordinates; for a mosaic, the one that fits its sheets' corners best."""

    matrix: FloatArray  #: (3, 3)
    crs: str  #: as WKT, "" if unknown
    rms: float = 0.0  #: RMS residual of the corners, in the unit of the coordinates
    sheets: int = 1  #: number of sheets with coordinates


def mean_georeference(canvas: Canvas, sizes: FloatArray, sheets: Sequence[Georeference | None]) -> Georeference | None:
    """The georeference of a mosaic, by least squares over the corners of sheets that have one; None if none has.

    It does not rectify the mosaic: `rms` is how far the sheets deviate. Raises ValueError for sheets in different CRSs.
    """
    known, given = [number for number, sheet in enumerate(sheets) if sheet], [sheet for sheet in sheets if sheet]
    if not given:
        return None
    names = {sheet.crs for sheet in given if sheet.crs}
    if len(names) > 1:
        raise ValueError("Invalid georeferences. The sheets are in different CRSs.")
    rims = corners(sizes[known])
    here = places(canvas.matrices[known], rims).reshape(-1, 2)
    there = places(np.stack([sheet.matrix for sheet in given]), rims).reshape(-1, 2)
    # Coordinates of a CRS are large, so that they are counted from their means.
    middle, target = here.mean(axis=0), there.mean(axis=0)
    A = np.linalg.lstsq(here - middle, there - target, rcond=None)[0].T
    gaps = there - target - (here - middle) @ A.T
    matrix = np.eye(3)
    matrix[:2, :2], matrix[:2, 2] = A, target - A @ middle
    return Georeference(matrix, names.pop() if names else "", float(np.sqrt((gaps**2).sum(axis=1).mean())), len(given))


def world_file(path: AnyPath) -> Path:
    """The name of a picture's world file: x.pgw of x.png."""
    path = Path(path)
    letters = path.suffix.lstrip(".")
    return path.with_suffix(f".{letters[0]}{letters[-1]}w" if letters else ".wld")


def read_world_file(path: AnyPath) -> Georeference | None:
    """The georeference in a picture's world file (.pgw, .pngw or .wld); None without one; raises ValueError."""
    path = Path(path)
    names = (world_file(path), path.with_name(path.name + "w"), path.with_suffix(".wld"))
    file = next((name for name in names if name.is_file()), None)
    if file is None:
        return None
    try:
        a, d, b, e, c, f = (float(word) for word in file.read_text(encoding="ascii").split())
    except (OSError, ValueError) as error:
        raise ValueError(f"Invalid world file '{file}'. It must have six numbers.") from error
    matrix = np.array([[a, b, c], [d, e, f], [0.0, 0.0, 1.0]])
    if not np.isfinite(matrix).all() or np.linalg.det(matrix) == 0:
        raise ValueError(f"Invalid world file '{file}'. Its numbers must be of a map of the plane.")
    return Georeference(matrix @ np.linalg.inv(_MIDDLE), "")


def write_world_file(path: Path, matrix: FloatArray, *, overwrite: bool = True) -> None:
    """Write a world file for a map from pixels to coordinates; raises FileExistsError, OSError."""
    numbers = (matrix @ _MIDDLE)[:2].T.reshape(-1)
    with replacing(path, overwrite=overwrite) as new:
        new.write_text("".join(f"{value!r}\n" for value in numbers.tolist()), encoding="ascii")
