"""Draw the pictures of the gallery and write their parts of docs/gallery.md: `python tools/draw_gallery.py [NAME...]`.

Names of maps or regions, as `robinson` or `fiji`, draw only their pictures, `made` only the world maps made to measure,
which take two minutes. The parts of the page are always written whole.
"""

from __future__ import annotations

import sys
import time
from typing import NamedTuple

import numpy as np
from docs_files import DPI, IMAGES, write_part, write_png
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from projdist import Projection, get_region, plots, summarize, world_map
from projdist.answers import Summary

# ---- maps with their indicatrices -----------------------------------------------------------

PANEL = 3.9  # inches: the greatest width and height of a map
SPHERE = "+R=6371008.7714"


class Entry(NamedTuple):
    """A map of the gallery; without a region it is drawn and measured on the globe."""

    slug: str
    title: str
    projection: str
    measure: str
    text: str
    region: str = "globe"
    place: str = "the globe"


ENTRIES = (
    Entry(
        "robinson",
        "Robinson",
        "robinson",
        "fisher",
        "A compromise drawn by eye and given as a table: neither areas nor angles are kept, but neither suffers badly.",
    ),
    Entry(
        "winkel-tripel",
        "Winkel Tripel",
        "winkel-tripel",
        "fisher",
        "The mean of plate carrée and Aitoff: a compromise with curved parallels.",
    ),
    Entry(
        "natural-earth",
        "Natural Earth",
        "natural-earth",
        "fisher",
        "A compromise with rounded corners, made for small world maps.",
    ),
    Entry(
        "kavrayskiy-7",
        "Kavrayskiy VII",
        "kavrayskiy-7",
        "fisher",
        "A compromise from one short formula: straight parallels and elliptical meridians.",
    ),
    Entry(
        "aitoff",
        "Aitoff",
        "aitoff",
        "fisher",
        "The azimuthal equidistant hemisphere, with longitudes halved before and widths doubled after.",
    ),
    Entry(
        "van-der-grinten",
        "Van der Grinten",
        "van-der-grinten",
        "areal_scale",
        "The world in a circle, all meridians and parallels arcs of circles. Areas grow fast towards the poles.",
    ),
    Entry(
        "mollweide",
        "Mollweide",
        "mollweide",
        "omega",
        "Areas are true and the meridians are ellipses. Shapes suffer at the edge.",
    ),
    Entry(
        "equal-earth",
        "Equal Earth",
        "equal-earth",
        "omega",
        "Areas are true; the outline is like that of Robinson's map.",
    ),
    Entry(
        "eckert-4",
        "Eckert IV",
        "eckert-4",
        "omega",
        "Areas are true. The poles are lines half as long as the equator, the outer meridians semicircles.",
    ),
    Entry(
        "sinusoidal",
        "Sinusoidal",
        "sinusoidal",
        "omega",
        "Areas are true, and so are all lengths along parallels. The poles are points.",
    ),
    Entry(
        "hammer",
        "Hammer",
        "hammer",
        "omega",
        "Areas are true and the parallels curved: Lambert's azimuthal hemisphere, stretched to the world.",
    ),
    Entry(
        "wagner-7",
        "Wagner VII",
        "wagner-7",
        "omega",
        "Areas are true, the parallels are curved, and the poles are curved lines.",
    ),
    Entry(
        "plate-carree",
        "Plate carrée",
        "plate-carree",
        "fisher",
        "Longitude and latitude taken as x and y. Meridians have their true length.",
    ),
    Entry(
        "mercator",
        "Mercator",
        "mercator",
        "areal_scale",
        "Angles are true. The poles lie at infinity: the picture stops short of them, but the figures do not.",
    ),
    Entry(
        "gall-peters",
        "Gall–Peters",
        "gall-peters",
        "omega",
        "A cylindrical map with true areas, free of distortion at 45 degrees north and south.",
    ),
    Entry(
        "interrupted-goode-homolosine",
        "Interrupted Goode homolosine",
        "interrupted-goode-homolosine",
        "omega",
        "Sinusoidal in the middle, Mollweide beyond 40°44′; cut in the oceans. Areas are true.",
    ),
    Entry(
        "interrupted-mollweide",
        "Interrupted Mollweide",
        "interrupted-mollweide",
        "omega",
        "Mollweide's map in lobes, each with its own central meridian. Areas are true.",
    ),
    Entry(
        "oblique-mollweide",
        "Oblique Mollweide",
        f"+proj=ob_tran +o_proj=moll +o_lat_p=45 +o_lon_p=0 {SPHERE}",
        "omega",
        "Mollweide's map of a turned globe. The pole lies inside the map, and the seam crosses oceans and land.",
    ),
    Entry(
        "lambert-azimuthal",
        "Lambert azimuthal equal-area, oblique",
        f"+proj=laea +lat_0=20 +lon_0=20 {SPHERE}",
        "omega",
        "Areas are true, and so are directions from the centre. The edge is one point, the antipode.",
    ),
    Entry(
        "orthographic",
        "Orthographic",
        f"+proj=ortho +lat_0=40 +lon_0=10 {SPHERE}",
        "omega",
        "The Earth from far away: a hemisphere. The figures are those of the half that is shown.",
    ),
    Entry(
        "gnomonic",
        "Gnomonic",
        f"+proj=gnom +lat_0=40 +lon_0=-100 {SPHERE}",
        "fisher",
        "Every great circle is a straight line, at the price of scales that grow without bound.",
        "cap:-100,40,5000",
        "the cap of 5,000 km round 40° N 100° W",
    ),
    Entry(
        "polar-stereographic",
        "Polar stereographic",
        f"+proj=stere +lat_0=90 +lat_ts=70 +lon_0=-45 {SPHERE}",
        "areal_scale",
        "Angles are true, and circles stay circles. The scale is true on the parallel of 70 degrees.",
        "box:-180,50,180,90",
        "the cap north of 50° N",
    ),
    Entry(
        "conic-us",
        "Lambert conformal conic, United States",
        "+proj=lcc +lat_1=33 +lat_2=45 +lat_0=39 +lon_0=-96 +ellps=GRS80",
        "areal_scale",
        "Angles are true. Scales are true on the parallels of 33 and 45 degrees, too small between them.",
        "box:-125,24,-66,50",
        "the box 125° W to 66° W, 24° N to 50° N",
    ),
    Entry(
        "europe-laea",
        "EPSG:3035, Europe",
        "EPSG:3035",
        "omega",
        "The grid for European statistics: Lambert's azimuthal map with true areas.",
        "box:-25,34,45,72",
        "the box 25° W to 45° E, 34° N to 72° N",
    ),
    Entry(
        "france-lambert-93",
        "EPSG:2154, France",
        "EPSG:2154",
        "scale_error_ppm",
        "Lambert-93, the conformal conic grid of France, true on the parallels of 44 and 49 degrees.",
        "box:-5.5,41,10,51.5",
        "the box 5.5° W to 10° E, 41° N to 51.5° N",
    ),
    Entry(
        "utm-32n",
        "EPSG:32632, UTM zone 32N",
        "EPSG:32632",
        "scale_error_ppm",
        "A zone of transverse Mercator, 400 ppm too small on its meridian so as to be true 180 km to either side.",
        "box:6,47,12,55.5",
        "the box 6° E to 12° E, 47° N to 55.5° N",
    ),
    Entry(
        "antarctica",
        "EPSG:3031, Antarctica",
        "EPSG:3031",
        "areal_scale",
        "The polar stereographic grid of Antarctica, true on the parallel of 71 degrees.",
        "box:-180,-90,180,-60",
        "the cap south of 60° S",
    ),
)


