"""Low-distortion projections, on which grid distances are nearly those measured on the ground.

Only the axis is searched for: for the three usual criteria the best scale factor k_0 on it has a closed form.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from projdist import answers, earth, numerics, projections, regions, support
from projdist._typing import AnyPath, ArrayLike, FloatArray
from projdist.decisions import ground as on_ground
from projdist.decisions.families import Extent, ellipsoid_text, extent_of, get_family, usual_crs
from projdist.decisions.family_search import Objective
from projdist.decisions.ground import Ground, HeightStatistics, ground_of, statistics_of
from projdist.field import FIGURES, AnyFigure, Figure, get_figure

Factors = FloatArray  # combined factors for k_0 = 1
Order = tuple[float, float]  # a figure and the RMS distortion; less is better

SHARE = "share"
"""The criterion that counts the points within a target by their weight; unlike others it is not a figure of a map."""


def rms_scale(q: Factors, w: FloatArray) -> float:
    """The k_0 of least RMS distortion."""
    return float(np.sum(w * q) / np.sum(w * q * q))


def _rms(ppm: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(np.sum(w * ppm * ppm)))


# The best scale and the figure of conformal maps, more quickly than by the general functions of Jacobians.
_QUICK: dict[object, tuple[Callable[[Factors, FloatArray], float], Callable[[FloatArray, FloatArray], float]]] = {
    FIGURES["max_scale_error_ppm"].essence: (
        lambda q, w: float(2.0 / (q.max() + q.min())),
        lambda ppm, w: float(np.abs(ppm).max()),
    ),
    FIGURES["rms_scale_error_ppm"].essence: (rms_scale, _rms),
}


@dataclass(frozen=True)
class LdpGoal:
    """The criterion: a figure, or None for the share of points within `target` ppm; k_0 is a multiple of `round_k`."""

    figure: Figure | None
    target: float
    round_k: float

    @property
    def name(self) -> str:
        """The criterion's name."""
        return self.figure.name if self.figure else SHARE

    def order(self, ppm: FloatArray, weight: FloatArray) -> Order:
        """The order of distortions by the figure, then by RMS."""
        if self.figure is None:
            # Shares that differ by rounding only are the same.
            return -round(float(np.sum(weight[np.abs(ppm) <= self.target])), 9), _rms(ppm, weight)
        if quick := _QUICK.get(self.figure.essence):
            return quick[1](ppm, weight), _rms(ppm, weight)
        return self.figure(_similar(1.0 + 1e-6 * ppm), weight), _rms(ppm, weight)

    def rounded_scale(self, q: Factors, weight: FloatArray) -> tuple[float, Order]:
        """The best multiple of `round_k`, and its order."""
        if self.figure is None:
            multiple = _crowded(q, weight, self.target, self.round_k)
        elif quick := _QUICK.get(self.figure.essence):
            multiple = quick[0](q, weight) / self.round_k
        else:
            multiple = Objective(self.figure).scale(_similar(q), weight) / self.round_k
        # Figures are convex in k_0: the best multiple is next to the best of all.
        options = np.unique([np.floor(multiple), np.ceil(multiple)]) * self.round_k
        orders = [self.order(1e6 * (k * q - 1.0), weight) for k in options]
        best = min(range(len(orders)), key=lambda index: orders[index])
        return float(options[best]), orders[best]


def goal_of(criterion: AnyFigure, target: float, round_k: float) -> LdpGoal:
    """The goal of a criterion; raises ValueError for one that does not depend on a conformal map's scale."""
    if isinstance(criterion, str) and criterion == SHARE:
        return LdpGoal(None, target, round_k)
    figure = get_figure(criterion)
    if figure.aspect == "angles" or figure.version:
        raise ValueError(
            f"Invalid criterion '{figure.name}'. It must be share, or a figure that conformal maps have at a scale, as "
            "max_scale_error_ppm or rms_scale_error_ppm."
        )
    return LdpGoal(figure, target, round_k)


def _similar(factor: FloatArray) -> FloatArray:
    """Jacobians (n, 2, 2) of scale factors (n,) in all directions."""
    return factor[:, None, None] * np.eye(2)


