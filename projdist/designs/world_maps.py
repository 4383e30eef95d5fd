"""Maps of the world made to measure: their specification, the search, and triangles for PROJ's tinshift.

https://proj.org/en/stable/operations/transformations/tinshift.html
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from projdist import answers, earth, regions, support
from projdist._typing import AnyPath, FloatArray, IntArray
from projdist.designs.base_maps import SYMMETRIES, OnProgress, check_within
from projdist.designs.newton import Elements, minimise_elements
from projdist.designs.spline_sheets import Cut, CutLike, SplineMap, Splines, SplineSheet, get_cut
from projdist.field import sample
from projdist.matrices import EXPONENT, Energy
from projdist.projections import Projection, ProjectionLike, listed_projections

# ---- specification -------------------------------------------------------------------------------

WORLD_SYMMETRIES = ("auto", *SYMMETRIES)

_DEGREE = 3
_GRADED, _GRADED_FOR_PARTS = 3.0, 2.0  # powers of the distance from a pole, by which cells are finer there
_POINTS = 4  # Gauss points of a cell, either way
_LEAST_ELSEWHERE = 1e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class WorldSpec:
    """The wanted map; `region` is None for the whole world, `area` is where the map is measured."""

    region: regions.Place | None
    area: regions.Place
    cut: Cut
    elsewhere: float
    until: float
    symmetric: str
    energy: Energy

    @property
    def name(self) -> str:
        """The name of the map."""
        made_for = "World map" if self.region is None else f"World map for {self.region.name}"
        return f"{made_for}, cut at {self.cut.name}"

    def sheet(self, cells: int) -> SplineSheet:
        """Splines on cells that are finer toward poles."""
        across = np.linspace(-np.pi, np.pi, cells + 1)
        t = np.linspace(-1.0, 1.0, cells + 1)
        power = 1.0 if self.until < 90.0 else _GRADED if self.region is None else _GRADED_FOR_PARTS
        along = np.radians(self.until) * np.sign(t) * (1.0 - (1.0 - np.abs(t)) ** power)
        mirrors = (self.symmetric in (axis, "both") for axis in ("meridian", "equator"))
        return SplineSheet(self.cut, Splines(across, _DEGREE), Splines(along, _DEGREE), *mirrors)

    def weights(self, sheet: SplineSheet, share: float) -> FloatArray:
        """Weights of the sheet's nodes, (spans of v, spans of u, points v, points u)."""
        u, v, area = sheet.nodes(_POINTS)
        if self.region is None:
            return area
        if isinstance(self.region, regions.PointSet):
            return share * area / area.sum() + _counted(self.region, sheet)
        return area * np.where(self.region.contains(*self.cut.rolled(u, v)), 1.0, share)


def get_world_spec(
    region: regions.RegionLike | None, cut: CutLike, elsewhere: float, until: float, symmetric: str, exponent: float
) -> WorldSpec:
    """The checked specification; raises ValueError."""
    where, end = get_cut(cut), check_within("end", until, 10.0, 90.0)
    chosen = None if region is None else regions.get_region(region, earth.WGS84)
    mirrors = support.check_choice("symmetry", symmetric, WORLD_SYMMETRIES)
    if mirrors == "auto":
        mirrors = "both" if chosen is None and where.is_straight else "none"
    if mirrors != "none" and not where.is_straight:
        raise ValueError(f"Invalid symmetry '{mirrors}' for the cut '{where.name}'. Where it is bent there is none.")
    if end < 90.0 and where.frame is not None and chosen is None:
        raise ValueError(
            f"Invalid end '{until}' for the cut '{where.name}'. A map that ends needs a meridian or a region."
        )
    everything = regions.get_region("globe") if end == 90.0 else regions.Box(-180.0, -end, 180.0, end)
    return WorldSpec(
        region=chosen,
        area=everything if chosen is None else chosen,
        cut=where,
        elsewhere=check_within("weight elsewhere", elsewhere, _LEAST_ELSEWHERE, 1.0),
        until=end,
        symmetric=mirrors,
        energy=Energy(exponent=check_within("exponent", exponent, 0.0, 1.0)),
    )


