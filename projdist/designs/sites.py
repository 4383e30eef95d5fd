"""A region and its surroundings as fixed nodes in the plane of a base map."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from projdist._typing import FloatArray
from projdist.field import Nodes, nodes_at
from projdist.projections import Projection, ProjectionError

__all__ = ["Site", "site_of"]

_TORN = 1e-9  # of the region's area: nodes at which the base is not smooth, or turns over


@dataclass(frozen=True)
class Site:
    """Nodes with what the base makes of them.

    `x`, `y` (n,) in metres and Jacobians `J` (n, 2, 2) are the base's; `weight` (n,) sums to 1 over the region;
    `around` (n,) are the weights of the surroundings, which sum to 1, too; nodes of neither lie on the region's edge.
    """

    base: Projection
    lon: FloatArray
    lat: FloatArray
    weight: FloatArray
    around: FloatArray
    x: FloatArray
    y: FloatArray
    J: FloatArray

    @property
    def origin(self) -> complex:
        """The middle of the region on the base, to the metre."""
        x, y = np.round([np.sum(self.weight * self.x), np.sum(self.weight * self.y)])
        return complex(x, y)

    @property
    def size(self) -> float:
        """The greatest distance from the origin, to the metre."""
        return float(np.ceil(np.abs(self.x + 1j * self.y - self.origin).max()))

    @property
    def plane(self) -> tuple[FloatArray, FloatArray]:
        """Coordinates about the origin, at most 1."""
        return (self.x - self.origin.real) / self.size, (self.y - self.origin.imag) / self.size

    @property
    def in_region(self) -> FloatArray:
        """Which nodes (n,) are of the region or its edge."""
        return self.around == 0.0

    def weights(self, share: float) -> FloatArray:
        """Weights (n,) that sum to 1, of which the surroundings have a share."""
        return (1.0 - share) * self.weight + share * self.around

    def scaled(self, factor: float) -> Site:
        """The same with a base of another scale."""
        return replace(self, x=factor * self.x, y=factor * self.y, J=factor * self.J)


def site_of(base: Projection, nodes: Nodes, around: Nodes | None) -> Site:
    """Nodes of a region and of its surroundings on a base; raises ProjectionError for one that tears the region."""
    if around is not None:
        both = nodes_at(
            np.append(nodes.lon, around.lon),
            np.append(nodes.lat, around.lat),
            np.append(nodes.weight, np.zeros(around.lon.size)),
            nodes.ellipsoid,
        )
        beside = np.append(np.zeros(nodes.lon.size), around.weight)
    else:
        both, beside = nodes, np.zeros(nodes.lon.size)
    J, _ = both.jacobian(base)
    x, y = base(both.lon, both.lat)
    det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
    smooth = np.isfinite(x + y + det) & (det > 0.0)
    lost = float(both.weight[~smooth].sum())
    if lost > _TORN:
        raise ProjectionError(
            f"Invalid base '{base.label}'. It tears, turns over or does not show {100.0 * lost:.2g} % of the region."
        )
    beside = np.where(smooth, beside, 0.0)
    site = Site(base, both.lon, both.lat, both.weight, beside / max(beside.sum(), 1e-300), x, y, J)
    kept = smooth & ((beside > 0.0) | (np.arange(smooth.size) < nodes.lon.size))
    return replace(
        site,
        **{name: getattr(site, name)[kept] for name in ("lon", "lat", "weight", "around", "x", "y", "J")},
    )
