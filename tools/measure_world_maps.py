"""Measure all world maps, and write their part of docs/gallery.md with its picture: `make world-maps`.

It takes some minutes on two cores.
"""

from __future__ import annotations

import itertools
import math
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from docs_files import DPI, IMAGES, write_part, write_png
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from projdist import indices, projection_names, summarize
from projdist.projections import needed_parameters

PICTURE = IMAGES / "world_maps.png"

# Maps of parts of the world, of the cube's sides, or of a hemisphere, whatever PROJ makes of the rest.
PARTS = frozenset(
    """adams_hemi airy alsk bipc calcofi col_urban gnom gs48 gs50 gstmerc guyou krovak leac lee_os mil_os mod_krovak
    nicol nzmg ortho qsc rouss s2 som somerc""".split()
)
# Maps that are others turned, on the ellipsoid only, or by PROJ's default parameters.
SAME = frozenset("cass fouc_s ocea polar-stereographic sterea tcc tcea tmerc webmerc".split())

INDICES = {  # symbol: decimals at most
    "I": 5,
    "A": 5,
    "F": 5,
    "S": 5,
    "D": 5,
    "B": 5,
    "score": 4,
    "Dab": 5,
    "Dar": 5,
    "Dan": 3,
    "Q": 2,
    "|ln a/b|": 5,
    "DI": 5,
    "bend": 5,
}
FIRST = ("AK", "AK scaled", "AK affine", "I", "A", "F", "S", "D", "B", "score")
SECOND = ("Dab", "Dar", "Dan", "Q", "|ln a/b|", "DI", "bend")

NOTHING = 0.01  # an error as large as the figure is told only where both are small

Figures = dict[str, tuple[float, float]]


def world_maps() -> list[str]:
    """Names of maps of the whole world, each map once."""
    names: dict[str, str] = {}
    for name, definition in projection_names().items():
        if not needed_parameters(name) and not {name, name_of_proj(definition)} & (PARTS | SAME):
            names.setdefault(definition, name)
    return list(names.values())


def name_of_proj(definition: str) -> str:
    """The PROJ id of a definition that has no parameters of its own, else nothing."""
    parts = definition.split()
    return parts[0].removeprefix("+proj=") if len(parts) <= 2 else ""


def measured(name: str) -> tuple[Figures, float]:
    """The figures of a map with their errors, and the share of the globe that it shows."""
    summary = summarize(name)
    found = indices(name, names=list(INDICES))
    errors = {
        "AK": summary.airy_kavrayskiy,
        "AK scaled": summary.airy_kavrayskiy_scaled,
        "AK affine": summary.airy_kavrayskiy_affine,
    }
    figures = {key: (value, summary.error_estimate) for key, value in errors.items()}
    return figures | {symbol: (found[symbol].value, found[symbol].error) for symbol in INDICES}, summary.coverage


def shown(figure: tuple[float, float], decimals: int) -> str:
    """A figure with its error, of the last digit, in brackets; without brackets it is below half of that digit."""
    value, error = figure
    if not math.isfinite(value) or error >= max(abs(value), NOTHING):
        return "–"
    if not error > 0.5 * 10.0**-decimals:
        return f"{value:.{decimals}f}"
    decimals = min(decimals, max(0, math.ceil(-math.log10(error))))
    return f"{value:.{decimals}f}({math.ceil(error * 10**decimals)})"


def table(maps: dict[str, Figures], columns: tuple[str, ...]) -> str:
    """A table in Markdown."""
    head = "".join(f" {column.replace('|', chr(92) + '|')} |" for column in columns)
    rows = (
        f"| {name} |" + "".join(f" {shown(figures[column], INDICES.get(column, 5))} |" for column in columns)
        for name, figures in maps.items()
    )
    return "\n".join([f"| map |{head}", "| --- |" + " ---: |" * len(columns), *rows]) + "\n"


# ---- the picture ----------------------------------------------------------------------------

