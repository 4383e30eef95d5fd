"""Maps made to measure: the finished map, measured and compared with others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from projdist import decisions, projections, regions, support
from projdist.designs import base_maps, conformal_bounds
from projdist.designs.base_maps import SYMMETRIES, BaseNodes, DesignObjective
from projdist.designs.fits import SHARES, Stage, best_of, stage_of, stages, with_poles
from projdist.designs.plane_maps import ComplexPolynomial, PlaneMap
from projdist.earth import SPHERE, WGS84, unit_vectors
from projdist.field import Extreme, Nodes, jacobian, nodes_at, nodes_of, sample


@dataclass(frozen=True, kw_only=True)
class Degree:
    """A degree that was tried, its figure at fixed nodes, and the surroundings' share of the energy."""

    degree: int
    value: float
    share: float


@dataclass(frozen=True)
class Rival:
    """A map to compare with by the same criterion; `gain` is what the made map saves, relative to it."""

    kind: str
    name: str
    projection: projections.Projection = field(metadata=support.schema(of="definition"))
    value: float
    error: float
    gain: float


@dataclass(frozen=True)
class Surroundings:
    """The map around the region: the smallest and the largest scale there, and the share that folds."""

    within_km: float
    smallest_scale: float
    largest_scale: float
    folded: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Design(support.Answer):
    """A map made to measure."""

    region: regions.Place = field(metadata=support.schema(of=("name", "area_km2")))
    kind: str
    criterion: str
    unit: str
    degree: int
    poles: int
    balance: float
    exponent: float
    base: projections.Projection = field(metadata=support.schema(of="definition"))  #: the map that is corrected
    projection: projections.Projection = field(metadata=support.HIDDEN)  #: the map as PROJ runs it
    value: float  #: the figure of `criterion` over the region, of the finished map by adaptive cubature
    error: float = field(metadata=support.schema("error_estimate"))  #: of the value
    airy_kavrayskiy: float
    proven: float | None  #: no conformal map of the region's largest part has less; None for other kinds and criteria
    limit: float | None  #: about the least Airy-Kavrayskiy error of any map of the kind, None if unknown
    smallest: Extreme = field(metadata=support.schema("smallest_scale"))  #: in any direction
    largest: Extreme = field(metadata=support.schema("largest_scale"))  #: in any direction
    overlaps: bool | None  #: the image of the region covers itself; None for points
    surroundings: Surroundings | None
    inverse_error: float  #: largest round-trip error in metres over the region, infinite where PROJ's inverse fails
    degrees: tuple[Degree, ...]  #: those tried, with their figures
    rivals: tuple[Rival, ...]
    notes: tuple[str, ...] = ()
    crs: projections.DerivedCrs = field(
        metadata=support.schema(of={"proj": "pipeline", "wkt": "wkt", "wkt_derived": "wkt_derived"}, spread=True)
    )

    @property
    def proj(self) -> str:
        """The PROJ pipeline from degrees to metres."""
        return self.crs.pipeline

    @property
    def wkt(self) -> str:
        """WKT2 of a projected CRS."""
        return self.crs.wkt

    def _line(self) -> str:
        figure = f"{self.criterion} {self.value:.4g} ± {self.error:.1g}"
        return f"{self.kind} map of degree {self.degree} for {self.region.name}: {figure}"

    def _table(self) -> list[dict[str, Any]]:
        """A row a map: this one, and its rivals."""
        rows = [("made", self.projection.name, self.value, 0.0)]
        rows += [(one.kind, one.name, one.value, one.gain) for one in self.rivals]
        return [dict(zip(("map", "name", self.criterion, "gain"), row, strict=True)) for row in rows]


# ---- the finished map, measured ------------------------------------------------------------------

_TOLERANCE = 1e-8  # of the cubature


@dataclass(frozen=True)
class MapFigures:
    """The figure of the objective with its error, the Airy-Kavrayskiy error, and the extreme scales."""

    value: float
    error: float
    airy_kavrayskiy: float
    smallest: Extreme
    largest: Extreme
    coverage: float


def measure_map(
    projection: projections.Projection, region: regions.Place, objective: DesignObjective, *, scaled: bool = False
) -> MapFigures:
    """The figures of a projection over a region; with `scaled` at its best scale."""
    field = sample(projection, region, measures=["a", "b"], tolerance=_TOLERANCE)
    smallest, largest = field.minimum("b"), field.maximum("a")
    found = field.airy_kavrayskiy
    if objective.figure.is_maximum:
        a, b, in_ppm = largest.value, smallest.value, objective.figure.unit == "ppm"
        if scaled:
            factor = 2.0 / (a + b) if in_ppm else 1.0 / np.sqrt(a * b)
            a, b = factor * a, factor * b
        value = float(1e6 * max(a - 1.0, 1.0 - b) if in_ppm else max(np.log(a), -np.log(b)))
        error = max(smallest.error, largest.error) * (1e6 if in_ppm else 1.0)
    elif objective.figure.name == "airy_kavrayskiy":
        value, error = (found.scaled if scaled else found.raw), found.error
    else:
        value, error = field.figure(objective.figure)
    return MapFigures(value, error, found.raw, smallest, largest, field.coverage)


