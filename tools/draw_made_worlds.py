"""Make the maps of made_to_measure_worlds.md, its table and its pictures: `python tools/draw_made_worlds.py`.

It takes about two minutes.
"""

from __future__ import annotations

from docs_files import IMAGES, write_png

from projdist import Projection, plots, summarize, world_map

OTHERS = (
    *("winkel-tripel", "gott-wagner", "wagner-9", "kavrayskiy-7", "winkel-2", "natural-earth", "natural-earth-2"),
    *("robinson", "aitoff", "wagner-7", "hammer", "equal-earth", "mollweide", "plate-carree"),
)
LEVELS = {"world": [0.2, 0.4, 0.6, 0.8, 1.0], "land-pacific": [0.5, 1.0, 2.0], "land-seas": [0.5, 1.0, 2.0]}
PACIFIC, SEAS = [(-180, -70), (-172, 37)], [(-155, 35), (-89, -58)]


def main() -> None:
    """Write the pictures, print the table."""
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


if __name__ == "__main__":
    main()
