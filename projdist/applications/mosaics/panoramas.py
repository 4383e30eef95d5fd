"""Panoramas: the images of a camera that only turns, on the sphere that it sees, and on a map of that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.mosaics.cameras import Cameras, turned_cameras
from projdist.applications.mosaics.canvases import Camera, SphereCanvas, angles_of, sphere_canvas
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.registration import alone, left_out_note
from projdist.projections import ProjectedCrs, Projection, ProjectionLike, projected_crs_of
from projdist.support import Answer, plain

_MOST_PIXELS = 1e8  # of a canvas
_ARC = 40  # edges of an outline for each side of an image
# Horizontals of cameras that turned about more than one axis by some degrees tell the vertical.
_TURNED, _LEVEL = 1e-3, 0.25
_NO_MIDDLE = 0.05  # mean of directions that have none, as round the horizon
_SEVERAL = 2.0  # times worse is worth a word


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Panorama(Answer):
    """Images of a camera that only turns, on the sphere that it sees.

    Longitudes grow to the right, from 0 in the middle, and latitudes up. `cameras`: as they were found, the first one's
    directions being those of the sphere; `rotations` (n, 3, 3): from each camera's right, down and forward to those at
    longitude and latitude 0, level.

    It stands for the part of the sphere that it shows wherever a region does: `projdist.optimize("auto", found)`.
    """

    points: Correspondences
    cameras: Cameras
    rotations: FloatArray

    @property
    def images(self) -> list[int]:
        """The numbers of the images in the panorama."""
        return self.cameras.images

    @property
    def left_out(self) -> list[str]:
        """The names or numbers of the images that do not hang together with the others."""
        return [self.points.name(image) for image in self.cameras.left_out]

    @property
    def alone(self) -> list[str]:
        """The names or numbers of the images that hang together with no other."""
        return [self.points.name(image) for image in alone(self.cameras.components, self.cameras.left_out)]

    @property
    def notes(self) -> list[str]:
        """What is to be said of the result; mostly nothing."""
        return self.told()

    def told(self, *, others: bool = True) -> list[str]:
        """The notes; without `others` none of other groups of images, which have panoramas of their own."""
        found = self.cameras
        left = left_out_note(self.points, found.components, found.left_out, others)
        notes = [left] if left else []
        if found.rms_pixels > _SEVERAL * found.rms_homographies and found.rms_pixels > 1.0:
            notes.append(
                f"Rotations fit the points to {found.rms_pixels:.3g} pixels RMS, a homography a pair to "
                f"{found.rms_homographies:.3g}: the camera also moved, or its lens bends lines."
            )
        return notes

    @property
    def views(self) -> tuple[Camera, ...]:
        """The cameras of `images` on the sphere."""
        sizes = self.points.sizes[self.images].tolist()
        return tuple(
            Camera(R, float(f), (w, h)) for R, f, (w, h) in zip(self.rotations, self.cameras.focals, sizes, strict=True)
        )

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The outlines of all images, polygons of longitudes and latitudes, as GeoJSON."""
        return {"type": "MultiPolygon", "coordinates": [[_outline(view).tolist()] for view in self.views]}

    def mapped(self, projection: ProjectionLike, *, most_pixels: float = _MOST_PIXELS) -> MappedPanorama:
        """The panorama on a map of the sphere, to be drawn by `render`; of so many pixels at most.

        Raises ValueError for maps of an ellipsoid, and for those of which PROJ does not have the inverse.
        """
        return MappedPanorama(self, *map_of_sphere(projection), most_pixels)

    def _line(self) -> str:
        return f"{len(self.images)} images of a camera that turns"

    def to_dict(self) -> dict[str, Any]:
        """The report. Lists are of all images, in their order, with None for what was left out."""
        found, name = self.cameras, self.points.name
        lon, lat = angles_of(self.rotations[:, :, 2])
        rolls = np.degrees(np.arctan2(self.rotations[:, 1, 0], self.rotations[:, 1, 1]))
        return {
            "model": "rotation",
            "images": [name(image) for image in range(len(self.points.sizes))],
            "sizes": self.points.sizes.tolist(),
            "rotations": self._of_all(self.rotations),
            "longitudes": self._of_all(lon),
            "latitudes": self._of_all(lat),
            "rolls": self._of_all(rolls),
            "focals": self._of_all(found.focals),
            "focal_errors": self._of_all(found.focal_errors),
            "rms_pixels": found.rms_pixels,
            "rms_pixels_of_homographies": found.rms_homographies,
            "left_out": self.left_out,
            "components": [[name(image) for image in group] for group in found.components],
            "pairs": [
                m._asdict() | {"i": name(m.i), "j": name(m.j), "false_alarms": plain(m.false_alarms)}
                for m in found.matches
            ],
            "notes": self.notes,
        }

    def _of_all(self, values: FloatArray) -> list[Any]:
        """A value an image, None for those left out."""
        rows: list[Any] = [None] * len(self.points.sizes)
        for image, value in zip(self.images, values.tolist(), strict=True):
            rows[image] = value
        return rows

    def _table(self) -> list[dict[str, Any]]:
        """A row an image: where it looks, how it is rolled, its focal length."""
        answer = self.to_dict()
        columns = {"longitude": "longitudes", "latitude": "latitudes", "roll": "rolls", "focal": "focals"}
        return [
            {"image": self.points.name(image)} | {key: answer[column][image] for key, column in columns.items()}
            for image in self.images
        ]