def entry_figure(entry: Entry) -> tuple[Figure, str]:
    """Tissot's indicatrices beside a heat map, both of one size; and the name of the colours."""
    region = None if entry.region == "globe" else get_region(entry.region)
    figure = Figure(figsize=(2 * PANEL + 0.2, PANEL + 1.0), dpi=DPI, layout="constrained")
    left, right = figure.subplots(1, 2)
    radius = plots.tissot(entry.projection, left, region=region, title="")
    width, height = PANEL * shape_of(left) / shape_of(left).max()
    figure.set_size_inches(max(2 * width + 0.2, 6.0), height + 1.0)
    scale = plots.heatmap(entry.projection, right, measure=entry.measure, region=region, title="")
    figure.suptitle(entry.title, fontsize=11)
    text = f"Circles on the ground with a radius of {radius / 1e3:,.0f} km"
    below = -0.04 if region is None else -0.12  # of the map's height: under the labels of a graticule
    left.text(0.5, below, text, transform=left.transAxes, ha="center", va="top", fontsize=8, color="#555555")
    return figure, scale.cmap


def shape_of(ax: Axes) -> np.ndarray:
    """Width and height of a map in metres."""
    return np.ptp([ax.get_xlim(), ax.get_ylim()], axis=1)


def describe(entry: Entry, summary: Summary) -> str:
    """The section of a map."""
    raw, scaled, affine = (
        f"{value:.3g}" if value < 0.01 else f"{value:.4f}"
        for value in (summary.airy_kavrayskiy, summary.airy_kavrayskiy_scaled, summary.airy_kavrayskiy_affine)
    )
    covered = "" if summary.coverage > 0.999 else f" ({summary.coverage:.0%} of it is on the map)"
    return f"""
### {entry.title}

{entry.text}

`{entry.projection}` over {entry.place}{covered}: {raw} as it is, {scaled} scaled, {affine} affine.

![{entry.title}: Tissot's indicatrices, and {entry.measure}](images/{entry.slug}.png)
"""


