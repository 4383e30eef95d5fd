"""Pages: one file that asks nothing of anybody, whose text is complete without scripts."""

import base64
import hashlib
import re
from html.parser import HTMLParser
from importlib.resources import files

import pytest

from projdist.matrices import MEASURES
from projdist.web import Cell, Page, PageTable, draw_maps, page_html
from projdist.web.page import SHOWN_MEASURES

VOID = {"meta", "link", "br", "img", "input", "hr"}
EVIL = '<script>alert("x")</script>&\'</title></pre>'


class _Read(HTMLParser):
    """A page: its elements, which must end in order, and the text that is read without scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.inside: dict[str, list[str]] = {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.elements.append((tag, dict(attrs)))
        assert len(dict(attrs)) == len(attrs)
        if tag not in VOID:
            self.open.append(tag)
            self.inside.setdefault(tag, []).append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        for tag in set(self.open):
            self.inside[tag][-1] += data


def page(**more) -> str:
    rows = [[Cell("a"), Cell("0.5*", 0.5)], [Cell(EVIL), Cell("-")]]
    table = PageTable(title="The table", columns=[("map", True), ("figure & unit", False)], rows=rows)
    return page_html(Page(title="Maps", lead=["Before"], tables=[table], notes=["After", ""], **more))


@pytest.fixture(scope="module")
def with_maps() -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("projdist.web.page._NODES", 200)  # as `few_cells`, for all tests of the module
        maps = draw_maps(["robinson", "EPSG:3035"], titles=["Robinson", EVIL], region="globe")
    return page(copies={"PROJ": "+proj=robin", "WKT2": "\n".join("abcdefghijklmnop")}, maps=maps)


@pytest.fixture(scope="module")
def parsed(with_maps: str) -> _Read:
    return _Read(with_maps)


def test_elements_end_in_order_and_have_names_of_their_own(parsed: _Read) -> None:
    """Ids are there once, and what refers to one finds it."""
    ids, keys = [attrs["id"] for _, attrs in parsed.elements if "id" in attrs], ("aria-labelledby", "aria-describedby")
    assert len(set(ids)) == len(ids)
    refers = [attrs[key] for _, attrs in parsed.elements for key in keys if key in attrs]
    assert {*refers, "title-1", "map-1", "told-1", "frame-1", "scales"} <= set(ids)
    assert ("html", {"lang": "en"}) in parsed.elements


def test_all_that_is_said_is_text(parsed: _Read) -> None:
    """Title, lead, tables, notes and texts to copy are read without a script, and that maps need one."""
    expected = {
        "h1": ["Maps"], "title": ["Maps"], "caption": ["The table"], "th": ["map", "figure & unit", "a", EVIL],
        "td": ["0.5*", "-"], "li": ["After"], "pre": ["+proj=robin", "\n".join("abcdefghijklmnop")],
        "summary": ["a ..."],  # of sixteen lines; a text of one is not folded
        "figcaption": ["Robinson", EVIL],
    }  # fmt: skip
    assert {tag: parsed.inside[tag] for tag in expected} == expected
    assert "runs none" in parsed.inside["noscript"][0]
    # Heads have their scope; a number is there as it was computed, none where there is none.
    assert [attrs["scope"] for tag, attrs in parsed.elements if tag == "th"] == ["col", "col", "row", "row"]
    assert [attrs.get("data-value") for tag, attrs in parsed.elements if tag == "td"] == ["0.5", None]


def test_what_users_give_is_no_markup(parsed: _Read) -> None:
    kinds = [attrs.get("type") for tag, attrs in parsed.elements if tag == "script"]
    assert kinds == ["application/json", "text/plain", "text/plain", "module"]
    read = _Read(page_html(Page(title=EVIL, lead=[EVIL], notes=[EVIL], copies={EVIL: EVIL})))
    assert read.inside["h1"] == read.inside["title"] == read.inside["li"] == read.inside["pre"] == [EVIL]
    assert [attrs for tag, attrs in read.elements if tag == "script"] == [{"type": "module"}]


def test_the_policy_allows_the_own_style_and_script_only(parsed: _Read) -> None:
    """Their hashes are those of what stands in the page; nothing else may be loaded."""
    policy = next(attrs["content"] for tag, attrs in parsed.elements if "http-equiv" in attrs) or ""
    assert policy.startswith("default-src 'none'; ")
    for name, text in (("script", parsed.inside["script"][-1]), ("style", parsed.inside["style"][0])):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"{name}-src 'sha256-{digest}';" in policy
    assert "unsafe" not in policy
    assert not [attrs for _, attrs in parsed.elements if "style" in attrs or any(key.startswith("on") for key in attrs)]


def test_nothing_comes_from_elsewhere(with_maps: str, parsed: _Read) -> None:
    assert "://" not in with_maps
    assert not [attrs for _, attrs in parsed.elements if {"src", "href", "action"} & set(attrs)]
    assert not re.search(r"url\(|@import|\bfetch\(|\bimport\b|\bexport\b", with_maps)


def test_a_page_without_maps_is_small() -> None:
    text = page()
    assert len(text) < 10_000
    assert not [tag for tag, _ in _Read(text).elements if tag in ("canvas", "figure")]


@pytest.mark.slow
@pytest.mark.parametrize(("given", "region"), [
    ("winkel-tripel", "globe"), ("stereographic@65,15", "country:NO"), ("EPSG:3034", "country:GR"),
    ("EPSG:3571", "box:-180,60,180,90"), ("EPSG:3035", "continent:Europe"), ("EPSG:3978", "country:CA"),
    ("EPSG:2193", "country:NZ"), ("EPSG:3031", "continent:Antarctica"), ("airy@60,100", "country:PH"),
    ("isea", "globe"), ("igh", "land"), ("peirce_q", "land"), ("goode-homolosine", "ocean"),
])  # fmt: skip
def test_a_map_has_less_than_400_kb(given: str, region: str) -> None:
    """Also of coasts with many islands, and of all land on maps that are cut often."""
    maps = draw_maps([given], titles=["A"], region=region)
    (frame,) = maps.frames
    assert len(frame) < 400_000
    assert len(str(maps.scales)) < 30_000


@pytest.mark.usefixtures("few_cells")
def test_a_map_that_shows_nothing_is_told() -> None:
    given = ["robinson", "+proj=ortho +lat_0=90 +R=6371000"]
    maps = draw_maps(given, titles=["A", "B"], region="box:0,-40,40,-10", measure="flexion")
    assert (maps.titles, maps.measure) == (("A",), "fisher")
    assert "No part of it can be projected." in maps.notes[0]
    assert maps.notes[0].replace("'", "&#x27;") in page_html(Page(title="", maps=maps))


def test_the_menu_has_every_measure_of_a_jacobian() -> None:
    """A measure that is added to the registry needs its place in the menu and its formula in the page's script."""
    names = {name for name, measure in MEASURES.items() if not measure.needs_hessian and name != "orientation"}
    script = (files("projdist") / "web" / "measures.js").read_text(encoding="utf-8")
    assert {*SHOWN_MEASURES} == names
    assert [name for name in names if f"  {name}:" not in script] == []
