"""Low-distortion projections: what a surveyor measures on the ground is what the coordinates say.

The combined factor of a point is k R_G / (R_G + h): the scale factor of a conformal map, reduced from the
ellipsoid to the ellipsoidal height h (not an orthometric one: that is lower by the geoid's height) with the
Gaussian mean radius of curvature R_G = sqrt(M N). The distortion is combined factor - 1, in parts per million.

Only the axis needs a search: for the three criteria the best scale factor k_0 on it has a closed form.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.answer import Answer
from projdist.ellipsoid import Ellipsoid
from projdist.families import Extent, ellipsoid_text, extent_of, get_family
from projdist.measures import areal_scale
from projdist.nodes import Nodes, nodes_at, nodes_of
from projdist.projections import (
    Projection,
    ProjectionError,
    crs_wkt,
    geodetic_ellipsoid,
    number_text,
    with_parameters,
)
from projdist.regions import Place, PointSet, get_region
from projdist.search import descend_lattice, lattice, minimise

__all__ = ["LDP", "LDP_CRITERIA", "LDP_FAMILIES", "HeightStatistics", "distortion_ppm", "elevation_factor", "ldp"]

_SHARES = (5, 10, 20, 50)  # ppm
_NODES, _SEARCHED = 4000, 400  # points of a region of one height, and about how many the search looks at
_SAME = 0.02  # ppm, far less than the rounding of k_0 costs: the family that was named first is as good
_WIDEST = 60.0  # degrees: regions beyond that have no low distortion
_STARTS, _LATTICE = 3, 24  # of the descents to whole numbers; places tried before
_COARSE = (64.0, 8.0, 1.0)  # steps of the axis, in units of its rounding
_EAST, _NORTH = 10_000.0, 10_000.0  # metres: what false eastings and northings are multiples of
_ORIGIN = 1 / 6  # degrees: what the latitude of origin is a multiple of


@dataclass(frozen=True)
class HeightStatistics:
    """Distortion at heights, in ppm; `within` the share of the points, or of the area, within so many ppm."""

    min: float
    max: float
    mean: float
    std: float
    rms: float
    within: dict[float, float]

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        within = {f"{ppm:g}": share for ppm, share in self.within.items()}
        return {"min": self.min, "max": self.max, "mean": self.mean, "std": self.std, "rms": self.rms, "within": within}


@dataclass(frozen=True)
class LDP(Answer):
    """A low-distortion projection, and how low its distortion is.

    `lon`, `lat`, `height`, `weight`, `ppm` are the points it was made for. `baselines` are other maps on the same
    points, `others` the best of the other families. `wkt` is WKT2, `esri` Esri's WKT; either may be None.
    """

    region: Place
    family: str
    criterion: str
    target_ppm: float
    parameters: dict[str, float]
    projection: Projection
    wkt: str | None
    esri: str | None
    statistics: HeightStatistics
    baselines: tuple[tuple[str, HeightStatistics], ...]
    others: tuple[LDP, ...]
    lon: FloatArray = field(repr=False, compare=False)
    lat: FloatArray = field(repr=False, compare=False)
    height: FloatArray = field(repr=False, compare=False)
    weight: FloatArray = field(repr=False, compare=False)
    ppm: FloatArray = field(repr=False, compare=False)

    @property
    def proj(self) -> str:
        """The PROJ string."""
        return self.projection.definition

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "family": self.family,
            "criterion": self.criterion,
            "target_ppm": self.target_ppm,
            "parameters": self.parameters,
            "points": self.lon.size,
            "height": {"min": float(self.height.min()), "max": float(self.height.max()), "kind": "ellipsoidal"},
            "statistics": self.statistics.to_dict(),
            "baselines": [{"name": name} | statistics.to_dict() for name, statistics in self.baselines],
            "others": [{"family": o.family, "proj": o.proj, "statistics": o.statistics.to_dict()} for o in self.others],
            "proj": self.proj,
            "wkt": self.wkt,
            "esri_wkt": self.esri,
        }

    def _table(self) -> dict[str, FloatArray]:
        """A row a point."""
        return {"lon": self.lon, "lat": self.lat, "height": self.height, "ppm": self.ppm, "weight": self.weight}


def elevation_factor(lat: ArrayLike, height: ArrayLike, ellipsoid: Ellipsoid) -> FloatArray:
    """R_G / (R_G + h) at latitudes in degrees and ellipsoidal heights in metres.

    >>> from projdist.ellipsoid import WGS84
    >>> round(float(elevation_factor(39.2, 1610.152, WGS84)), 8)
    0.99974744
    """
    meridian, vertical = ellipsoid.radii(lat)
    radius = np.sqrt(meridian * vertical)
    return np.asarray(radius / (radius + np.asarray(height, dtype=float)))


def distortion_ppm(projection: Any, lon: ArrayLike, lat: ArrayLike, height: ArrayLike) -> FloatArray:
    """Combined factor - 1, in ppm, at points in degrees and ellipsoidal heights in metres.

    The scale factor is the geometric mean of the principal scales, which a conformal map has in all directions.
    """
    projection = Projection.from_user_input(projection)
    lon, lat, height = np.broadcast_arrays(*(np.asarray(value, dtype=float) for value in (lon, lat, height)))
    nodes = nodes_at(lon.ravel(), lat.ravel(), np.ones(lon.size), projection.ellipsoid)
    scale = np.sqrt(areal_scale(nodes.jacobian(projection)[0])).reshape(lon.shape)
    return 1e6 * (scale * elevation_factor(lat, height, projection.ellipsoid) - 1.0)


# ---- criteria -------------------------------------------------------------------------------

Factors = FloatArray  # combined factors with k_0 = 1
Best = Callable[[Factors, FloatArray, float], float]
Order = Callable[[FloatArray, FloatArray, float], tuple[float, float]]


def _rms_scale(q: Factors, w: FloatArray, target: float) -> float:
    return float(np.sum(w * q) / np.sum(w * q * q))


def _middle_scale(q: Factors, w: FloatArray, target: float) -> float:
    return float(2.0 / (q.max() + q.min()))


def _crowded_scale(q: Factors, w: FloatArray, target: float) -> float:
    """The k_0 with the most weight of points within the target; of all that have as much the one of least RMS.

    A point is within it for k_0 from (1 - t) / q to (1 + t) / q: where most of these intervals overlap is found in one
    walk along their ends.
    """
    ends = np.concatenate([(1.0 - 1e-6 * target) / q, (1.0 + 1e-6 * target) / q])
    order = np.argsort(ends)
    inside = np.cumsum(np.concatenate([w, -w])[order])
    # Rounding of the sums makes shares that are the same differ by 1e-13.
    most = inside > inside.max() - 1e-12
    first = int(np.argmax(most))
    last = first + int(np.argmin(most[first:]))
    return float(np.clip(_rms_scale(q, w, target), ends[order[first]], ends[order[last]]))


def _rms(ppm: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(np.sum(w * ppm * ppm)))


def _share_order(ppm: FloatArray, w: FloatArray, target: float) -> tuple[float, float]:
    # Shares that differ by rounding only are the same.
    return -round(float(np.sum(w[np.abs(ppm) <= target])), 9), _rms(ppm, w)


def _minimax_order(ppm: FloatArray, w: FloatArray, target: float) -> tuple[float, float]:
    return float(np.abs(ppm).max()), _rms(ppm, w)


def _rms_order(ppm: FloatArray, w: FloatArray, target: float) -> tuple[float, float]:
    return _rms(ppm, w), 0.0


LDP_CRITERIA: dict[str, tuple[Best, Order]] = {
    "share": (_crowded_scale, _share_order),
    "minimax": (_middle_scale, _minimax_order),
    "rms": (_rms_scale, _rms_order),
}
LDP_FAMILIES = ("tmerc", "lcc", "omerc")


# ---- the search -----------------------------------------------------------------------------


def ldp(
    region: str | Place,
    *,
    heights: ArrayLike | None = None,
    height: float | None = None,
    families: Sequence[str] = LDP_FAMILIES,
    criterion: str = "share",
    target_ppm: float = 20.0,
    round_k: float = 1e-6,
    round_axis: float = 1 / 60,
    geodetic: str = "EPSG:4326",
    against: Sequence[Any] = (),
    name: str | None = None,
) -> LDP:
    """The conformal map on which distances differ least from those measured on the ground.

    `heights` are longitudes, latitudes and ellipsoidal heights, shape (n, 3), of which those in the region count;
    or `height` is that of the whole region; a set of points may have heights of its own. `criterion` is "share" (the
    most points within `target_ppm`), "minimax" (the least largest distortion) or "rms". The scale factor on the axis
    is a multiple of `round_k`, the axis of `round_axis` degrees. `geodetic` is the geographic CRS that the map is
    based on; `against` are projections to compare with, by default the UTM zone. Raises ValueError, and
    ProjectionError where no family maps the region.
    """
    area, surface = get_region(region), geodetic_ellipsoid(geodetic)
    _check(families, criterion, target_ppm, round_k, round_axis)
    nodes, h = _points(area, surface, heights, height)
    extent = extent_of(area)
    if extent.radius > _WIDEST:
        raise ValueError(f"Invalid region '{area.name}'. It must reach no farther than {_WIDEST:g} degrees.")
    few, few_heights = _few(area, nodes, h, is_level=height is not None)
    design = _Design(
        area, extent, nodes, h, few, few_heights, criterion, target_ppm, round_k, round_axis, geodetic, name
    )
    found = [design.best(family) for family in families]
    found.sort(key=lambda one: design.order(one.ppm))
    best = min((one for one in found if design.is_as_good(one, found[0])), key=lambda one: families.index(one.family))
    others = [one for one in found if one is not best]
    maps = [*((_utm(extent)) if not against else ()), *against]
    baselines = tuple((_label(one), design.statistics(_ppm(one, nodes, h))) for one in maps)
    wkt, esri = design.forms(best.projection)
    more = {"wkt": wkt, "esri": esri, "baselines": baselines, "others": tuple(others)}
    return LDP(**(_fields(best) | more))


def _fields(found: LDP) -> dict[str, Any]:
    return {key: getattr(found, key) for key in found.__dataclass_fields__}


def _check(families: Sequence[str], criterion: str, target: float, round_k: float, round_axis: float) -> None:
    if not families or not set(families) <= set(LDP_FAMILIES):
        raise ValueError(f"Invalid families '{','.join(families)}'. They must be of {', '.join(LDP_FAMILIES)}.")
    if criterion not in LDP_CRITERIA:
        raise ValueError(f"Invalid criterion '{criterion}'. It must be one of {', '.join(LDP_CRITERIA)}.")
    if not 0 < target <= 1e5:
        raise ValueError(f"Invalid target '{target}'. It must be above 0 and at most 1e5, in ppm.")
    if not 1e-10 <= round_k <= 1e-3:
        raise ValueError(f"Invalid rounding of k_0 '{round_k}'. It must lie within 1e-10 and 1e-3.")
    if not 1e-7 <= round_axis <= 1.0:
        raise ValueError(f"Invalid rounding of the axis '{round_axis}'. It must lie within 1e-7 and 1 degree.")


def _points(
    region: Place, ellipsoid: Ellipsoid, heights: ArrayLike | None, height: float | None
) -> tuple[Nodes, FloatArray]:
    """Points with weights that sum to 1, and their heights."""
    if isinstance(region, PointSet) and region.height is not None and heights is None and height is None:
        return nodes_at(region.lon, region.lat, region.weight, ellipsoid), region.height
    if (heights is None) == (height is None):
        raise ValueError("Invalid heights. There must be either points with heights, or one height.")
    if height is not None:
        if not -500.0 <= height <= 9000.0:
            raise ValueError(f"Invalid height '{height}'. It must lie within -500 and 9000 m.")
        nodes = nodes_of(region, ellipsoid, _NODES, edges=True)
        return nodes, np.full(nodes.lon.size, float(height))
    points = np.asarray(heights, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError("Invalid heights. They must be rows of longitude, latitude and height, all finite.")
    points = points[region.contains(points[:, 0], points[:, 1])]
    if not len(points):
        raise ValueError(f"Invalid heights for {region.name}. No point lies in the region.")
    return nodes_at(points[:, 0], points[:, 1], np.ones(len(points)), ellipsoid), points[:, 2]


def _few(region: Place, nodes: Nodes, height: FloatArray, *, is_level: bool) -> tuple[Nodes, FloatArray]:
    """Fewer points of the same kind, for the search."""
    if is_level:
        few = nodes_of(region, nodes.ellipsoid, _SEARCHED, edges=True)
        return few, np.full(few.lon.size, height[0])
    step = nodes.lon.size // _SEARCHED
    if step <= 1:
        return nodes, height
    lon, lat, weight = (values[::step] for values in (nodes.lon, nodes.lat, nodes.weight))
    return nodes_at(lon, lat, weight, nodes.ellipsoid), height[::step]


def _ppm(projection: Any, nodes: Nodes, height: FloatArray) -> FloatArray:
    return distortion_ppm(projection, nodes.lon, nodes.lat, height)


def _label(projection: Any) -> str:
    return projection if isinstance(projection, str) else Projection.from_user_input(projection).label


def _utm(extent: Extent) -> list[str]:
    if abs(extent.lat) > 84.0:
        return []
    return [f"EPSG:32{6 if extent.lat >= 0 else 7}{int((extent.lon + 180.0) % 360.0 // 6.0) + 1:02d}"]


@dataclass(frozen=True)
class _Design:
    """What a projection is designed for."""

    region: Place
    extent: Extent
    nodes: Nodes
    height: FloatArray
    few: Nodes
    few_heights: FloatArray
    criterion: str
    target: float
    round_k: float
    round_axis: float
    geodetic: str
    name: str | None

    def order(self, ppm: FloatArray, weight: FloatArray | None = None) -> tuple[float, float]:
        """Less is better."""
        return LDP_CRITERIA[self.criterion][1](ppm, self.nodes.weight if weight is None else weight, self.target)

    def is_as_good(self, one: LDP, best: LDP) -> bool:
        """Whether a map is as good as the best for every purpose."""
        mine, theirs = self.order(one.ppm), self.order(best.ppm)
        slack = 0.0 if self.criterion == "share" else _SAME
        return mine[0] <= theirs[0] + slack and (mine[1] <= theirs[1] + _SAME or slack > 0.0)

    def statistics(self, ppm: FloatArray) -> HeightStatistics:
        """The statistics of a map on the same points."""
        w = self.nodes.weight
        mean = float(np.sum(w * ppm))
        within = {float(p): float(np.sum(w[np.abs(ppm) <= p])) for p in sorted({*_SHARES, self.target})}
        std = float(np.sqrt(np.sum(w * (ppm - mean) ** 2)))
        return HeightStatistics(float(ppm.min()), float(ppm.max()), mean, std, _rms(ppm, w), within)

    def best(self, family: str) -> LDP:
        """The best map of a family, rounded."""
        axis = _Axis(family, self)
        place, _ = axis.optimum()
        values = axis.parameters(place)
        values |= {"k_0": self.rounded_scale(axis.factors(place, self.nodes, self.height), self.nodes.weight)[0]}
        values |= self.origin(axis.base, values)
        projection = Projection.from_user_input(with_parameters(axis.base, values).definition)
        ppm = _ppm(projection, self.nodes, self.height)
        nodes = self.nodes
        return LDP(
            self.region,
            family,
            self.criterion,
            self.target,
            {key: float(number_text(value)) for key, value in values.items()},
            projection,
            None,
            None,
            self.statistics(ppm),
            (),
            (),
            nodes.lon,
            nodes.lat,
            self.height,
            nodes.weight,
            ppm,
        )

    def forms(self, projection: Projection) -> tuple[str | None, str | None]:
        """WKT2 and Esri's WKT."""
        name = self.name or f"{projection.name} for {self.region.name}, low distortion"
        wkt, esri = (
            crs_wkt(projection, name, geodetic=self.geodetic, version=version)[0]
            for version in ("WKT2_2019", "WKT1_ESRI")
        )
        return wkt, esri

    def rounded_scale(self, q: Factors, weight: FloatArray) -> tuple[float, tuple[float, float]]:
        """The multiple of `round_k` next to the best scale that is best itself, and how good it is."""
        scale = LDP_CRITERIA[self.criterion][0](q, weight, self.target)
        options = (np.floor(scale / self.round_k) + np.arange(2)) * self.round_k
        orders = [self.order(1e6 * (k * q - 1.0), weight) for k in options]
        best = int(orders[1] < orders[0])
        return float(options[best]), orders[best]

    def origin(self, base: Projection, values: dict[str, float]) -> dict[str, float]:
        """A latitude of origin south of the region, and offsets with which all its coordinates are positive."""
        result: dict[str, float] = {}
        if base.definition.startswith("+proj=tmerc"):
            result["lat_0"] = float(np.floor(self.extent.south / _ORIGIN) * _ORIGIN)
        x, y = with_parameters(base, values | result)(self.nodes.lon, self.nodes.lat)
        result["x_0"] = float(np.ceil((_EAST - np.nanmin(x)) / _EAST) * _EAST)
        result["y_0"] = max(0.0, float(np.ceil(-np.nanmin(y) / _NORTH) * _NORTH))
        return result


