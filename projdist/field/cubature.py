"""Adaptive spectral cubature: the panels of a region, evaluated and split where a goal needs it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field import panels as spectral
from projdist.field.at_points import jacobian
from projdist.field.panel_cuts import TEAR, cut, jumps
from projdist.field.panels import Layout, Pieces, Rows, tails
from projdist.matrices import Measure, log_scales
from projdist.numerics import NODES, PLANE_WEIGHTS
from projdist.projections import Projection, discontinuities_of
from projdist.regions import Clips, Region

Integrand = Callable[[FloatArray], FloatArray]
"""A function of Jacobians (n, p, p, 2, 2) whose mean over the region is to be resolved."""

_BATCH = 1500  # panels in one call: 150,000 points
_SMALL = 4e-3  # of the region's area: pieces and panels that may be taken point by point, or given up
_SPLINTER = 1e-4  # likewise, of panels of which the region has only a part
_FEW, _NEXT_TO_NOTHING = 16, 1e-8  # so few pieces are taken point by point only if they are this small a part
_COARSE, _ROUGH = 1e-3, 1e-6  # last coefficients that show a singularity, in whole and in clipped panels
_SMALLEST = 1e-12  # of the region's area; a smaller panel is a singular point
STENCIL = 20  # evaluations of a Jacobian by stencils, near seams
_STRIKES = 2  # splits without gain that prove rounding; one of a cut panel may just have found a singularity
_MARKING = 0.05  # share of the error that may wait for another generation
_TINY, _MINUTE = 1e-5, 1e-11  # of the globe's area: pieces without second derivatives, if stuck and in any case
_LOOSE = 0.5  # of a rectangle: if the region has less of it, the rest may lie beyond an edge of the map
_NOISE = 3e-7  # of the semi-major axis; iterative projections in PROJ stop at a third of that
# Four points on each side of [-1, 1]^2, just within.
_BORDER = (1.0 - 1e-9) * np.array(
    [(u, v) for t in (-1.0, -0.5, 0.0, 0.5) for u, v in ((t, -1.0), (1.0, t), (-t, 1.0), (-1.0, -t))]
).T


@dataclass(frozen=True)
class MeshGoal:
    """What a refinement resolves: the Airy-Kavrayskiy errors if `column` is 0, else the mean of another integrand."""

    column: int
    tolerance: float  # relative where the mean is above 1
    # Share of its error that a panel at the level of rounding keeps when it is split; singular points and lines halve
    # their errors, cuts and resolved parts do far better.
    stuck: float = 0.8
    gives_up: bool = False  # go on beside panels at the level of rounding


@dataclass(kw_only=True)
class _MeasuredPanels(Rows):
    """What is known of each panel; the first axis is the panels'."""

    patch: IntArray
    rectangle: FloatArray
    area: FloatArray
    covered: FloatArray
    undecided: BoolArray  # an edge of the map crosses it, and is not found yet
    clipped: BoolArray  # it is only partly in the region
    cut: BoolArray
    split_at: FloatArray  # u and v; NaN for a direction in which a split would not help
    integrals: FloatArray
    tails: FloatArray  # last Legendre coefficients of each integrand, in u and in v
    errors: FloatArray  # of each integral, in u and in v
    unresolved: FloatArray  # last Legendre coefficients of x and y, in semi-major axes
    strikes: IntArray  # splits in a row, up to this panel, that gained nothing; those of uncut panels count double
    alive: BoolArray  # not split yet


