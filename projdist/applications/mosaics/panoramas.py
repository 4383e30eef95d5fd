"""Panoramas: images of a camera that only turns, on the sphere and on maps of it, and the bundle adjustment for them.

A pixel x of image i, from the image's middle, is seen in the direction R_i K_i^-1 (x, 1), K_i = diag(f_i, f_i, 1). The
rotations R_i and one focal length, or one each, minimise the symmetric transfer error, as homographies do in
`bundle_adjustment`: the eight entries of a homography here depend on three or four numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.mosaics import homographies, registration
from projdist.applications.mosaics.bundle_adjustment import Chart, Link, Pair, adjust, transfer_errors, transfers
from projdist.applications.mosaics.canvases import Camera, SphereCanvas, angles_of, sphere_canvas
from projdist.applications.mosaics.correspondences import Correspondences
from projdist.matrices import turns
from projdist.projections import ProjectedCrs, Projection, ProjectionLike, projected_crs_of
from projdist.support import check_choice

_ARC = 40  # edges of an outline for each side of an image
# The cameras' right directions give the vertical if the second eigenvalue of their scatter exceeds a share of their
# number, as it does after turns by some degrees, and the first is below a share of the second.
_TURNED, _LEVEL = 1e-3, 0.25
_NO_MIDDLE = 0.05  # length of the mean direction below which there is no middle, as all around the horizon
_SEVERAL = 2.0  # times: a fit worse by this gives a note


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Panorama(registration.ImageAnswer):
    """Images of a camera that only turns, on the sphere that it sees.

    Longitudes increase to the right from 0 in the middle, latitudes upwards. It is also a region, the part of the
    sphere that it shows: `projdist.optimize("auto", found)`.
    """

    cameras: registration.Cameras  #: in the directions of the first one
    rotations: FloatArray  #: (n, 3, 3), from each camera's right, down and forward to those at 0, 0 when level

    @property
    def _found(self) -> registration.Cameras:
        return self.cameras

    def messages(self, *, others: bool = True) -> list[str]:
        """Remarks on the result; without `others` none on other groups of images, which have their own panoramas."""
        found, left = self.cameras, self._left_out_note(others=others)
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
        given = zip(self.rotations, self.cameras.focals, self.points.sizes[self.images].tolist(), strict=True)
        return tuple(Camera(R, float(f), (w, h)) for R, f, (w, h) in given)

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The outlines of all images as a GeoJSON geometry, polygons of longitudes and latitudes."""
        along = np.linspace(0.0, 1.0, _ARC, endpoint=False)
        one, none = np.ones_like(along), np.zeros_like(along)
        sides = [(along, none), (one, along), (1.0 - along, one), (none, 1.0 - along), (none[:1], none[:1])]
        rim = np.concatenate([np.column_stack(side) for side in sides])
        outlines = [np.column_stack(angles_of(view.directions(rim * view.size))) for view in self.views]
        return {"type": "MultiPolygon", "coordinates": [[outline.tolist()] for outline in outlines]}

    def mapped(self, projection: ProjectionLike, *, most_pixels: float = 1e8) -> MappedPanorama:
        """The panorama on a map of the sphere with an inverse, for `render`; raises ValueError for other maps."""
        return MappedPanorama(self, *map_of_sphere(projection), most_pixels)

    def _line(self) -> str:
        return f"{len(self.images)} images of a camera that turns"

    def to_dict(self) -> dict[str, Any]:
        """The report. Lists are for all images in their order, with None for those left out."""
        found = self.cameras
        images, groups, end = self._shared_parts()
        return {
            "model": "rotation",
            **images,
            "rotations": self._of_all(self.rotations),
            **{f"{name}s": self._of_all(values) for name, values in self._columns().items()},
            "focal_errors": self._of_all(found.focal_errors),
            "rms_pixels": found.rms_pixels,
            "rms_pixels_of_homographies": found.rms_homographies,
            **groups,
            **end,
        }

    def _columns(self) -> dict[str, FloatArray]:
        """Longitude, latitude, roll and focal length of each image."""
        lon, lat = angles_of(self.rotations[:, :, 2])
        roll = np.degrees(np.arctan2(self.rotations[:, 1, 0], self.rotations[:, 1, 1]))
        return {"longitude": lon, "latitude": lat, "roll": roll, "focal": self.cameras.focals}

    def _table(self) -> dict[str, Any]:
        return {"image": self.points.names_of(self.images)} | self._columns()


@dataclass(frozen=True, eq=False)
class MappedPanorama:
    """A panorama on a map of the sphere, for `render`."""

    panorama: Panorama
    projection: Projection
    plane: ProjectedCrs
    most_pixels: float

    @property
    def points(self) -> Correspondences:
        """The correspondences of all images."""
        return self.panorama.points

    @property
    def images(self) -> list[int]:
        """The numbers of the images in the panorama."""
        return self.panorama.images

    def canvas(self, *, most_pixels: float | None = None) -> SphereCanvas:
        """The picture that holds all images, of at most `most_pixels`; raises ValueError if the map shows none."""
        most = self.most_pixels if most_pixels is None else most_pixels
        return sphere_canvas(self.panorama.views, self.plane, self.projection.ellipsoid.a, most)


