"""Style: themes, letters, titles and bars; no text of a picture is cut or lies on another."""

import itertools
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import refused, run, run_ok
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from mosaic_sets import affine_maps, common_points
from refusals import refuses
from tables import each

from projdist import plots, profile
from projdist.applications.mosaics import mosaic
from projdist.applications.oldmaps import ControlPoints, old_map
from projdist.plots.style import THEMES

pytestmark = pytest.mark.usefixtures("few_cells")  # texts and colours do not hang on them

EUROPE = "box:-10,35,40,70"
FOUR = ["robin", "moll", "wintri", "eqearth"]
AK = [0.4193, 0.5455, 0.3859, 0.5148]
COLUMN = (3.5, 2.2)

FIGURES: dict[str, dict[str, Any]] = {
    "column": {"projections": "robin", "size": COLUMN, "airy_kavrayskiy": AK[:1]},
    "column of four": {"projections": FOUR, "size": COLUMN, "airy_kavrayskiy": AK},
    "column, levels": {"projections": "robin", "size": COLUMN, "measure": "omega", "levels": [5, 8, 10, 12, 15]},
    "column, region": {"projections": "EPSG:3035", "size": (3.5, 3.0), "region": EUROPE, "measure": "ppm"},
    "page": {"projections": "robin", "size": (7, 4), "airy_kavrayskiy": AK[:1]},
    "page of four": {"projections": FOUR, "size": (7, 4), "airy_kavrayskiy": AK},
    "tissot column": {"projections": FOUR, "kind": "tissot", "size": COLUMN, "airy_kavrayskiy": AK},
    "heading": {"projections": FOUR, "look": plots.Look(title="Four maps", credits="Sources"), "airy_kavrayskiy": AK},
    "heading, column": {
        "projections": FOUR[:2],
        "size": (3.5, 2.0),
        "look": plots.Look(title="Two maps", credits="We"),
    },
    "no titles": {"projections": FOUR[:2], "look": plots.Look(title=""), "airy_kavrayskiy": AK[:2]},
    "no bar": {"projections": "igh", "measure": "h", "look": plots.Look(colourbar=False, theme="dark")},
    "large letters": {"projections": FOUR[:2], "look": plots.Look(font_size=14, theme="print")},
    "small letters": {"projections": "EPSG:25832", "look": plots.Look(font_size=5), "region": EUROPE},
    "long title": {"projections": "robin", "size": COLUMN, "look": plots.Look(title="As long as it can be " * 4)},
}
THREE = ["EPSG:5361", "EPSG:5362", "EPSG:5343"]
LONG = {"projections": [*THREE, "EPSG:27707"], "titles": [*THREE, "EPSG:27707 with a longer name"]}
NARROW = [{"projections": THREE, "titles": THREE}, LONG | {"size": (4.0, 3.0)}, LONG | {"size": (3.0, 6.0)}]
for place, given in itertools.product(("country:CL", "box:7,45,8,60"), NARROW):
    errors = [0.003922] * len(given["titles"])
    FIGURES[f"narrow {place} {given.get('size')}"] = given | {"region": place, "airy_kavrayskiy": errors}


def texts_of(figure: Figure) -> list[Text]:
    """What is written beside and above the maps."""
    figure.canvas.draw()
    bars = [ax for ax in figure.axes if ax.axison]
    found = [*figure.texts, *(ax.title for ax in figure.axes), *(ax.xaxis.label for ax in bars)]
    found += [text for ax in figure.axes for text in ax.texts if text.get_label() == "below the title"]
    found += [label for ax in bars for label in ax.get_xticklabels()]
    return [text for text in found if text.get_text().strip() and text.get_visible()]


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_texts_have_room(name: str) -> None:
    """All texts are inside of the figure, and none touches another or a map."""
    figure = plots.figure(**FIGURES[name])
    texts, titles = texts_of(figure), FIGURES[name].get("titles", [])
    if titles:  # each with its figure below it, in letters as large as ever where the size is free
        lines = [text for text in texts if text.get_text() in titles or "Airy" in text.get_text()]
        assert len(lines) == 2 * len(titles)
        assert "size" in FIGURES[name] or {line.get_fontsize() for line in lines} == {10.5, 8.0}
    width, height = figure.canvas.get_width_height()
    boxes = [text.get_window_extent() for text in texts]
    assert boxes or FIGURES[name]["look"].title == ""
    for box in boxes:
        assert 0.0 <= box.x0 < box.x1 <= width, name
        assert 0.0 <= box.y0 < box.y1 <= height, name
    maps = [ax.get_window_extent() for ax in figure.axes]
    for one, other in [*itertools.combinations(boxes, 2), *itertools.product(boxes, maps)]:
        across, along = min(one.x1, other.x1) - max(one.x0, other.x0), min(one.y1, other.y1) - max(one.y0, other.y0)
        # The box of a line of text has the room for letters that go below it, though none does.
        assert across < 1.0 or along < 0.25 * min(one.height, other.height), name


