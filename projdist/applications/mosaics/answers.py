"""A mosaic: images in a common frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.applications.mosaics.canvases import Canvas
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.applications.mosaics.homographies import corners, places
from projdist.applications.mosaics.registration import (
    CommonFrames,
    Frame,
    ImageRegistration,
    alone,
    common_frames,
    frame_of_image,
    left_out_note,
    register_groups,
)
from projdist.matrices import ROTATIONS, check_weights
from projdist.support import Answer, plain

FRAMES = ("mdt", "first", "last", "central", "best")
_SEVERAL = 2.0  # times better is worth a word
_MOST_PIXELS = 1e8  # of a canvas: 300 MB of colours


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Mosaic(Answer):
    """Images brought into a common frame, and what other frames would be worth.

    `frame`: that of the mosaic, `frame_name` as it was asked for. `common`: the frames to choose from. `most_pixels`:
    of the canvas.
    """

    points: Correspondences
    registration: ImageRegistration
    common: CommonFrames
    frame_name: str
    frame: Frame
    most_pixels: float = _MOST_PIXELS

    @property
    def frames(self) -> dict[str, Frame | None]:
        """`first`, `last`, `central`, `best` and `mdt`; None where the plane has no room for some image."""
        return self.common.frames

    @property
    def images(self) -> list[int]:
        """The numbers of the images in the mosaic."""
        return self.registration.images

    @property
    def matrices(self) -> FloatArray:
        """From the pixels of `images` to the frame, (n, 3, 3)."""
        return self.frame.matrices

    @property
    def left_out(self) -> list[str]:
        """The names or numbers of the images that do not hang together with the others."""
        return [self.points.name(image) for image in self.registration.left_out]

    @property
    def alone(self) -> list[str]:
        """The names or numbers of the images that hang together with no other."""
        found = self.registration
        return [self.points.name(image) for image in alone(found.components, found.left_out)]

    @property
    def notes(self) -> list[str]:
        """What is to be said of the result; mostly nothing."""
        return self.told()

    def told(self, *, others: bool = True) -> list[str]:
        """The notes; without `others` none of other groups of images, which have mosaics of their own."""
        left = left_out_note(self.points, self.registration.components, self.registration.left_out, others)
        notes = (left, self._better, self.common.rotation.note, self.canvas().note)
        return [note for note in notes if note]

    @property
    def _better(self) -> str:
        """That homographies fit several times better than the affine maps that were asked for."""
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
        """The picture that holds all images, of so many pixels at most."""
        most_pixels = self.most_pixels if most_pixels is None else most_pixels
        rims = places(self.matrices, corners(self.registration.sizes)).reshape(-1, 2)
        low, extent = rims.min(axis=0), np.ptp(rims, axis=0)
        scale = min(1.0, float(np.sqrt(most_pixels / np.prod(extent))))
        to_canvas = np.diag([scale, scale, 1.0])
        to_canvas[:2, 2] = -scale * low
        width, height = (max(1, int(np.ceil(round(scale * side, 6)))) for side in extent)
        full = f"{extent[0]:.0f} x {extent[1]:.0f}"
        note = f"The canvas would have {full} pixels: it is drawn at {100 * scale:.3g} %." if scale < 1.0 else ""
        return Canvas(width, height, to_canvas @ self.matrices, scale, note)

    def _line(self) -> str:
        return f"{len(self.images)} images in the frame {self.frame_name}"

    def to_dict(self) -> dict[str, Any]:
        """The report. Lists are of all images, in their order, with None for what was left out."""
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
            "pairs": [
                m._asdict() | {"i": name(m.i), "j": name(m.j), "false_alarms": plain(m.false_alarms)}
                for m in found.matches
            ],
            "notes": self.notes,
        }

    def _of_all(self, values: FloatArray) -> list[Any]:
        """A value an image, None for those left out."""
        listed: list[Any] = [None] * len(self.points.sizes)
        for image, value in zip(self.images, values.tolist(), strict=True):
            listed[image] = value
        return listed

    def _table(self) -> list[dict[str, Any]]:
        """A row an image: its Dist_F in each frame."""
        columns = {
            key: [np.nan] * len(self.images) if frame is None else frame.distortions.tolist()
            for key, frame in self.frames.items()
        }
        return [
            {"image": self.points.name(image)} | {key: values[row] for key, values in columns.items()}
            for row, image in enumerate(self.images)
        ]


def check_frame(frame: str | int, count: int) -> str | int:
    """The name of a frame or the number of one of so many images; raises ValueError for another."""
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
    """Bring images into a common frame by the points that they have in common.

    `model`: affine maps, homographies, or "auto": those that the points ask for. `frame`: "mdt", in which the images
    are distorted least, or the plane of an image: "first", "last", "central", "best" of all, or a number. `weights`: of
    the images, equal ones if not given. `rotation`: as `method` of `mean_rotation`. `tolerance`: pixels, as for
    `register`. `most_pixels`: of the canvas. Raises ValueError for frames in which an image reaches infinity, and as
    `register` does.
    """
    return _mosaics(points, model, frame, weights, rotation, tolerance, most_pixels, 1)[0]


def mosaics_of_groups(
    points: Correspondences,
    *,
    model: str = "affine",
    frame: str = "mdt",
    weights: ArrayLike | None = None,
    rotation: str = "chordal",
    tolerance: float = 4.0,
    most_pixels: float = _MOST_PIXELS,
) -> list[Mosaic]:
    """A mosaic of each group of images that hang together, the largest first; arguments and errors as of `mosaic`.

    `frame`: a name, as an image is in one group only.
    """
    if not isinstance(check_frame(frame, len(points.sizes)), str):
        raise ValueError(f"Invalid frame '{frame}'. An image is in one group only; it must be {', '.join(FRAMES)}.")
    return _mosaics(points, model, frame, weights, rotation, tolerance, most_pixels, None)


def _mosaics(
    points: Correspondences,
    model: str,
    frame: str | int,
    weights: ArrayLike | None,
    rotation: str,
    tolerance: float,
    most_pixels: float,
    most: int | None,
) -> list[Mosaic]:
    frame = check_frame(frame, len(points.sizes))
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
    """Registered images in a frame."""
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
