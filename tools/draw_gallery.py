"""Draw the pictures of the gallery, and write gallery.md: `python tools/draw_gallery.py [NAME...]`.

Names of entries draw only their pictures; gallery.md is always written whole.
"""

from __future__ import annotations

import sys
import time
from typing import NamedTuple

import numpy as np
from docs_files import DOCS, DPI, IMAGES, write_png
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from projdist import Summary, get_region, plots, summarize

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
        "A compromise drawn by eye and given as a table: neither areas nor angles are kept, none is hurt badly.",
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
        "Areas are true, the outline is like that of Robinson's map.",
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
        "Areas are true, parallels curved and the poles curved lines.",
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
        "Angles are true. The poles lie at infinity: the picture stops before them, the figures do not.",
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
        "Mollweide's map in lobes, each with a meridian of its own. Areas are true.",
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
        "A zone of transverse Mercator, 400 ppm too small on its meridian so as to be right 180 km beside it.",
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


def draw(entry: Entry) -> tuple[Figure, str]:
    """Tissot's indicatrices beside a heat map, both of one size; and the name of the colours."""
    region = None if entry.region == "globe" else get_region(entry.region)
    figure = Figure(figsize=(2 * PANEL + 0.2, PANEL + 1.0), dpi=DPI, layout="constrained")
    left, right = figure.subplots(1, 2)
    radius = plots.tissot(left, entry.projection, region=region, title="")
    width, height = PANEL * shape_of(left) / shape_of(left).max()
    figure.set_size_inches(max(2 * width + 0.2, 6.0), height + 1.0)
    scale = plots.heatmap(right, entry.projection, measure=entry.measure, region=region, title="")
    figure.suptitle(entry.title, fontsize=11)
    text = f"Circles on the ground with a radius of {radius / 1e3:,.0f} km"
    below = -0.04 if region is None else -0.12  # of the map's height: under the labels of a graticule
    left.text(0.5, below, text, transform=left.transAxes, ha="center", va="top", fontsize=8, color="#555555")
    return figure, scale.cmap


def shape_of(ax: Axes) -> np.ndarray:
    """Width and height of a map in metres."""
    return np.ptp([ax.get_xlim(), ax.get_ylim()], axis=1)


HEAD = """# Gallery

Made by `make gallery`. Left: Tissot's indicatrices, the images of equal small circles on the ground. Right: a measure
that suits the map. Below each name, the Airy–Kavrayskiy error, the root mean square of the Fisher distortion
sqrt(ln² a + ln² b) by area: of the map as it is, after the best uniform scale, and after the best linear map.
"""


def describe(entry: Entry, summary: Summary) -> str:
    """The section of a map in gallery.md."""
    raw, scaled, affine = (
        f"{value:.3g}" if value < 0.01 else f"{value:.4f}"
        for value in (summary.airy_kavrayskiy, summary.airy_kavrayskiy_scaled, summary.airy_kavrayskiy_affine)
    )
    covered = "" if summary.coverage > 0.999 else f" ({summary.coverage:.0%} of it is on the map)"
    return f"""
## {entry.title}

{entry.text}

`{entry.projection}` over {entry.place}{covered}: {raw} as it is, {scaled} scaled, {affine} affine.

![{entry.title}: Tissot's indicatrices, and {entry.measure}](images/{entry.slug}.png)
"""


def main(names: list[str]) -> None:
    IMAGES.mkdir(exist_ok=True)
    sections = []
    for entry in ENTRIES:
        start = time.perf_counter()
        sections.append(describe(entry, summarize(entry.projection, entry.region, tolerance=1e-6)))
        if not names or entry.slug in names:
            figure, cmap = draw(entry)
            write_png(figure, IMAGES / f"{entry.slug}.png", cmap)
            print(f"    {time.perf_counter() - start:.1f} s")
    (DOCS / "gallery.md").write_text(HEAD + "".join(sections), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
