"""The pages and pictures of the atlas: `python tools/atlas_pages.py [--all]`.

It writes docs/atlas.md, a part of docs/gallery.md and the pictures of ten places; with --all the pictures of all
places, in a quarter of an hour. The site has a page of each place, which `make docs` writes.
"""

from __future__ import annotations

import argparse
import functools
import re
import statistics
import sys
import textwrap
import unicodedata
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

import geopandas
import matplotlib.pyplot as plt
import shapely
from docs_files import DOCS, IMAGES, write_part
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from typer.testing import CliRunner

import projdist
from projdist import gis, plots
from projdist.cli.app import app
from projdist.designs import AtlasEntry

TEN = (
    *("continent:Africa", "country:Brazil", "country:Chile", "country:France", "country:Germany", "country:Indonesia"),
    *("country:Japan", "country:New Zealand", "country:Norway", "state:Texas"),
)
"""The places whose pictures are kept beside the documentation."""

SIZE, DPI = (7.6, 3.8), 110  # inches, and dots in one
WORLD = "+proj=eqearth"
STEPS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)  # times the error of the best map
NONE, SEA = "#c9c9c9", "#f0f4f8"

_AS_GOOD, _FACTOR = 0.05, 2.0
_SMALL, _LARGE = 1_000, 50_000  # square kilometres of a country that is worth a name
_NAMED = 8  # places of a sentence
_LONGEST, _LONG = 4000, "too long for a page; `--format json` has it."  # characters
_WIDTH = 132  # characters of a line


def slug(entry: AtlasEntry) -> str:
    """The name of an entry's page and picture."""
    kind = f"{entry.kind} " if entry.kind == "continent" else ""
    plain = unicodedata.normalize("NFKD", f"{kind}{entry.title}".casefold())
    return re.sub(r"[^a-z0-9]+", "-", "".join(c for c in plain if not unicodedata.combining(c))).strip("-")


@functools.cache
def entries() -> dict[str, AtlasEntry]:
    """The entries by the names that `atlas` takes."""
    return {name: projdist.atlas(name) for name in projdist.atlas_names()}


# ---- the page of a place --------------------------------------------------------------------


def place_page(name: str, picture: str | None) -> str:
    """The maps of a place, with a picture if there is one, and the PROJ strings."""
    entry = entries()[name]
    lines = [f"# {entry.title}", ""]
    if picture is not None:
        lines += [f"![{_caption(entry)}]({picture})", "", f"{_caption(entry)}.", ""]
    lines += [f"`projdist atlas {_quoted(name)}`, over {entry.area_km2:,.0f} km²:", "", _printed("atlas", name), ""]
    strings = list(_strings(entry))
    if strings:
        lines += ["## PROJ strings", ""]
    for title, proj in strings:
        lines += [f"{title}:", "", "```text", proj, "```", ""] if len(proj) < _LONGEST else [f"{title}: {_LONG}", ""]
    return "\n".join(lines).rstrip() + "\n"


def pictured(entry: AtlasEntry) -> dict[str, str]:
    """The maps of a picture by their titles: the official CRS, or else the best existing one; one made to measure."""
    best = entry.purposes["any"]
    first = entry.official or best.existing
    maps = {} if first is None else {first.projection: first.projection}
    if best.made is not None:
        maps["made to measure"] = best.made.projection
    elif best.custom is not None:
        maps[best.custom.name] = best.custom.projection
    return maps


def _caption(entry: AtlasEntry) -> str:
    return f"Distortion of {entry.title} on {' and on the map '.join(pictured(entry))}"


def _strings(entry: AtlasEntry) -> Iterator[tuple[str, str]]:
    """What a PROJ string is the map of, and the string; each once."""
    told: dict[str, list[str]] = {}
    names = {}
    for purpose in entry.purposes.values():
        for one in purpose.maps.values():
            if one.projection.startswith("+"):
                told.setdefault(one.projection, []).append(purpose.name)
                names[one.projection] = one.name
    yield from (
        (f"{names[proj][0].upper()}{names[proj][1:]} ({', '.join(purposes)})", proj) for proj, purposes in told.items()
    )


def _printed(*words: str) -> str:
    """What a command prints as Markdown."""
    result = CliRunner().invoke(app, [*words, "--format", "markdown"], catch_exceptions=False)
    if result.exit_code:
        raise RuntimeError(f"'projdist {' '.join(words)}' ended with {result.exit_code}.")
    return result.stdout.rstrip()


def _quoted(text: str) -> str:
    return f'"{text}"' if " " in text else text


# ---- the page of all places -----------------------------------------------------------------