# ---- the design ----------------------------------------------------------------------------------

_NODES, _AROUND = 3000, 1000
_BESIDE_POLES = 12  # degree of the polynomial with which poles are chosen, if it is not given
_MARGIN = 0.15  # width of the surroundings, of the region's radius
_WIDEST = 120.0  # degrees from the middle to which surroundings may reach

Progress = Callable[[str], None]


def design(
    region: regions.RegionLike,
    *,
    kind: str = "any",
    criterion: str = "airy_kavrayskiy",
    degree: int | str = "auto",
    poles: int | str = 0,
    base: projections.ProjectionLike | None = None,
    balance: float = 0.5,
    norm: float | None = None,
    background: float | str = "auto",
    symmetric: str = "none",
    north: tuple[float, float] | None = None,
    datum: str | None = None,
    against: projections.ProjectionLike | Iterable[projections.ProjectionLike] = "recommend",
    name: str | None = None,
    progress: Progress | None = None,
) -> Design:
    """The map that distorts a region least, of all polynomial corrections of a base map, as a CRS that PROJ runs.

    Parameters
    ----------
    region : RegionLike
        Whatever `get_region` takes, also points with weights; it must lie within 100 degrees of its middle.
    kind : {"any", "conformal", "equal-area"}
        The property that the map keeps.
    criterion : {"airy_kavrayskiy", "max_scale_error_ppm", "max_log_scale"}
        What to minimise; the largest scale errors are for conformal maps.
    degree : int or "auto"
        Degree of the polynomials; "auto" tries degrees until three in a row gain less than 1 %, for conformal maps up
        to 12, and takes the one after which none gains 1 % a degree.
    poles : int or "auto", default 0
        Number of poles around the region, for the largest scale errors: they reach what polynomials do not, and PROJ
        takes about half a microsecond for each. "auto" adds eight while they gain 1 %, 96 at most.
    base : ProjectionLike, optional
        The map to correct, by default the best member of the families of the kind. It has little influence.
    balance : float, default 0.5
        The share of areas in the energy, above 0 and below 1: 0.5 is the Airy-Kavrayskiy error, more keeps areas
        better, less angles. For maps of any kind.
    norm : float, optional
        The norm of ln k for conformal maps, 2 or more: the higher, the more the worst places count.
    background : float or "auto"
        The surroundings' share of the energy, from 0 to 0.5, so that they do not fold; "auto" is the least of a few for
        which scales there stay between 0.5 and 2.
    symmetric : {"none", "meridian", "equator", "both"}
        The axis of symmetry: the base's central meridian, the equator.
    north : pair of float, optional
        Longitude and latitude in degrees of the origin, where north is up; by default the middle of the region, on the
        meridian of symmetry, or the pole of a region about it, with Greenwich's meridian up and down.
    datum : str, optional
        The geographic CRS that the map is based on, as EPSG:4258; by default that of the base, or WGS 84.
    against : ProjectionLike, or iterable of them
        Maps to compare with; "recommend" is the best existing CRS.
    name : str, optional
        Name of the CRS.
    progress : callable, optional
        Called with what is being done, in a word or two.

    Returns
    -------
    Design
        The finished map, measured anew by adaptive cubature, its gain over other maps, and its texts for programs.

    Raises
    ------
    ValueError
        For unknown words, numbers out of their range, a degree that the region does not resolve, and a region that is a
        point or wider than 100 degrees.
    ProjectionError
        For a base that tears the region, or is not of the kind.

    References
    ----------
    - P. Chebyshev 1856, Sur la construction des cartes geographiques: the least largest scale error.
    - W. I. Reilly 1973, Survey Review 22:108: the New Zealand Map Grid, a conformal polynomial.
    - P. Neff, I.-D. Ghiba, J. Lankeit 2015, Journal of Elasticity 121: the exponentiated energy.

    Examples
    --------
    The best conformal map of a round region is stereographic, whose mean ln^2 k over a small cap of radius r is
    r^4 / 192, by which the error is sqrt(2) times r^2 / sqrt(192) (here r = 1/10):

    >>> found = design("cap:10,50,637.1", kind="conformal", degree=2, against=())
    >>> round(found.airy_kavrayskiy / (2**0.5 * 0.01 / 192**0.5), 2)
    1.0
    """
    objective = base_maps.design_objective(kind, criterion, balance, norm)
    title = "" if name is None else support.check_text("name", name).strip()
    if not title.isprintable():
        raise ValueError(f"Invalid name {support.quoted(name)}. It must be one line of text.")
    is_auto = isinstance(background, str) and background == "auto"
    share = None if is_auto else base_maps.check_within("background", background, 0.0, 0.5)
    support.check_choice("symmetry", symmetric, SYMMETRIES)
    up = None if north is None else support.check_pair("north", north)
    given = None if base is None else base_maps.given_base(base)
    ellipsoid = given.ellipsoid if given else WGS84
    if datum is not None:
        ellipsoid = projections.geodetic_ellipsoid(support.check_text("datum", datum))
        if given is not None and not given.ellipsoid.is_close(ellipsoid):
            raise ValueError(f"Invalid datum '{datum}' for base '{given.label}'. They have different ellipsoids.")
    elif base is not None:
        datum = projections.geodetic_of(projections.Projection.from_user_input(base))
    chosen = None if isinstance(degree, str) and degree == "auto" else base_maps.check_degree(degree)
    on_progress = progress or (lambda _: None)
    area = regions.get_region(region, ellipsoid.ground)
    extent = base_maps.check_extent(area)
    wanted = base_maps.check_poles(poles, objective, area, symmetric)
    on_progress("nodes")
    nodes = nodes_of(area, ellipsoid, _NODES, edges=True, all_ends=objective.figure.is_maximum)
    on_progress("base")
    start = given or base_maps.best_base(area, objective, nodes, symmetric)
    base_nodes = base_maps.mirrored(base_maps.base_nodes_of(start, nodes, _beside(extent, nodes)), symmetric)
    base_maps.check_base(objective.kind, base_nodes, area)
    on_progress("fit")
    try:
        poled = None if wanted == 0 else with_poles(base_nodes, area, wanted, chosen or _BESIDE_POLES)
        base_nodes, first = poled or (base_nodes, None)
        if chosen is None:
            tried = list(stages(base_nodes, objective, share))
        else:
            tried = [stage_of(base_nodes, objective, chosen, SHARES if share is None else (share,))]
    except ValueError as error:
        raise ValueError(f"Invalid degree '{chosen or 'auto'}' for region '{area.name}'. {error}") from error
    stage = best_of(tried)
    if first is not None and isinstance(stage.plane_map, ComplexPolynomial):
        stage = replace(stage, plane_map=first.then(stage.plane_map))
    finished = _turned(stage.plane_map, start, up or _middle(extent, start, symmetric))
    title = title or f"{area.name}, {objective.kind.adjective} map"
    crs = projections.derived_crs(start, finished.steps, title, _area_of_use(area, extent, stage), geodetic=datum)
    on_progress("measure")
    made = measure_map(crs.projection, area, objective)
    limited = objective.figure.is_airy_kavrayskiy  # for other figures the limit is not known
    limit = decisions.least_error(area, kind, ellipsoid, degree=12) if limited else None
    reach = float(np.radians(_MARGIN * extent.radius) * ellipsoid.ground.mean_radius / 1000.0)
    around = Surroundings(reach, *stage.around)
    rivals = tuple(_rivals(area, objective, start if base is None else None, against, made, on_progress))
    return Design(
        region=area,
        kind=objective.kind.name,
        criterion=objective.figure.name,
        unit=objective.figure.unit,
        degree=stage.degree,
        poles=0 if first is None else len(first.terms) - 2,
        balance=objective.balance,
        exponent=stage.objective.exponent,
        base=start,
        projection=crs.projection,
        crs=crs,
        value=made.value,
        error=made.error,
        airy_kavrayskiy=made.airy_kavrayskiy,
        proven=conformal_bounds.proven_least(objective.figure.name, area, ellipsoid) if kind == "conformal" else None,
        limit=limit,
        smallest=made.smallest,
        largest=made.largest,
        overlaps=base_maps.overlaps(crs.projection, area),
        surroundings=None if np.isnan(around.smallest_scale) else around,
        inverse_error=_inverse_error(crs, base_nodes),
        degrees=tuple(Degree(degree=one.degree, value=one.value, share=one.share) for one in tried),
        rivals=rivals,
        notes=tuple(_notes(stage, made)),
    )


