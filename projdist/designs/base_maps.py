"""The objective of a map made to measure, the base map that is corrected, and nodes in its plane."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from projdist import decisions, projections
from projdist._typing import BoolArray, FloatArray
from projdist.field import FIGURES, Figure, Nodes, cut_length, nodes_at
from projdist.matrices import Energy, Measure, log_anisotropy, log_areal_scale
from projdist.regions import Place, polygons_of
from projdist.support import Registry, check_choice, check_number, quoted

OnProgress = Callable[[int, int], object] | None
"""Called with the numbers of steps done and of all."""


@dataclass(frozen=True)
class Kind:
    """A kind of map: the PROJ families to start from, and the degrees to try."""

    name: str
    families: tuple[str, ...]
    degrees: range
    adjective: str
    free_scale: bool = True  # a map of the kind may have any scale
    idle: int = 3  # degrees in a row without gain that end the search; for two islands the fifth may gain a lot


KINDS = {
    kind.name: kind
    for kind in (
        Kind("any", ("aeqd", "eqdc", "laea", "aea", "lcc", "stere", "omerc"), range(2, 11), "least-distorting"),
        Kind("conformal", ("lcc", "tmerc", "omerc", "stere"), range(1, 13), "conformal", idle=12),
        Kind("equal-area", ("laea", "aea", "cea"), range(1, 9), "equal-area", free_scale=False),
    )
}


@dataclass(frozen=True)
class DesignObjective:
    """A figure to minimise by maps of a kind, the share of areas in the energy, the norm of ln k, and the exponent."""

    kind: Kind
    figure: Figure
    balance: float = 0.5
    norm: float = 2.0
    exponent: float = 0.0

    @property
    def energy(self) -> Energy:
        """The energy of a general map."""
        return Energy(2.0 * self.balance, 2.0 - 2.0 * self.balance, self.exponent)


CRITERIA_OF_DESIGNS = ("airy_kavrayskiy", "max_scale_error_ppm", "max_log_scale")

_POINT = 1e-6  # degrees: 10 cm
WIDEST = 100.0  # degrees from the middle, beyond which a region needs a map of the world
_FINEST = 20  # largest degree at which the monomials of PROJ's horner are accurate to a nanometre
MOST_POLES = 96
"""The most poles of a conformal map: PROJ takes 50 microseconds a point for as many."""


def design_objective(kind: str, criterion: str, balance: float = 0.5, norm: float | None = None) -> DesignObjective:
    """The checked objective; raises ValueError for unknown names and options that do not go together."""
    wanted = Registry("kind", KINDS).named(kind)
    kind = wanted.name
    check_choice("criterion", criterion, CRITERIA_OF_DESIGNS)
    share = check_within("balance", balance, 0.0, 1.0, open=True)
    if kind != "any" and share != 0.5:
        raise ValueError(f"Invalid balance '{balance}' for {kind} maps. It is for maps of any kind.")
    if kind != "conformal" and (norm is not None or criterion != "airy_kavrayskiy"):
        what, given = ("norm", norm) if norm is not None else ("criterion", criterion)
        raise ValueError(f"Invalid {what} '{given}' for maps of kind {kind}. It is for conformal maps.")
    figure = FIGURES[criterion] if share == 0.5 else _balanced(share)
    if figure.is_maximum:
        if norm is not None:
            raise ValueError(f"Invalid norm '{norm}' with criterion {criterion}. It is for airy_kavrayskiy.")
        return DesignObjective(wanted, figure, share, np.inf)
    return DesignObjective(wanted, figure, share, 2.0 if norm is None else check_within("norm", norm, 2.0, 64.0))


def _balanced(share: float) -> Figure:
    """The Airy-Kavrayskiy error with another share of areas than a half."""
    energy = Energy(2.0 * share, 2.0 - 2.0 * share)

    def root(J: FloatArray) -> FloatArray:
        return np.sqrt(energy.value(J.reshape(-1, 2, 2))).reshape(J.shape[:-2])

    return Figure(
        name=f"balanced_{share:g}",
        description=f"RMS of the distortion in which areas have a share of {share:g}.",
        measure=Measure(f"balanced_{share:g}", root),
        statistic="rms",
        aspect="distortion",
    )


def check_within(thing: str, value: Any, low: float, high: float, *, open: bool = False) -> float:
    """A number from low to high, with `open` between them; raises ValueError."""
    number = check_number(thing, value)
    if not (low < number < high if open else low <= number <= high):
        between = f"above {low:g} and below {high:g}" if open else f"from {low:g} to {high:g}"
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be a number {between}.")
    return number


def check_degree(value: Any) -> int:
    """A degree that PROJ's horner can have; raises ValueError."""
    return _check_whole("degree", value, 1, _FINEST)