def overview_page(images: str, link: Callable[[str], str | None]) -> str:
    """All places in one table, and what stands out; `link` tells where a place has its page."""
    known = list(entries().values())
    lines = [
        "# The atlas",
        "",
        *_wrapped(
            f"The best maps of {len(known)} places, measured beforehand: continents, areas such as the European "
            "Union, oceans, UTM zones, countries and their distant parts, and states of the USA. There are five "
            "purposes: any, angles, areas, a compromise, and the least scale error. For each the atlas has the best "
            "CRS of EPSG and ESRI, the best member of PROJ's families, the best map made to measure, a prediction of "
            "the least possible error, and the country's own system."
        ),
        "",
        "```sh",
        "projdist atlas NZ",
        "projdist atlas --export atlas.gpkg",
        "```",
        "",
        "```python",
        "import projdist",
        "",
        'projdist.atlas("NZ").purposes["conformal"].custom.projection',
        "```",
        "",
        "## What stands out",
        "",
        *_findings(known),
        "",
        f"![How far the official CRS of each country is from the best map of all]({images}/world.png)",
        "",
        *_wrapped(
            "The error of each country's official CRS, over that of the best map made to measure. Gray: there is no "
            "single official CRS, for example where the country has zones."
        ),
        "",
        "## All places",
        "",
        *_wrapped(
            "Errors are Airy-Kavrayskiy's, for any purpose. Official: the best of the country's own CRSs for general "
            "use that hold at least nine tenths of the place, on the datum in force; for states and distant parts "
            "only a CRS that was made for them; none for an area of several countries. Saves: by how much the error is "
            "less than that of the official CRS, or of the best existing one if there is none."
        ),
        "",
        *_table(link),
        "",
        *_about(known[0].versions),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, _WIDTH, break_on_hyphens=False)


_HEADS = (
    *("place", "kind", "official", "error", "best existing"),
    *("saves", "custom saves", "made saves", "official over limit"),
)


def _table(link: Callable[[str], str | None]) -> Iterator[str]:
    yield f"| {' | '.join(_HEADS)} |"
    yield "| --- | --- | --- | ---: | --- | ---: | ---: | ---: | ---: |"
    for name, entry in entries().items():
        row, page = entry.summary(), link(name)
        cells = [
            f"[{entry.title}]({page})" if page else entry.title,
            entry.kind,
            row["official"] or "-",
            _number(row["official_error"]),
            row["existing"] or "-",
            *(_share(row[f"{what}_saves"]) for what in ("existing", "custom", "made")),
            _number(row["official_over_limit"], 3),
        ]
        yield f"| {' | '.join(cells)} |"


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.0f} %"


def _findings(known: Sequence[AtlasEntry]) -> Iterator[str]:
    """What the figures say of official systems."""
    countries = [entry for entry in known if entry.kind == "country"]
    official = [entry for entry in countries if entry.official is not None]
    lost = {entry.title: loss for entry in official if (loss := _loss(entry, "existing")) is not None}
    good = sum(loss <= 1.0 + _AS_GOOD for loss in lost.values())
    seen = {entry.title for entry in official if entry.area_km2 >= _SMALL}
    bad = sorted((title for title in seen if lost.get(title, 0.0) >= _FACTOR), key=lambda title: -lost[title])
    made = {entry.title: loss for entry in official if (loss := _loss(entry, "made")) is not None}
    large = {entry.title for entry in official if entry.area_km2 >= _LARGE}
    near = sorted(large & made.keys(), key=lambda title: made[title])
    crs = {entry.title: entry.official.projection for entry in official if entry.official is not None}
    middle = statistics.median(made.values())
    yield from _item(
        f"Of {len(countries)} countries {len(official)} have a CRS of their own for general use that holds at least "
        "nine tenths of their main part. It is called official here. The others have zones, or no CRS of their own. "
        "An agency that has zones as well mostly uses the one CRS for small scales only."
    )
    yield from _item(
        f"The errors of {good} of these {len(official)} are at most {100 * _AS_GOOD:.0f} % above that of the best "
        "existing CRS."
    )
    yield from _item(
        f"In {len(bad)} countries of at least {_SMALL:,} km² the official CRS has {_FACTOR:g} times the error of the "
        f"best existing one or more: {_told(bad, lost, crs)}."
    )
    yield from _item(
        f"Half of the official CRSs have at least {middle:.2g} times the error of the best map made to measure. Among "
        f"countries of at least {_LARGE:,} km² these are nearest to it: {_told(near[:_NAMED], made, crs)}. "
        f"These are farthest: {_told(near[: -_NAMED - 1 : -1], made, crs)}."
    )


