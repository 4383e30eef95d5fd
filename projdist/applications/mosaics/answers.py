"""Mosaics: images in a common frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.applications.mosaics.canvases import Canvas, canvas_size
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.homographies import corners, places
from projdist.applications.mosaics.registration import (
    CommonFrames,
    Frame,
    ImageAnswer,
    ImageRegistration,
    common_frames,
    frame_of_image,
    register_groups,
)
from projdist.matrices import ROTATIONS, check_weights
from projdist.support import plain

FRAMES = ("mdt", "first", "last", "central", "best")
_SEVERAL = 2.0  # times better gives a note
_MOST_PIXELS = 1e8  # of a canvas: 300 MB of colours


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Mosaic(ImageAnswer):
    """Images in a common frame, with the figures of other frames.

    `frame`: that of the mosaic, `frame_name` as requested. `common`: the frames to choose from. `most_pixels`: limit of
    the canvas.
    """

    registration: ImageRegistration
    common: CommonFrames
    frame_name: str
    frame: Frame
    most_pixels: float = _MOST_PIXELS

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
        """The notes; without `others` none on other groups of images, which have mosaics of their own."""
        left = self._left_out_note(others=others)
        notes = (left, self._model_note, self.common.rotation.note, self.canvas().note)
        return [note for note in notes if note]

    @property
    def _model_note(self) -> str:
        """A note if homographies fit several times better than the requested affine maps."""
        models = self.registration.models
        if self.registration.model != "affine" or not models:
            return ""
        affine, homography = models["affine"], models["homography"]
        if affine.gric <= homography.gric or affine.rms_pixels < _SEVERAL * homography.rms_pixels:
            return ""
        return (
            f"Homographies fit the pairs to {homography.rms_pixels:.3g} pixels RMS, affine maps to "
            f"{affine.rms_pixels:.3g}: the model should be homography."
        )

    def canvas(self, *, most_pixels: float | None = None) -> Canvas:
        """The picture that holds all images, of at most `most_pixels`."""
        rims = places(self.matrices, corners(self.registration.sizes)).reshape(-1, 2)
        size = canvas_size(np.ptp(rims, axis=0), self.most_pixels if most_pixels is None else most_pixels)
        to_canvas = np.diag([size.scale, size.scale, 1.0])
        to_canvas[:2, 2] = -size.scale * rims.min(axis=0)
        return Canvas(size.width, size.height, to_canvas @ self.matrices, size.scale, size.note)

    def _line(self) -> str:
        return f"{len(self.images)} images in the frame {self.frame_name}"

    def to_dict(self) -> dict[str, Any]:
        """The report. Lists are for all images in their order, with None for those left out."""
        found, canvas, name = self.registration, self.canvas(), self.points.name
        references = {
            key: frame.reference for key, frame in self.frames.items() if frame and frame.reference is not None
        }
        return {
            "model": found.model,
            "images": [name(image) for image in range(len(self.points.sizes))],
            "sizes": self.points.sizes.tolist(),
            "frame": self.frame_name,
            "frames": {key: None if frame is None else plain(frame.figure) for key, frame in self.frames.items()},
            "references": {key: name(image) for key, image in references.items()},
            "impossible": [name(image) for image in self.common.impossible],
            "distortions": {
                key: None if frame is None else self._of_all(frame.distortions) for key, frame in self.frames.items()
            },
            "matrices": self._of_all(self.matrices),
            "rms_pixels": found.rms_pixels,
            "models": {key: fit._asdict() for key, fit in found.models.items()},
            "resultant_length": float(self.common.rotation.mean_resultant_length),
            "left_out": self.left_out,
            "components": [[name(image) for image in group] for group in found.components],
            "canvas": {"width": canvas.width, "height": canvas.height, "scale": canvas.scale},
            "pairs": self._pairs(),
            "notes": self.notes,
        }

    def _table(self) -> list[dict[str, Any]]:
        """A row per image with its Dist_F in each frame."""
        columns = {
            key: [np.nan] * len(self.images) if frame is None else frame.distortions.tolist()
            for key, frame in self.frames.items()
        }
        return [
            {"image": self.points.name(image)} | {key: values[row] for key, values in columns.items()}
            for row, image in enumerate(self.images)
        ]


def check_frame(frame: str | int, count: int) -> str | int:
    """The name of a frame, or the number of one of `count` images; raises ValueError for others."""
    if isinstance(frame, str) and frame.isdecimal():
        frame = int(frame)
    if not (frame in FRAMES or (isinstance(frame, int) and 0 <= frame < count)):
        raise ValueError(
            f"Invalid frame '{frame}'. It must be {', '.join(FRAMES)}, or the number of an image, 0 to {count - 1}."
        )
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
) -> Mosaic:
    """Bring images into a common frame by their common points.

    `model`: affine maps, homographies, or "auto" for the model that suits the points. `frame`: "mdt", in which the
    images are distorted least, or the plane of an image: "first", "last", "central", "best" of all, or a number.
    `weights`: of the images, by default equal. `rotation`: as `method` of `mean_rotation`. `tolerance`: pixels, as in
    `register`. `most_pixels`: limit of the canvas. Raises ValueError for frames in which an image reaches infinity, and
    as `register`.
    """
    (found,) = mosaics_of_groups(
        points,
        model=model,
        frame=frame,
        weights=weights,
        rotation=rotation,
        tolerance=tolerance,
        most_pixels=most_pixels,
        most=1,
    )
    return found


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
    """A mosaic of each group of connected images, the largest first, at most `most`; see `mosaic`.

    `frame`: of several groups a name, not a number, as an image is in one group only.
    """
    frame = check_frame(frame, len(points.sizes))
    if most != 1 and not isinstance(frame, str):
        raise ValueError(f"Invalid frame '{frame}'. An image is in one group only; it must be {', '.join(FRAMES)}.")
    if rotation not in ROTATIONS:
        raise ValueError(f"Invalid rotation '{rotation}'. It must be {' or '.join(ROTATIONS)}.")
    all_weights = check_weights(weights, (len(points.sizes),))
    groups = register_groups(points, model=model, tolerance=tolerance, most=most)
    return [_framed(points, found, frame, all_weights, rotation, most_pixels) for found in groups]


def _framed(
    points: Correspondences,
    found: ImageRegistration,
    frame: str | int,
    all_weights: FloatArray,
    rotation: str,
    most_pixels: float,
) -> Mosaic:
    """The mosaic of registered images."""
    each = check_weights(all_weights[found.images], (len(found.images),))
    common = common_frames(found, each, rotation)
    if isinstance(frame, str):
        chosen = common.frames[frame]
    elif frame in found.images:
        chosen = frame_of_image(found, frame, each)
    else:
        raise ValueError(f"Invalid frame '{frame}'. Nothing connects image {points.name(frame)} with the others.")
    if chosen is None:
        raise ValueError(f"Invalid frame '{frame}'. Its plane sends other images through infinity; mdt does not.")
    return Mosaic(
        points=points, registration=found, common=common, frame_name=str(frame), frame=chosen, most_pixels=most_pixels
    )
