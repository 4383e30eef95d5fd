"""Maps made to measure: the base to correct, the fits of ascending degrees, and the finished map."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.decisions import (
    LIMITED,
    Extent,
    Objective,
    best_member,
    ellipsoid_text,
    extent_of,
    least_error,
    recommend,
    sensible_families,
)
from projdist.designs.answers import Degree, Design, MapFigures, Rival, Surroundings, measure_map
from projdist.designs.objectives import (
    DesignObjective,
    Kind,
    check_degree,
    check_extent,
    check_within,
    design_objective,
    exponentiated,
    get_kind,
    needs_exponent,
)
from projdist.designs.plane_maps import PlaneMap
from projdist.designs.sites import (
    SYMMETRIES,
    TORN,
    BaseNodes,
    base_nodes_of,
    central_meridian,
    mirrored,
    overlaps,
    smooth_at,
)
from projdist.earth import SPHERE, WGS84, Ellipsoid, unit_vectors
from projdist.field import FIGURES, Nodes, cut_length, jacobian, nodes_at, nodes_of
from projdist.matrices import log_anisotropy, log_areal_scale, principal_scales
from projdist.projections import (
    AreaOfUse,
    Body,
    DerivedCrs,
    Projection,
    ProjectionError,
    ProjectionLike,
    crs_wkt,
    derived_crs,
    geodesic_lengths,
    geodetic_ellipsoid,
    geodetic_of,
    listed_projections,
    parameters_of,
)
from projdist.regions import Cap, Place, RegionLike, check_on_body, get_region
from projdist.support import check_choice, check_pair, check_text, quoted

_KEPT = 1e-7  # relative error of scales of a map that is conformal or equal-area: 0.1 ppm
_ROUGH = 1e-3  # share of the region in which rounding may be larger


def best_base(kind: Kind, region: Place, objective: DesignObjective, nodes: Nodes, symmetry: str) -> Projection:
    """The best member of the families of a kind that suit the region; raises ProjectionError."""
    extent = extent_of(region)
    if symmetry in ("equator", "both"):
        return _equatorial(kind, extent, nodes.ellipsoid)
    scale_matters = objective.figure.is_maximum or not kind.free_scale
    figure = objective.figure if scale_matters else FIGURES["airy_kavrayskiy_scaled"]
    sensible = [name for name in sensible_families(extent, nodes.ellipsoid) if name in kind.families]
    found: list[tuple[float, Projection]] = []
    for name in sensible or kind.families:
        if name == "omerc" and symmetry == "meridian":
            continue
        try:
            projection, _ = best_member(name, region, figure, nodes.ellipsoid)
        except ProjectionError:
            continue
        J, _ = nodes.jacobian(projection)
        smooth = smooth_at(J)
        J, weight = J[smooth], nodes.weight[smooth]
        if 1.0 - weight.sum() > TORN or not _keeps(kind, J, weight):
            continue
        if cut_length(projection, region) == 0.0 and crs_wkt(projection, name)[0] is not None:
            found.append((figure(J, weight), projection))
    if not found:
        raise ProjectionError(f"Invalid region '{region.name}'. No {kind.name} map of PROJ's shows it whole.")
    return min(found, key=lambda one: one[0])[1]


def _equatorial(kind: Kind, extent: Extent, ellipsoid: Ellipsoid) -> Projection:
    """An azimuthal map centred on the equator, for maps that are symmetric about it."""
    name = "stere" if kind.name == "conformal" else "laea"
    return Projection.from_user_input(f"+proj={name} +lat_0=0 +lon_0={extent.lon:.7g} {ellipsoid_text(ellipsoid)}")


def check_whole(base: Projection, region: Place) -> None:
    """Raise ProjectionError for a base that is cut within the region, which no correction mends."""
    if cut_length(base, region) > 0.0:
        raise ProjectionError(f"Invalid base '{base.label}'. It is cut within {region.name}.")


def given_base(given: ProjectionLike) -> Projection:
    """A projection by the PROJ string of the same map; raises ProjectionError if there is none."""
    projection = Projection.from_user_input(given)
    text = parameters_of(projection, np.eye(2))
    if text is None:
        raise ProjectionError(
            f"Invalid base '{projection.label}'. It must be a projection with a PROJ string, in metres to the east "
            "and north."
        )
    return Projection.from_user_input(text)


def check_keeps(kind: Kind, nodes: BaseNodes) -> None:
    """Raise ProjectionError for a base that is not of the kind, as the corrected map would not be either."""
    base = nodes.base
    if not _keeps(kind, nodes.J, nodes.weight):
        own = "at scale 1" if kind.name == "equal-area" else "itself"
        raise ProjectionError(f"Invalid base '{base.label}' for {kind.name} maps. It must be {kind.name} {own}.")


def _keeps(kind: Kind, J: FloatArray, weight: FloatArray) -> bool:
    """True if Jacobians with weights that sum to 1 are of the kind, except for rounding of PROJ, as about a pole.

    Those of conics that are nearly cylindrical are not: they are rounded everywhere.
    """
    lost = {"conformal": log_anisotropy, "equal-area": log_areal_scale}.get(kind.name)
    return lost is None or float(weight[np.abs(lost(J)) > _KEPT].sum()) <= _ROUGH


# ---- degree by degree ----------------------------------------------------------------------------


SHARES = (0.0, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3)
"""The surroundings' shares of the energy that are tried until one keeps them whole."""