class _Axis:
    """The axis of one family: the middle meridian, the standard parallel, or an oblique line."""

    def __init__(self, family: str, design: _Design) -> None:
        self.design, self.unit = design, design.round_axis
        extent = design.extent
        self.fixed: dict[str, float] = {}
        # Over ground that slopes the best axis lies beside the region: scale falls with height.
        across = 1.0 + 1.5 * extent.radius
        east = across / max(np.cos(np.radians(extent.lat)), 0.1)
        sides = {"tmerc": {"lon_0": (extent.lon, east)}, "lcc": {"lat_1": (extent.lat, across)}}.get(family)
        if sides is None:
            oblique = get_family("omerc", extent)
            moving, turning, _ = oblique.free
            self.fixed = {
                key: float(np.round(value / self.unit) * self.unit)
                for key, value in oblique.fixed.items()
                if key not in oblique.free
            }
            middle, side = (extent.lon, east) if moving == "lonc" else (extent.lat, across)
            sides = {moving: (middle, side), turning: (extent.azimuth, 90.0)}
        self.names = tuple(sides)
        self.low = np.array([middle - side for middle, side in sides.values()])
        self.high = np.array([middle + side for middle, side in sides.values()])
        for index, key in enumerate(self.names):
            if key.startswith("lat"):
                self.low[index], self.high[index] = max(self.low[index], -89.0), min(self.high[index], 89.0)
        text = f"+proj={family} {ellipsoid_text(design.nodes.ellipsoid)}"
        words = " ".join(f"+{key}={number_text(value)}" for key, value in self.parameters(self._middle()).items())
        self.base = Projection.from_user_input(f"{text} {words}")

    def _middle(self) -> FloatArray:
        # Not where an oblique line runs due north or east.
        return self.low + 0.43 * (self.high - self.low)

    def parameters(self, place: FloatArray) -> dict[str, float]:
        """PROJ's parameters; the one standard parallel of lcc is its latitude of origin, too."""
        values = self.fixed | dict(zip(self.names, map(float, place), strict=True))
        if "lat_1" in values:
            values["lat_0"] = values["lat_1"]
        for name in {"lon_0", "lonc"} & set(values):
            values[name] = float(np.mod(values[name] + 180.0, 360.0) - 180.0)
        if "alpha" in values:
            values["alpha"] = float(np.mod(values["alpha"] + 90.0, 180.0) - 90.0)
        if "lat_1" in values:
            values["lon_0"] = float(np.round(self.design.extent.lon / self.unit) * self.unit)
        return values

    def factors(self, place: FloatArray, nodes: Nodes, height: FloatArray) -> Factors:
        """Combined factors with a scale of 1 on the axis; NaN where PROJ refuses the axis."""
        try:
            scale = nodes.meridional_scale(with_parameters(self.base, self.parameters(place)))
        except ProjectionError:
            return np.full(nodes.lon.size, np.nan)
        return scale * elevation_factor(nodes.lat, height, nodes.ellipsoid)

    def optimum(self) -> tuple[FloatArray, tuple[float, float]]:
        """The best multiples of the rounding: from several starts, by ever smaller steps."""
        design = self.design
        nodes, height = design.few, design.few_heights

        def value(place: FloatArray, nodes: Nodes = nodes, height: FloatArray = height) -> tuple[float, float]:
            q = self.factors(place * self.unit, nodes, height)
            if not np.isfinite(q).all():
                return np.inf, np.inf
            return design.rounded_scale(q, nodes.weight)[1]

        starts = sorted(self._starts(nodes, height), key=lambda place: value(np.round(place / self.unit)))
        found = []
        for start in starts[:_STARTS]:
            place = np.round(start / self.unit)
            for coarse in _COARSE:
                place = coarse * descend_lattice(lambda p, c=coarse: value(c * p), np.round(place / coarse))[0]  # type: ignore[misc]
            found.append(place)
        best = min(found, key=value)
        if nodes is not design.nodes:
            best = descend_lattice(lambda p: value(p, design.nodes, design.height), best)[0]
        return best * self.unit, value(best, design.nodes, design.height)

    def _starts(self, nodes: Nodes, height: FloatArray) -> list[FloatArray]:
        """The axis of least RMS, if that is asked for that of the least maximum, and a lattice over all of them."""
        weight = np.sqrt(nodes.weight)

        def squares(place: FloatArray) -> FloatArray:
            q = self.factors(place, nodes, height)
            k = _rms_scale(q, nodes.weight, 0.0)
            return np.nan_to_num(1e6 * weight * (k * q - 1.0), nan=1e6)

        def extremes(place: FloatArray) -> FloatArray:
            q = np.log(self.factors(place, nodes, height))
            return np.nan_to_num(np.stack([q, -q]), nan=1.0)

        starts = [minimise(squares, self.low, self.high, worst=False, count=_LATTICE).place]
        if self.design.criterion == "minimax":
            starts.append(minimise(extremes, self.low, self.high, worst=True, count=_LATTICE).place)
        return starts + list(self.low + lattice(self.low.size, _LATTICE) * (self.high - self.low))