class Mesh:
    """The panels of a region under a projection, and the integrals of ln^2 a + ln^2 b, ln(a b) and others over them."""

    def __init__(
        self, projection: Projection, region: Region, integrands: Sequence[Integrand], second_order: Sequence[Measure]
    ) -> None:
        self.plan = spectral.plan_of(region, projection.ellipsoid)
        self.projection, self.region = projection, self.plan.region  # the plan's own has its parts at hand
        self.integrands, self.second_order = tuple(integrands), tuple(second_order)
        self.limited = False  # whether the map is known to end within the region
        self.peaks = np.zeros(2 + len(self.integrands) + len(self.second_order))  # largest value seen of each integrand
        self.pieces: list[Pieces] = []
        first = self.plan.first(discontinuities_of(projection))
        self.evaluations = first.lon.size
        patch, rectangles, layout = first.layout.patch, first.clips.rectangles, first.layout
        every = np.stack(projection(first.lon, first.lat))
        xy = every[:, : layout.lon.size].reshape(2, *layout.lon.shape)
        sides = every[:, layout.lon.size :].reshape(2, len(patch), 2, 2, -1)
        lines = np.stack([xy[..., spectral.LINES], xy[..., spectral.LINES, :].swapaxes(-1, -2)], axis=2)
        torn = spectral.torn_sides(projection, region, patch, rectangles, lines, sides)
        if torn.any():
            patch, rectangles, evaluations = spectral.without_seams(projection, region, patch, rectangles, torn)
            self.evaluations += evaluations
            self.panels = _MeasuredPanels.joined(self._evaluated(0, patch, rectangles)[0])
        else:
            self.panels = self._assessed(0, first.clips, layout, xy)

    def _evaluated(
        self, first: int, patch: IntArray, rectangles: FloatArray, within: FloatArray | None = None
    ) -> tuple[list[_MeasuredPanels], IntArray]:
        """New panels in batches, numbered from `first`, and the indices of the rectangles that meet the region."""
        clips = self.region.clip(patch, rectangles, within)
        parts = []
        for start in range(0, len(clips.kept), _BATCH):
            some = clips.take(slice(start, start + _BATCH))
            layout = self.plan.layout(patch[some.kept], some)
            xy = np.stack(self.projection(layout.lon, layout.lat))
            self.evaluations += layout.lon.size
            parts.append(self._assessed(first + start, some, layout, xy))
        return parts, clips.kept

    def _assessed(self, first: int, clips: Clips, layout: Layout, xy: FloatArray) -> _MeasuredPanels:
        """Panels of a layout where the map is x, y (2, n, p, p)."""
        _, rectangles, _, filled = clips
        n, patch = len(rectangles), layout.patch
        curved = bool(self.second_order)
        pieces = spectral.pieces_of(self.projection, np.arange(n), layout, xy, curved=curved)
        area = layout.area
        split_at = 0.5 * (rectangles[:, 0::2] + rectangles[:, 1::2])
        whole, empty = self._inside(patch, rectangles, xy[0])
        undecided = ~(whole | empty)
        done = np.zeros(n, dtype=bool)
        torn = whole & (pieces.unresolved > TEAR)
        if torn.any():
            torn[torn] = jumps(xy[:, torn], TEAR * self.projection.ellipsoid.a)
        hard = np.flatnonzero(torn | undecided)
        if hard.size:
            cuts = cut(self.projection, self.region, hard, patch[hard], rectangles[hard], filled[hard], curved=curved)
            self.evaluations += cuts.evaluations
            done[hard] = cuts.done
            guided = np.isfinite(cuts.split_at).any(axis=-1)
            split_at[hard[guided]] = cuts.split_at[guided]
            # If the map ends beside the region, in the same rectangle, only a smaller rectangle can show it.
            loose = undecided & ~done & (area < _LOOSE * (pieces.density * PLANE_WEIGHTS).sum(axis=(1, 2)))
            split_at[loose, 0], split_at[loose, 1] = np.nan, 0.5 * rectangles[loose, 2:].sum(axis=1)
            pieces = Pieces.joined([pieces.take(whole & ~done), *cuts.pieces])
            self._mend(pieces, torn[pieces.panel])
        elif not whole.all():
            pieces = pieces.take(whole)
        covered = area if whole.all() and not done.any() else pieces.weight.sum(axis=(1, 2))
        own = pieces.panel
        integrals, last, errors = self._integrate(pieces, covered)
        unresolved = np.where(np.isnan(pieces.unresolved), np.inf, pieces.unresolved)
        if covered is not area:
            covered, integrals, last, errors = (_summed(one, own, n) for one in (covered, integrals, last, errors))
            unresolved = _summed(unresolved, own, n, np.maximum)
        panels = _MeasuredPanels(
            patch=patch,
            rectangle=rectangles,
            area=area,
            covered=covered,
            undecided=undecided & ~done,
            clipped=~filled,
            cut=done,
            split_at=split_at,
            integrals=integrals,
            tails=last,
            errors=errors,
            unresolved=unresolved,
            strikes=np.zeros(n, dtype=int),
            alive=np.ones(n, dtype=bool),
        )
        pieces.panel = own + first
        self.pieces.append(pieces)
        return panels

    def _inside(self, patch: IntArray, rectangles: FloatArray, x: FloatArray) -> tuple[BoolArray, BoolArray]:
        """The panels that the map covers wholly, and those that it does not cover at all."""
        inside = np.isfinite(x)
        whole, empty = np.asarray(inside.all(axis=(1, 2))), np.asarray(~inside.any(axis=(1, 2)))
        if not self.limited and whole.all():
            return whole, empty
        # An edge of the map may clip a corner of a panel between the nodes and its sides.
        self.limited = True
        half = 0.5 * (rectangles[:, 1::2] - rectangles[:, 0::2])
        centre = 0.5 * (rectangles[:, 1::2] + rectangles[:, 0::2])
        u, v = (centre[:, k, None] + half[:, k, None] * _BORDER[k] for k in (0, 1))
        points = self.region.chart(patch[:, None], u, v)
        border = np.isfinite(self.projection(points.lon, points.lat)[0])
        self.evaluations += border.size
        return whole & border.all(axis=1), empty & ~border.any(axis=1)

    def _mend(self, pieces: Pieces, suspects: BoolArray) -> None:
        """Take the Jacobian point by point, from one side only, where seams are too tangled to cut."""
        # It costs 20 times as much: it is done in small pieces, and if these are few, as about a singular point, where
        # splitting soon helps, in very small ones. Areas are shares of the globe, as ellipsoids may differ.
        share = pieces.weight.sum(axis=(1, 2)) / self.projection.ellipsoid.area
        whole = 1e6 * self.region.area_km2 / self.region.figure.area
        ragged = np.flatnonzero(suspects & (pieces.unresolved > TEAR) & (share < _SMALL * whole))
        if ragged.size <= _FEW:
            ragged = ragged[share[ragged] < _NEXT_TO_NOTHING * whole]
        if ragged.size:
            J = jacobian(self.projection, pieces.lon[ragged], pieces.lat[ragged])
            pieces.jacobian[ragged] = np.where(np.isfinite(J), J, pieces.jacobian[ragged])
            self.evaluations += STENCIL * pieces.lon[ragged].size

    def _integrate(self, pieces: Pieces, area: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Integrals (n, m), their tails and errors (n, m, 2) in u and v, over pieces of an area (n,)."""
        J = pieces.jacobian
        found = [*log_scales(J), *(integrand(J) for integrand in self.integrands)]
        if self.second_order:
            H = self.second_derivatives(pieces)
            found += [integrand(J, H) for integrand in self.second_order]
        values = np.array(found)
        if not np.isfinite(values).all():
            values = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
        self.peaks = np.maximum(self.peaks, np.abs(values).max(axis=(1, 2, 3), initial=0.0))
        last, errors = tails(values, pieces.density, pieces.share)
        # A tear too small to be cut makes J large and smooth: the integrands' own coefficients see nothing of that.
        # ln^2 a + ln^2 b changes by 2 |ln sigma| times a small change of the logarithms, and by its square.
        doubt = pieces.doubt
        if doubt.any():
            level = np.sqrt(np.maximum(values[0].mean(axis=(1, 2)), 0.0))[:, None]
            for column, share in ((0, doubt * (2.0 * level + doubt)), (1, doubt)):
                last[column] += area[:, None] * share
                errors[column] += area[:, None] * share
        values *= pieces.weight
        return values.sum(axis=(2, 3)).T, last.swapaxes(0, 1), errors.swapaxes(0, 1)

    def second_derivatives(self, pieces: Pieces) -> FloatArray:
        """H (n, p, p, 2, 2, 2) along geodesics at the nodes of pieces, in units of the semi-major axis."""
        H = spectral.second_derivatives(pieces, self.projection.ellipsoid) * self.projection.ellipsoid.a
        self._forget(H, pieces, pieces.weight.sum(axis=(1, 2)) < _MINUTE * self.projection.ellipsoid.area)
        return H

    def _forget(self, H: FloatArray, pieces: Pieces, some: BoolArray) -> None:
        """Put NaN into H in those of some pieces whose J has no derivatives, at kinks and beside singular points."""
        index = np.flatnonzero(some)
        H[index[spectral.blurred(pieces, index, self.projection.ellipsoid)]] = np.nan

    # ---- splitting ----------------------------------------------------------------------

    def refine(self, goal: MeshGoal, most: int) -> str:
        """Split panels until the goal is met (""), or "rounding" or the number of evaluations ("budget") stops it."""
        self.panels.strikes[:] = 0
        while True:
            chosen, limit = self._to_split(goal)
            if not chosen.size:
                return limit
            if self.evaluations + 2 * NODES.size**2 * chosen.size > most:
                return "budget"
            self._split(chosen, goal)

    @property
    def region_area(self) -> float:
        """Area of the region in m^2, on the projection's ellipsoid."""
        return float(self.panels.area[self.panels.alive].sum())

    def _to_split(self, goal: MeshGoal) -> tuple[IntArray, str]:
        """The panels to split next, and what limits the accuracy if there are none."""
        panels = self.panels
        none = np.empty(0, dtype=int)
        covered = float(panels.covered[panels.alive].sum())
        if covered > 0.0:
            means = panels.integrals[panels.alive].sum(axis=0) / covered
            sensitivity = np.zeros(len(means))  # the weight of an error of each mean, in tolerances
            if goal.column:
                sensitivity[goal.column] = 1.0 / (goal.tolerance * max(1.0, abs(float(means[goal.column]))))
            else:
                square, log_area = float(means[0]), float(means[1])
                # d sqrt(q) = dq / (2 sqrt q). Where the scaled error nearly vanishes its relative accuracy is enough.
                scaled = np.sqrt(max(square - 0.5 * log_area**2, 0.0))
                # Over polygons weights may be negative, and so may the mean of a square that is next to nothing.
                root = max(scaled, 0.01 * np.sqrt(max(square, 0.0)), goal.tolerance)
                sensitivity[:2] = 0.5 / root, 0.5 * abs(log_area) / root
                sensitivity /= goal.tolerance
            # A panel whose edge is not found yet may hold as much as the worst.
            unknown = np.where(panels.undecided, (self.peaks @ sensitivity) * panels.area, 0.0)
            error = (panels.errors.sum(axis=-1) @ sensitivity + unknown) / covered  # in tolerances
        else:
            error = np.where(panels.undecided | (panels.area > _SMALL * self.region_area), np.inf, 0.0)
        error = np.where(panels.alive, error, 0.0)
        if error.sum() <= 1.0:
            return none, ""
        can = panels.alive & (panels.strikes < _STRIKES) & (panels.area > _SMALLEST * self.region_area)
        least = 1.0 if goal.gives_up else 0.1 * error[~can].sum()
        if error[can].sum() < least:
            return none, "rounding"
        # Leave the small errors that together are half of the tolerance, or little of the sum.
        order = np.argsort(error)
        small = np.searchsorted(np.cumsum(error[order]), max(0.5, _MARKING * error[can].sum()))
        return order[small:][can[order[small:]]], "rounding"

    def _split(self, chosen: IntArray, goal: MeshGoal) -> None:
        """Replace panels by halves, or by quarters where both directions need it."""
        panels = self.panels
        in_u, in_v = panels.errors[chosen, goal.column].T
        u0, u1, v0, v1 = panels.rectangle[chosen].T
        um, vm = panels.split_at[chosen].T
        can_u, can_v = np.isfinite(um), np.isfinite(vm)
        similar = np.minimum(in_u, in_v) > 0.1 * np.maximum(in_u, in_v)
        by_u = can_u & (similar | (in_u >= in_v) | ~can_v)
        by_v = can_v & (similar | (in_u < in_v) | ~can_u)
        corner_u, corner_v = np.where(by_u, um, u1), np.where(by_v, vm, v1)
        parts = [
            (np.ones(chosen.size, dtype=bool), (u0, corner_u, v0, corner_v)),
            (by_u, (um, u1, v0, corner_v)),
            (by_v, (u0, corner_u, vm, v1)),
            (by_u & by_v, (um, u1, vm, v1)),
        ]
        rectangles = np.concatenate([np.stack(edges, axis=-1)[mask] for mask, edges in parts])
        parent = np.concatenate([np.flatnonzero(mask) for mask, _ in parts])
        first = len(panels.patch)
        panels.alive[chosen] = False
        new, kept = self._evaluated(first, panels.patch[chosen][parent], rectangles, panels.rectangle[chosen][parent])
        self.panels = _MeasuredPanels.joined([panels, *new])
        self._judge(chosen, parent[kept], first + np.arange(len(kept)), goal)

    def _judge(self, chosen: IntArray, parent: IntArray, children: IntArray, goal: MeshGoal) -> None:
        """Give strikes to panels that resolve the map but gained nothing when split: their errors are rounding."""
        panels = self.panels
        before = panels.tails[chosen, goal.column].sum(axis=-1)
        after = _summed(panels.tails[children, goal.column].sum(axis=-1), parent, chosen.size)
        # In a panel that was cut, only a split across the cut shows progress, and it always does.
        was_cut, across = panels.cut[chosen], np.isnan(panels.split_at[chosen]).any(axis=-1)
        stuck = (after > goal.stuck * before) & ~panels.undecided[chosen] & (across | ~was_cut)
        resolved = (panels.cut[children] & was_cut[parent]) | (panels.unresolved[children] < _NOISE)
        np.logical_and.at(stuck, parent, resolved & ~panels.undecided[children])
        # Rounding is small in large panels: there it is a singularity that the nodes had missed.
        # Integrands come in any unit; as for goals, their size counts where their mean is above 1.
        level = max(self.region_area, abs(float(panels.integrals[panels.alive, goal.column].sum()))) / self.region_area
        # Beside the region there may be a singularity, which smaller panels will leave outside.
        small = panels.area[chosen] < np.where(panels.clipped[chosen], _SPLINTER, _SMALL) * self.region_area
        coarse = np.where(panels.clipped[chosen], _ROUGH, _COARSE) * level * panels.area[chosen]
        stuck &= small | (before < coarse)
        strikes = panels.strikes[chosen] + np.where(was_cut, 1, _STRIKES)
        panels.strikes[children] = np.where(stuck, strikes, 0)[parent]
        # Noise in x and y makes twice as much in J when a panel is halved: take the whole ones back.
        worse = stuck & ~was_cut & (after > before)
        panels.alive[chosen[worse]], panels.alive[children[worse[parent]]] = True, False
        panels.strikes[chosen[worse]] = _STRIKES

    # ---- the result ---------------------------------------------------------------------

    def leaves(self) -> Pieces:
        """The pieces of all panels that were not split, with second derivatives if integrands need them."""
        pieces = Pieces.joined(self.pieces)
        pieces = pieces.take(self.panels.alive[pieces.panel])
        if not self.second_order:
            return pieces
        H = self.second_derivatives(pieces)
        panels = self.panels
        bent = np.s_[:, -len(self.second_order) :]
        lost = (panels.errors.sum(axis=-1)[bent] > np.abs(panels.integrals[bent])).any(axis=1)
        given_up = (lost | (panels.strikes >= _STRIKES)) & (panels.area < _TINY * self.projection.ellipsoid.area)
        self._forget(H, pieces, given_up[pieces.panel])
        return replace(pieces, hessian=H)


def _summed(values: FloatArray, index: IntArray, n: int, ufunc: np.ufunc = np.add) -> FloatArray:
    """Values (m, ...) added up, or gathered by another ufunc, into the n places of an index (m,)."""
    total = np.zeros((n, *values.shape[1:]))
    ufunc.at(total, index, values)
    return total
