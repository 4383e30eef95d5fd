"""Make docs/atlas: the data of the atlas as CSV, Parquet and GeoPackage, its pages of ten places, and their pictures.

`python tools/draw_atlas.py [--all]`; with --all the pictures of all places, in a quarter of an hour.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Collection
from pathlib import Path

import geopandas
import matplotlib.pyplot as plt
import pandas as pd
import shapely
from atlas_pages import TEN, entries, overview_page, pictured, place_page, slug
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from projdist import AtlasEntry, get_region, gis, plots
from projdist.regions import polygons_of

DOCS = Path(__file__).parents[1] / "docs"
FOLDER, IMAGES = DOCS / "atlas", DOCS / "images" / "atlas"
SIZE, DPI = (7.6, 3.8), 110  # inches, and dots in one
DIGITS = 6
WORLD = "+proj=eqearth"
STEPS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)  # times the error of the best map
NONE, SEA = "#c9c9c9", "#f0f4f8"


def write_data() -> None:
    """The rows of all entries, and the outlines."""
    frame = pd.DataFrame([row for entry in entries().values() for row in entry.rows()])
    numbers = frame.select_dtypes("float").columns
    frame[numbers] = frame[numbers].map(lambda value: float(f"{value:.{DIGITS}g}"))
    frame.to_csv(FOLDER / "atlas.csv.gz", index=False, compression={"method": "gzip", "mtime": 0})
    frame.to_parquet(FOLDER / "atlas.parquet", compression="zstd", index=False)
    os.environ["OGR_CURRENT_DATE"] = "2026-01-01T00:00:00.000Z"  # the same data makes the same file
    outlines().to_file(FOLDER / "atlas.gpkg", driver="GPKG", layer="atlas", engine="pyogrio")


def outlines() -> geopandas.GeoDataFrame:
    """The outlines of all places, with their summaries."""
    rows = [entry.summary() for entry in entries().values()]
    shapes = [polygons_of(get_region(entry.region)) for entry in entries().values()]
    return geopandas.GeoDataFrame(rows, geometry=shapes, crs="OGC:CRS84")


def world_figure() -> Figure:
    """How many times the error of the best map the official CRSs of countries have."""
    frame = outlines()
    frame = frame[frame.kind.isin(["country", "part"])]
    ratio = frame.official_error / frame.made_error
    moved = gis.convert_frame(frame.assign(ratio=ratio)[["ratio", "geometry"]], WORLD, densify=50.0)
    figure = Figure(figsize=(9.0, 5.0), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.set_aspect("equal")
    globe = geopandas.GeoDataFrame(geometry=[shapely.box(-180.0, -90.0, 180.0, 90.0)], crs=frame.crs)
    gis.convert_frame(globe, WORLD, densify=50.0).plot(ax=axes, color=SEA, edgecolor="black", linewidth=0.5)
    colours = plt.get_cmap("viridis_r", len(STEPS))
    norm = BoundaryNorm(STEPS, colours.N, extend="max")
    known = moved[moved.ratio.notna()]
    moved[moved.ratio.isna()].plot(ax=axes, color=NONE, edgecolor="white", linewidth=0.2)
    known.plot(ax=axes, column="ratio", cmap=colours, norm=norm, edgecolor="white", linewidth=0.2)
    bar = figure.colorbar(
        plt.cm.ScalarMappable(norm, colours), ax=axes, orientation="horizontal", shrink=0.6, aspect=40
    )
    bar.set_label("error of the official CRS over that of the best map (gray: no single official CRS)")
    bar.set_ticks(STEPS, labels=[f"{step:g}" for step in STEPS])
    return figure


def place_figure(entry: AtlasEntry) -> Figure:
    """The distortion of a place on the official CRS and on the best map."""
    maps = pictured(entry)
    return plots.heatmap_figure(list(maps.values()), region=entry.region, titles=list(maps), size=SIZE, dpi=DPI)


def main(chosen: Collection[str]) -> None:
    FOLDER.mkdir(exist_ok=True)
    IMAGES.mkdir(exist_ok=True)
    write_data()
    plots.save(world_figure(), IMAGES / "world.png")
    for name in chosen:
        entry = entries()[name]
        sys.stderr.write(f"{entry.title}\n")
        plots.save(place_figure(entry), IMAGES / f"{slug(entry)}.png")
    for name in TEN:
        page = slug(entries()[name])
        (FOLDER / f"{page}.md").write_text(place_page(name, f"../images/atlas/{page}.png"), encoding="utf-8")
    links = {name: f"{slug(entries()[name])}.md" for name in TEN}
    (FOLDER / "README.md").write_text(overview_page("../images/atlas", links.get), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--all", action="store_true", help="the pictures of all places")
    main(list(entries()) if parser.parse_args().all else TEN)