def _check_whole(thing: str, value: Any, least: int, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        raise ValueError(f"Invalid {thing} {quoted(value)}. It must be auto, or a whole number from {least} to {most}.")
    return int(value)


def check_poles(value: Any, objective: DesignObjective, region: Place, symmetric: str) -> int | None:
    """A number of poles, None for "auto"; raises ValueError."""
    is_auto = isinstance(value, str) and value == "auto"
    count = None if is_auto else _check_whole("poles", value, 0, MOST_POLES)
    if count != 0 and not (objective.kind.name == "conformal" and objective.figure.is_maximum):
        raise ValueError(f"Invalid poles '{value}'. They are for conformal maps by max_scale_error_ppm, max_log_scale.")
    if count != 0 and not (region.area_km2 and symmetric == "none"):
        raise ValueError(f"Invalid poles '{value}'. They are for regions with an area, and not for symmetric maps.")
    return count


def check_extent(region: Place) -> decisions.Extent:
    """The extent of a region; raises ValueError for a point or a region that is too wide."""
    extent = decisions.extent_of(region)
    if not extent.radius > _POINT:
        raise ValueError(f"Invalid region '{region.name}'. It is a point: all maps are right there.")
    if extent.radius > WIDEST:
        raise ValueError(
            f"Invalid region '{region.name}'. It reaches {extent.radius:.0f} degrees from its middle, and must reach "
            f"at most {WIDEST:.0f}: maps of the world are another task, as they must be cut."
        )
    return extent


# ---- nodes on a base -----------------------------------------------------------------------------

SYMMETRIES: tuple[str, ...] = ("none", "meridian", "equator", "both")

_KEPT = 1e-7  # relative error of scales of a map that is conformal or equal-area: 0.1 ppm
_ROUGH = 1e-3  # share of the region in which rounding may be larger
_SAME = 1e-3  # metres
_ASIDE, _THROWN, _NEAR = 1e-3, 1.0, 1e5  # degrees to neighbours; metres from their middle, least; between them, most
TORN = 1e-9
"""Largest share of a region's area where a base may be torn or mirrored."""


@dataclass(frozen=True)
class BaseNodes:
    """Nodes in the plane of a base map; those without either weight lie on the edge of the region."""

    base: projections.Projection
    lon: FloatArray
    lat: FloatArray
    weight: FloatArray  # (n,), of the region, with the sum 1
    around: FloatArray  # (n,), of the surroundings, with the sum 1
    x: FloatArray  # (n,), metres
    y: FloatArray
    J: FloatArray  # (n, 2, 2)

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
        """Coordinates about the origin, in units of `size`."""
        return (self.x - self.origin.real) / self.size, (self.y - self.origin.imag) / self.size

    @property
    def in_region(self) -> FloatArray:
        """True for nodes (n,) of the region or its edge."""
        return self.around == 0.0

    def weights(self, share: float) -> FloatArray:
        """Weights (n,) that sum to 1, with a share for the surroundings."""
        return (1.0 - share) * self.weight + share * self.around


def base_nodes_of(base: projections.Projection, nodes: Nodes, around: Nodes | None) -> BaseNodes:
    """Nodes of a region and its surroundings on a base map; raises ProjectionError if the map tears the region."""
    both, beside = nodes, np.zeros(nodes.lon.size)
    if around is not None:
        lon, lat = np.append(nodes.lon, around.lon), np.append(nodes.lat, around.lat)
        both = nodes_at(lon, lat, np.append(nodes.weight, np.zeros(around.lon.size)), nodes.ellipsoid)
        beside = np.append(beside, around.weight)
    J, _ = both.jacobian(base)
    x, y = _places(base, both.lon, both.lat)
    smooth = smooth_at(J) & np.isfinite(x + y)
    lost = float(both.weight[~smooth].sum())
    if lost > TORN:
        raise projections.ProjectionError(
            f"Invalid base '{base.label}'. It tears, turns over or does not show {100.0 * lost:.3g} % of the region."
        )
    beside = np.where(smooth, beside, 0.0)
    kept = smooth & ((beside > 0.0) | (np.arange(smooth.size) < nodes.lon.size))
    share = beside / max(beside.sum(), 1e-300)
    return BaseNodes(base, *(values[kept] for values in (both.lon, both.lat, both.weight, share, x, y, J)))


def smooth_at(J: FloatArray) -> BoolArray:
    """True where a map with Jacobians (n, 2, 2) is smooth and not mirrored."""
    det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
    return np.asarray(np.isfinite(det) & (det > 0.0))


def _places(base: projections.Projection, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Coordinates (2, n) in metres; for a misplaced point the middle of its neighbours."""
    # PROJ's omerc misplaces a strip a metre wide, along the meridian where the tangent in its equations is infinite.
    own = np.array(base(lon, lat))
    west, east = np.array(base(lon - _ASIDE, lat)), np.array(base(lon + _ASIDE, lat))
    middle = 0.5 * (west + east)
    thrown = (np.hypot(*(own - middle)) > _THROWN) & (np.hypot(*(east - west)) < _NEAR)
    return np.where(thrown, middle, own)


def mirrored(nodes: BaseNodes, symmetry: str) -> BaseNodes:
    """The nodes and their mirror images, so that the best map is symmetric; ProjectionError if the base is not."""
    middle = central_meridian(nodes.base)
    x, y = nodes.base(np.full(2, middle), np.array([nodes.lat[0], 0.0]))
    axes = np.array([x[0], y[1]])  # through the false origin
    lon, lat = np.array([3.0, 11.0, 7.0]), np.array([20.0, 35.0, 5.0])
    for name, sign in (("meridian", np.array([-1.0, 1.0])), ("equator", np.array([1.0, -1.0]))):
        if symmetry in (name, "both"):
            shift = np.where(sign < 0.0, 2.0 * axes, 0.0)
            one = np.array(nodes.base(middle + lon, lat))
            other = np.array(nodes.base(middle + sign[0] * lon, sign[1] * lat))
            if not np.allclose(one, sign[:, None] * other + shift[:, None], rtol=0.0, atol=_SAME):
                base = f"Invalid base '{nodes.base.label}' for a symmetric map"
                raise projections.ProjectionError(f"{base}. It is not symmetric about the {name}.")
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


def central_meridian(base: projections.Projection) -> float:
    """The longitude of a PROJ string's central meridian, or of its UTM zone's."""
    found = re.search(r"\+(lon_0|zone)=(\S+)", base.definition)
    if found is None:
        return 0.0
    return float(found[2]) if found[1] == "lon_0" else 6.0 * float(found[2]) - 183.0


# ---- base maps -----------------------------------------------------------------------------------


def best_base(region: Place, objective: DesignObjective, nodes: Nodes, symmetry: str) -> projections.Projection:
    """The best member of the kind's families that suit the region; raises ProjectionError."""
    # For maps that are symmetric about the equator it is an azimuthal map centred on the equator.
    kind, extent = objective.kind, decisions.extent_of(region)
    if symmetry in ("equator", "both"):
        name, body = "stere" if kind.name == "conformal" else "laea", decisions.ellipsoid_text(nodes.ellipsoid)
        return projections.Projection.from_user_input(f"+proj={name} +lat_0=0 +lon_0={extent.lon:.7g} {body}")
    scale_matters = objective.figure.is_maximum or not kind.free_scale
    figure = objective.figure if scale_matters else FIGURES["airy_kavrayskiy_scaled"]
    sensible = [name for name in decisions.sensible_families(extent, nodes.ellipsoid) if name in kind.families]
    found: list[tuple[float, projections.Projection]] = []
    for name in sensible or kind.families:
        if name == "omerc" and symmetry == "meridian":
            continue
        try:
            least = min((value for value, _ in found), default=np.inf)
            projection, _ = decisions.best_member(name, region, figure, nodes.ellipsoid, least)
        except projections.ProjectionError:
            continue
        J, _ = nodes.jacobian(projection)
        smooth = smooth_at(J)
        J, weight = J[smooth], nodes.weight[smooth]
        if 1.0 - weight.sum() > TORN or not _keeps(kind, J, weight):
            continue
        if cut_length(projection, region) == 0.0 and projections.crs_wkt(projection, name)[0] is not None:
            found.append((figure(J, weight), projection))
    if not found:
        raise projections.ProjectionError(
            f"Invalid region '{region.name}'. No {kind.name} map of PROJ's shows it whole."
        )
    return min(found, key=lambda one: one[0])[1]


def given_base(given: projections.ProjectionLike) -> projections.Projection:
    """A projection as the PROJ string of the same map; raises ProjectionError if there is none."""
    projection = projections.Projection.from_user_input(given)
    text = projections.parameters_of(projection, np.eye(2))
    if text is None:
        raise projections.ProjectionError(
            f"Invalid base '{projection.label}'. It must be a projection with a PROJ string, in metres to the east "
            "and north."
        )
    return projections.Projection.from_user_input(text)


def check_base(kind: Kind, nodes: BaseNodes, region: Place) -> None:
    """Raise ProjectionError for a base that is cut within the region or not of the kind, which no correction mends."""
    base = nodes.base
    if cut_length(base, region) > 0.0:
        raise projections.ProjectionError(f"Invalid base '{base.label}'. It is cut within {region.name}.")
    if not _keeps(kind, nodes.J, nodes.weight):
        own = "at scale 1" if kind.name == "equal-area" else "itself"
        raise projections.ProjectionError(
            f"Invalid base '{base.label}' for {kind.name} maps. It must be {kind.name} {own}."
        )


def _keeps(kind: Kind, J: FloatArray, weight: FloatArray) -> bool:
    """True if Jacobians with weights of sum 1 are of the kind, except where PROJ rounds, as at a pole."""
    # Conics that are nearly cylindrical are refused: PROJ rounds them everywhere.
    lost = {"conformal": log_anisotropy, "equal-area": log_areal_scale}.get(kind.name)
    return lost is None or float(weight[np.abs(lost(J)) > _KEPT].sum()) <= _ROUGH


_EDGE = 0.25  # degrees: longer edges are divided, because their images are curves
_AREA = 1e-6  # share of the image that overlaps, at least: the edges' images are chords


def overlaps(projection: projections.Projection, region: Place) -> bool | None:
    """True if the image of a region covers itself, for a map that mirrors nowhere; None for points."""
    if not region.area_km2:
        return None
    outline = shapely.segmentize(polygons_of(region), _EDGE)
    image = shapely.transform(outline, lambda points: np.column_stack(projection(points[:, 0], points[:, 1])))
    rings, which = shapely.get_rings(shapely.get_parts(image), return_index=True)
    shell = np.append(True, which[1:] != which[:-1])
    once = float(shapely.union_all(shapely.make_valid(shapely.get_parts(image))).area)
    areas = shapely.area(shapely.polygons(rings))  # what is covered twice counts twice in them
    return bool(float(np.sum(np.where(shell, 1.0, -1.0) * areas)) > once * (1.0 + _AREA))
