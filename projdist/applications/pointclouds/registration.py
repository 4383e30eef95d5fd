"""Several clouds of points in one frame: affine registration, and the frame that distorts them least."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray
from projdist.applications.pointclouds import affine, correspondences
from projdist.matrices import Affine, Modes, mdt, mean_rotation, modes
from projdist.support import Answer, check_bool, check_choice, listed

FRAMES = ("first", "last", "central", "best", "mdt")
_SHRUNK = 0.01  # logarithm of a ratio of volumes; less is not visible
_NOISY = 0.5  # of a cloud's variance along an axis: if less agrees with the others, the axis is uncertain
_SINGULAR = 1e3  # condition of a matrix: along an axis the cloud has a thousandth of the extent of the others
_FEW = 0.5  # of a cloud's points: fewer with a partner give a warning
_SHOWN = 10  # names in one message
_ROUNDS = 30  # of the search for wrong points; a round finds at most one wrong cloud at each point


class LeftOut(NamedTuple):
    """A cloud that cannot be registered, and the reason."""

    name: str
    reason: str


class WrongPoint(NamedTuple):
    """A point that does not correspond to its given partners, and its distance from the place that they give it."""

    cloud: str
    point: str
    distance: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Registration(Answer):
    """Clouds in one frame: M_i y + t_i of the points y of cloud i."""

    names: tuple[str, ...]  #: of the N registered clouds
    method: str
    correspond: str
    frame: str
    reference: int | None  #: number of the cloud whose coordinates are the frame, None for the MDT
    matrices: FloatArray  #: M (N, n, n)
    shifts: FloatArray  #: t (N, n)
    distortions: FloatArray  #: (N,), Dist_F of each matrix
    sums: FloatArray  #: (N,), of squared distortions with cloud k as the reference, whatever the frame
    mdt_sum: float  #: the same with the MDT as the reference
    rms: FloatArray  #: (N,), RMS distance of a cloud's points from their mean places in the frame
    rms_total: float  #: the same over all clouds
    used: IntArray  #: (N,), number of points, of weight above 0, that other clouds have too
    correlations: FloatArray  #: (N, n), canonical, with the mean of all, or with the first cloud for least squares
    shrinkage: FloatArray  #: (N,), ln of the ratio of the volume to that of the target, 0 for the symmetric fit
    mirrored: BoolArray  #: (N,), True for mirror images of most clouds
    conditions: FloatArray  #: (N,), of the matrices into the frame of the MDT
    left_out: tuple[LeftOut, ...]
    points: tuple[FloatArray, ...]  #: as given
    converged: bool
    note: str  #: on the mean rotation, or ""
    robust: bool  #: True if the wrong points were left out
    wrong: tuple[WrongPoint, ...]  #: not at their partners; with a probability of 5 % one is named if all are right
    left_out_distances: FloatArray  #: (N, M), from the place that the others give, by the fit without the point, or NaN
    point_names: tuple[str, ...]  #: (M,)
    weights: tuple[FloatArray, ...] | None  #: (M_i,) each, the largest of all 1; None if none were given

    @property
    def worst(self) -> list[list[WrongPoint]]:
        """The points of each cloud farthest from the places that the others give them, at most five."""
        orders = np.argsort(-np.nan_to_num(self.left_out_distances, nan=-1.0), axis=1, kind="stable")[:, :5]
        return [
            [WrongPoint(name, self.point_names[k], float(far[k])) for k in order if np.isfinite(far[k])]
            for name, far, order in zip(self.names, self.left_out_distances, orders, strict=True)
        ]

    @property
    def aligned(self) -> list[FloatArray]:
        """All points of each registered cloud in the frame."""
        return [Affine(M, t)(y) for y, M, t in zip(self.points, self.matrices, self.shifts, strict=True)]

    @property
    def modes(self) -> Modes:
        """Differences of the clouds in size, proportions and shear: the principal components of their matrices."""
        return modes(self.matrices)

    @property
    def warnings(self) -> list[str]:
        """Warnings about the figures, one line each; usually none."""
        counted = self.weights or [np.ones(len(cloud)) for cloud in self.points]
        few = self.used < _FEW * np.array([np.sum(counts > 0.0) for counts in counted])
        noisy = self.correlations[:, -1] ** 2 < _NOISY
        clouds = {
            "Mirror images of the others": self.mirrored,
            "Uncertain, as along an axis half of what varies does not agree with the others": noisy,
            "Nearly singular beside the others": self.conditions > _SINGULAR,
            "Less than half of the points have a partner": few & (self.correspond == "icp"),
        }
        said = [f"{what}: {_shown(np.array(self.names)[some])}." for what, some in clouds.items() if some.any()]
        if (mean := float(self.shrinkage[1:].mean())) < -_SHRUNK:
            left = f"{100 * np.exp(mean):.2g} % of their volume"
            said.append(f"Least squares shrinks the clouds, on average to {left}; the symmetric fit shrinks none.")
        if self.wrong:
            named = _shown([f"{one.point} of '{one.cloud}'" for one in self.wrong])
            what = "Left out as wrong partners" if self.robust else "Wrong partners, which a robust fit leaves out"
            chance = f"with a chance of {100 * affine.FALSE_ALARM:g} % that any is named where all are right"
            said.append(f"{what} ({chance}): point {named}.")
        if not self.converged:
            said.append("The fit has not converged: the clouds share too few points, or are too noisy.")
        return [*said, self.note] if self.note else said

    @property
    def frames(self) -> dict[str, tuple[str | None, float]]:
        """The cloud that each frame belongs to, None for the MDT, and the sum of Dist_F^2 in it."""
        references = _references(self.sums).items()
        return {**{name: (self.names[k], float(self.sums[k])) for name, k in references}, "mdt": (None, self.mdt_sum)}

    def _line(self) -> str:
        return f"{len(self.names)} clouds, RMS {self.rms_total:.4g}"

    def to_dict(self) -> dict[str, Any]:
        """`{"dimension", "method", ..., "frames": {"first": {"cloud", "sum"}, ...}, "clouds": [{"name", ...}]}`."""
        worst = [[{"point": one.point, "distance": one.distance} for one in some] for some in self.worst]
        columns = self._columns() | {"matrix": self.matrices.tolist(), "shift": self.shifts.tolist(), "worst": worst}
        return {
            "dimension": self.shifts.shape[1],
            **{name: getattr(self, name) for name in ("method", "correspond", "frame")},
            "reference": None if self.reference is None else self.names[self.reference],
            "frames": {name: {"cloud": cloud, "sum": total} for name, (cloud, total) in self.frames.items()},
            "rms": self.rms_total,
            "modes": self.modes.rows,
            "clouds": [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
            "weighted": self.weights is not None,
            "robust": self.robust,
            "wrong": [one._asdict() for one in self.wrong],
            "left_out": [one._asdict() for one in self.left_out],
            "warnings": self.warnings,
        }

    def _columns(self) -> dict[str, list[Any]]:
        """Columns of a table with a row per cloud."""
        return {
            "name": list(self.names),
            "points": [len(cloud) for cloud in self.points],
            "used": self.used.tolist(),
            "distortion": self.distortions.tolist(),
            "sum_as_frame": self.sums.tolist(),
            "rms": self.rms.tolist(),
            "least_correlation": self.correlations[:, -1].tolist(),
            "shrinkage": self.shrinkage.tolist(),
            "mirrored": self.mirrored.tolist(),
        }

    def _table(self) -> dict[str, Any]:
        """A row per cloud, with its matrix as M_00, M_01, ... and its shift as t_0, t_1, ..."""
        n = self.shifts.shape[1]
        entries = {f"M_{i}{j}": self.matrices[:, i, j] for i in range(n) for j in range(n)}
        return self._columns() | entries | {f"t_{i}": self.shifts[:, i] for i in range(n)}


def register(
    clouds: Sequence[ArrayLike],
    *,
    correspond: str = "rows",
    ids: Sequence[Sequence[str]] | None = None,
    frame: str | int = "mdt",
    method: str = "symmetric",
    names: Sequence[str] | None = None,
    robust: bool = False,
    weights: Sequence[ArrayLike] | ArrayLike | None = None,
) -> Registration:
    """Register clouds of shape (M_i, n), at least two, in one frame by an affine map each.

    `correspond`: "rows", row k of each cloud is the same point, missing if NaN; "id", rows with equal `ids`, texts for
    each row of each cloud, are the same point; "icp", closest points are matched, starting from the clouds as given.
    `frame`: "mdt", the mean distorting transformation of all, or the coordinates of a cloud: "first", "last", "central"
    (the middle one as given), "best" (the least sum of Dist_F^2), a name or a number. In the frame of the MDT the
    clouds keep their mean rotation and position.
    `method`: "symmetric", with no reference cloud and no shrinkage, or "least_squares", which fits all clouds to the
    first and shrinks them. `names`: names of the clouds for messages, by default numbers.
    `robust`: leave out points that do not correspond to their given partners; otherwise they are only reported. They
    are found by iteratively reweighted least squares with Tukey's biweight, then tested by Hotelling's T^2; in 5 % of
    sets without such points one is named. Not with "icp", which finds partners itself.
    `weights`: weights of points in all fits and in the RMS, (M,) for the rows of all clouds, or (M_i,) for each cloud.
    A row of weight 2 counts as two rows, one of weight 0 as none; only ratios matter. In tests of points a weight is an
    inverse variance. Each cloud counts the same in the MDT.

    Raises ValueError if fewer than two clouds share enough points (n + 1, not in one plane), and for weights that are
    negative, not finite, all 0 in a cloud, or not as many as points.

    >>> import numpy as np
    >>> points = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    >>> moved = 2.0 * points + [[0, 0], [0, 0], [0, 0], [5, 5]]
    >>> register([points, moved], frame="first", weights=[1, 1, 1, 0]).matrices[1].round(12) + 0.0
    array([[0.5, 0. ],
           [0. , 0.5]])
    """
    check_choice("method", method, affine.FITS)
    if check_bool("robust", robust) and correspond == "icp":
        message = "Invalid robust with the correspondence icp. It is for rows and ids, whose partners are given."
        raise ValueError(message)
    arrays, labels = _checked(clouds, names)
    wanted = labels[frame] if isinstance(frame, int) and 0 <= frame < len(labels) else frame
    if not isinstance(wanted, str) or wanted not in (*FRAMES, *labels):
        allowed = listed([*FRAMES, "a cloud by its name or number"], "or")
        raise ValueError(f"Invalid frame '{frame}'. It must be {allowed}.")
    counted = _weights(weights, arrays, labels)
    points, counts = correspondences.corresponding_points(arrays, counted, labels, correspond, ids)
    kept, reasons = affine.kept_clouds(points, counts, first_only=method == "least_squares")
    left_out = tuple(LeftOut(labels[i], reason) for i, reason in reasons.items())
    if len(kept) < 2:
        why = "; ".join(f"'{one.name}': {one.reason}" for one in left_out)
        raise ValueError(f"Invalid clouds. Fewer than two share points enough; {why}.")
    labels, arrays, counted = [labels[i] for i in kept], [arrays[i] for i in kept], [counted[i] for i in kept]
    points, counts = points[kept], counts[kept]
    fit = affine.consensus if method == "symmetric" else affine.onto_first
    wrong = np.zeros(counts.shape, dtype=bool) if correspond == "icp" else _wrong(fit, points, counts)
    right = np.where(wrong, 0.0, counts)
    chosen = right if robust else counts
    group, mirrored = affine.upright(fit(points, chosen))
    found, sums = mdt(group.A), np.array([affine.dist_squares(A, group.A).sum() for A in group.A])
    rotation = mean_rotation(group.A[~mirrored], T=found.T)
    to_mdt = rotation.q @ np.linalg.inv(found.T)
    A, shift = (np.einsum("ij,nj...->ni...", to_mdt, part) for part in (group.A, group.shift))
    # Points keep their mean position, as their mean rotation.
    moves, there = points - affine.placed(A, shift, points), chosen > 0.0
    shift = shift + np.average(moves[there], axis=0, weights=chosen[there])
    for one in left_out:
        if one.name == wanted:
            raise ValueError(f"Invalid frame '{wanted}'. That cloud is left out: {one.reason}.")
    reference = labels.index(wanted) if wanted in labels else _references(sums).get(wanted)
    if reference is not None:
        own = group.A[reference]
        A = np.linalg.solve(own, group.A)
        shift = np.linalg.solve(own, (group.shift - group.shift[reference]).T).T
    # Squared distances from mean places, without points of only one cloud.
    places, shared = affine.placed(A, shift, points), (chosen > 0.0).sum(axis=0) > 1
    w, gaps = chosen[:, shared], np.where((chosen > 0.0)[..., None], places, 0.0)[:, shared]
    gaps = gaps - np.einsum("im,imn->mn", w, gaps) / w.sum(axis=0)[:, None]
    squares, total = (w * np.sum(gaps**2, axis=2)).sum(axis=1), w.sum(axis=1)
    distances = np.full(counts.shape, np.nan)
    if correspond != "icp":
        # Distances are those from the place that the right points give, of a right one by the fit without it.
        by_all, by_right = (affine.wrong_partners(places, some)[1] for some in (counts, right))
        distances = np.where(wrong | np.isnan(by_right), by_all, by_right)
    marks = tuple(str(k + 1) for k in range(points.shape[1]))
    if correspond == "id" and ids is not None:
        marks = tuple(dict.fromkeys(str(mark) for some in ids for mark in some))
    return Registration(
        names=tuple(labels),
        method=method,
        correspond=correspond,
        frame=wanted,
        reference=reference,
        matrices=A,
        shifts=shift,
        distortions=np.sqrt(affine.dist_squares(np.eye(A.shape[-1]), A)),
        sums=sums,
        mdt_sum=float(found.distances.sum()),
        rms=np.sqrt(squares / total),
        rms_total=float(np.sqrt(squares.sum() / total.sum())),
        used=(w > 0.0).sum(axis=1),
        correlations=group.correlations,
        # Least squares multiplies each canonical axis by its correlation.
        shrinkage=np.log(group.correlations).sum(axis=1) if method == "least_squares" else np.zeros(len(group.A)),
        mirrored=mirrored,
        conditions=np.linalg.cond(np.linalg.solve(found.T, group.A)),
        left_out=left_out,
        points=tuple(arrays),
        converged=group.converged,
        note=rotation.note,
        robust=robust,
        wrong=tuple(
            WrongPoint(labels[i], marks[k], float(distances[i, k]))
            for i, k in sorted(np.argwhere(wrong).tolist(), key=lambda at: -np.nan_to_num(distances[at[0], at[1]]))
        ),
        left_out_distances=distances,
        point_names=marks,
        weights=None if weights is None else tuple(counted),
    )


def _wrong(fit: Callable[[FloatArray, FloatArray], affine.Group], points: FloatArray, weights: FloatArray) -> BoolArray:
    """Flags (N, M) of points that do not correspond to the others, by fits without the wrong ones."""
    wrong = np.zeros(weights.shape, dtype=bool)
    for _ in range(_ROUNDS):
        kept = np.where(wrong, 0.0, weights)
        if len(affine.kept_clouds(points, kept)[0]) < len(points):
            break
        group = fit(points, kept)
        more, _ = affine.wrong_partners(affine.placed(group.A, group.shift, points), kept)
        if not more.any():
            break
        wrong |= more
    return wrong


def _checked(clouds: Sequence[ArrayLike], names: Sequence[str] | None) -> tuple[list[FloatArray], list[str]]:
    """The clouds as arrays, and their names; raises ValueError."""
    arrays = [np.asarray(cloud, dtype=float) for cloud in clouds]
    labels = [str(i) for i in range(len(arrays))] if names is None else [str(name) for name in names]
    if len(labels) != len(arrays):
        raise ValueError(f"Invalid names. There must be {len(arrays)}, one per cloud; there are {len(labels)}.")
    if len(arrays) < 2:
        raise ValueError(f"Invalid clouds. There must be at least two; there {'is one' if arrays else 'are none'}.")
    for name, cloud in zip(labels, arrays, strict=True):
        if cloud.ndim != 2 or cloud.size == 0:
            message = f"Invalid cloud '{name}' of shape {cloud.shape}. It must be (M, n), M points in n dimensions."
            raise ValueError(message)
        if cloud.shape[1] != arrays[0].shape[1]:
            has = f"It has {cloud.shape[1]} coordinates a point, '{labels[0]}' {arrays[0].shape[1]}."
            raise ValueError(f"Invalid cloud '{name}'. {has}")
    return arrays, labels


def _weights(
    given: Sequence[ArrayLike] | ArrayLike | None, clouds: list[FloatArray], names: list[str]
) -> list[FloatArray]:
    """Weights of each cloud's points, scaled so that the largest of all is 1; those of missing points are 0."""
    if given is None:
        return [np.ones(len(cloud)) for cloud in clouds]
    several: list[Any] = list(given) if isinstance(given, (Sequence, np.ndarray)) else [given]
    if all(np.ndim(one) == 0 for one in several):
        several = [several] * len(clouds)
    if len(several) != len(clouds):
        must = f"There must be one for each row, or {len(clouds)} arrays, one per cloud"
        raise ValueError(f"Invalid weights. {must}; there are {len(several)} arrays.")
    found = [
        affine.checked_weights(one, np.asarray(np.isnan(cloud).all(axis=1)), f"Invalid weights of cloud '{name}'.")
        for name, cloud, one in zip(names, clouds, several, strict=True)
    ]
    most = max(float(one.max()) for one in found)
    return [one / most for one in found]


def _references(sums: FloatArray) -> dict[str, int]:
    """Numbers of the clouds for the names in `FRAMES` other than "mdt"."""
    return {"first": 0, "last": len(sums) - 1, "central": len(sums) // 2, "best": int(np.argmin(sums))}


def _shown(names: Sequence[str]) -> str:
    """The first ten names and the number of others."""
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
