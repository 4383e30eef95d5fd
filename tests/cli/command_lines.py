"""A quick command line of every command and format of people's, and the files that they read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mosaic_sets import SIZES, affine_maps, common_points, write_csv
from shapely import LineString, Point, box

geopandas = pytest.importorskip("geopandas")

FAROES = "box:-7.2,61.3,-6.2,62.5"
EUROPE = "box:-10,35,30,70"
QUICK = ("--tolerance", "1e-3")

LINES: dict[str, tuple[str, ...]] = {
    "info": ("info", "EPSG:2056"),
    "info_picture": ("info", "robin", "-r", EUROPE, "-o", "info.png", "--dpi", "30"),
    "find": ("find", "utm", "33"),
    "find_nothing": ("find", "amersfort"),
    "atlas": ("atlas", "NZ"),
    "compare": ("compare", "robin", "mollweide", "EPSG:3857", "-r", EUROPE, "-m", "omega", "-m", "s", *QUICK),
    "compare_indices": ("compare", "robin", "mollweide", "-r", EUROPE, "--indices", "all", *QUICK),
    "compare_part": ("compare", "+proj=ortho +lat_0=90 +R=6371000", "moll", "-m", "s", "--tolerance", "1e-2"),
    "compare_failures": ("compare", "robin", "EPSG:4326", "nosuch", "-r", EUROPE, *QUICK),
    "compare_plot": (
        *("compare", "robin", "moll", "-r", EUROPE, *QUICK),
        *("--plot", "pareto", "-o", "p.png", "--dpi", "30"),
    ),
    "compare_regions": ("compare", "robin", "EPSG:3857", "--regions", EUROPE, "--regions", FAROES, *QUICK),
    "factors": ("factors", "EPSG:32633", "15", "50", "16", "51"),
    "factors_file": ("factors", "robin", "--at", "points.csv"),
    "profile": ("profile", "EPSG:25832", "--line", "9,48,9.4,48.2,10,48.1", "--height", "500", "--spacing", "20"),
    "profile_picture": ("profile", "EPSG:25832", "--line", "road.geojson", "-o", "profile.png", "--dpi", "30"),
    "tissot": ("tissot", "robin", "-o", "tissot.png", "--dpi", "30"),
    "heatmap": ("heatmap", "EPSG:2169", "-o", "heatmap.png", "--dpi", "30"),
    "heatmap_against": ("heatmap", "robin", "--against", "moll", "-r", EUROPE, "-o", "less.png", "--dpi", "30"),
    "morph": ("morph", "robin", "moll", "-r", EUROPE, "-o", "film.gif", "--frames", "3", "--dpi", "30"),
    "recommend": ("recommend", FAROES, "--authority", "EPSG", "--datum", "FD54"),
    "recommend_picture": (
        *("recommend", FAROES, "--authority", "EPSG", "--datum", "FD54", "--custom", "--purpose", "conformal"),
        *("-o", "best.png", "--dpi", "30"),
    ),
    "recommend_regions": ("recommend", "--regions", FAROES, "--authority", "EPSG", "--datum", "FD54"),
    "optimize": ("optimize", "lcc", EUROPE, "--round", "0.5", "--against", "EPSG:3034"),
    "design": ("design", FAROES, "--degree", "2", "--base", "EPSG:5316", "--against", "EPSG:25829"),
    "world_map": ("world-map", "--cells", "8", "--against", "robin", "--tinshift", "world.json"),
    "optimize_file": ("optimize", "lcc", EUROPE, "-o", "optimum.txt"),
    "mean_map": ("mean-map", "EPSG:25832", "EPSG:3035", "-r", FAROES, "--degree", "3"),
    "ldp": ("ldp", "box:-104.2,38.9,-103.2,39.6", "--height", "1610", "--against", "EPSG:32613"),
    "convert": ("convert", "parcels.geojson", "--to", "EPSG:3035", "-o", "moved.gpkg"),
    "check": ("check", "parcels.geojson", "--crs", "EPSG:25832"),
    "check_above": ("check", "parcels.geojson", "--crs", "EPSG:3857", "--fail-above", "1%"),
    "compare_space": ("compare", "robin", "-r", EUROPE, "--plot", "space", "-o", "space.png", "--dpi", "30"),
    "compare_modes": ("compare", "robin", "moll", "-r", EUROPE, "--modes"),
    "correct": ("correct", "mollweide", "-r", EUROPE),
    "correct_median": ("correct", "mollweide", "-r", EUROPE, "--criterion", "median"),
    "correct_local": ("correct", "robin", "-r", EUROPE, "--local", "500", "-o", "local.png", "--dpi", "30"),
    "mosaic": ("mosaic", "--correspondences", "common.csv"),
    "clouds": ("clouds", "a.csv", "b.csv", "c.csv", "-o", "moved"),
    "clouds_weights": ("clouds", "a.csv", "b.csv", "--weights", "counts.txt"),
    "oldmap": ("oldmap", "control.csv", "--scan-dpi", "300", "-o", "oldmap.png", "--dpi", "30"),
    "tables": ("tables",),
    "tables_one": ("tables", "snyder"),
    "tables_canters": ("tables", "canters-decleir"),
    "list_projections": ("list", "projections"),
    "list_measures": ("list", "measures"),
    "list_criteria": ("list", "criteria"),
    "list_indices": ("list", "indices"),
    "version": ("--version",),
    "help": ("--help",),
    "nothing": (),
    "unknown_command": ("compere",),
    "unknown_option": ("compare", "robin", "--reigon", "globe"),
    "wrong_region": ("compare", "robin", "-r", "country:Nowhereland & (box:1,2,3,4 - cap:10,50,abc)"),
}


def write_files(folder: Path) -> None:
    """The files that the command lines name."""
    rng = np.random.default_rng(1)
    (folder / "points.csv").write_text("name,lon,lat\nPraha,14.42,50.09\nBrno,16.61,49.2\n", encoding="utf-8")
    road = LineString([(9, 48, 300), (9.5, 48.3, 650), (10.4, 48.2, 500)])
    geopandas.GeoDataFrame(geometry=[road], crs="EPSG:4326").to_file(folder / "road.geojson")
    shapes = [box(5.9, 47.3, 15.0, 55.1), LineString([(8, 50), (9, 51)]), Point(10, 50)]
    names = {"name": ["Germany", "a road", "a tower"]}
    geopandas.GeoDataFrame(names, geometry=shapes, crs="EPSG:4326").to_file(folder / "parcels.geojson")
    write_csv(folder / "common.csv", common_points(affine_maps(rng, count=3), SIZES[:3], rng, noise=0.3))
    (folder / "counts.txt").write_text("1\n2\n0\n" * 4, encoding="utf-8")
    points = rng.normal(size=(12, 3))
    for name in ("a.csv", "b.csv", "c.csv"):
        moved = points @ (np.eye(3) + 0.2 * rng.normal(size=(3, 3)))
        np.savetxt(folder / name, moved, delimiter=",", header="x,y,z", comments="")
    x, y = np.stack(np.meshgrid(*[np.linspace(0.0, 400.0, 5)] * 2), axis=-1).reshape(-1, 2).T
    table = np.stack([x, y, 6e5 + 50.0 * x + 0.02 * x * x, 2e5 - 52.0 * y + 0.01 * x * y], axis=-1)
    np.savetxt(folder / "control.csv", table, delimiter=",", header="x_old,y_old,x_new,y_new", comments="")