def _item(text: str) -> list[str]:
    """An item of a list."""
    return textwrap.wrap(f"- {text}", _WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def _loss(entry: AtlasEntry, what: str) -> float | None:
    """The error of the official CRS over that of one of the best of any purpose."""
    best = entry.purposes["any"].maps.get(what)
    if entry.official is None or best is None or not best.airy_kavrayskiy or entry.official.airy_kavrayskiy is None:
        return None
    return entry.official.airy_kavrayskiy / best.airy_kavrayskiy


def _told(titles: Sequence[str], factors: Mapping[str, float], crs: Mapping[str, str]) -> str:
    """Countries, with their CRSs and factors."""
    return ", ".join(f"{title} ({crs[title]}, {factors[title]:.3g})" for title in titles)


# ---- the data -------------------------------------------------------------------------------


def _about(versions: Mapping[str, str]) -> Iterator[str]:
    """The schema and the licence of the data."""
    yield from ("## The data", "")
    yield from _wrapped(
        "The data come with the program. `projdist atlas --export atlas.csv` (or `.parquet`) writes a row for each map "
        "of each purpose, `projdist atlas --export atlas.gpkg` the outline of each place with a row of figures; "
        "`projdist atlas NZ --export nz.csv` writes the data of one place. All of it was measured with projdist "
        f"{versions['projdist']} and {versions['PROJ']}; `make atlas` measures it again, in two hours on two "
        "cores. Anybody may use the figures for anything (CC0 1.0). Names of CRSs are those of EPSG's dataset, whose "
        "terms of use are at epsg.org, and of Esri's; outlines are Natural Earth's and, of states, the US Census "
        "Bureau's, both in the public domain."
    )
    yield from ("", "| column | what it is |", "| --- | --- |")
    yield from (f"| {names} | {text} |" for names, text in _COLUMNS)
    yield ""
    yield from _wrapped(
        "Tests measure the maps of one place in twelve again by differences of PROJ's coordinates, and look in eleven "
        "places at all CRSs of EPSG and Esri for a better one, by pyproj's factors. No member of a family that shows "
        "the place in one piece is better than the map made to measure. Around the poles (Antarctica, the Southern "
        "and the Arctic Ocean) a cone that is cut within the place can be."
    )


_COLUMNS = (
    (
        "`region`, `kind`, `area_km2`",
        "the place; country, part, state, continent, area (of countries, by name), ocean or zone; its area on WGS 84",
    ),
    ("`purpose`", "any, conformal, equal-area, compromise, least scale error; none for the official CRS"),
    ("`what`", "official; existing: the best CRS; custom: the best of PROJ's families; made: the best made to measure"),
    ("`projection`, `name`, `method`, `datum`", "code or PROJ string, and what the registry says"),
    ("`keeps`", "what the map keeps true there, as measured"),
    ("`national`, `share`", "whether it is the country's own; the share of the place within the area of use"),
    ("`airy_kavrayskiy`", "the RMS of sqrt(ln² a + ln² b) over the place"),
    ("`max_scale_error_ppm`, `mean_scale_error_ppm`", "of scales in any direction, parts per million"),
    ("`max_omega`, `mean_omega`", "angular deformation, degrees"),
    ("`max_areal_error_ppm`, `mean_areal_error_ppm`", "of areal scales, parts per million"),
    ("`cut_km`", "the length of cuts of the map within the place"),
    ("`over_limit`", "the error over about what the best of all maps of the purpose in one piece has"),
    ("`saves`", "the share of the error saved against the official CRS, else the best existing one; below 0 it costs"),
)
"""The rows of the data, in the order of the columns."""


# ---- pictures -------------------------------------------------------------------------------


def world_figure() -> Figure:
    """How many times the error of the best map the official CRSs of countries have."""
    frame = gis.atlas_frame([*entries().values()])
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


def gallery_part() -> str:
    """The pictures of ten places."""
    lines = []
    for name in TEN:
        entry = entries()[name]
        picture = f"![{_caption(entry)}](images/atlas/{slug(entry)}.png)"
        lines += [f"**{entry.title}**: `projdist atlas {_quoted(name)}`", "", picture, ""]
    return "\n".join(lines)


def main(chosen: Collection[str]) -> None:
    folder = IMAGES / "atlas"
    folder.mkdir(exist_ok=True)
    (DOCS / "atlas.md").write_text(overview_page("images/atlas", lambda _: None), encoding="utf-8")
    write_part("atlas", gallery_part())
    plots.save(world_figure(), folder / "world.png")
    for name in chosen:
        entry = entries()[name]
        sys.stderr.write(f"{entry.title}\n")
        plots.save(place_figure(entry), folder / f"{slug(entry)}.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--all", action="store_true", help="the pictures of all places")
    main(list(entries()) if parser.parse_args().all else TEN)