_CUT = 0.9999999  # coverage of a map that shows the region whole


def _beside(extent: decisions.Extent, nodes: Nodes) -> Nodes | None:
    """Nodes within the margin around the region; None if it is half of the world."""
    reach = (1.0 + _MARGIN) * extent.radius
    if reach > _WIDEST:
        return None
    cap = regions.Cap(extent.lon, extent.lat, float(np.radians(reach) * SPHERE.a / 1000.0), SPHERE)
    found = nodes_of(cap, nodes.ellipsoid, _AROUND)
    cosine = unit_vectors(found.lon, found.lat).T @ unit_vectors(nodes.lon, nodes.lat)
    near = cosine.max(axis=1) > np.cos(np.radians(_MARGIN * extent.radius))
    return nodes_at(found.lon[near], found.lat[near], found.weight[near], nodes.ellipsoid)


def _area_of_use(region: regions.Place, extent: decisions.Extent, stage: Stage) -> projections.AreaOfUse:
    """The box about the region, and about its surroundings if the map is whole there."""
    west, south, east, north = region.bounds
    margin = _MARGIN * extent.radius if stage.is_whole_around else 0.0
    if south - margin <= -90.0 or north + margin >= 90.0:
        west, east = -180.0, 180.0
    elif margin:  # the meridian that touches a circle about a corner
        widest = np.cos(np.radians(max(abs(south), abs(north))))
        aside = float(np.degrees(np.arcsin(min(np.sin(np.radians(margin)) / widest, 1.0))))
        west, east = west - aside, east + aside
    return projections.AreaOfUse(region.name, (west, max(south - margin, -90.0), east, min(north + margin, 90.0)))


