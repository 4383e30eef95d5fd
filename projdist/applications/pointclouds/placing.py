"""The frame that registered clouds are brought to, and how well they agree there."""

from __future__ import annotations

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.applications.pointclouds.groupwise import Group
from projdist.matrices import Rotation, mean_rotation, principal_scales

__all__ = ["dist_squares", "into_cloud", "into_mdt", "placed", "squared_residuals", "upright"]


def dist_squares(T: FloatArray, A: FloatArray) -> FloatArray:
    """Dist_F(T^-1 A_i)^2 of matrices (N, n, n)."""
    return np.asarray(np.sum(np.log(principal_scales(np.linalg.solve(T, A))) ** 2, axis=-1))


def upright(group: Group) -> tuple[Group, BoolArray]:
    """The same maps into a frame that most clouds are no mirror images in, and which clouds are.

    Of equally many the first is none.
    """
    signs = np.linalg.slogdet(group.A)[0]
    most = np.sign(signs.sum()) or signs[0]
    flip = np.ones(group.shift.shape[1])
    flip[-1] = most
    return group._replace(A=flip[:, None] * group.A, shift=flip * group.shift), np.asarray(signs != most)


def into_cloud(group: Group, reference: int) -> tuple[FloatArray, FloatArray]:
    """Matrices and shifts into the coordinates of a cloud."""
    frame = group.A[reference]
    shift = np.linalg.solve(frame, (group.shift - group.shift[reference]).T).T
    return np.asarray(np.linalg.solve(frame, group.A)), np.asarray(shift)


def into_mdt(
    group: Group, T: FloatArray, mirrored: BoolArray, points: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, Rotation]:
    """Matrices and shifts into the frame of the MDT, where points (N, M, n) keep their mean orientation and place."""
    rotation = mean_rotation(group.A[~mirrored], T=T)
    A, shift = (np.einsum("ij,nj...->ni...", rotation.q @ np.linalg.inv(T), part) for part in (group.A, group.shift))
    moves, there = points - placed(A, shift, points), weights > 0.0
    moved = np.average(moves[there], axis=0, weights=weights[there])
    return A, shift + moved, rotation


def placed(A: FloatArray, shift: FloatArray, points: FloatArray) -> FloatArray:
    """The places of points (N, M, n)."""
    return np.einsum("nij,nmj->nmi", A, points) + shift[:, None]


def squared_residuals(places: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of each cloud the sum by weights of the squared distances from the points' mean places, and that of the weights.

    Points of one cloud alone do not count.
    """
    shared = (weights > 0.0).sum(axis=0) > 1
    places, weights = places[:, shared], weights[:, shared]
    places = np.where((weights > 0.0)[..., None], places, 0.0)
    mean = np.einsum("im,imn->mn", weights, places) / weights.sum(axis=0)[:, None]
    squares = weights * np.sum((places - mean) ** 2, axis=2)
    return squares.sum(axis=1), weights.sum(axis=1)