def _counted(points: regions.PointSet, sheet: SplineSheet) -> FloatArray:
    """The weights of points, each added to the nearest node in its cell of the sheet; their sum is 1."""
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


# ---- triangulation -------------------------------------------------------------------------------

_ROUNDING = 1e-9  # of a step, and of degrees
_BEYOND = 1e-13  # of a latitude, beyond the poles: PROJ may miss triangles with a pole on their edge


def triangulation(given: SplineMap, name: str, step: float) -> dict[str, Any]:
    """The contents of the file: triangles between graticule lines at most `step` degrees apart."""
    # They lead from degrees in the frame of the map's cut to x and y, exactly at corners, linearly between them.
    u, v = (_divided(splines.breaks, step) for splines in (given.u, given.v))
    if given.cut.is_straight:  # no triangle passes the longitude 180
        u = np.union1d(u, np.radians(np.mod(180.0 - given.cut.points[0][0], 360.0) - 180.0))
    x, y = given.on_sheet(*(axis.ravel() for axis in np.meshgrid(u, v)))
    lat = np.repeat(np.degrees(v), u.size)
    lon = np.tile(np.degrees(u), v.size) + given.cut.at(lat)[0] - 180.0
    lon = np.where(np.abs(np.mod(lon, 360.0) - 180.0) < _ROUNDING, np.round(lon), lon)
    lat *= 1.0 + _BEYOND
    triangles = _triangles(v.size, u.size)
    vertices: list[FloatArray] = []
    found: list[IntArray] = []
    for turn in (-360.0, 0.0, 360.0):
        corners = (lon + turn)[triangles]
        shown = triangles[(corners.max(axis=1) > -180.0) & (corners.min(axis=1) < 180.0)]
        used, places = np.unique(shown, return_inverse=True)
        found.append(places.reshape(-1, 3) + sum(len(part) for part in vertices))
        vertices.append(np.column_stack([lon + turn, lat, x, y])[used])
    return {
        "file_type": "triangulation_file",
        "format_version": "1.0",
        "name": name,
        "transformed_components": ["horizontal"],
        "vertices_columns": ["source_x", "source_y", "target_x", "target_y"],
        "triangles_columns": ["idx_vertex1", "idx_vertex2", "idx_vertex3"],
        "vertices": np.concatenate(vertices).tolist(),
        "triangles": np.concatenate(found).tolist(),
    }


def _divided(breaks: FloatArray, step: float) -> FloatArray:
    """The breaks with the same number of values between any two, all at most `step` degrees apart."""
    # Near the ends of the cut, where the map is steep, breaks are closer together.
    pieces = int(np.ceil(np.degrees(np.diff(breaks).max()) / step - _ROUNDING))
    parts = np.linspace(breaks[:-1], breaks[1:], pieces, endpoint=False, axis=1)
    return np.append(parts.ravel(), breaks[-1])