SIZE = (11.0, 10.0)  # inches
LEFT, BELOW, WIDTH, HEIGHT = 0.15, 0.225, 0.82, 0.735  # of the axes, in shares of the figure
WIDEST, HIGHEST = 1.06, 0.92  # I and A; the few maps beyond are named in a corner
CROWD = (0.47, 0.64), (0.195, 0.36)  # I and A where most maps are: once more, larger
LARGER = (0.36, 0.61, 0.34, 0.36)  # of the axes
VAGUE = 0.01  # errors of I and A of maps that are not drawn
PERFECT = 0.01  # I of conformal, A of equal-area maps
FONT = 7.0
KINDS = (  # largest B, colour, what it is
    (0.2, "#2a9d8f", "not cut, or along less than a meridian"),
    (0.26, "#33658a", "cut along one meridian"),
    (math.inf, "#e08e2b", "interrupted"),
)
CHARACTER, BOLD = 0.58, 0.65  # widths of a character, of the size of the font
ROUND = tuple((radius, angle) for radius in np.geomspace(6.0, 130.0, 16) for angle in range(0, 360, 15))
"""Points from a mark to its label, and degrees."""


def draw(maps: dict[str, Figures]) -> Figure:
    """Areas against shapes: a mark a map, with its name, and a line through those that no other of their kind beats."""
    figure = Figure(figsize=SIZE, dpi=DPI)
    FigureCanvasAgg(figure)
    ax = figure.add_axes((LEFT, BELOW, WIDTH, HEIGHT))
    ax.set(xlim=(-0.02, WIDEST), ylim=(-0.02, HIGHEST))
    places = {name: (figures["I"][0], figures["A"][0]) for name, figures in maps.items()}
    vague = [name for name, figures in maps.items() if max(figures["I"][1], figures["A"][1]) > VAGUE]
    for name in vague:
        del places[name]
    beyond = [name for name, (i, a) in places.items() if i > WIDEST or a > HIGHEST]
    inside = {name: place for name, place in places.items() if name not in beyond}
    kinds = {name: next(k for k, kind in enumerate(KINDS) if maps[name]["B"][0] < kind[0]) for name in inside}
    best = frontier({name: place for name, place in inside.items() if kinds[name] == 1})
    colours = {name: KINDS[kinds[name]][1] for name in inside}
    larger = ax.inset_axes(LARGER, xlim=CROWD[0], ylim=CROWD[1])
    for one in (ax, larger):
        one.plot(*zip(*(inside[name] for name in best), strict=True), color="#cc3333", lw=0.9, alpha=0.7, zorder=1)
        for k, (_, colour, text) in enumerate(KINDS):
            points = np.array([inside[name] for name in inside if kinds[name] == k])
            one.plot(*points.T, "o", color=colour, ms=3.6, mec="white", mew=0.4, label=text, zorder=3)
        one.tick_params(labelsize=8, direction="in")
        one.grid(color="#eeeeee", zorder=0)
        one.set_axisbelow(True)
    larger.tick_params(labelsize=FONT)
    larger.set_title("the rectangle, larger", fontsize=FONT, pad=3)
    (west, east), (south, north) = CROWD
    ax.indicate_inset((west, south, east - west, north - south), edgecolor="#888888", lw=0.6, alpha=0.8)
    ax.plot([], [], color="#cc3333", lw=0.9, label="no map with one cut is better in both")
    along_side(ax, {name: i for name, (i, a) in inside.items() if a < PERFECT and i >= PERFECT}, colours, best, "x")
    along_side(ax, {name: a for name, (i, a) in inside.items() if i < PERFECT}, colours, best, "y")
    crowd = {name for name, (i, a) in inside.items() if west < i < east and south < a < north}
    free = {name: place for name, place in inside.items() if min(place) >= PERFECT and name not in crowd}
    beside(ax, free, inside, colours, best)
    beside(larger, {name: inside[name] for name in crowd}, inside, colours, best)
    ax.set_xlabel("I: root mean square of ln(a/b), the distortion of shapes; 0 is conformal", fontsize=9)
    ax.set_ylabel("A: standard deviation of ln(ab), the distortion of areas; 0 is equal-area", fontsize=9)
    ax.xaxis.set_label_coords(0.5, -0.275)
    ax.yaxis.set_label_coords(-0.155, 0.5)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    ax.legend(loc="upper right", fontsize=8, frameon=False)
    far = [f"{name} {places[name][0]:.2f}, {places[name][1]:.2f}" for name in beyond]
    text = "\n".join(["beyond the frame:", *far, "", "with errors too large to be drawn:", *vague])
    ax.text(0.985, 0.86, text, transform=ax.transAxes, fontsize=FONT, ha="right", va="top")
    ax.set_title(f"{len(places)} maps of the world", fontsize=12, loc="left")
    return figure