_LEAST, _LARGEST = 0.5, 2.0  # scales of surroundings that are whole
_PAYS = 0.01  # relative gain that a degree must bring


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A map of a degree: its figure at the nodes, the surroundings' share of the energy, and its objective."""

    degree: int
    value: float
    share: float
    objective: DesignObjective
    plane_map: PlaneMap
    around: tuple[float, float, float]  # smallest and largest scale of the surroundings, and the share that folds

    @property
    def is_whole_around(self) -> bool:
        """True if the surroundings do not fold, with scales near 1."""
        return _is_whole(self.around)


def stages(nodes: BaseNodes, kind: Kind, objective: DesignObjective, share: float | None) -> Iterator[Stage]:
    """Maps of ascending degrees until some in a row gain too little, or the nodes do not resolve more."""
    idle, least = 0, np.inf
    shares: tuple[float, ...] = SHARES if share is None else (share,)
    for degree in kind.degrees:
        try:
            stage = stage_of(nodes, kind, objective, degree, shares)
        except ValueError:
            if degree == kind.degrees[0]:
                raise
            return
        yield stage
        idle = idle + 1 if stage.value > (1.0 - _PAYS) * least else 0
        if idle == kind.idle:
            return
        least, objective = min(least, stage.value), stage.objective
        shares = tuple(one for one in shares if one >= stage.share)  # finer maps need no smaller share


def best_of(found: Sequence[Stage]) -> Stage:
    """The map after which finer ones gain less than 1 % a degree."""
    return min(found, key=lambda one: one.value * (1.0 + _PAYS) ** one.degree)


def stage_of(
    nodes: BaseNodes, kind: Kind, objective: DesignObjective, degree: int, shares: Sequence[float] = SHARES
) -> Stage:
    """The map of one degree, with the first share that keeps the surroundings whole; ValueError for too few nodes."""
    for share in shares:
        plane_map, objective = _fitted(nodes, kind, objective, degree, share)
        J = plane_map.at(nodes.x, nodes.y)[2] @ nodes.J
        plane_map, J = _scaled(nodes, kind, objective, plane_map, J)
        around = _scales_around(nodes, J)
        if not nodes.around.any() or _is_whole(around):
            break
    inside = nodes.in_region
    value = objective.figure(J[inside], nodes.weight[inside])
    return Stage(degree=degree, value=value, share=share, objective=objective, plane_map=plane_map, around=around)


