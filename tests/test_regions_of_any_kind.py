"""A region as anything that one is given as: one region, in every function that takes one."""

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image
from public_calls import CALLS, geoaxes
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
DOORS = (BOUNDS, SQUARE, MERCATOR)
KINDS = ["box:8,48,8.2,48.2", BOX, *DOORS, list(BOUNDS), np.array(BOUNDS), HALVES, DEGREES]
KINDS += [{"type": "FeatureCollection", "crs": CRS, "features": [MEMBER]}]
KINDS += [shapely.geometry.mapping(SQUARE), geopandas.GeoSeries([SQUARE])]
SLOW = ("ldp", "optimize", "recommend", "design", "distance_distortion", "great_circle_bending", "mean_map")


def answer(name: str, region: Any) -> Any:
    """Of a public function, over a region."""
    return getattr(projdist, name)(**CALLS[name]() | OPTIONS.get(name, {}) | {"region": region})


def limits(name: str, region: Any, _: Path) -> list[float]:
    """Of the first axes of a picture."""
    call = CALLS[name]() | OPTIONS.get(name, {}) | {"region": region}
    found = getattr(plots, name.removeprefix("plots."))(**call)
    axes = call.get("ax") or (found[0] if isinstance(found, tuple) else found).axes[0]
    return [*axes.get_xlim(), *axes.get_ylim()]


def added(draw: Callable[..., object], region: Any) -> list[float]:
    """Where on axes of cartopy there is anything."""
    axes = geoaxes()
    draw(axes, region=region)
    return [float(value) for one in axes.collections for value in one.get_datalim(axes.transData).extents]


def extent_of_arrays(region: Any, _: Path) -> list[float]:
    """The first and last coordinates of arrays of measures."""
    pytest.importorskip("xarray")
    found = gis.measure_arrays("robin", region=region, size=20)
    return [float(one[end]) for one in (found.x, found.y) for end in (0, -1)]


def of_plate_carree(lon: Any, lat: Any) -> Any:
    """Its Jacobians: h = 1 and k = 1 / cos(latitude)."""
    return np.eye(2) / np.stack([np.cos(np.radians(lat)), np.ones(np.shape(lat))], axis=-1)[..., None]


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


ANSWERS = {*SLOW, "compare", "correct", "indices", "info", "sample", "summarize"}
OPTIONS = {"optimize": {"free": ["lat_ts"]}, "recommend": {"authorities": ["IGNF"]}}
OPTIONS |= {name: {"tolerance": 0.5} for name in ("distance_distortion", "great_circle_bending")}
OPTIONS |= {name: {"radius_km": 10.0} for name in ("plots.local_field", "plots.local_figure")}
# They are drawn in figures of others, or take long.
DRAWN_TWICE = {*(f"plots.{name}" for name in ("figure", "heatmap", "tissot", "local_field"))}
LONG = {*(f"plots.{kind}_figure" for kind in ("heatmap", "modes", "tissot", "local", "space"))}
OTHERS: dict[str, Callable[[Any, Path], Any]] = {
    "field_of": lambda region, _: projdist.field_of(of_plate_carree, region=region).weight.sum(),
    "gis.indicatrices": lambda region, _: gis.indicatrices("robin", region=region, step=0.1).total_bounds,
    "gis.measure_arrays": extent_of_arrays,
    "gis.raster": lambda region, _: gis.raster("robin", ["fisher"], region=region, size=20).pixels.transform,
    "gis.weighted": weighted,
    "plots.add_heatmap": lambda region, _: added(plots.add_heatmap, region),
    "plots.add_tissot": lambda region, _: added(plots.add_tissot, region),
    "plots.morph": film,
    "plots.to_cartopy": lambda region, _: geoaxes() and plots.to_cartopy("robin", region=region).bounds,
    **{name: functools.partial(limits, name) for name in ("plots.distribution_figure", *sorted(DRAWN_TWICE | LONG))},
}


@each("kind", KINDS)
def test_all_kinds_are_one_region(kind: Any) -> None:
    """Of one area, as far as areas of polygons are good, and with one outline."""
    found = projdist.get_region(kind)
    assert found.area_km2 == pytest.approx(BOX.area_km2, rel=1e-8)
    np.testing.assert_allclose(found.bounds, BOUNDS, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(ANSWERS))
def test_answers_are_of_the_region(name: str) -> None:
    """Whatever it was given as; what takes seconds is tried with what is least like text."""
    for kind in [MERCATOR] if name in SLOW else DOORS:
        assert answer(name, kind).region.area_km2 == pytest.approx(BOX.area_km2, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.usefixtures("few_cells")
def test_pictures_and_files_are_of_the_region(name: str, tmp_path: Path) -> None:
    """They reach as far as those of the box."""
    expected, *others = (OTHERS[name](kind, tmp_path) for kind in (BOX, *DOORS))
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
    by_options = {"plots.figure", "plots.heatmap", "plots.tissot"}
    assert taking | by_options == {*ANSWERS, *OTHERS, *elsewhere}
    for name, parameters in found.items():
        for parameter in parameters.keys() & TYPES:
            assert TYPES[parameter] in str(parameters[parameter].annotation), name
