"""Draw the pictures of regions and write regional_maps.md: `python tools/draw_regions.py [NAME...]`."""

from __future__ import annotations

import sys
from typing import NamedTuple

from docs_files import DOCS
from docs_files import IMAGES as ALL_IMAGES

from projdist import plots

IMAGES = ALL_IMAGES / "regions"
SIZE, DPI = (5.2, 5.2), 110  # inches, and dots in one


class Picture(NamedTuple):
    """A region on a map that is in use there."""

    slug: str
    title: str
    projection: str
    region: str
    measure: str | None = None  # None: Tissot's indicatrices


GROUPS = {
    "Across the antimeridian": (
        Picture("new-zealand", "New Zealand", "EPSG:2193", "country:NZ", "areal_scale"),
        Picture("fiji", "Fiji", "EPSG:3460", "country:FJ", "areal_scale"),
        Picture("united-states", "United States", "EPSG:6350", "country:US", "omega"),
        Picture("russia", "Russia", "EPSG:3576", "country:RU", "omega"),
        Picture("kiribati", "Kiribati", "EPSG:3832", "country:KI@all"),
    ),
    "About the poles": (
        Picture("antarctica", "Antarctica", "EPSG:3031", "country:AQ", "areal_scale"),
        Picture("greenland", "Greenland", "EPSG:3413", "country:GL", "areal_scale"),
        Picture("svalbard", "Svalbard", "EPSG:25833", "country:NO & box:5,74,40,82", "areal_scale"),
    ),
    "Islands": (
        Picture("iceland", "Iceland", "EPSG:3057", "country:IS", "areal_scale"),
        Picture("malta", "Malta", "EPSG:32633", "box:14.1,35.75,14.65,36.12", "areal_scale"),
        Picture("mauritius", "Mauritius", "EPSG:3337", "country:MU@main"),
    ),
    "Cities": (
        Picture("paris", "Paris", "EPSG:2154", "cap:2.35,48.855,30", "areal_scale"),
        Picture("san-francisco", "San Francisco", "EPSG:26910", "cap:-122.35,37.75,50", "areal_scale"),
        Picture("hong-kong", "Hong Kong", "EPSG:2326", "box:113.8,22.13,114.45,22.6", "areal_scale"),
        Picture("oslo", "Oslo", "EPSG:25832", "cap:10.75,59.9,40"),
        Picture("cape-town", "Cape Town", "EPSG:2048", "cap:18.5,-33.95,50", "areal_scale"),
    ),
    "Countries": (
        Picture("germany", "Germany", "EPSG:25832", "country:DE", "areal_scale"),
        Picture("switzerland", "Switzerland", "EPSG:2056", "country:CH", "areal_scale"),
        Picture("france", "France", "EPSG:2154", "country:FR", "areal_scale"),
        Picture("chile", "Chile", "EPSG:32719", "country:CL", "areal_scale"),
        Picture("brazil", "Brazil", "EPSG:5880", "country:BR", "omega"),
        Picture("indonesia", "Indonesia", "EPSG:23834", "country:ID"),
        Picture("japan", "Japan", "+proj=laea +lat_0=37 +lon_0=138 +ellps=GRS80", "country:JP", "omega"),
        Picture("south-africa", "South Africa", "ESRI:102024", "country:ZA", "omega"),
        Picture("italy", "Italy", "EPSG:6875", "country:IT", "areal_scale"),
    ),
}


def draw(picture: Picture) -> None:
    """Write the picture of a region."""
    options = {"region": picture.region, "size": SIZE, "dpi": DPI}
    if picture.measure is None:
        figure = plots.tissot_figure(picture.projection, **options)
    else:
        figure = plots.heatmap_figure(picture.projection, measure=picture.measure, **options)
    plots.save(figure, IMAGES / f"{picture.slug}.png")  # of all colours: a palette makes bands


def page() -> str:
    """regional_maps.md."""
    lines = [
        "# Maps of regions",
        "",
        "Pictures of countries, islands and cities on the maps that are in use there, each as one command makes it. A",
        "region is drawn whole, also across the antimeridian and about a pole. The ground about it is Natural Earth's,",
        "the cities from GeoNames. `--context none`, `coast` or `borders` shows less of it.",
    ]
    for group, pictures in GROUPS.items():
        lines += ["", f"## {group}", ""]
        for picture in pictures:
            command = (
                f"heatmap {quoted(picture.projection)}" if picture.measure else f"tissot {quoted(picture.projection)}"
            )
            measure = f" -m {picture.measure}" if picture.measure else ""
            lines += [
                f"**{picture.title}**: `projdist {command} -r {quoted(picture.region)}{measure}`",
                "",
                f"![{picture.title}](images/regions/{picture.slug}.png)",
                "",
            ]
    return "\n".join(lines).rstrip() + "\n"


def quoted(text: str) -> str:
    """A word of a command line."""
    return f'"{text}"' if " " in text else text


def main(chosen: list[str]) -> None:
    """Draw the chosen pictures, or all, and write the page."""
    IMAGES.mkdir(exist_ok=True)
    for picture in (picture for pictures in GROUPS.values() for picture in pictures):
        if not chosen or picture.slug in chosen:
            print(picture.slug, flush=True)
            draw(picture)
    (DOCS / "regional_maps.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