def _fitted(
    nodes: BaseNodes, kind: Kind, objective: DesignObjective, degree: int, share: float
) -> tuple[PlaneMap, DesignObjective]:
    """The best map, by the exponentiated energy if the plain one is not elliptic at a node."""
    plane_map = kind.fit(nodes, degree, share, objective)
    if kind.name == "any" and needs_exponent(plane_map.at(nodes.x, nodes.y)[2] @ nodes.J, nodes.weight, objective):
        objective = exponentiated(objective)
        plane_map = kind.fit(nodes, degree, share, objective)
    return plane_map, objective


def _scaled(
    nodes: BaseNodes, kind: Kind, objective: DesignObjective, plane_map: PlaneMap, J: FloatArray
) -> tuple[PlaneMap, FloatArray]:
    """The map at the best scale for the region."""
    if not kind.free_scale:
        return plane_map, J
    inside = nodes.in_region
    factor = Objective(objective.figure).scale(J[inside], nodes.weight[inside])
    return plane_map.moved(complex(factor), 0j), factor * J


def _scales_around(nodes: BaseNodes, J: FloatArray) -> tuple[float, float, float]:
    """Smallest and largest scale of the surroundings, and the share of them that folds."""
    beside = nodes.around > 0.0
    if not beside.any():
        return np.nan, np.nan, np.nan
    with np.errstate(over="ignore", invalid="ignore"):  # scales of high degrees overflow far outside
        folds = np.linalg.det(J[beside]) <= 0.0
    a, b = np.moveaxis(principal_scales(J[beside]), -1, 0)
    return float(b.min()), float(a.max()), float(nodes.around[beside][folds].sum())


def _is_whole(around: tuple[float, float, float]) -> bool:
    least, largest, folded = around
    return folded == 0.0 and least >= _LEAST and largest <= _LARGEST


# ---- the design ----------------------------------------------------------------------------------


_NODES, _AROUND = 3000, 1000
_LIMIT_DEGREE = 12
_MARGIN = 0.15  # width of the surroundings, of the region's radius
_WIDEST = 120.0  # degrees from the middle to which surroundings may reach

Progress = Callable[[str], None]


