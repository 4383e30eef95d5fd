"""projdist over countries and land against the usual way, as Markdown tables: `python benchmarks/regions.py`."""

import math
import statistics
import time
from collections.abc import Callable

import numpy as np
import shapely
from pyproj import Geod, Proj

from projdist.answers.summaries import summarize
from projdist.earth import WGS84, natural_earth as geodata
from projdist.projections import Projection
from projdist.regions import Polygons, cells_of, get_region

R = 6371008.7714
RUNS = 5
STEPS = {"country:CH": (0.05, 0.005), "country:CA": (0.25, 0.05, 0.02), "land@50m": (0.25, 0.05)}  # degrees


def seconds(function: Callable[[], object], runs: int = RUNS) -> float:
    """Median time of a function."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def table(title: str, *columns: str) -> None:
    print(f"\n### {title}\n\n| {' | '.join(columns)} |\n|{' --- |' * len(columns)}")


def row(*cells: object) -> None:
    print(f"| {' | '.join(str(cell) for cell in cells)} |", flush=True)


def grid_error(projection: Proj, geometry: shapely.MultiPolygon, step: float) -> float:
    """The usual way: factors at those centres of cells that are in the polygons, weighted by cos(latitude)."""
    west, south, east, north = geometry.bounds
    lon, lat = np.meshgrid(np.arange(west + step / 2, east, step), np.arange(south + step / 2, north, step))
    shapely.prepare(geometry)
    inside = shapely.contains_xy(geometry, lon, lat)
    lon, lat = lon[inside], lat[inside]
    found = projection.get_factors(lon, lat, errcheck=False)
    square = np.log(found.tissot_semimajor) ** 2 + np.log(found.tissot_semiminor) ** 2
    weight = np.cos(np.radians(lat))
    return math.sqrt(np.sum(weight * square) / np.sum(weight))


REGIONS = ("country:CH", "country:FR", "country:CA", "continent:Africa", "land@50m")
MAPS = ("robin", "moll", "merc", "lcc +lat_1=30 +lat_2=60 +lon_0=-96")


def times() -> None:
    table(
        "summarize(tolerance=1e-6): the first map finds the weights of the panels, which serve all others",
        *("region", "vertices", "map", "first ms", "next ms", "evaluations", "estimate", "error"),
    )
    for name in REGIONS:
        region = get_region(name)
        for text in MAPS:
            projection = Projection.from_user_input(f"+proj={text} +R={R}")
            new = Polygons(region.geometry, region.name)
            start = time.perf_counter()
            found = summarize(projection, new, tolerance=1e-6)
            first = time.perf_counter() - start
            again = seconds(lambda p=projection, r=new: summarize(p, r, tolerance=1e-6))
            truth = summarize(projection, region, tolerance=1e-10).airy_kavrayskiy
            row(
                name,
                len(region.edges),
                text.split()[0],
                f"{1e3 * first:.0f}",
                f"{1e3 * again:.1f}",
                found.evaluations,
                f"{found.error_estimate:.0e}",
                f"{abs(found.airy_kavrayskiy - truth):.0e}",
            )


def grids() -> None:
    table(
        "The usual way, an indicator on a grid, and projdist at the grid's error: a first map, and a next one",
        *(
            "region",
            "map",
            "step",
            "grid's error",
            "grid ms",
            "projdist's error",
            "first ms",
            "next ms",
            "ratios of times",
        ),
    )
    for name, steps in STEPS.items():
        region = get_region(name)
        for text in ("robin", "moll"):
            definition = f"+proj={text} +R={R}"
            projection, proj = Projection.from_user_input(definition), Proj(definition)
            truth = summarize(projection, region, tolerance=1e-10).airy_kavrayskiy
            for step in steps:
                error = abs(grid_error(proj, region.geometry, step) - truth)
                theirs = seconds(lambda p=proj, g=region.geometry, s=step: grid_error(p, g, s), runs=1)
                tolerance = max(error, 1e-9)

                def ours(p: Projection = projection, g: shapely.Geometry = region.geometry, t: float = tolerance):
                    return summarize(p, Polygons(g, "new"), tolerance=t)

                found, first = abs(ours().airy_kavrayskiy - truth), seconds(ours)
                following = seconds(lambda p=projection, r=region, t=tolerance: summarize(p, r, tolerance=t))
                row(
                    name,
                    text,
                    step,
                    f"{error:.0e}",
                    f"{1e3 * theirs:.0f}",
                    f"{found:.0e}",
                    f"{1e3 * first:.0f}",
                    f"{1e3 * following:.1f}",
                    f"{theirs / first:.0f}, {theirs / following:.0f}",
                )


def nodes() -> None:
    table(
        "About 2000 cells of a region with their areas and middles, and the weights of Gauss nodes in the same cells",
        *("region", "vertices", "cells", "cells ms", "weights ms", "ratio"),
    )
    for name in (*REGIONS[:4], "country:US", "country:NZ"):
        region = get_region(name)
        found = cells_of(region, WGS84, 2000)

        def ours(r: Polygons = region) -> object:
            cells_of.cache_clear()
            return cells_of(r, WGS84, 2000)

        def theirs(r: Polygons = region, patch: object = found.patch, rectangle: object = found.rectangle) -> object:
            return Polygons(r.geometry, "new").clip(patch, rectangle)

        fast, slow = seconds(ours), seconds(theirs, runs=3)
        row(name, len(region.edges), found.area.size, f"{1e3 * fast:.0f}", f"{1e3 * slow:.0f}", f"{slow / fast:.0f}")


def areas() -> None:
    table("Areas against geodesics", "country", "km2", "relative difference")
    geod = Geod(ellps="WGS84")
    for code in ("CA", "RU", "FJ", "AQ", "CH"):
        region = get_region(f"country:{code}")
        total = 0.0
        for part in region.geometry.geoms:
            dense = shapely.segmentize(part, 0.01)
            for k, ring in enumerate((dense.exterior, *dense.interiors)):
                area = abs(geod.polygon_area_perimeter(*shapely.get_coordinates(ring).T)[0]) / 1e6
                total += area if k == 0 else -area
        row(code, f"{region.area_km2:,.0f}", f"{region.area_km2 / total - 1:.0e}")


def loading() -> None:
    table("Reading the shipped data, once", "what", "ms")
    start = time.perf_counter()
    geodata.land("50m")
    row("land 50m", f"{1e3 * (time.perf_counter() - start):.0f}")


if __name__ == "__main__":
    loading()
    times()
    grids()
    nodes()
    areas()