def _crowded(q: Factors, w: FloatArray, target: float, unit: float) -> float:
    """The multiple of `unit` with the most points, by weight, within the target; of several the one of least RMS."""
    # A point is within the target for k_0 from (1 - t) / q to (1 + t) / q: a walk along the ends finds the best.
    usual = rms_scale(q, w) / unit
    first, beyond = np.ceil((1.0 - 1e-6 * target) / q / unit), np.floor((1.0 + 1e-6 * target) / q / unit) + 1.0
    held = first < beyond
    if not held.any():
        return usual
    ends, place = np.unique(np.concatenate([first[held], beyond[held]]), return_inverse=True)
    inside = np.cumsum(np.bincount(place, np.concatenate([w[held], -w[held]])))
    # Rounding of the sums makes shares that are the same differ by 1e-13.
    most = np.flatnonzero(inside[:-1] > inside[:-1].max() - 1e-12)
    nearest = np.clip(np.round(usual), ends[most], ends[most + 1] - 1.0)
    return float(nearest[np.argmin(np.abs(nearest - usual))])


# ---- the axis ----------------------------------------------------------------------------------------

_STARTS, _LATTICE = 8, 64  # starts of descents to whole numbers, and places tried before
_SMOOTH = 24  # places tried for the least RMS or maximum
_COARSE = ((64.0, 5), (8.0, 3), (1.0, 3))  # steps of the axis, in units of its rounding, and the ends that are kept
_SCANNED, _KEPT = 400, 8  # most places of a scan of one parameter, and those that are kept
_FINER = 8.0  # ratio of a step of the scan to the next


class LdpAxis:
    """The axis of a family over a region: a place has values of `names` in degrees, in the end multiples of `unit`."""

    def __init__(self, family: str, extent: Extent, ellipsoid: earth.Ellipsoid, unit: float) -> None:
        self.extent, self.unit = extent, unit
        sides, self.fixed = self._sides(family)
        self.names = tuple(sides)
        limits = np.array([89.0 if key.startswith("lat") else np.inf for key in sides])
        middle, side = np.array(list(sides.values())).T
        self.low, self.high = np.maximum(middle - side, -limits), np.minimum(middle + side, limits)
        # Not in the middle, where an oblique line may run due north or east.
        some = self.parameters(self.low + 0.43 * (self.high - self.low))
        text = projections.defined_by(f"+proj={family} {ellipsoid_text(ellipsoid)}", some)
        self.base = projections.Projection.from_user_input(text)

    def _sides(self, family: str) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
        """Middle and half width of the range of each parameter of the axis, and the fixed parameters."""
        extent = self.extent
        # On sloping ground the best axis may lie beside the region, because scale falls with height.
        across = 1.0 + 1.5 * extent.radius
        east = across / max(np.cos(np.radians(extent.lat)), 0.1)
        if family == "tmerc":
            return {"lon_0": (extent.lon, east)}, {}
        if family == "lcc":
            return {"lat_1": (extent.lat, across)}, {}
        oblique = get_family("omerc", extent)
        moving, turning, _ = oblique.free
        held = {key: value for key, value in oblique.fixed.items() if key not in oblique.free}
        fixed = {key: float(np.round(value / self.unit) * self.unit) for key, value in held.items()}
        middle = (extent.lon, east) if moving == "lonc" else (extent.lat, across)
        return {moving: middle, turning: (extent.azimuth, 90.0)}, fixed

    def parameters(self, place: FloatArray) -> dict[str, float]:
        """PROJ's parameters; the standard parallel of lcc is also its latitude of origin."""
        values = self.fixed | dict(zip(self.names, map(float, place), strict=True))
        if "lat_1" in values:
            values["lat_0"] = values["lat_1"]
            values["lon_0"] = float(np.round(self.extent.lon / self.unit) * self.unit)
        for name in {"lon_0", "lonc"} & set(values):
            values[name] = float(np.mod(values[name] + 180.0, 360.0) - 180.0)
        if "alpha" in values:
            values["alpha"] = float(np.mod(values["alpha"] + 90.0, 180.0) - 90.0)
        return values

    def factors(self, place: FloatArray, ground: Ground) -> Factors:
        """Combined factors with a scale of 1 on the axis; NaN if PROJ refuses the axis."""
        nodes = ground.nodes
        try:
            J, _ = nodes.jacobian(projections.with_parameters(self.base, self.parameters(place)))
            scale = np.hypot(J[:, 0, 1], J[:, 1, 1])
        except projections.ProjectionError:
            return np.full(nodes.lon.size, np.nan)
        return scale * answers.elevation_factor(nodes.lat, ground.height, nodes.ellipsoid)