@dataclass(frozen=True, eq=False)
class MappedPanorama:
    """A panorama on a map of the sphere, which `render` draws."""

    panorama: Panorama
    projection: Projection
    plane: ProjectedCrs
    most_pixels: float

    @property
    def points(self) -> Correspondences:
        """Those of all images."""
        return self.panorama.points

    @property
    def images(self) -> list[int]:
        """The numbers of the images in the panorama."""
        return self.panorama.images

    def canvas(self, *, most_pixels: float | None = None) -> SphereCanvas:
        """The picture that holds all images, of so many pixels at most; raises ValueError where the map shows none."""
        most = self.most_pixels if most_pixels is None else most_pixels
        return sphere_canvas(self.panorama.views, self.plane, self.projection.ellipsoid.a, most)


def map_of_sphere(projection: ProjectionLike) -> tuple[Projection, ProjectedCrs]:
    """A map of the sphere and its plane, with an inverse; raises ValueError for others."""
    given = Projection.from_user_input(projection)
    if not given.ellipsoid.is_sphere:
        raise ValueError(
            f"Invalid projection '{given.label}'. It must be of a sphere: a name, or with +R=6371008.7714."
        )
    plane = projected_crs_of(given)
    if plane is None or not plane.has_inverse:
        raise ValueError(f"Invalid projection '{given.label}'. It must be one that PROJ has the inverse of.")
    return given, plane


def panorama(points: Correspondences, *, focal: str = "common", tolerance: float = 4.0) -> Panorama:
    """Bring the images of a camera that only turns onto the sphere that it sees.

    Bundle adjustment on SO(3): the rotations and one focal length for all images (`focal`: "common"), or one each
    ("free"), that make the symmetric transfer error least. The vertical is that across which most images lie level.
    `tolerance`: as for `register`. Raises ValueError as that does, and where the camera did more than turn.
    """
    return panoramas_of_groups(points, focal=focal, tolerance=tolerance, most=1)[0]


def panoramas_of_groups(
    points: Correspondences, *, focal: str = "common", tolerance: float = 4.0, most: int | None = None
) -> list[Panorama]:
    """A panorama of each group of images that hang together, the largest first; at most so many."""
    return [
        Panorama(points=points, cameras=found, rotations=_level(found.rotations) @ found.rotations)
        for found in turned_cameras(points, focal=focal, tolerance=tolerance, most=most)
    ]


def _level(R: FloatArray) -> FloatArray:
    """The rotation to right, down and forward of a level panorama, longitude 0 in its middle.

    Cameras are held level more often than not: the vertical is at right angles to their rights, as nearly as can be
    (M. Brown & D. G. Lowe 2007, "Automatic panoramic image stitching using invariant features", section 5).
    """
    up = -R[:, :, 1].mean(axis=0)
    values, vectors = np.linalg.eigh(R[:, :, 0].T @ R[:, :, 0])
    if values[1] > _TURNED * len(R) and values[0] < _LEVEL * values[1]:
        up = vectors[:, 0] * (1.0 if vectors[:, 0] @ up >= 0 else -1.0)
    up = up / np.linalg.norm(up)
    forwards = R[:, :, 2] - np.outer(R[:, :, 2] @ up, up)
    forward = forwards.mean(axis=0)
    if np.linalg.norm(forward) < _NO_MIDDLE:
        forward = forwards[0] if np.linalg.norm(forwards[0]) > _NO_MIDDLE else np.linalg.svd(up[None])[2][1]
    forward = forward / np.linalg.norm(forward)
    return np.stack([np.cross(-up, forward), -up, forward])


def _outline(view: Camera) -> FloatArray:
    """Longitudes and latitudes round an image, closed."""
    along = np.linspace(0.0, 1.0, _ARC, endpoint=False)
    one, none = np.ones_like(along), np.zeros_like(along)
    sides = [(along, none), (one, along), (1.0 - along, one), (none, 1.0 - along), (none[:1], none[:1])]
    rim = np.concatenate([np.column_stack(side) for side in sides]) * view.size
    return np.column_stack(angles_of(view.directions(rim)))