@pytest.mark.slow
@pytest.mark.parametrize(("size", "count"), [(COLUMN, 1), ((7.0, 4.0), 1), ((7.0, 5.0), 4)])
def test_maps_fill_a_column(size: tuple[float, float], count: int) -> None:
    """In a figure of a journal's size maps take what titles and bar leave of its width."""
    figure = plots.figure(FOUR[:count], size=size, airy_kavrayskiy=AK[:count])
    assert tuple(figure.get_size_inches()) == size
    assert sum(sorted(ax.get_position().width for ax in figure.axes[:count])[-min(count, 2) :]) > 0.85
    assert min(text.get_fontsize() for text in texts_of(figure)) >= 5.5  # points, which journals print


def luminance(colour: Any) -> float:
    """Of sRGB, by ITU-R BT.601, as a copier sees it."""
    return float(np.dot(to_rgb(colour), (0.299, 0.587, 0.114)))


@each("theme", THEMES.values())
def test_letters_are_seen_on_their_ground(theme: plots.Theme) -> None:
    least = {("text", "background"): 0.7, ("quiet", "background"): 0.5, ("land", "sea"): 0.07, ("outline", "sea"): 0.5}
    for (one, other), apart in least.items():
        assert abs(luminance(getattr(theme, one)) - luminance(getattr(theme, other))) > apart, (one, other)


def test_print_is_grey() -> None:
    theme = THEMES["print"]
    for name in ("background", "text", "quiet", "sea", "land", "coast", "graticule", "outline", "face", "edge", "ink"):
        assert len(set(to_rgb(getattr(theme, name)))) == 1, name
    for colours in (theme.rising, theme.diverging):
        shades = [luminance(colours(x / 20)) for x in range(21)]
        assert shades == sorted(shades, reverse=True)


ONE_MAP, TWO_TITLES, CALLS = ["eqc"], ["a", "b"], (plots.distribution_figure, plots.space_figure, plots.heatmap_figure)


@each(("call", "words", "said"), [
    (plots.Look, {"theme": "pink"}, r"^Invalid theme 'pink'\. It must be light, dark or print\."),
    (plots.Look, {"font_size": 0}, r"^Invalid font size '0'\. It must be 1 to 72 points\."),
    (plots.Look, {"style": "no"}, r"^Invalid style 'no'\. It must be a file of a matplotlib style, or one of .*ggplot"),
    (plots.distribution_figure, {"projections": "robin", "kind": "pie"}, r"^Invalid kind of distribution 'pie'\."),
    *((call, {"projections": []}, r"^Invalid list of .*\. It must name (1 to \d+|at least one)\.$") for call in CALLS),
    *((call, {"projections": ONE_MAP, "titles": TWO_TITLES}, "There must be one for each of 1 maps") for call in CALLS),
    (plots.heatmap_figure, {"projections": "moll", "context": "much"},
     r"Invalid context 'much'. It must be one of none, coast, borders, full"),
    (plots.tissot_figure, {"projections": ONE_MAP, "size": (0, 3)}, r"Invalid size '\(0, 3\)'"),
    (plots.tissot_figure, {"projections": ONE_MAP, "exaggeration": 0.0},
     r"Invalid exaggeration '0.0'. It must be a factor of 0.1 to 1e6, or auto."),
    (plots.tissot_figure, {"projections": ONE_MAP, "step": -1}, r"Invalid step '-1'"),
    (plots.heatmap_figure, {"projections": ONE_MAP, "step": -1}, r"Invalid step '-1'"),
    (plots.heatmap_figure, {"projections": ONE_MAP, "levels": 0}, r"Invalid levels '0'"),
    (plots.heatmap_figure, {"projections": ONE_MAP, "region": "here"}, r"Invalid region 'here'"),
])  # fmt: skip
def test_what_is_refused(call: Callable[..., Any], words: dict[str, Any], said: str) -> None:
    refuses(said, call, **words)