def frontier(places: dict[str, tuple[float, float]]) -> list[str]:
    """Names of places than which no other is better in both coordinates, from left to right."""
    best: list[str] = []
    for name in sorted(places, key=places.__getitem__):
        if not best or places[name][1] < places[best[-1]][1] - 1e-4:
            best.append(name)
    return best


def spread(values: list[float], gap: float) -> list[float]:
    """Ascending places, near given ones, that are a gap apart: what is too near is moved apart from its middle."""
    groups = [([value], value) for value in sorted(values)]
    k = 0
    while k + 1 < len(groups):
        (one, middle), (other, next_middle) = groups[k], groups[k + 1]
        if next_middle - middle >= gap * (len(one) + len(other)) / 2:
            k += 1
            continue
        together = one + other
        groups[k : k + 2] = [(together, sum(together) / len(together))]
        k = max(0, k - 1)
    return [middle + gap * (place - (len(group) - 1) / 2) for group, middle in groups for place in range(len(group))]


def along_side(ax: Axes, values: dict[str, float], colours: dict[str, str], best: list[str], side: str) -> None:
    """Names outside of an axis, of maps that lie on it, with lines that lead to them."""
    names = sorted(values, key=values.__getitem__)
    points = SIZE[0] * WIDTH * 72 / (WIDEST + 0.02) if side == "x" else SIZE[1] * HEIGHT * 72 / (HIGHEST + 0.02)
    for name, place in zip(names, spread(list(values.values()), (FONT + 1.6) / points), strict=True):
        at = (values[name], 0.0) if side == "x" else (0.0, values[name])
        ax.annotate(
            short(name),
            at,
            (place, -0.075) if side == "x" else (-0.055, place),
            fontsize=FONT,
            color=colours[name],
            weight="bold" if name in best else "normal",
            rotation=90 if side == "x" else 0,
            ha="center" if side == "x" else "right",
            va="top" if side == "x" else "center",
            arrowprops={"arrowstyle": "-", "color": "#bbbbbb", "lw": 0.5, "shrinkA": 0, "shrinkB": 2},
            annotation_clip=False,
        )


def beside(
    ax: Axes,
    places: dict[str, tuple[float, float]],
    marks: dict[str, tuple[float, float]],
    colours: dict[str, str],
    best: list[str],
) -> None:
    """Names beside their marks, each where there is still room, those in the densest places first."""
    to_points = 72 / DPI
    xy = {name: ax.transData.transform(place) * to_points for name, place in marks.items()}
    taken = [(x - 2.5, y - 2.5, x + 2.5, y + 2.5) for x, y in xy.values()]
    limits = ax.get_window_extent().extents * to_points
    # The larger part covers a piece of the whole, where no names should be.
    taken += [tuple(child.get_tightbbox().extents * to_points) for child in ax.child_axes]
    blocked = len(taken)
    crowd = {name: sum(np.hypot(*(xy[name] - other)) < 40 for other in xy.values()) for name in places}
    lines = list(itertools.pairwise(xy[name] for name in best))
    for name in sorted(places, key=lambda name: (name not in best, -crowd[name])):
        width, height = FONT * (BOLD if name in best else CHARACTER) * len(short(name)), FONT * 1.1
        options = []
        for radius, angle in ROUND:
            cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
            x, y = xy[name] + [radius * cos - width * (0.5 - 0.5 * cos), radius * sin]
            box = (x, y - height / 2, x + width, y + height / 2)
            end = np.clip(xy[name], box[:2], box[2:])
            line = (xy[name], end)
            cost = radius + 10.0 * sum(overlap(box, other) for other in taken)
            cost += 60.0 * sum(crossing(line, other) or hits(other, box) for other in lines)
            cost += 60.0 * sum(hits(line, other) for other in taken[blocked:])
            cost += 1e4 * (box[0] < limits[0] or box[1] < limits[1] or box[2] > limits[2] or box[3] > limits[3])
            options.append((cost, box, line))
        _, box, line = min(options, key=lambda option: option[0])
        taken.append(box)
        lines.append(line)
        ax.annotate(
            short(name),
            places[name],
            ((box[0] - xy[name][0]), (box[1] + box[3]) / 2 - xy[name][1]),
            textcoords="offset points",
            fontsize=FONT,
            color=colours[name],
            weight="bold" if name in best else "normal",
            va="center",
        )
        if np.hypot(*(line[1] - line[0])) > 8.0:
            ends = ax.transData.inverted().transform(np.array(line) / to_points)
            ax.plot(*ends.T, color="#bbbbbb", lw=0.5, zorder=2)