def design(
    region: RegionLike,
    *,
    kind: str = "any",
    criterion: str = "airy_kavrayskiy",
    degree: int | str = "auto",
    base: ProjectionLike | None = None,
    balance: float = 0.5,
    norm: float | None = None,
    background: float | str = "auto",
    symmetric: str = "none",
    north: tuple[float, float] | None = None,
    datum: str | None = None,
    against: ProjectionLike | Iterable[ProjectionLike] = "recommend",
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
    wanted = get_kind(kind)
    title = _printable(name)
    objective = design_objective(wanted, criterion, balance, norm)
    share = None if _is_auto(background) else check_within("background", background, 0.0, 0.5)
    check_choice("symmetry", symmetric, SYMMETRIES)
    up = None if north is None else check_pair("north", north)
    given = None if base is None else given_base(base)
    ellipsoid = given.ellipsoid if given else WGS84
    if datum is not None:
        ellipsoid = _of_datum(check_text("datum", datum), given)
    elif base is not None:
        datum = geodetic_of(Projection.from_user_input(base))
    chosen = None if _is_auto(degree) else check_degree(degree)
    on_progress = progress or (lambda _: None)
    area = get_region(region, ellipsoid.ground)
    extent = check_extent(area)
    on_progress("nodes")
    nodes = nodes_of(area, ellipsoid, _NODES, edges=True, all_ends=objective.figure.is_maximum)
    on_progress("base")
    start = given or best_base(wanted, area, objective, nodes, symmetric)
    base_nodes = mirrored(base_nodes_of(start, nodes, _beside(extent, nodes)), symmetric)
    check_whole(start, area)
    check_keeps(wanted, base_nodes)
    on_progress("fit")
    tried = _tried(base_nodes, wanted, objective, chosen, share, area)
    stage = best_of(tried)
    finished = _turned(stage.plane_map, start, up or _middle(extent, start, symmetric))
    title = title or f"{area.name}, {_ADJECTIVES[wanted.name]}"
    crs = derived_crs(start, finished.steps, title, _area_of_use(area, extent, stage), geodetic=datum)
    on_progress("measure")
    made = measure_map(crs.projection, area, objective)
    limit = least_error(area, kind, ellipsoid, _LIMIT_DEGREE) if objective.figure.name in LIMITED else None
    rivals = tuple(_rivals(area, wanted, objective, start if base is None else None, against, made, on_progress))
    return Design(
        region=area,
        kind=wanted.name,
        criterion=objective.figure.name,
        unit=objective.figure.unit,
        degree=stage.degree,
        balance=objective.balance,
        exponent=stage.objective.exponent,
        base=start,
        projection=crs.projection,
        crs=crs,
        value=made.value,
        error=made.error,
        airy_kavrayskiy=made.airy_kavrayskiy,
        limit=limit,
        smallest=made.smallest,
        largest=made.largest,
        overlaps=overlaps(crs.projection, area),
        surroundings=_around(extent, stage, ellipsoid),
        inverse_error=_inverse_error(crs, base_nodes),
        degrees=tuple(Degree(degree=one.degree, value=one.value, share=one.share) for one in tried),
        rivals=rivals,
        notes=tuple(_notes(stage, made)),
    )


_ADJECTIVES = {"any": "least-distorting map", "conformal": "conformal map", "equal-area": "equal-area map"}
_CUT = 0.9999999  # coverage of a map that shows the region whole


def _is_auto(value: Any) -> bool:
    return isinstance(value, str) and value == "auto"


def _printable(name: str | None) -> str:
    """A name in one line; raises ValueError."""
    text = "" if name is None else check_text("name", name).strip()
    if text.isprintable():
        return text
    raise ValueError(f"Invalid name {quoted(name)}. It must be one line of text.")


def _of_datum(datum: str, base: Projection | None) -> Ellipsoid:
    """The ellipsoid of a geographic CRS; raises ValueError if it is not the base's."""
    ellipsoid = geodetic_ellipsoid(datum)
    if base is not None and not base.ellipsoid.is_close(ellipsoid):
        raise ValueError(f"Invalid datum '{datum}' for base '{base.label}'. They have different ellipsoids.")
    return ellipsoid


def _tried(
    nodes: BaseNodes,
    kind: Kind,
    objective: DesignObjective,
    degree: int | None,
    share: float | None,
    region: Place,
) -> list[Stage]:
    """Maps of all degrees that are tried, or of the given one."""
    try:
        if degree is None:
            return list(stages(nodes, kind, objective, share))
        return [stage_of(nodes, kind, objective, degree, SHARES if share is None else (share,))]
    except ValueError as error:
        asked = "auto" if degree is None else degree
        raise ValueError(f"Invalid degree '{asked}' for region '{region.name}'. {error}") from error


def _beside(extent: Extent, nodes: Nodes) -> Nodes | None:
    """Nodes within the margin around the region; None if it is half of the world."""
    reach = (1.0 + _MARGIN) * extent.radius
    if reach > _WIDEST:
        return None
    cap = Cap(extent.lon, extent.lat, float(np.radians(reach) * SPHERE.a / 1000.0), SPHERE)
    found = nodes_of(cap, nodes.ellipsoid, _AROUND)
    cosine = unit_vectors(found.lon, found.lat).T @ unit_vectors(nodes.lon, nodes.lat)
    near = cosine.max(axis=1) > np.cos(np.radians(_MARGIN * extent.radius))
    return nodes_at(found.lon[near], found.lat[near], found.weight[near], nodes.ellipsoid)


def _around(extent: Extent, stage: Stage, ellipsoid: Ellipsoid) -> Surroundings | None:
    smallest, largest, folded = stage.around
    if np.isnan(smallest):
        return None
    reach = float(np.radians(_MARGIN * extent.radius) * ellipsoid.ground.mean_radius / 1000.0)
    return Surroundings(within_km=reach, smallest_scale=smallest, largest_scale=largest, folded=folded)


def _area_of_use(region: Place, extent: Extent, stage: Stage) -> AreaOfUse:
    """The box about the region, with its surroundings if the map is whole there."""
    west, south, east, north = region.bounds
    margin = _MARGIN * extent.radius if stage.is_whole_around else 0.0
    if south - margin <= -90.0 or north + margin >= 90.0:
        west, east = -180.0, 180.0
    elif margin:  # the meridian that touches a circle about a corner
        widest = np.cos(np.radians(max(abs(south), abs(north))))
        aside = float(np.degrees(np.arcsin(min(np.sin(np.radians(margin)) / widest, 1.0))))
        west, east = west - aside, east + aside
    return AreaOfUse(region.name, (west, max(south - margin, -90.0), east, min(north + margin, 90.0)))


def _middle(extent: Extent, base: Projection, symmetry: str) -> tuple[float, float]:
    """The middle of a region on the axis of symmetry; the pole, on Greenwich's meridian, for a region about it."""
    if symmetry in ("meridian", "both"):
        return central_meridian(base), extent.lat
    pole = math.copysign(90.0, extent.lat)
    if abs(extent.lat) + 0.5 * extent.radius > 90.0 and np.isfinite(jacobian(base, [0.0], [pole])).all():
        return 0.0, pole
    return extent.lon, extent.lat


def _turned(plane_map: PlaneMap, base: Projection, north: tuple[float, float]) -> PlaneMap:
    """The map with its origin at a place and north up there."""
    lon, lat = np.array([north[0]]), np.array([north[1]])
    new_x, new_y, by = plane_map.at(*base(lon, lat))
    east, up = (by @ jacobian(base, lon, lat))[0, :, 1]
    size = float(np.hypot(east, up))
    if not (np.isfinite(size) and size > 0.0):
        raise ValueError(f"Invalid north '{north[0]:g},{north[1]:g}'. The map does not show it.")
    turn = 1j * complex(east, -up) / size
    return plane_map.moved(turn, -turn * complex(new_x[0], new_y[0]))


def _inverse_error(crs: DerivedCrs, nodes: BaseNodes) -> float:
    """Largest round-trip error of the region's nodes, metres."""
    lon, lat = nodes.lon[nodes.in_region], nodes.lat[nodes.in_region]
    back = crs.inverse(*crs.projection(lon, lat))
    missed = geodesic_lengths(nodes.base.ellipsoid, lon, lat, *back)
    return float(np.max(np.where(np.isfinite(missed), missed, np.inf)))


def _rivals(
    region: Place,
    kind: Kind,
    objective: DesignObjective,
    member: Projection | None,
    against: Any,
    made: MapFigures,
    on_progress: Progress,
) -> Iterator[Rival]:
    """The best member of the families, and the maps to compare with."""
    if member is not None:
        yield _rival("best of the families", "", member, region, objective, made, scaled=kind.free_scale)
    for given in listed_projections(against):
        code = given
        if given == "recommend":
            if not region.area_km2 or region.figure.is_of_another_body:
                continue
            on_progress("recommend")
            best = recommend(region, purpose=kind.name, criterion=objective.figure, limit=1).results
            if not best:
                continue
            code = best[0].code
        words = "best existing" if given == "recommend" else "given"
        name, rival = code if isinstance(code, str) else "", Projection.from_user_input(code)
        check_on_body([rival], Body(region.figure))
        yield _rival(words, name, rival, region, objective, made)


def _rival(
    kind: str,
    name: str,
    projection: Projection,
    region: Place,
    objective: DesignObjective,
    made: MapFigures,
    *,
    scaled: bool = False,
) -> Rival:
    found = measure_map(projection, region, objective, scaled=scaled)
    gain = 1.0 - made.value / found.value if found.value > 0.0 else 0.0
    return Rival(
        kind=kind,
        name=name or projection.name,
        projection=projection,
        value=found.value,
        error=found.error,
        gain=gain,
    )


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