def best_place(axis: LdpAxis, goal: LdpGoal, few: Ground, ground: Ground) -> FloatArray:
    """The best place of the axis, from a search on few points that ends on all."""

    def value(steps: FloatArray, at: Ground) -> Order:
        q = axis.factors(steps * axis.unit, at)
        if not np.isfinite(q).all():
            return np.inf, np.inf
        return goal.rounded_scale(q, at.nodes.weight)[1]

    on_few = functools.partial(value, at=few)
    found = _scanned(axis, on_few) if axis.low.size == 1 else _descended(axis, goal, few, on_few)
    if few is ground:
        return axis.unit * found[0]
    best = min(found, key=lambda steps: value(steps, ground))
    return axis.unit * numerics.descend_lattice(lambda steps: value(steps, ground), best)[0]


def _scanned(axis: LdpAxis, value: Callable[[FloatArray], Order]) -> list[FloatArray]:
    """The best multiples of the unit in the range of one parameter, best first."""
    # A share has many maxima a few units wide: all multiples are tried if few, else ever finer ones near the best.
    low, high = np.ceil(axis.low[0] / axis.unit), np.floor(axis.high[0] / axis.unit)
    stride = 1.0
    while (high - low) / stride >= _SCANNED:
        stride *= _FINER
    places = np.arange(low, high + 1.0, stride)
    known: dict[float, Order] = {}
    while True:
        for place in np.unique(np.clip(places, low, high)):
            if place not in known:
                known[place] = value(np.array([place]))
        kept = sorted(known, key=known.__getitem__)[:_KEPT]
        if stride == 1.0:
            return [np.array([place]) for place in kept]
        stride /= _FINER
        places = np.add.outer(kept, stride * np.arange(-_FINER, _FINER + 1.0))


def _descended(axis: LdpAxis, goal: LdpGoal, ground: Ground, value: Callable[[FloatArray], Order]) -> list[FloatArray]:
    """Ends of descents by ever smaller steps from the best of several starts, best first."""
    known = functools.cache(lambda *place: value(np.array(place)))

    def once(steps: FloatArray) -> Order:
        return known(*steps.tolist())

    def descended(steps: FloatArray, coarse: float) -> FloatArray:
        return coarse * numerics.descend_lattice(lambda multiple: once(coarse * multiple), np.round(steps / coarse))[0]

    places = sorted((np.round(start / axis.unit) for start in _starts(axis, goal, ground)), key=once)[:_STARTS]
    for coarse, kept in _COARSE:
        ends = [descended(steps, coarse) for steps in places]
        # Descents often meet.
        places = sorted({tuple(end.tolist()): end for end in ends}.values(), key=once)[:kept]
    return places


def _starts(axis: LdpAxis, goal: LdpGoal, ground: Ground) -> list[FloatArray]:
    """The place of the least RMS, for a maximum also that of the least maximum, and a lattice over all places."""
    weight = ground.nodes.weight

    def squares(place: FloatArray) -> FloatArray:
        q = axis.factors(place, ground)
        return np.nan_to_num(1e6 * np.sqrt(weight) * (rms_scale(q, weight) * q - 1.0), nan=1e6)

    def extremes(place: FloatArray) -> FloatArray:
        q = np.log(axis.factors(place, ground))
        return np.nan_to_num(np.stack([q, -q]), nan=1.0)

    starts = [numerics.minimise(squares, axis.low, axis.high, worst=False, count=_SMOOTH).place]
    if goal.figure is not None and goal.figure.is_maximum:
        starts.append(numerics.minimise(extremes, axis.low, axis.high, worst=True, count=_SMOOTH).place)
    return starts + list(axis.low + numerics.lattice(axis.low.size, _LATTICE) * (axis.high - axis.low))


