"""A quick command line of every command and format of people's, and the files that they read."""

import shlex
from pathlib import Path

import numpy as np
import pytest
from mosaic_sets import SIZES, affine_maps, common_points, write_csv
from shapely import LineString, Point, box

geopandas = pytest.importorskip("geopandas")

FAROES = "box:-7.2,61.3,-6.2,62.5"
TABLE = Path(__file__).parents[1] / "data" / "command_lines.txt"
LINES = {
    name: tuple(shlex.split(words))
    for name, _, words in (line.partition(":") for line in TABLE.read_text(encoding="utf-8").splitlines())
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
