"""Draw the pictures of the README and of the guides: `python tools/draw_guides.py [NAME...]`.

Names are readme, correction, regions, recommendation, ldp, profile, comparisons and mean; all of them if none.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

from docs_files import DPI, IMAGES, write_png
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from projdist import compare, correct, ldp, mean_map, plots, profile, recommend

README_MAPS = ({"robinson": 1.96, "mollweide": 1.99}, {"winkel-tripel": 1.63, "mercator": 1.0})  # width over height
OMEGA = (0.0, 90.0)  # degrees
SPHERE = "+R=6371008.7714"


def draw_readme() -> None:
    """The README's pictures of world maps."""
    figure = readme_figure(lambda ax, name: plots.tissot(name, ax, radius=5e5))
    text = "Ellipses: circles on the ground with a radius of 500 km. Each map has its own scale."
    figure.text(0.5, 0.4 / figure.get_figheight(), text, ha="center", va="center", fontsize=9, color="#555555")
    write_png(figure, IMAGES / "readme.png", colours=96)

    figure = readme_figure(lambda ax, name: plots.heatmap(name, ax, measure="omega", limits=OMEGA, colourbar=False))
    place = figure.add_axes((0.2, 0.47 / figure.get_figheight(), 0.6, 0.13 / figure.get_figheight()))
    colours = ScalarMappable(Normalize(*OMEGA), "viridis_r")
    figure.colorbar(colours, cax=place, orientation="horizontal", extend="max")
    place.set_xlabel("Angular distortion omega (degrees)", fontsize=9)
    write_png(figure, IMAGES / "readme-heatmap.png")


def draw_correction() -> None:
    """The README's picture of a corrected map."""
    result = correct("hammer")
    figure = plots.heatmap_figure(
        [result.projection, result.corrected],
        airy_kavrayskiy=[result.airy_kavrayskiy, result.airy_kavrayskiy_corrected],
        size=(8.0, 3.6),
        dpi=DPI,
    )
    write_png(figure, IMAGES / "readme-corrected.png")


def draw_regions() -> None:
    """The README's picture of a region."""
    africa = compare(["aitoff", "winkel-tripel", "gall-peters"], "continent:Africa")
    figure = plots.heatmap_figure(
        [summary.projection for summary in africa.results],
        region=africa.region,
        airy_kavrayskiy=[summary.airy_kavrayskiy for summary in africa.results],
        size=(8.0, 4.2),
        dpi=DPI,
    )
    write_png(figure, IMAGES / "readme-africa.png")


def draw_recommendation() -> None:
    """The README's picture of existing CRSs beside the best custom projection."""
    found = recommend("box:5.9,47.3,15.0,55.1", limit=3, custom=True)
    maps = {one.code: one for one in found.results} | {found.custom[0].proj: found.custom[0]}
    figure = plots.heatmap_figure(
        list(maps),
        region=found.region,
        titles=[*(one.code for one in found.results), f"custom {found.custom[0].family}"],
        airy_kavrayskiy=[one.value for one in maps.values()],
        size=(9.0, 3.9),
        dpi=DPI,
    )
    write_png(figure, IMAGES / "readme-recommend.png")


def draw_ldp() -> None:
    """The README's picture of a low-distortion projection."""
    found = ldp("box:-104.2,38.9,-103.2,39.6", height=1610.0, geodetic="EPSG:6318")
    write_png(plots.ldp_figure(found, size=(5.0, 5.2), dpi=DPI), IMAGES / "readme-ldp.png")


def draw_profile() -> None:
    """The picture of a profile along a line with heights."""
    line = [(9.0, 48.0, 300.0), (9.5, 48.3, 650.0), (10.4, 48.2, 500.0), (11.2, 48.9, 400.0), (12.6, 49.5, 800.0)]
    write_png(plots.profile_figure(profile("EPSG:25832", line), dpi=DPI), IMAGES / "profile.png")


def draw_comparisons() -> None:
    """The pictures of maps beside each other: a difference, distributions, areas against angles, an animation."""
    less = plots.heatmap_figure(["robinson"], measure="omega", against="winkel-tripel", size=(7.0, 4.6), dpi=DPI)
    write_png(less, IMAGES / "difference.png")
    few = ["robinson", "mollweide", "winkel-tripel", "mercator", "equal-earth"]
    write_png(plots.distribution_figure(few, "cumulative", measure="omega", dpi=DPI), IMAGES / "distribution.png")
    many = [
        *few,
        "plate-carree",
        "igh",
        "hammer",
        "aitoff",
        "kav7",
        "vandg",
        "gall",
        "eck3",
        "patterson",
        "times",
        "aeqd",
    ]
    write_png(plots.distribution_figure(many, "pareto", dpi=DPI), IMAGES / "trade.png")
    plots.morph("igh", "winkel-tripel", IMAGES / "morph.gif", frames=16, size=(4.8, 3.2), dpi=90)


def draw_mean() -> None:
    """The picture of a mean of two maps beside their average."""
    found = mean_map(["aitoff", f"+proj=eqc +lat_ts=50.46 {SPHERE}"])
    figure = plots.heatmap_figure(
        [found.projection, found.average],
        region=found.region,
        titles=["Mean of Aitoff's map and plate carrée", "Winkel tripel, their average"],
        airy_kavrayskiy=[found.standing(kind).airy_kavrayskiy for kind in ("mean", "average")],
        size=(8.0, 3.8),
        dpi=DPI,
    )
    write_png(figure, IMAGES / "mean-map.png")


def readme_figure(painter: Callable[[Axes, str], object]) -> Figure:
    """The maps of the README in rows that are all as wide as the figure, with room at the foot."""
    gap, title, foot, width = 0.15, 0.4, 0.75, 8.0
    heights = [(width - gap * (len(row) + 1)) / sum(row.values()) for row in README_MAPS]
    total = foot + sum(heights) + title * len(heights)
    figure = Figure(figsize=(width, total), dpi=DPI)
    top = total
    for row, height in zip(README_MAPS, heights, strict=True):
        left, top = gap, top - title - height
        for name, shape in row.items():
            painter(figure.add_axes((left / width, top / total, shape * height / width, height / total)), name)
            left += shape * height + gap
    return figure


PICTURES: dict[str, Callable[[], None]] = {
    "readme": draw_readme,
    "correction": draw_correction,
    "regions": draw_regions,
    "recommendation": draw_recommendation,
    "ldp": draw_ldp,
    "profile": draw_profile,
    "comparisons": draw_comparisons,
    "mean": draw_mean,
}


if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()