def _triangles(rows: int, columns: int) -> IntArray:
    """Corners (n, 3) of the halves of a grid's cells, counterclockwise, symmetric about the middle."""
    j, i = (axis.ravel() for axis in np.mgrid[: rows - 1, : columns - 1])
    a = j * columns + i
    b, c, d = a + 1, a + columns, a + columns + 1
    rising = ((2 * i < columns - 1) == (2 * j < rows - 1))[:, None]
    first = np.where(rising, np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
    second = np.where(rising, np.stack([a, d, c], axis=1), np.stack([b, d, c], axis=1))
    return np.concatenate([first, second])


# ---- world maps ----------------------------------------------------------------------------------

AGAINST = ("winkel-tripel", "wagner-9", "robinson", "equal-earth")

_CELLS, _CELLS_FOR_PARTS = 32, 64
_FEWEST, _MOST, _COARSEST = 8, 128, 16
_BLENDS = (1.0, 0.9, 0.8, 0.6, 0.4, 0.2, 0.0)
_TOLERANCE, _TOLERANCE_OF_GLOBE = 1e-5, 1e-4  # of figures of the finished map: coasts cross the splines' breaks
_STEP = 2.0  # degrees
_NORTH = 1e-3  # degrees, for the direction of north


@dataclass(frozen=True)
class Refinement:
    """A mesh of `cells` by `cells`, its unknowns, and the figures of the best map on it at the nodes."""

    cells: int
    unknowns: int
    energy: float  # root of the mean energy, by the objective's weights
    airy_kavrayskiy: float  # root mean square Fisher distortion, by the same
    steps: int


@dataclass(frozen=True)
class Standing:
    """A map's Airy-Kavrayskiy errors at its best scale, over the region and over the whole Earth (`over_globe`)."""

    name: str
    airy_kavrayskiy: float
    error_estimate: float
    over_globe: float
    coverage: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class WorldMap(support.Answer):
    """A map of the world made to measure, at the best scale for the region."""

    #: A cubic spline in metres, twice continuously differentiable except at the ends of the cut.
    projection: Projection = field(metadata=support.schema("name", of="name"))
    region: regions.Place = field(metadata=support.schema(of=("name", "area_km2")))
    cut: Cut = field(metadata=support.schema(of="name"))
    elsewhere: float  #: the weight outside the region
    until: float
    symmetric: str
    exponent: float
    airy_kavrayskiy: float  #: over the region, by adaptive cubature
    error_estimate: float
    over_globe: float  #: the same over the whole Earth; NaN for a map that ends before the poles
    coverage: float
    mirrored: float
    refinements: tuple[Refinement, ...]  #: the meshes
    standings: tuple[Standing, ...]  #: other maps by the same measure

    @property
    def sheet(self) -> SplineMap:
        """The spline map that the projection calls."""
        function = self.projection.function
        assert isinstance(function, SplineMap)
        return function

    def write_tinshift(self, path: AnyPath, *, step: float = _STEP, overwrite: bool = True) -> str:
        """Write the map as triangles for PROJ, and return the operation that reads them, from degrees to metres.

        Parameters
        ----------
        path : str or path
            A file that ends in .json.
        step : float, default 2
            Largest distance of the triangles' corners in degrees. PROJ is exact at the corners, and linear between
            them. At 2 degrees errors are at most 1 to 3 km at 95 % of all places, at 1 degree a quarter of that; near
            the ends of the cut they are ten times larger.
        overwrite : bool, default True
            Whether to replace an existing file.

        Returns
        -------
        str
            The pipeline for `pyproj.Transformer.from_pipeline`, or the program cct.

        Raises
        ------
        ValueError
            For a step that is not within 0.2 and 30 degrees, or a suffix that is not .json.
        FileExistsError
            For an existing file that is not to be overwritten.
        """
        file, size = support.check_path("file", path), support.check_number("step", step)
        if file.suffix.lower() != ".json":
            raise ValueError(f"Invalid file '{file}'. Its suffix must be .json.")
        if not 0.2 <= size <= 30.0:
            raise ValueError(f"Invalid step '{step}'. It must be within 0.2 and 30 degrees.")
        with support.replacing(file, overwrite=overwrite) as new:
            new.write_text(json.dumps(triangulation(self.sheet, self.projection.name, size)), encoding="utf-8")
        return self.pipeline(file)

    def pipeline(self, path: AnyPath) -> str:
        """PROJ's operation from degrees to metres that reads a file of `write_tinshift`."""
        shift = f'+proj=tinshift +file="{path}"' if " " in str(path) else f"+proj=tinshift +file={path}"
        if self.cut.frame is None:
            return shift
        frame = f"+proj=unitconvert +xy_in=deg +xy_out=rad +step {self.cut.frame.step} +step +proj=unitconvert"
        return f"+proj=pipeline +step {frame} +xy_in=rad +xy_out=deg +step {shift}"

    def _line(self) -> str:
        return f"{self.projection.name}: AK {self.airy_kavrayskiy:.4g} ± {self.error_estimate:.1g}"

    def _table(self) -> list[dict[str, Any]]:
        own = Standing("this", self.airy_kavrayskiy, self.error_estimate, self.over_globe, self.coverage)
        return [asdict(one) for one in (own, *self.standings)]


def world_map(
    region: regions.RegionLike | None = None,
    *,
    cut: CutLike = 180.0,
    elsewhere: float = 0.02,
    until: float = 90.0,
    symmetric: str = "auto",
    exponent: float = EXPONENT,
    cells: int | None = None,
    against: ProjectionLike | Iterable[ProjectionLike] = AGAINST,
    progress: OnProgress = None,
) -> WorldMap:
    """The map of the world, cut along a line, that distorts a region least.

    Newton's method minimises the exponentiated Airy-Kavrayskiy energy of cubic splines on the unrolled globe. The map
    does not fold, and shows every place once.

    Parameters
    ----------
    region : RegionLike, optional
        The region to show well: whatever `get_region` takes, also points with weights; by default the whole map.
    cut : float, or points (lon, lat), default 180
        The cut of the globe: along a meridian; or from the first of two or more points through the others to the
        antipode of the first. Two points make half a great circle, more a smooth curve.
    elsewhere : float, default 0.02
        Weight of places outside the region, relative to those inside, within 1e-4 and 1. For points, which have no
        area, it is the weight of the whole Earth relative to all points.
    until : float, default 90
        The latitude north and south at which the map ends, in the frame of the cut; at 90 it has the poles, as points.
    symmetric : str, default "auto"
        The axis of symmetry: "none", "equator", "meridian" (the one opposite the cut) or "both", all in the frame of
        the cut. "auto" is both if there is no region and the cut is straight, else none.
    exponent : float, default 1/8
        Exponent of the energy, at most 1; 0 is the Airy-Kavrayskiy error itself, for maps that end before the poles.
    cells : int, optional
        Number of cells of the finest mesh either way, even and within 8 and 128; by default 32, with a region 64.
    against : ProjectionLike, or iterable of them
        Maps to compare with, each at its best scale.
    progress : callable, optional
        Called with the numbers of cells of meshes done and of all.

    Returns
    -------
    WorldMap
        `projection` is the map, on the sphere of the Earth's mean radius, with the middle of the sheet at 0, 0.

    Raises
    ------
    ValueError
        For an unknown region or symmetry, an impossible cut, and numbers out of their ranges.
    ProjectionError
        For one of `against` that is no projection.

    References
    ----------
    - P. Neff, I.-D. Ghiba, J. Lankeit 2015, Journal of Elasticity 121: the exponentiated energy.
    - J. Brown 1935 and G. B. Airy 1861 ask the same of families of maps; C. de Boor 1978 for splines.

    Examples
    --------
    >>> found = world_map(cells=8, against=["winkel-tripel"])
    >>> found.airy_kavrayskiy < found.standings[0].airy_kavrayskiy
    True
    """
    spec = get_world_spec(region, cut, elsewhere, until, symmetric, exponent)
    usual = _CELLS if spec.region is None else _CELLS_FOR_PARTS
    finest = support.check_whole_number("number of cells", usual if cells is None else cells)
    if finest % 2 or not _FEWEST <= finest <= _MOST:
        raise ValueError(f"Invalid number of cells '{cells}'. It must be even, within {_FEWEST} and {_MOST}.")
    others = listed_projections(against)
    function, refinements = _refined(spec, finest, progress)
    projection = Projection(spec.name, spec.name, earth.SPHERE, function)
    own = sample(projection, spec.area, tolerance=_TOLERANCE)
    return WorldMap(
        projection=projection,
        region=spec.area,
        cut=spec.cut,
        elsewhere=1.0 if spec.region is None else spec.elsewhere,
        until=spec.until,
        symmetric=spec.symmetric,
        exponent=spec.energy.exponent,
        airy_kavrayskiy=own.airy_kavrayskiy.scaled,
        error_estimate=own.error,
        over_globe=_over_globe(projection, own.airy_kavrayskiy.scaled, spec),
        coverage=own.coverage,
        mirrored=own.mirrored,
        refinements=refinements,
        standings=tuple(sorted((_standing(one, spec) for one in others), key=lambda one: one.airy_kavrayskiy)),
    )


def _standing(given: ProjectionLike, spec: WorldSpec) -> Standing:
    found = answers.summarize(given, spec.area, tolerance=_TOLERANCE)
    name, figure = found.projection.name, found.airy_kavrayskiy_scaled
    over_globe = _over_globe(found.projection, figure, spec)
    return Standing(name, figure, found.error_estimate, over_globe, found.coverage)


def _over_globe(projection: Projection, figure: float, spec: WorldSpec) -> float:
    """The error of a map over the whole Earth, where `figure` is that over the area; NaN if maps end before poles."""
    if spec.until < 90.0:
        return float("nan")
    if spec.region is None:
        return figure
    return answers.summarize(projection, "globe", tolerance=_TOLERANCE_OF_GLOBE).airy_kavrayskiy_scaled


# ---- the search -----------------------------------------------------------------------------


def _refined(spec: WorldSpec, finest: int, progress: OnProgress) -> tuple[SplineMap, tuple[Refinement, ...]]:
    """The best map on the finest mesh, in metres at the region's best scale, and the refinements that led to it."""
    if not spec.weights(spec.sheet(finest), 0.0).any():
        raise ValueError(
            f"Invalid region '{spec.area.name}'. It is too small for a map of the world of {finest} cells, "
            "or is not on it."
        )
    sizes = [finest]  # meshes that double their cells, the finest last
    while sizes[0] % 4 == 0 and sizes[0] > _COARSEST:
        sizes.insert(0, sizes[0] // 2)
    best: SplineMap | None = None
    found = []
    for k, cells in enumerate(sizes):
        if progress is not None:
            progress(sum(one * one for one in sizes[:k]), sum(one * one for one in sizes))
        sheet = spec.sheet(cells)
        elements = sheet.elements(spec.weights(sheet, spec.elsewhere))
        place, energy, steps = minimise_elements(spec.energy, elements, _start(sheet, spec.energy, elements, best))
        best = sheet.map(place)
        error = np.sqrt(elements.mean(Energy(), place))
        found.append(Refinement(cells, elements.count, float(np.sqrt(energy)), float(error), steps))
    assert best is not None
    inside = sheet.elements(spec.weights(sheet, 0.0)).weights.ravel()
    log_area = float(inside @ np.log(np.linalg.det(elements.jacobians(place))))
    return _placed(best, earth.SPHERE.a * np.exp(-0.5 * log_area)), tuple(found)


def _start(sheet: SplineSheet, energy: Energy, elements: Elements, coarse: SplineMap | None) -> FloatArray:
    """Unknowns of a map that does not fold at a node: the coarser mesh's best, mixed with Hammer's map if needed."""
    u, v = np.meshgrid(sheet.u.middles, sheet.v.middles)
    scale = np.sqrt(2.0 / (1.0 + np.cos(v) * np.cos(0.5 * u)))
    hammer = sheet.interpolated(2.0 * scale * np.cos(v) * np.sin(0.5 * u), scale * np.sin(v))  # its poles are points
    if coarse is None:
        return hammer
    best = sheet.interpolated(*(z.reshape(u.shape) for z in coarse.on_sheet(u.ravel(), v.ravel())))
    mixed = (share * best + (1.0 - share) * hammer for share in _BLENDS)
    return next(one for one in mixed if np.isfinite(elements.mean(energy, one)))


def _placed(found: SplineMap, scale: float) -> SplineMap:
    """The map at a scale, with its middle at 0, 0 and, for a cut with a frame, north up there."""
    middle = np.zeros(1)
    if found.cut.frame is None:
        return found.moved(scale, -scale * complex(*(z[0] for z in found.on_sheet(middle, middle))))
    lon, lat = found.cut.rolled(middle, middle)
    x, y = found(np.repeat(lon, 2), np.array([lat[0] - _NORTH, lat[0] + _NORTH]))
    north = complex(x[1] - x[0], y[1] - y[0])
    turn = scale * 1j * abs(north) / north
    return found.moved(turn, -turn * complex(*(z[0] for z in found.on_sheet(middle, middle))))