def _middle(extent: decisions.Extent, base: projections.Projection, symmetry: str) -> tuple[float, float]:
    """The middle of a region on the axis of symmetry; the pole, on Greenwich's meridian, for a region about it."""
    if symmetry in ("meridian", "both"):
        return base_maps.central_meridian(base), extent.lat
    pole = float(np.copysign(90.0, extent.lat))
    if abs(extent.lat) + 0.5 * extent.radius > 90.0 and np.isfinite(jacobian(base, [0.0], [pole])).all():
        return 0.0, pole
    return extent.lon, extent.lat


def _turned(plane_map: PlaneMap, base: projections.Projection, north: tuple[float, float]) -> PlaneMap:
    """The map with its origin at a place and north up there."""
    lon, lat = np.array([north[0]]), np.array([north[1]])
    new_x, new_y, by = plane_map.at(*base(lon, lat))
    at = jacobian(base, lon, lat)
    if not np.isfinite(at).all():  # a pole beside the middle of the base: 10 m from it
        at = jacobian(base, lon, lat * (1.0 - 1e-6))
    east, up = (by @ at)[0, :, 1]
    size = float(np.hypot(east, up))
    if not (np.isfinite(size) and size > 0.0):
        raise ValueError(f"Invalid north '{north[0]:g},{north[1]:g}'. The map does not show it.")
    turn = 1j * complex(east, -up) / size
    return plane_map.moved(turn, -turn * complex(new_x[0], new_y[0]))


def _inverse_error(crs: projections.DerivedCrs, nodes: BaseNodes) -> float:
    """Largest round-trip error of the region's nodes, metres."""
    lon, lat = nodes.lon[nodes.in_region], nodes.lat[nodes.in_region]
    missed = projections.geodesic_inverse(nodes.base.ellipsoid, lon, lat, *crs.inverse(*crs.projection(lon, lat)))[0]
    return float(np.max(np.where(np.isfinite(missed), missed, np.inf)))


def _rivals(
    region: regions.Place,
    objective: DesignObjective,
    member: projections.Projection | None,
    against: Any,
    made: MapFigures,
    on_progress: Progress,
) -> Iterator[Rival]:
    """The best member of the families, and the maps to compare with."""

    def measured(kind: str, name: str, projection: projections.Projection, *, scaled: bool = False) -> Rival:
        found = measure_map(projection, region, objective, scaled=scaled)
        gain = 1.0 - made.value / found.value if found.value > 0.0 else 0.0
        return Rival(kind, name or projection.name, projection, found.value, found.error, gain)

    if member is not None:
        yield measured("best of the families", "", member, scaled=objective.kind.free_scale)
    for given in projections.listed_projections(against):
        kind, code = "given", given
        if given == "recommend":
            if not region.area_km2 or region.figure.is_of_another_body:
                continue
            on_progress("recommend")
            best = decisions.recommend(region, purpose=objective.kind.name, criterion=objective.figure, limit=1).results
            if not best:
                continue
            kind, code = "best existing", best[0].code
        rival = projections.Projection.from_user_input(code)
        regions.check_on_body([rival], projections.Body(region.figure))
        yield measured(kind, code if isinstance(code, str) else "", rival)


def _notes(stage: Stage, made: MapFigures) -> Iterator[str]:
    """Notes on the map."""
    if stage.objective.exponent:
        yield (
            "Scales leave the range in which the Airy-Kavrayskiy energy is elliptic, so that a finer map could tear: "
            "its exponentiated twin was minimised."
        )
    if made.coverage < _CUT:
        yield f"The map shows {100.0 * made.coverage:.6g} % of the region."
    if stage.around[2] > 0.0:
        yield f"The map folds in {100.0 * stage.around[2]:.2g} % of the surroundings: ask for more --background."
