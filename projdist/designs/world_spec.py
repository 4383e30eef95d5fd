"""The specification of a map of the world, and the weights of its places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.designs.sites import SYMMETRIES
from projdist.designs.spline_sheets import Cut, CutLike, Splines, SplineSheet, get_cut
from projdist.earth import WGS84
from projdist.matrices import Energy
from projdist.regions import Box, Place, PointSet, RegionLike, get_region
from projdist.support import check_choice, check_number

WORLD_SYMMETRIES = ("auto", *SYMMETRIES)

_DEGREE = 3
_GRADED, _GRADED_FOR_PARTS = 3.0, 2.0  # powers of the distance from a pole, by which cells are finer there
_POINTS = 4  # Gauss points of a cell, either way
_LEAST_ELSEWHERE = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class WorldSpec:
    """The map that is asked for: `region` is None for the whole map, `area` is what is measured."""

    region: Place | None
    area: Place
    cut: Cut
    elsewhere: float
    until: float
    across: bool
    along: bool
    energy: Energy

    @property
    def name(self) -> str:
        """The name of the map."""
        made_for = "World map" if self.region is None else f"World map for {self.region.name}"
        return f"{made_for}, cut at {self.cut.name}"

    @property
    def symmetric(self) -> str:
        """The name of the symmetry."""
        return {(True, True): "both", (True, False): "meridian", (False, True): "equator"}.get(
            (self.across, self.along), "none"
        )

    def sheet(self, cells: int) -> SplineSheet:
        """Splines on cells that are finer toward poles."""
        across = np.linspace(-np.pi, np.pi, cells + 1)
        t = np.linspace(-1.0, 1.0, cells + 1)
        power = 1.0 if self.until < 90.0 else _GRADED if self.region is None else _GRADED_FOR_PARTS
        along = np.radians(self.until) * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** power)
        return SplineSheet(self.cut, Splines(across, _DEGREE), Splines(along, _DEGREE), self.across, self.along)

    def weights(self, sheet: SplineSheet, share: float) -> FloatArray:
        """Weights of the sheet's nodes, (spans of v, spans of u, points v, points u)."""
        u, v, area = sheet.nodes(_POINTS)
        if self.region is None:
            return area
        if isinstance(self.region, PointSet):
            return share * area / area.sum() + _counted(self.region, sheet)
        return area * np.where(self.region.contains(*self.cut.rolled(u, v)), 1.0, share)


def get_world_spec(
    region: RegionLike | None, cut: CutLike, elsewhere: float, until: float, symmetric: str, exponent: float
) -> WorldSpec:
    """The checked specification; raises ValueError."""
    where, end = get_cut(cut), _within("end", until, 10.0, 90.0)
    chosen = None if region is None else get_region(region, WGS84)
    mirrors = check_choice("symmetry", symmetric, WORLD_SYMMETRIES)
    if mirrors == "auto":
        mirrors = "both" if chosen is None and where.is_straight else "none"
    if mirrors != "none" and not where.is_straight:
        raise ValueError(f"Invalid symmetry '{mirrors}' for the cut '{where.name}'. Where it is bent there is none.")
    if end < 90.0 and where.frame is not None and chosen is None:
        raise ValueError(
            f"Invalid end '{until}' for the cut '{where.name}'. A map that ends needs a meridian or a region."
        )
    everything = get_region("globe") if end == 90.0 else Box(-180.0, -end, 180.0, end)
    return WorldSpec(
        region=chosen,
        area=everything if chosen is None else chosen,
        cut=where,
        elsewhere=_within("weight elsewhere", elsewhere, _LEAST_ELSEWHERE, 1.0),
        until=end,
        across=mirrors in ("meridian", "both"),
        along=mirrors in ("equator", "both"),
        energy=Energy(exponent=_within("exponent", exponent, 0.0, 1.0)),
    )


def _within(thing: str, value: float, low: float, high: float) -> float:
    number = check_number(thing, value)
    if not low <= number <= high:
        raise ValueError(f"Invalid {thing} '{value}'. It must be within {low:g} and {high:g}.")
    return number


def _counted(points: PointSet, sheet: SplineSheet) -> FloatArray:
    """The points' weights, which sum to 1, each at the nearest node in its cell of the sheet."""
    u, v = sheet.cut.unrolled(points.lon, points.lat)
    shown = np.abs(v) <= sheet.v.breaks[-1]
    (column, i), (row, j) = _nearest(sheet.u.breaks, u[shown]), _nearest(sheet.v.breaks, v[shown])
    counted = np.zeros((len(sheet.v.breaks) - 1, len(sheet.u.breaks) - 1, _POINTS, _POINTS))
    np.add.at(counted, (row, column, j, i), points.weight[shown])
    if not counted.any():
        raise ValueError(f"Invalid region '{points.name}'. Nothing of it is on the map.")
    return counted / counted.sum()


def _nearest(breaks: FloatArray, t: FloatArray) -> tuple[IntArray, IntArray]:
    """The span of each t, and the nearest of its Gauss points."""
    span = np.clip(np.searchsorted(breaks, t, side="right") - 1, 0, len(breaks) - 2)
    nodes = np.polynomial.legendre.leggauss(_POINTS)[0]
    share = 2.0 * (t - breaks[span]) / (breaks[span + 1] - breaks[span]) - 1.0
    return span, np.searchsorted(0.5 * (nodes[1:] + nodes[:-1]), share)