# ---- projections ----------------------------------------------------------------------------------

LDP_FAMILIES = ("tmerc", "lcc", "omerc")

_SHARES = (5, 10, 20, 50)  # ppm
_SAME = 0.02  # ppm: maps that differ by less are equally good, as rounding k_0 costs far more
_NEARLY_SHARE, _NEARLY = 0.05, 1.05  # a simpler map may have 5 % fewer points within the target, or a 5 % larger figure
_SIMPLE = ("tmerc", "lcc")  # families that every program has
_WIDEST = 60.0  # degrees from the middle: wider regions have no low distortion
_METRES, _FEET = 10_000.0, 50_000.0  # of which false eastings and northings are multiples
_WHOLE = 1e-6  # of a number that is whole but for rounding
_MILLIMETRE = 1e-3  # metres
_LARGEST = 1e8  # metres of false eastings and northings
_ORIGINS = (1 / 6, 0.2, 0.25, 0.5, 1.0)  # degrees: the latitude of origin is a multiple of one, and of the rounding


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class LDP(support.Answer):
    """A low-distortion projection and its distortion."""

    region: regions.Place
    family: str
    goal: LdpGoal
    parameters: dict[str, float]
    projection: projections.Projection
    unit: projections.LinearUnit  #: of the CRS
    geodetic: str = "EPSG:4326"  #: the geographic CRS that it is based on
    wkt: str | None = None  #: WKT2, None if there is none
    esri: str | None = None  #: Esri's WKT, likewise
    statistics: HeightStatistics
    baselines: tuple[tuple[str, HeightStatistics], ...] = ()  #: other maps on the same points
    others: tuple[LDP, ...] = ()  #: the best of the other families
    lon: FloatArray  #: longitudes of the points it was made for; the next four are theirs, too
    lat: FloatArray
    height: FloatArray
    weight: FloatArray
    ppm: FloatArray  #: their distortion
    geoid: str | None = None  #: the grid of the geoid that orthometric heights were above
    geoid_height: FloatArray | None = None  #: the geoid's heights at the points, which were added

    @property
    def criterion(self) -> str:
        """The name of the criterion."""
        return self.goal.name

    @property
    def target_ppm(self) -> float:
        """The limit in ppm for the share of points."""
        return self.goal.target

    @property
    def proj(self) -> str:
        """The PROJ string."""
        return self.projection.definition

    @property
    def false_origin(self) -> tuple[float, float]:
        """False easting and northing in the unit of the CRS; PROJ's x_0 and y_0 are in metres."""
        x_0, y_0 = (round(self.parameters[key] / self.unit.metres, 6) for key in ("x_0", "y_0"))
        return x_0, y_0

    @functools.cached_property
    def test_points(self) -> list[dict[str, Any]]:
        """Points in whole seconds, their coordinates in the unit of the CRS, and their factors."""
        return on_ground.points_to_test(self.projection, self.unit.metres, self._table())

    @functools.cached_property
    def test_lines(self) -> list[dict[str, Any]]:
        """Lines between test points, and their distances on the map and on the ground in the unit of the CRS."""
        return on_ground.lines_to_test(self.projection, self.unit.metres, self.test_points)

    @property
    def simpler(self) -> LDP | None:
        """The best of tmerc and lcc, if this map is oblique and better by at most 5 % of the points or the figure."""
        simple = [one for one in self.others if one.family in _SIMPLE]
        if self.family in _SIMPLE or not simple:
            return None
        best = simple[0]
        mine, its = (self.goal.order(one.ppm, one.weight)[0] for one in (self, best))
        near = its <= mine + _NEARLY_SHARE if self.goal.figure is None else its <= _NEARLY * mine
        return best if near else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks, a sentence each: coordinates that may be confused, and a simpler map that is nearly as good."""
        return tuple(self._notes())

    def _notes(self) -> Iterator[str]:
        x, y = (on_ground.span_of(values) / self.unit.metres for values in self.projection(self.lon, self.lat))
        if (negative := min(x[0], y[0]) < -_MILLIMETRE) or on_ground.overlap(x, y):
            spans = [f"{low:,.0f} to {high:,.0f}" for low, high in (x, y)]
            why = "some are negative" if negative else "one may be taken for the other"
            yield f"Eastings are {spans[0]} and northings {spans[1]} {self.unit.plural}: {why}."
        if (simple := self.simpler) is not None:
            its, mine = (
                f"{100 * one.statistics.within[self.target_ppm]:.1f} % within {self.target_ppm:g} ppm, RMS "
                f"{one.statistics.rms:.2f} ppm"
                for one in (simple, self)
            )
            yield f"A simpler map is nearly as good: {simple.family} has {its}; this has {mine}."

    def _line(self) -> str:
        return f"{self.proj} over {self.region.name}"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        N = self.geoid_height
        others = [{"family": o.family, "proj": o.proj, "statistics": o.statistics.to_dict()} for o in self.others]
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            **{name: getattr(self, name) for name in ("family", "criterion", "target_ppm", "parameters")},
            **{"units": self.unit.name, "false_easting": self.false_origin[0], "false_northing": self.false_origin[1]},
            "points": self.lon.size,
            "height": {"min": float(self.height.min()), "max": float(self.height.max()), "kind": "ellipsoidal"},
            "geoid": None if N is None else {"grid": self.geoid, "min": float(N.min()), "max": float(N.max())},
            "statistics": self.statistics.to_dict(),
            "baselines": [{"name": name} | statistics.to_dict() for name, statistics in self.baselines],
            "others": others,
            "simpler": self.simpler.family if self.simpler else None,
            **{"notes": list(self.notes), "proj": self.proj, "wkt": self.wkt, "esri_wkt": self.esri},
            **{"test_points": self.test_points, "test_lines": self.test_lines},
        }

    def _table(self) -> dict[str, FloatArray]:
        """A row a point."""
        geoid = {} if self.geoid_height is None else {"geoid_height": self.geoid_height}
        of_points = {"lon": self.lon, "lat": self.lat, "height": self.height, "ppm": self.ppm, "weight": self.weight}
        return of_points | geoid


def ldp(
    region: regions.RegionLike,
    *,
    heights: ArrayLike | None = None,
    height: float | None = None,
    families: Sequence[str] = LDP_FAMILIES,
    criterion: AnyFigure = "share",
    target_ppm: float = 20.0,
    round_k: float = 1e-6,
    round_axis: float = 1 / 60,
    geodetic: str = "EPSG:4326",
    against: projections.ProjectionLike | Iterable[projections.ProjectionLike] = (),
    name: str | None = None,
    units: str = "m",
    false_easting: float | None = None,
    false_northing: float | None = None,
    geoid: AnyPath | float | None = None,
) -> LDP:
    """The conformal map on which distances differ least from those measured on the ground.

    Parameters
    ----------
    region : RegionLike
        Whatever `get_region` takes, reaching no farther than 60 degrees from its middle. A set of points may have
        heights of its own; otherwise there must be either `heights` or `height`.
    heights : array_like (n, 3), optional
        Longitudes and latitudes in degrees and ellipsoidal heights in metres, of which those in the region count.
    height : float, optional
        The ellipsoidal height of the whole region in metres, within -500 and 9000.
    families : sequence of str
        Of tmerc, lcc and omerc.
    criterion : str, Figure, Measure or callable
        share (the most points within `target_ppm`), or what to minimise: a figure that depends on the scale of
        conformal maps, such as max_scale_error_ppm (the largest distortion) or rms_scale_error_ppm; or a function of
        Jacobians J (n, 2, 2), here the combined factors times the unit matrix, as `get_figure` takes it.
    target_ppm : float
        In ppm, above 0 and at most 1e5.
    round_k : float
        The scale factor on the axis is a multiple of it, within 1e-10 and 1e-3.
    round_axis : float
        The axis is a multiple of it in degrees, within 1e-7 and 1.
    geodetic : str
        The geographic CRS that the map is based on.
    against : ProjectionLike, or iterable of them
        Projections to compare with, by default the UTM zone.
    name : str, optional
        Of the CRS in WKT.
    units : str
        The unit of the CRS: m, us-ft (US survey feet) or ft (international feet). Heights are always in metres.
    false_easting, false_northing : float, optional
        PROJ's x_0 and y_0, but in the unit of the CRS; at most 1e8 m. By default multiples of 10,000 m or 50,000 feet
        that make all coordinates positive, and all eastings larger than the northings.
    geoid : str, path or float, optional
        For orthometric heights H: a grid of geoid heights N, which PROJ finds by its name or path, or one N in metres.
        The ellipsoidal height is H + N.

    Returns
    -------
    LDP
        The best map, its WKT, its distortion at each point in ppm, and points and lines to test programs with.

    Raises
    ------
    ValueError
        For an unknown region, family, criterion, unit or CRS, a number out of its range, heights that are missing,
        given twice, or not in the region, and a geoid that PROJ does not find.
    ProjectionError
        Where no family maps the region.

    References
    ----------
    - J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5: grid and elevation factors.
    - M. L. Dennis 2015, Ground Truth: Design and Documentation of Low Distortion Projections for Surveying and GIS:
      round parameters, and false origins that make coordinates positive and distinct.

    Examples
    --------
    The elevation factor there is 0.999747, and k_0 nearly one over that, as the scale grows beside the axis:

    >>> ldp("box:-104,39,-103.8,39.2", height=1610, families=["tmerc"]).parameters["k_0"]
    1.000252
    """
    surface = projections.geodetic_ellipsoid(geodetic)
    area = regions.get_region(region, surface.ground)
    families = support.listed_values(families)
    rivals = [projections.Projection.from_user_input(one) for one in projections.listed_projections(against)]
    regions.check_on_body(rivals, projections.Body(surface))
    if name is not None:
        support.check_text("name", name)
    if not families or any(support.check_text("family", family) not in LDP_FAMILIES for family in families):
        raise ValueError(f"Invalid families '{','.join(families)}'. They must be of {', '.join(LDP_FAMILIES)}.")
    if not 0 < support.check_number("target", target_ppm) <= 1e5:
        raise ValueError(f"Invalid target '{target_ppm}'. It must be above 0 and at most 1e5, in ppm.")
    if not 1e-10 <= support.check_number("rounding of k_0", round_k) <= 1e-3:
        raise ValueError(f"Invalid rounding of k_0 '{round_k}'. It must lie within 1e-10 and 1e-3.")
    if not 1e-7 <= support.check_number("rounding of the axis", round_axis) <= 1.0:
        raise ValueError(f"Invalid rounding of the axis '{round_axis}'. It must lie within 1e-7 and 1 degree.")
    unit = projections.LINEAR_UNITS[support.check_choice("units", units, projections.LINEAR_UNITS)]
    origin = {"x_0": ("false easting", false_easting), "y_0": ("false northing", false_northing)}
    stated = {key: unit.metres * support.check_number(*one) for key, one in origin.items() if one[1] is not None}
    for key, metres in stated.items():
        if not abs(metres) <= _LARGEST:
            raise ValueError(f"Invalid {origin[key][0]} '{origin[key][1]}'. It must be at most {_LARGEST:g} m.")
    goal = goal_of(criterion, target_ppm, round_k)
    ground = ground_of(area, surface, heights, height)
    if geoid is not None:
        ground = ground.raised(geoid)
    extent = extent_of(area)
    if extent.radius > _WIDEST:
        raise ValueError(f"Invalid region '{area.name}'. It must reach no farther than {_WIDEST:g} degrees.")
    design = _Design(area, extent, ground, ground.fewer(area), goal, round_axis, unit, stated)
    found = sorted((design.best(family) for family in families), key=design.order)
    best = min((one for one in found if design.is_as_good(one, found[0])), key=lambda one: families.index(one.family))
    title = name or f"{best.projection.name} for {area.name}, low distortion"
    usual, code = usual_crs(extent)  # near the poles it is not made for distances
    baselines = rivals or ([projections.Projection.from_user_input(code)] if usual.startswith("UTM") else [])
    to_wkt = functools.partial(projections.crs_wkt, best.projection, title, geodetic=geodetic)
    return replace(
        best,
        geodetic=geodetic,
        geoid=str(geoid) if isinstance(geoid, str | os.PathLike) else None,
        wkt=to_wkt(version="WKT2_2019")[0],
        esri=to_wkt(version="WKT1_ESRI")[0],
        baselines=tuple((one.label, design.statistics(ground.ppm(one))) for one in baselines),
        others=tuple(one for one in found if one is not best),
    )


@dataclass(frozen=True)
class _Design:
    """The task: `few` is the ground with fewer points, for the search; `stated` are given x_0 and y_0 in metres."""

    region: regions.Place
    extent: Extent
    ground: Ground
    few: Ground
    goal: LdpGoal
    round_axis: float
    unit: projections.LinearUnit
    stated: Mapping[str, float]

    def order(self, found: LDP) -> tuple[float, float]:
        """The order of a map by the goal."""
        return self.goal.order(found.ppm, found.weight)

    def is_as_good(self, one: LDP, best: LDP) -> bool:
        """True if a map is as good as the best for all practical purposes."""
        mine, theirs = self.order(one), self.order(best)
        slack = 0.0 if self.goal.figure is None else _SAME if self.goal.figure.unit == "ppm" else 1e-6 * _SAME
        return mine[0] <= theirs[0] + slack and (mine[1] <= theirs[1] + _SAME or slack > 0.0)

    def statistics(self, ppm: FloatArray) -> HeightStatistics:
        """The statistics of a map on the same points."""
        return statistics_of(ppm, self.ground.nodes.weight, (*_SHARES, self.goal.target))

    def best(self, family: str) -> LDP:
        """The best map of a family, rounded; without WKT, baselines and others."""
        ground, nodes = self.ground, self.ground.nodes
        axis = LdpAxis(family, self.extent, nodes.ellipsoid, self.round_axis)
        place = best_place(axis, self.goal, self.few, ground)
        values = axis.parameters(place)
        values["k_0"] = self.goal.rounded_scale(axis.factors(place, ground), nodes.weight)[0]
        values |= self.origin(axis.base, values)
        text = projections.with_parameters(axis.base, values).definition
        units = "" if self.unit.name == "m" else f" +units={self.unit.name}"
        projection = projections.Projection.from_user_input(text + units)
        ppm = ground.ppm(projection)
        return LDP(
            region=self.region,
            family=family,
            goal=self.goal,
            parameters={key: float(projections.number_text(value)) for key, value in values.items()},
            projection=projection,
            unit=self.unit,
            geoid_height=ground.geoid_height,
            statistics=self.statistics(ppm),
            lon=nodes.lon,
            lat=nodes.lat,
            height=ground.height,
            weight=nodes.weight,
            ppm=ppm,
        )

    def origin(self, base: projections.Projection, values: dict[str, float]) -> dict[str, float]:
        """A latitude of origin south of the region, and the false origin."""
        result: dict[str, float] = {}
        if base.definition.startswith("+proj=tmerc"):
            multiples = {angle: angle / self.round_axis for angle in _ORIGINS}
            usual = (angle for angle, count in multiples.items() if abs(count - round(count)) < _WHOLE)
            angle = next(usual, np.ceil(_ORIGINS[0] / self.round_axis) * self.round_axis)
            result["lat_0"] = float(np.floor(self.extent.south / angle) * angle)
        x, y = projections.with_parameters(base, values | result)(self.ground.nodes.lon, self.ground.nodes.lat)
        step = (_METRES if self.unit.name == "m" else _FEET) * self.unit.metres
        return result | on_ground.false_origin_for(on_ground.span_of(x), on_ground.span_of(y), step, self.stated)