def map_of_sphere(projection: ProjectionLike) -> tuple[Projection, ProjectedCrs]:
    """A map of the sphere that has an inverse, and its plane; raises ValueError for other maps."""
    given = Projection.from_user_input(projection)
    if not given.ellipsoid.is_sphere:
        message = f"Invalid projection '{given.label}'. It must be of a sphere: a name, or with +R=6371008.7714."
        raise ValueError(message)
    plane = projected_crs_of(given)
    if plane is None or not plane.has_inverse:
        raise ValueError(f"Invalid projection '{given.label}'. It must be one that PROJ has the inverse of.")
    return given, plane


def panorama(points: Correspondences, *, focal: str = "common", tolerance: float = 4.0) -> Panorama:
    """Place the images of a camera that only turns on the sphere that it sees.

    A bundle adjustment on SO(3) finds the rotations and one focal length for all images (`focal`: "common"), or one
    each ("free"), with the least symmetric transfer error. The vertical is chosen so that the images are as level as
    possible. `tolerance`: as in `register`. Raises ValueError as `register`, and if the camera did not only turn.
    """
    return panoramas_of_groups(points, focal=focal, tolerance=tolerance, most=1)[0]


def panoramas_of_groups(
    points: Correspondences, *, focal: str = "common", tolerance: float = 4.0, most: int | None = None
) -> list[Panorama]:
    """A panorama of each group of connected images, the largest first, at most `most`."""
    check_choice("focal", focal, FOCALS)
    links = registration.links_of(points, tolerance)
    pairs = [registration.estimated(points, link, tolerance, "homography") for link in links]
    groups = registration.connected(points, links, pairs)[:most]
    cut = max(link.reduction for link in links) * tolerance / points.unit
    cameras = [_cameras(points, group, focal == "common", cut) for group in groups]
    return [Panorama(points=points, cameras=one, rotations=_level(one.rotations) @ one.rotations) for one in cameras]


def _level(R: FloatArray) -> FloatArray:
    """The rotation to right, down and forward of a level panorama with longitude 0 in its middle."""
    # Cameras are usually held level, so the vertical is as nearly perpendicular to their right directions as possible
    # (M. Brown & D. G. Lowe 2007, "Automatic panoramic image stitching using invariant features", section 5).
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


# ---- cameras --------------------------------------------------------------------------------------

FOCALS = ("common", "free")

# In half the longest side: fields of view from 152 to 5 degrees, in steps of 5 %.
_WIDEST, _NARROWEST, _STEPS = 0.25, 25.0, 96
_CAP = 10.0  # tolerances: larger errors count as this while the focal length is searched
_FAR = 0.7  # of half the longest side: links that chains miss by more are used only later
# Median errors within which points are kept even beyond the tolerance, as lenses bend lines: 2.5 standard deviations.
_WITHIN = 3.7


