"""A region as anything that one is given as: one region, in every function that takes one."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from gis_files import some_slow
from matplotlib.figure import Figure
from PIL import Image
from public_calls import geoaxes
from tables import each

import projdist

geopandas = pytest.importorskip("geopandas")
rasterio = pytest.importorskip("rasterio")

from projdist import gis, plots  # noqa: E402

BOUNDS = (8.0, 48.0, 8.2, 48.2)
SQUARE = shapely.box(*BOUNDS)
BOX = projdist.Box(*BOUNDS)
DEGREES = geopandas.GeoSeries([SQUARE], crs="EPSG:4326")
# Edges of a box are straight in Mercator's map, too.
MERCATOR = geopandas.GeoDataFrame({"name": ["square"]}, geometry=DEGREES.to_crs("EPSG:3395"))

MEMBER = {"type": "Feature", "properties": {}, "geometry": shapely.geometry.mapping(MERCATOR.geometry[0])}
CRS = {"type": "name", "properties": {"name": "EPSG:3395"}}
HALVES = shapely.MultiPolygon([shapely.box(8, 48, 8.1, 48.2), shapely.box(8.1, 48, 8.2, 48.2)])
# What goes through doors of their own: numbers, a geometry, one in another CRS.
DOORS = {"bounds": BOUNDS, "geometry": SQUARE, "GeoDataFrame": MERCATOR}
KINDS = ["box:8,48,8.2,48.2", BOX, *DOORS.values(), list(BOUNDS), np.array(BOUNDS), HALVES, DEGREES]
KINDS += [{"type": "FeatureCollection", "crs": CRS, "features": [MEMBER]}]
KINDS += [shapely.geometry.mapping(SQUARE), geopandas.GeoSeries([SQUARE])]
# Figures of theirs are drawn, or others are that take as long.
DRAWN_TWICE = ("plots.figure", "plots.heatmap", "plots.tissot", "plots.local_field")
PICTURES = "modes_figure", "tissot_figure", "morph", "local_figure", "space_figure"
LONG = "field_of", *(f"plots.{name}" for name in PICTURES)
SLOW = ("ldp", "optimize", "recommend", "design", "distance_distortion", "great_circle_bending", "mean_map")


def drawn(draw: Callable[..., object], *arguments: object, **options: object) -> list[float]:
    """The limits of axes after a picture was drawn in them."""
    figure = Figure()
    draw(figure.add_subplot(), *arguments, **options)
    return limits(figure)


def limits(figure: Figure) -> list[float]:
    """The limits of the first axes of a figure."""
    return [*figure.axes[0].get_xlim(), *figure.axes[0].get_ylim()]


def added(draw: Callable[..., object], region: Any) -> list[float]:
    """Where on axes of cartopy there is anything."""
    axes = geoaxes()
    draw(axes, region=region)
    return [float(value) for one in axes.collections for value in one.get_datalim(axes.transData).extents]


def cartopy_bounds(region: Any, _: Path) -> tuple[float, ...]:
    """The limits of a map for cartopy."""
    pytest.importorskip("cartopy")
    return plots.to_cartopy("robin", region=region).bounds


def extent_of_arrays(region: Any, _: Path) -> list[float]:
    """The first and last coordinates of arrays of measures."""
    pytest.importorskip("xarray")
    found = gis.measure_arrays("robin", region=region, size=20)
    return [*found.x.values[[0, -1]].tolist(), *found.y.values[[0, -1]].tolist()]


def of_plate_carree(lon: Any, lat: Any) -> Any:
    """Its Jacobians: h = 1 and k = 1 / cos(latitude)."""
    east = np.zeros((*np.shape(lon), 2, 2))
    east[..., 0, 0], east[..., 1, 1] = 1.0 / np.cos(np.radians(lat)), 1.0
    return east


def weighted(region: Any, folder: Path) -> float:
    """The sum of the weights of a region in a raster of ones, each a hundredth of a degree wide."""
    path = folder / "ones.tif"
    if not path.exists():
        profile = {"width": 100, "height": 100, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
        with rasterio.open(path, "w", transform=rasterio.Affine(0.01, 0, 7.5, 0, -0.01, 48.5), **profile) as image:
            image.write(np.ones((1, 100, 100)))
    return float(gis.weighted(region, path).weight.sum())


def film(region: Any, folder: Path) -> float:
    """The mean brightness of the first picture of a film, to tens, as outlines have other vertices."""
    options: dict[str, Any] = {"region": region, "frames": 2, "size": (2, 2), "dpi": 50}
    path = plots.morph("robin", "moll", folder / "film.gif", **options)
    with Image.open(path) as image:
        return round(float(np.asarray(image.convert("L")).mean()), -1)


COARSE = {"tolerance": 1e-3}
ANSWERS: dict[str, Callable[[Any], Any]] = {
    "compare": lambda region: projdist.compare(["robin"], region, **COARSE).results[0],
    "correct": lambda region: projdist.correct("robin", region, **COARSE),
    "design": lambda region: projdist.design(region, degree=2, base="EPSG:3035", against=()),
    "distance_distortion": lambda region: projdist.distance_distortion("robin", region, tolerance=0.5),
    "great_circle_bending": lambda region: projdist.great_circle_bending("robin", region, tolerance=0.5),
    "indices": lambda region: projdist.indices("robin", region, names="airy", **COARSE),
    "info": lambda region: projdist.info("robin", region, tolerance=1e-3),
    "ldp": lambda region: projdist.ldp(region, height=500, families=["tmerc"]),
    "mean_map": lambda region: projdist.mean_map(["robin"], region=region, degree=1),
    "optimize": lambda region: projdist.optimize("eqc", region, free=["lat_ts"]),
    "recommend": lambda region: projdist.recommend(region, limit=1, authorities=["IGNF"]),
    "sample": lambda region: projdist.sample("robin", region, **COARSE),
    "summarize": lambda region: projdist.summarize("robin", region, **COARSE),
}
OTHERS: dict[str, Callable[[Any, Path], Any]] = {
    "field_of": lambda region, _: projdist.field_of(of_plate_carree, region=region).weight.sum(),
    "interpolant": lambda region, _: projdist.interpolant("robin", region)([8.05, 8.15], 48.1).jacobian,
    "gis.indicatrices": lambda region, _: gis.indicatrices("robin", region=region, step=0.1).total_bounds,
    "gis.measure_arrays": extent_of_arrays,
    "gis.raster": lambda region, _: gis.raster("robin", ["fisher"], region=region, size=20).pixels.transform,
    "gis.weighted": weighted,
    "plots.add_heatmap": lambda region, _: added(plots.add_heatmap, region),
    "plots.add_tissot": lambda region, _: added(plots.add_tissot, region),
    "plots.distribution_figure": lambda region, _: limits(plots.distribution_figure(["robin"], region=region)),
    "plots.heatmap": lambda region, _: drawn(plots.heatmap, "robin", region=region),
    "plots.figure": lambda region, _: limits(plots.figure(["robin"], "tissot", region=region)),
    "plots.heatmap_figure": lambda region, _: limits(plots.heatmap_figure(["robin"], region=region)),
    "plots.local_field": lambda region, _: drawn(plots.local_field, "robin", 10.0, region=region),
    "plots.local_figure": lambda region, _: limits(plots.local_figure("robin", 10.0, region=region)[0]),
    "plots.modes_figure": lambda region, _: limits(plots.modes_figure(["robin"], region=region)),
    "plots.space_figure": lambda region, _: limits(plots.space_figure(["robin"], region=region)),
    "plots.morph": film,
    "plots.tissot": lambda region, _: drawn(plots.tissot, "robin", region=region),
    "plots.tissot_figure": lambda region, _: limits(plots.tissot_figure(["robin"], region=region)),
    "plots.to_cartopy": cartopy_bounds,
}


@each("kind", KINDS)
def test_all_kinds_are_one_region(kind: Any) -> None:
    """Of one area, as far as areas of polygons are good, and with one outline."""
    found = projdist.get_region(kind)
    assert found.area_km2 == pytest.approx(BOX.area_km2, rel=1e-8)
    np.testing.assert_allclose(found.bounds, BOUNDS, atol=1e-9)


@pytest.mark.parametrize("name", some_slow(ANSWERS, {*SLOW[:4]}))
def test_answers_are_of_the_region(name: str) -> None:
    """Whatever it was given as; what takes seconds is tried with what is least like text."""
    for kind in [MERCATOR] if name in SLOW else DOORS.values():
        assert ANSWERS[name](kind).region.area_km2 == pytest.approx(BOX.area_km2, rel=1e-8)


@pytest.mark.parametrize("doors", some_slow(["GeoDataFrame", "bounds geometry"], {"bounds geometry"}))
@pytest.mark.parametrize("name", some_slow(OTHERS, {*LONG, *DRAWN_TWICE}))
@pytest.mark.usefixtures("few_cells")
def test_pictures_and_files_are_of_the_region(name: str, doors: str, tmp_path: Path) -> None:
    """They reach as far as those of the box."""
    expected, *others = (OTHERS[name](kind, tmp_path) for kind in (BOX, *(DOORS[door] for door in doors.split())))
    for other in others:
        np.testing.assert_allclose(other, expected, rtol=1e-6)


TYPES = {"region": "RegionLike", "projection": "ProjectionLike", "projections": "ProjectionLike"}


def test_types_say_what_regions_and_projections_may_be() -> None:
    """Every public function that takes them has the types that are exported; all that take a region are above."""
    rooms = {"": projdist, "plots.": plots, "gis.": gis}
    functions = {f"{room}{name}": getattr(module, name) for room, module in rooms.items() for name in module.__all__}
    functions = {name: value for name, value in functions.items() if inspect.isfunction(value)}
    found = {name: inspect.signature(value).parameters for name, value in functions.items()}
    elsewhere = {"get_region", "world_map"}  # whose regions are parts of the world, not squares
    taking = {name for name, parameters in found.items() if "region" in parameters}
    assert taking | {"plots.figure"} == {*ANSWERS, *OTHERS, *elsewhere}  # an option of figure
    for name, parameters in found.items():
        for parameter in parameters.keys() & TYPES:
            assert TYPES[parameter] in str(parameters[parameter].annotation), name