@pytest.mark.slow
def test_themes_and_styles(tmp_path: Path) -> None:
    """A theme has its colours; a style its fonts, background and size; own colours are taken, too."""
    style = tmp_path / "own.mplstyle"
    style.write_text("font.family: serif\nfont.size: 12\nfigure.facecolor: eeeeff\n")
    own = plots.Look(theme=replace(THEMES["light"], background="#ffeeee"))
    for look, ground in (("dark", THEMES["dark"].background), (own, "#ffeeee"), (plots.Look(style=style), "#eeeeff")):
        styled = plots.figure("robin", "tissot", region=EUROPE, look=look)
        assert to_rgb(styled.get_facecolor()) == to_rgb(ground)
    assert styled.axes[0].title.get_fontfamily() == ["serif"]
    assert styled.axes[0].title.get_fontsize() == pytest.approx(10.5 * 12 / 9)


@pytest.mark.slow
def test_options_of_the_command(tmp_path: Path) -> None:
    """The options make a file, the same twice; of a layer they are of no use, which is said."""
    words = "--theme print --title Europe --credits Us --font-size 8 --no-colourbar --transparent --size 3,3 -o".split()
    for file in "ab":
        run_ok("heatmap", "robin", "-r", EUROPE, *words, str(tmp_path / f"{file}.png"))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert "--theme" in run("tissot", "robin", "--theme", "dark", "-o", str(tmp_path / "c.gpkg")).stderr


def other_figures(look: plots.Look) -> dict[str, Figure]:
    """Figures that are no maps of the Earth."""
    rows = np.random.default_rng(1).uniform(0.0, 100.0, (30, 2))
    sheet = old_map(ControlPoints(rows, rows @ [[9.0, 1.0], [-1.0, 9.0]] + 0.02 * rows**2), model="polynomial2")
    images = mosaic(common_points(affine_maps(np.random.default_rng(1))))
    return {
        "profile": plots.profile_figure(profile("EPSG:32632", "7,47,9,49,12,50"), look=look),
        "histogram": plots.distribution_figure(FOUR[:2], region=EUROPE, look=look),
        "pareto": plots.distribution_figure(FOUR, "pareto", region=EUROPE, look=look),
        "old map": plots.old_map_figure(sheet, draw=["grid", "scale"], look=look),
        "mosaic": plots.mosaic_figure(images, look=look),
    }


@pytest.mark.slow
@pytest.mark.parametrize("theme", THEMES)
def test_themes_of_other_figures(theme: str) -> None:
    """Graphs, old maps and mosaics have a theme's ground and letters, a heading and credits, all inside; or none."""
    colours = THEMES[theme]
    if theme == "light":
        for name, figure in other_figures(plots.Look(title="")).items():
            assert not any(ax.get_title() for ax in figure.axes if not ax.get_title().startswith("Arcs")), name
    look = plots.Look(theme=theme, title="A heading", font_size=10, credits="Sources")
    for name, figure in other_figures(look).items():
        figure.canvas.draw()
        width, height = figure.canvas.get_width_height()
        assert to_rgb(figure.get_facecolor()) == to_rgb(colours.background), name
        shown = [text.get_text() for text in figure.findobj(Text) if text.get_visible()]
        assert shown.count("A heading") == shown.count("Sources") == 1, name
        words = [text for ax in figure.axes for text in (ax.title, ax.xaxis.label, ax.yaxis.label)]
        for text in (text for text in (*figure.texts, *words) if text.get_text()):
            assert abs(luminance(text.get_color()) - luminance(colours.background)) > 0.3, (name, text)
            box = text.get_window_extent()
            assert -1.0 <= box.x0 <= box.x1 <= width + 1.0, (name, text)
            assert -1.0 <= box.y0 <= box.y1 <= height + 1.0, (name, text)