@dataclass(frozen=True)
class _Turns(Chart):
    """Changes of maps M_i = R_i K_i^-1, to R_i exp([w_i]) for all images but the first, and to f_i exp(t)."""

    is_common: bool

    def reduced(self, M: FloatArray, normal: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """J^T J and J^T r for w (n - 1, 3), then for t, common or of each image."""
        f = _focals_of(M)
        entries = np.zeros((len(M), 8, 4))
        # K [w]_x K^-1, its entries (0,1), (0,2), (1,0), (1,2), (2,0) and (2,1); and -t in (0,0) and (1,1).
        entries[:, 1, 2], entries[:, 3, 2] = -1.0, 1.0
        entries[:, 2, 1], entries[:, 5, 0] = f, -f
        entries[:, 6, 1], entries[:, 7, 0] = -1.0 / f, 1.0 / f
        entries[:, 0, 3] = entries[:, 4, 3] = -1.0
        small = np.einsum("iap,iajb,jbq->ipjq", entries, normal, entries, optimize=True)
        slopes = np.einsum("iap,ia->ip", entries, gradient)
        size = 4 * len(M)
        into = self._unknowns(len(M))
        return into.T @ small.reshape(size, size) @ into, into.T @ slopes.reshape(size)

    def moved(self, M: FloatArray, step: FloatArray) -> FloatArray:
        """The maps after a step."""
        each = (self._unknowns(len(M)) @ step).reshape(len(M), 4)
        f = _focals_of(M)
        R = (M @ _scalings(f)) @ turns(each[:, :3])
        with np.errstate(over="ignore"):
            return R @ _scalings(1.0 / (f * np.exp(each[:, 3])))

    def _unknowns(self, count: int) -> FloatArray:
        """The matrix from the unknowns to w and t of all images."""
        rows = np.arange(4 * count).reshape(count, 4)
        focals = 1 if self.is_common else count
        into = np.zeros((4 * count, 3 * (count - 1) + focals))
        into[rows[1:, :3].reshape(-1), np.arange(3 * (count - 1))] = 1.0
        into[rows[:, 3], 3 * (count - 1) + np.arange(count) % focals] = 1.0
        return into


def _cameras(
    points: Correspondences, group: registration.MatchedImages, is_common: bool, tolerance: float
) -> registration.Cameras:
    """The cameras of a group of images, with one focal length for all (`is_common`) or one each."""
    unit = points.unit
    registration.refuse_mirrors(points, group)
    f, turned = _start(group, tolerance)
    M = _scalings(np.array([1.0 / f]))[0] @ registration.chained(group.links, turned)
    M, rms, normal, count = _adjusted(_Turns("homography", is_common), M, group, tolerance)
    focals = _focals_of(M)
    # Deviations of the logarithms of focal lengths: noise s in each coordinate gives the two transfer distances, which
    # are nearly equal, a mean square of 4 s^2; the covariance is that times the inverse of J^T J over both ways.
    scale = rms**2 * 2.0 * count / max(2 * count - len(normal), 1)
    with np.errstate(invalid="ignore"):
        variances = np.diag(np.linalg.pinv(normal, hermitian=True))[3 * (len(focals) - 1) :]
    deviations = np.broadcast_to(np.sqrt(scale * np.maximum(variances, 0.0)), focals.shape)
    # With a homography for each pair.
    pairs = [(link.chosen(pair.agree), pair.S) for link, pair in zip(group.links, group.pairs, strict=True)]
    squares = [np.square(transfers(S, link.xi, link.xj)) for link, S in pairs if S is not None]
    return registration.Cameras(
        *group.shared,
        M @ _scalings(focals),
        focals * unit,
        focals * unit * deviations,
        rms * unit,
        float(np.sqrt(np.concatenate(squares, axis=1).mean())) * unit,
    )


def _focals_of(M: FloatArray) -> FloatArray:
    """Focal lengths (n,) of maps R K^-1."""
    return np.asarray(1.0 / np.linalg.norm(M[:, :, 0], axis=1))


def _scalings(f: FloatArray) -> FloatArray:
    """The matrices diag(f, f, 1)."""
    K = np.tile(np.eye(3), (len(f), 1, 1))
    K[:, 0, 0] = K[:, 1, 1] = f
    return K


def _start(group: registration.MatchedImages, tolerance: float) -> tuple[float, list[Pair]]:
    """The focal length, in halves of the longest side, with which rotations fit all pairs best, and those pairs."""
    # The rotation of a pair solves Wahba's problem for the directions to its points.
    f = np.geomspace(_WIDEST, _NARROWEST, _STEPS)
    cost, maps = np.zeros(_STEPS), []
    for link, agree in group.agreeing:
        xi, xj = link.xi[agree], link.xj[agree]
        U, _, V = np.linalg.svd(_directions(xj, f).swapaxes(1, 2) @ _directions(xi, f))
        U[:, :, 2] *= np.linalg.det(U @ V)[:, None]
        S = _scalings(f) @ (U @ V) @ _scalings(1.0 / f)
        there, back = transfers(S, xi, xj)
        cost += np.minimum(there**2 + back**2, (_CAP * tolerance) ** 2).sum(axis=-1)
        maps.append(S)
    best = int(cost.argmin())
    return float(f[best]), [pair._replace(S=S[best]) for pair, S in zip(group.pairs, maps, strict=True)]


def _directions(x: FloatArray, f: FloatArray) -> FloatArray:
    """Unit vectors (k, n, 3) towards points (n, 2) for focal lengths (k,)."""
    rays = homographies.homogeneous(x) / np.stack([f, f, np.ones_like(f)], axis=-1)[:, None]
    return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))


def _adjusted(
    chart: _Turns, M: FloatArray, group: registration.MatchedImages, tolerance: float
) -> tuple[FloatArray, float, FloatArray, int]:
    """The adjusted maps, the RMS error, the normal equations and the number of points."""
    # Links that the chains miss by far, as around the horizon, are left out at first. It ends when no points change.
    links = group.links
    gaps = _gaps(M, links)
    both = zip(gaps, group.agreeing, strict=True)
    chosen = [some & (np.median(gap[some]) < _FAR) & (gap < np.inf) for gap, (_, some) in both]
    for _ in range(10):
        kept = [link.chosen(some) for link, some in zip(links, chosen, strict=True) if some.sum() > 1]
        # All images must be in one group.
        if [len(group) for group in registration.components_of((link.i, link.j) for link in kept)] != [len(M)]:
            why = "Rotations do not bring their points together: the camera also moved, or they are not photographs."
            raise ValueError(f"Invalid images for a camera that only turns. {why}")
        M, rms, normal = adjust(chart, M, kept)
        gaps = _gaps(M, links)
        usual = float(np.median(np.concatenate([gap[some] for gap, some in zip(gaps, chosen, strict=True)])))
        before, chosen = chosen, [gap <= max(tolerance, _WITHIN * usual) for gap in gaps]
        if all((a == b).all() for a, b in zip(before, chosen, strict=True)):
            break
    return M, rms, normal, sum(len(link.xi) for link in kept)


def _gaps(M: FloatArray, links: Sequence[Link]) -> list[FloatArray]:
    """The transfer errors of the points of links."""
    return [transfer_errors(np.linalg.solve(M[link.j], M[link.i]), link.xi, link.xj) for link in links]