# ---- countries, islands and cities ----------------------------------------------------------

REGION_SIZE, REGION_DPI = (5.2, 5.2), 110  # inches, and dots in one


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


def draw_region(picture: Picture) -> None:
    """Write the picture of a region."""
    options = {"region": picture.region, "size": REGION_SIZE, "dpi": REGION_DPI}
    if picture.measure is None:
        figure = plots.tissot_figure(picture.projection, **options)
    else:
        figure = plots.heatmap_figure(picture.projection, measure=picture.measure, **options)
    plots.save(figure, IMAGES / "regions" / f"{picture.slug}.png")  # of all colours: a palette makes bands


def regions_part() -> str:
    """The pictures of regions, each with the command that draws it."""
    lines = []
    for group, pictures in GROUPS.items():
        lines += [f"### {group}", ""]
        for picture in pictures:
            command = "heatmap" if picture.measure else "tissot"
            measure = f" -m {picture.measure}" if picture.measure else ""
            words = f"{command} {quoted(picture.projection)} -r {quoted(picture.region)}{measure}"
            lines += [f"**{picture.title}**: `projdist {words}`", ""]
            lines += [f"![{picture.title}](images/regions/{picture.slug}.png)", ""]
    return "\n".join(lines)


def quoted(text: str) -> str:
    """A word of a command line."""
    return f'"{text}"' if " " in text else text


# ---- world maps made to measure -------------------------------------------------------------

OTHERS = (
    *("winkel-tripel", "gott-wagner", "wagner-9", "kavrayskiy-7", "winkel-2", "natural-earth", "natural-earth-2"),
    *("robinson", "aitoff", "wagner-7", "hammer", "equal-earth", "mollweide", "plate-carree"),
)
LEVELS = {"world": [0.2, 0.4, 0.6, 0.8, 1.0], "land-pacific": [0.5, 1.0, 2.0], "land-seas": [0.5, 1.0, 2.0]}
PACIFIC, SEAS = [(-180, -70), (-172, 37)], [(-155, 35), (-89, -58)]


def draw_made() -> None:
    """Draw the world maps made to measure, and print the table of docs/made_to_measure_worlds.md."""
    made = {
        "world": ("World", world_map(against=[])),
        "land": ("Land, elsewhere .1", world_map("land", elsewhere=0.1, against=[])),
        "land-180": ("Land, elsewhere .02", world_map("land", against=[])),
        "land-pacific": ("Land, cut through the Pacific", world_map("land", cut=PACIFIC, against=[])),
        "land-seas": ("Land, cut through the southern seas", world_map("land", cut=SEAS, against=[])),
    }
    rows = [(f"**{title}**", found.over_globe, over(found.projection, "land")) for title, found in made.values()]
    rows += [(name, over(name, "globe"), over(name, "land")) for name in OTHERS]
    for name, globe, land in rows:
        print(f"| {name} | {globe:.4f} | {land:.4f} |")
    for key in ("world", "land-pacific", "land-seas"):
        title, found = made[key]
        figure = plots.heatmap_figure(found.projection, titles=[title], size=(11.0, 7.2), levels=LEVELS[key])
        write_png(figure, IMAGES / f"made-{key}.png")


def over(projection: str | Projection, region: str) -> float:
    """The Airy-Kavrayskiy error at the best scale."""
    return summarize(projection, region, tolerance=1e-5).airy_kavrayskiy_scaled


# ---- all of it ------------------------------------------------------------------------------


def main(names: list[str]) -> None:
    (IMAGES / "regions").mkdir(exist_ok=True)
    sections = []
    for entry in ENTRIES:
        start = time.perf_counter()
        sections.append(describe(entry, summarize(entry.projection, entry.region, tolerance=1e-6)))
        if not names or entry.slug in names:
            figure, cmap = entry_figure(entry)
            write_png(figure, IMAGES / f"{entry.slug}.png", cmap)
            print(f"    {time.perf_counter() - start:.1f} s")
    write_part("maps", "".join(sections))
    for picture in (picture for pictures in GROUPS.values() for picture in pictures):
        if not names or picture.slug in names:
            print(picture.slug, flush=True)
            draw_region(picture)
    write_part("regions", regions_part())
    if not names or "made" in names:
        draw_made()


if __name__ == "__main__":
    main(sys.argv[1:])
