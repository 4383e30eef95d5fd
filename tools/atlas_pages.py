"""The pages of the atlas, in Markdown: one of all places, and one of each."""

from __future__ import annotations

import functools
import re
import statistics
import textwrap
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence

from typer.testing import CliRunner

import projdist
from projdist import AtlasEntry
from projdist.cli.app import app

TEN = (
    *("continent:Africa", "country:Brazil", "country:Chile", "country:France", "country:Germany", "country:Indonesia"),
    *("country:Japan", "country:New Zealand", "country:Norway", "state:Texas"),
)
"""The places whose pages and pictures are kept beside the documentation."""

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
            f"The best maps of {len(known)} places, measured beforehand: continents, oceans, UTM zones, countries and "
            "their distant parts, and states of the USA. There are five purposes: any, angles, areas, a compromise, "
            "and the least scale error. For each the atlas has the best CRS of EPSG and ESRI, the best member of "
            "PROJ's families, the best map made to measure, a prediction of the least possible error, and the "
            "country's own system."
        ),
        "",
        "```sh",
        "projdist atlas NZ",
        "projdist atlas --format csv > atlas.csv",
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
            "only a CRS that was made for them. Saves: by how much the error is less than that of the official CRS, "
            "or of the best existing one if there is none."
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
        "`docs/atlas/` has `atlas.csv.gz` and `atlas.parquet`, a row for each map of each purpose, and `atlas.gpkg`, "
        f"the outlines with a row for each place. Measured with projdist {versions['projdist']} and "
        f"{versions['PROJ']}; `make atlas` measures all anew, in an hour and a half on two cores. The figures may be "
        "used by anybody for anything (CC0 1.0). Names of CRSs are those of EPSG's dataset, whose terms of use are at "
        "epsg.org, and of Esri's; outlines are Natural Earth's and, of states, the US Census Bureau's, both in the "
        "public domain."
    )
    yield from ("", "| column | what it is |", "| --- | --- |")
    yield from (f"| {names} | {text} |" for names, text in _COLUMNS)
    yield ""
    yield from _wrapped(
        "Tests measure the maps of one place in twelve again by differences of PROJ's coordinates, and look in ten "
        "places at all CRSs of EPSG and Esri for a better one, by pyproj's factors. No member of a family that shows "
        "the place in one piece is better than the map made to measure. Around the poles (Antarctica, the Southern "
        "and the Arctic Ocean) a cone that is cut within the place can be."
    )


_COLUMNS = (
    ("`region`, `kind`, `area_km2`", "the place; country, part, state, continent, ocean or zone; its area on WGS 84"),
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