LONG_CREDITS = (
    "Sources: Natural Earth (public domain), GeoNames (CC BY 4.0), PROJ and its grids, map by A. N. Other " * 3
)
GRAPHS = {
    "histogram": lambda **words: plots.distribution_figure("robin", region=EUROPE, **words),
    "pareto": lambda **words: plots.distribution_figure(FOUR[:2], "pareto", region=EUROPE, **words),
    "profile": lambda **words: plots.profile_figure(
        profile("merc", "0,0,9,9", measures=["omega", "areal_scale"]), **words
    ),
}


@each("name", GRAPHS)
@each(("size", "points"), [(None, None), (None, 14.0), ((6.0, 5.0), 9.0), ((3.0, 3.0), None)])
def test_words_of_graphs_are_inside(name: str, size: tuple[float, float] | None, points: float | None) -> None:
    """Credits of any length stand in lines, and so do labels that are longer than an axis; nothing is left out."""
    figure = GRAPHS[name](size=size, look=plots.Look(font_size=points, credits=LONG_CREDITS), dpi=100)
    figure.canvas.draw()
    (credits,) = (text.get_text() for text in figure.texts if "Sources" in text.get_text())
    assert credits.split() == LONG_CREDITS.split()
    words = [*figure.texts, *(text for ax in figure.axes for text in (ax.title, ax.xaxis.label, ax.yaxis.label))]
    for box in (text.get_window_extent() for text in words if text.get_text()):
        assert -1.0 <= box.x0 <= box.x1 <= figure.bbox.width + 1.0
        assert -1.0 <= box.y0 <= box.y1 <= figure.bbox.height + 2.0  # with the room above letters
    lowest = min(ax.get_tightbbox().y0 for ax in figure.axes)
    assert credits.count("\n") > 0
    assert lowest > max(text.get_window_extent().y1 for text in figure.texts if "Sources" in text.get_text()) - 1.0


@each(("name", "size", "points"), [
    ("histogram", (3.0, 2.0), 40.0), ("pareto", (3.0, 0.5), None), ("histogram", (0.5, 3.0), None),
    ("profile", (3.0, 0.5), None), ("pareto", (2.0, 1.5), 14.0),
])  # fmt: skip
def test_graphs_without_room_are_refused(name: str, size: tuple[float, float], points: float | None) -> None:
    said = rf"^Invalid size '{size[0]:g},{size[1]:g}'\. It has no room for (a graph|\d panels)\.$"
    refuses(said, GRAPHS[name], size=size, look=plots.Look(font_size=points, title="T", credits="C"))


@pytest.mark.slow
def test_cities_and_scale_bars_follow_the_letters() -> None:
    for points in (5.0, 9.0, 14.0):
        figure = plots.figure("EPSG:3035", region="country:DE", look=plots.Look(font_size=points))
        sizes = [text.get_fontsize() for text in figure.axes[0].texts if text.get_label() in ("city", "scale bar")]
        assert sizes == pytest.approx([6.5 * points / 9.0] * len(sizes))
        assert len(sizes) > 3


@each(("words", "said"), [
    ("compare robin --theme dark", "Invalid option --theme. It needs a picture to draw: --plot"),
    ("mosaic --dpi 50", "Invalid option --dpi. It needs a figure to draw: --compare FILE."),
    ("profile robin --line 1,2,3,4 --no-title", "Invalid option --no-title. It needs a picture"),
    ("profile robin --line 1,2,3,4 --no-colourbar", "No such option --no-colourbar"),
    ("morph robin moll --transparent", "No such option --transparent"),
    ("morph robin moll --theme pink", "Invalid theme 'pink'"), ("tissot robin --theme pink", "Invalid theme 'pink'"),
    ("tissot robin --font-size big", "Invalid font size 'big'"),
    ("tissot robin --style none.mplstyle", "Invalid style 'none.mplstyle'"),
    ("tissot robin --title A --no-title", "Invalid option --no-title. It cannot be used with --title"),
    ("correct robin --theme dark", "Invalid option --theme. It needs a picture to draw to: -o FILE."),
])  # fmt: skip
def test_wrong_options_of_style(words: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # Old and new versions of click have quotation marks, or a colon.
    assert re.sub("option:? '?(--[a-z-]+)'?", r"option \1", refused(*words.split())).startswith(f"projdist: {said}")
    assert list(tmp_path.iterdir()) == []
