"""Fixed nodes of a region and its surroundings in the plane of a base map."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray
from projdist.field import Nodes, nodes_at
from projdist.projections import Projection, ProjectionError
from projdist.regions import Place, polygons_of

SYMMETRIES = ("none", "meridian", "equator", "both")

_SAME = 1e-3  # metres
_ASIDE, _THROWN, _NEAR = 1e-3, 1.0, 1e5  # degrees to neighbours, least metres from their middle, most between them
TORN = 1e-9
"""Largest share of a region's area in which a base may be not smooth or mirrored."""


@dataclass(frozen=True, kw_only=True)
class BaseNodes:
    """Nodes with their coordinates `x`, `y` (n,) in metres and Jacobians `J` (n, 2, 2) on the base.

    `weight` (n,) sums to 1 over the region; `around` (n,) are the weights of the surroundings, which also sum to 1;
    nodes without either lie on the region's edge.
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
        """True for nodes (n,) of the region or its edge."""
        return self.around == 0.0

    def weights(self, share: float) -> FloatArray:
        """Weights (n,) that sum to 1, with a share for the surroundings."""
        return (1.0 - share) * self.weight + share * self.around


def base_nodes_of(base: Projection, nodes: Nodes, around: Nodes | None) -> BaseNodes:
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
    x, y = _places(base, both.lon, both.lat)
    smooth = smooth_at(J) & np.isfinite(x + y)
    lost = float(both.weight[~smooth].sum())
    if lost > TORN:
        raise ProjectionError(
            f"Invalid base '{base.label}'. It tears, turns over or does not show {100.0 * lost:.2g} % of the region."
        )
    beside = np.where(smooth, beside, 0.0)
    share = beside / max(beside.sum(), 1e-300)
    base_nodes = BaseNodes(base=base, lon=both.lon, lat=both.lat, weight=both.weight, around=share, x=x, y=y, J=J)
    kept = smooth & ((beside > 0.0) | (np.arange(smooth.size) < nodes.lon.size))
    return replace(
        base_nodes,
        **{name: getattr(base_nodes, name)[kept] for name in ("lon", "lat", "weight", "around", "x", "y", "J")},
    )


def smooth_at(J: FloatArray) -> BoolArray:
    """True where a map with Jacobians (n, 2, 2) is smooth and not mirrored."""
    det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
    return np.asarray(np.isfinite(det) & (det > 0.0))


def _places(base: Projection, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Coordinates (2, n) in metres; for a point far from both neighbours the middle of these.

    PROJ's omerc misplaces a strip a metre wide, along the meridian where the tangent in its equations is infinite.
    """
    own = np.array(base(lon, lat))
    west, east = np.array(base(lon - _ASIDE, lat)), np.array(base(lon + _ASIDE, lat))
    middle = 0.5 * (west + east)
    thrown = (np.hypot(*(own - middle)) > _THROWN) & (np.hypot(*(east - west)) < _NEAR)
    return np.where(thrown, middle, own)


def mirrored(nodes: BaseNodes, symmetry: str) -> BaseNodes:
    """The nodes and their mirror images, so that the best map is symmetric; ProjectionError if the base is not."""
    middle = central_meridian(nodes.base)
    x, y = nodes.base(np.full(2, middle), np.array([nodes.lat[0], 0.0]))
    axes = np.array([x[0], y[1]])
    for name, sign in (("meridian", np.array([-1.0, 1.0])), ("equator", np.array([1.0, -1.0]))):
        if symmetry in (name, "both"):
            shift = np.where(sign < 0.0, 2.0 * axes, 0.0)
            _check_symmetric(nodes.base, name, middle, sign, shift)
            nodes = replace(
                nodes,
                lon=np.tile(nodes.lon, 2),
                lat=np.tile(nodes.lat, 2),
                weight=np.tile(0.5 * nodes.weight, 2),
                around=np.tile(0.5 * nodes.around, 2),
                x=np.append(nodes.x, sign[0] * nodes.x + shift[0]),
                y=np.append(nodes.y, sign[1] * nodes.y + shift[1]),
                J=np.concatenate([nodes.J, sign[:, None] * nodes.J * sign]),
            )
    return nodes


def central_meridian(base: Projection) -> float:
    """The longitude of a PROJ string's central meridian, or of its UTM zone's."""
    found = re.search(r"\+(lon_0|zone)=(\S+)", base.definition)
    if found is None:
        return 0.0
    return float(found[2]) if found[1] == "lon_0" else 6.0 * float(found[2]) - 183.0


def _check_symmetric(base: Projection, name: str, middle: float, sign: FloatArray, shift: FloatArray) -> None:
    """Raise ProjectionError for a base that is not symmetric about its false origin."""
    lon, lat = np.array([3.0, 11.0, 7.0]), np.array([20.0, 35.0, 5.0])
    one = np.array(base(middle + lon, lat))
    other = np.array(base(middle + sign[0] * lon, sign[1] * lat))
    if not np.allclose(one, sign[:, None] * other + shift[:, None], rtol=0.0, atol=_SAME):
        raise ProjectionError(f"Invalid base '{base.label}' for a symmetric map. It is not symmetric about the {name}.")


# ---- overlaps ------------------------------------------------------------------------------------


_EDGE = 0.25  # degrees: longer edges are divided, so that their images bend
_AREA = 1e-6  # share of the image that overlaps, at least: the edges' images are chords


def overlaps(projection: Projection, region: Place) -> bool | None:
    """True if the image of a region covers itself, for a map that mirrors nowhere; None for points."""
    if not region.area_km2:
        return None
    outline = shapely.segmentize(polygons_of(region), _EDGE)
    image = shapely.transform(outline, lambda points: np.column_stack(projection(points[:, 0], points[:, 1])))
    rings, which = shapely.get_rings(shapely.get_parts(image), return_index=True)
    shell = np.append(True, which[1:] != which[:-1])
    once = float(shapely.union_all(shapely.make_valid(shapely.get_parts(image))).area)
    # An area that is covered twice counts twice in the areas within the rings.
    signed = float(np.sum(np.where(shell, 1.0, -1.0) * np.abs([_turned(ring) for ring in rings])))
    return bool(signed > once * (1.0 + _AREA))


def _turned(ring: shapely.LinearRing) -> float:
    """The signed area within a ring."""
    x, y = shapely.get_coordinates(ring).T
    x, y = x - x[0], y - y[0]
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