def overlap(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """The area that two boxes share."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    return max(width, 0.0) * max(height, 0.0)


def hits(line: tuple[np.ndarray, np.ndarray], box: tuple[float, ...]) -> bool:
    """Whether a line runs through a box."""
    points = line[0] + np.linspace(0.0, 1.0, 40)[:, None] * (line[1] - line[0])
    return bool(((points > box[:2]) & (points < box[2:])).all(axis=1).any())


def short(name: str) -> str:
    """A name with fewer letters."""
    return name.replace("mcbryde-thomas", "mbt")


def crossing(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> bool:
    """Whether two lines between points cross."""
    (p, q), (r, s) = one, other

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    return side(p, q, r) * side(p, q, s) < 0 and side(r, s, p) * side(r, s, q) < 0


# ---- the page -------------------------------------------------------------------------------

HEAD = """
{count} maps on the sphere: the maps of the whole world that PROJ has without parameters or with textbook ones, and
those of `projdist.worldmaps`. Other maps turned (transverse Mercator, Cassini), maps of a hemisphere or of a part of
the world, and maps that need parameters are left out. `projdist list indices` has the source and the normalisation
of each figure, `projdist list projections` what each name stands for.

![Areas against shapes of {count} world maps](images/world_maps.png)

The error of a figure is in brackets, in units of the last digit; without brackets it is below half a unit. D, DI and
bend have standard errors, from four million pairs of points (bend: 65,000), which the error of the score includes. All
other errors are estimates by the cubature, on the safe side. A dash means that the figure diverges, or that its error
is as large as itself. Figures are at the nominal scale, except "AK scaled" and "AK affine".

### Scales, areas, angles, bending, distances, cuts

AK is the Airy-Kavrayskiy error, the root mean square of sqrt(ln² a + ln² b): as it is, after the best scale (by which
the rows are sorted), and after the best linear map. I, A, F, S, D and B are the indices of Goldberg and Gott; the
score is the sum of their squares, each divided by that of the plate carrée. Smaller is better.

"""

SECOND_HEAD = """
### Other indices

Dab, Dar and Dan are Canters and Decleir's mean errors of scales and areas and mean angular distortion in degrees. Q
is Capek's share of the area, in per cent, with little distortion (more is better). |ln a/b| is Kunimune's mean, DI
Peters' index of distances, and bend says how far great circles are from straight lines, relative to their length. The
order is the same.

"""


def main() -> None:
    names = world_maps()
    with ProcessPoolExecutor(2) as pool:
        found = dict(zip(names, pool.map(measured, names), strict=True))
    whole = {name: figures for name, (figures, coverage) in found.items() if coverage > 0.999}
    maps = dict(sorted(whole.items(), key=lambda item: item[1]["AK scaled"][0]))
    PICTURE.parent.mkdir(exist_ok=True)
    write_png(draw(maps), PICTURE, "turbo")
    page = HEAD.format(count=len(maps)) + table(maps, FIRST) + SECOND_HEAD + table(maps, SECOND)
    write_part("all world maps", page)
    print(f"{len(maps)} maps")


if __name__ == "__main__":
    main()
