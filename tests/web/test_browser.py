"""Pages in a browser: maps are drawn, answer, and say nothing wrong on the console."""

import re
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_pages import check_told, read
from commands import run_ok

import projdist
from projdist.matrices import MEASURES, get_measure
from projdist.projections import proj_version
from projdist.web import Cell, Page, PageTable, draw_maps, page_html
from projdist.web.frames import four_numbers

pytestmark = pytest.mark.slow

MAPS = ["winkel-tripel", "EPSG:3857"]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rows = [[Cell("b"), Cell("10", 10.0)], [Cell("a"), Cell("9", 9.0)], [Cell("c"), Cell("-")]]
    table = PageTable(columns=[("map", True), ("figure", False)], rows=rows)
    maps = draw_maps(MAPS, titles=MAPS, region="globe")
    page = Page(title="Two maps", tables=[table], copies={"PROJ": "+proj=wintri <&>"}, maps=maps)
    path = tmp_path_factory.mktemp("page") / "x.html"
    path.write_text(page_html(page), encoding="utf-8")
    return path


@pytest.fixture(params=[{}, {"color_scheme": "dark"}, {"viewport": {"width": 390, "height": 800}}], ids=str)
def page(open_page: Any, file: Path, request: pytest.FixtureRequest) -> Any:
    """The page as it is opened, on a light, a dark and a narrow screen."""
    opened = open_page(file.as_uri(), **request.param, permissions=["clipboard-read", "clipboard-write"])
    opened.wait_for_selector("html[data-ready]")
    return opened


def point(page: Any, across: float, up: float) -> list[str]:
    """What all maps tell with the pointer over a place of the first."""
    box = page.locator("canvas.map").first.bounding_box()
    page.mouse.move(box["x"] + across * box["width"], box["y"] + up * box["height"])
    return page.locator(".told").all_inner_texts()


def test_the_pointer_tells_the_factors_of_all_maps(page: Any) -> None:
    """To the last digit that is shown; no place, no figures."""
    for across, up in ((0.5, 0.5), (0.3, 0.3), (0.62, 0.71), (0.81, 0.4)):
        for given, told in zip(MAPS, point(page, across, up), strict=True):
            check_told(given, told, least=2)
    assert point(page, 0.001, 0.001) == ["", ""]


TORN = ("igh", "goode-homolosine", "healpix", "gs48", "isea", "peirce_q", "interrupted-mollweide", "robinson")
OBLIQUE = "+proj=ob_tran +o_proj=moll +o_lat_p=40 +o_lon_p=30 +lon_0=20"
POINT_AT_MANY = """(places) => {
    const map = document.querySelector("canvas.map"), told = document.querySelector(".told");
    const {left, top, width, height} = map.getBoundingClientRect();
    return places.map(([x, y]) => {
        const at = {clientX: left + x * width, clientY: top + y * height};
        map.dispatchEvent(new PointerEvent("pointermove", at));
        return told.textContent;
    });
}"""


@pytest.mark.parametrize("projection", [*TORN, pytest.param(OBLIQUE, id="oblique")])
def test_figures_beside_cuts_are_certain(projection: str, open_page: Callable[..., Any], tmp_path: Path) -> None:
    """All digits and spans that are shown hold the factors, at random places of maps that are cut, folded and bent."""
    path = tmp_path / "x.html"
    path.write_text(page_html(Page(title="", maps=draw_maps([projection], titles=["A"], region="globe"))))
    page = open_page(path.as_uri())
    page.wait_for_selector("html[data-ready]")
    texts = page.evaluate(POINT_AT_MANY, np.random.default_rng(11).random((3000, 2)).tolist())
    told = [read(text) for text in texts if text]
    assert len(told) > 1400
    assert any(": ~ " in text for text in texts)
    lon, lat = np.array([(lon, lat) for lon, lat, _ in told]).T
    # A place is told to 0.01 degrees, so that the cut may be on either side of what is told.
    near = [
        projdist.factors(projection, (lon + east + 180.0) % 360.0 - 180.0, np.clip(lat + north, -90.0, 90.0))
        for east, north in ((0.0, 0.0), (0.005, 0.005), (-0.005, 0.005), (0.005, -0.005), (-0.005, -0.005))
    ]
    for name in ("h", "k", "a", "b", "s", "omega", "fisher", "convergence"):
        true = np.array([getattr(one, name) for one in near])
        symbol = {"omega": "ω", "fisher": "Fisher"}.get(name, name)
        shown = [figures[symbol] for _, _, figures in told]
        wrong = [
            (place[:2], text)
            for place, text, values in zip(told, shown, true.T, strict=True)
            if not any(_holds(text, value, 360.0 if name == "convergence" else None) for value in values)
        ]
        assert wrong == [], name
        assert sum(text == "?" for text in shown) < 0.2 * len(shown)


def _holds(text: str, value: float, turn: float | None) -> bool:
    """Whether a figure, as it is shown, is that value: to its last digit, within a span, or unknown."""
    if text == "?":
        return True
    low, _, high = text.partition(" to ")
    if turn:
        value = (value - float(low) + 0.5 * turn) % turn + float(low) - 0.5 * turn
    if high:
        return float(low) <= value <= float(high) or bool(turn and value + turn <= float(high))
    return abs(float(text) - value) <= 1.01 * 10.0 ** -len(text.partition(".")[2])


def test_keys_move_the_probe(page: Any) -> None:
    page.locator("canvas.map").first.focus()
    page.keyboard.press("ArrowRight")
    lon, lat, _ = read(page.locator(".told").first.inner_text())
    assert lon > 0.0
    page.keyboard.press("Shift+ArrowUp")
    assert read(page.locator(".told").first.inner_text())[1] > lat + 5.0


def test_colours_are_those_of_the_measure(page: Any) -> None:
    """The middle of the maps differs in areas, and the menu changes what is drawn."""
    script = """() => [...document.querySelectorAll("canvas.map")].map((one) => {
        const pixel = new OffscreenCanvas(1, 1).getContext("2d");
        pixel.drawImage(one, one.width * 0.53, one.height * 0.47, 1, 1, 0, 0, 1, 1);
        return [...pixel.getImageData(0, 0, 1, 1).data];
    })"""
    before = page.evaluate(script)
    assert all(pixel[3] == 255 for pixel in before)
    page.select_option("#measure", "parallel_scale")
    after = page.evaluate(script)
    assert before != after
    page.check("#ellipses")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_the_page_has_the_measures_of_the_registry(open_page: Callable[..., Any]) -> None:
    """All of J alone but its sign, to rounding: of random matrices, mirrored, conformal and nearly singular ones."""
    script = (files("projdist") / "web" / "measures.js").read_text(encoding="utf-8").replace("export ", "")
    names = {name for name, measure in MEASURES.items() if not measure.needs_hessian and name != "orientation"}
    rng = np.random.default_rng(3)
    J = rng.normal(size=(60, 2, 2))
    J[:10] = np.eye(2) + 1e-3 * J[:10]
    J[10] = np.diag([1.0, 1e-3])
    J[11:14] = [[[1.3, -0.4], [0.4, 1.3]], [[0.9, 0.0], [0.0, 0.9]], [[1.3, 0.4], [0.4, -1.3]]]
    mirrored = np.linalg.det(J) < 0.0
    fours = [four_numbers(one, turned).tolist() for one, turned in zip(J, mirrored.tolist(), strict=True)]
    page = open_page("about:blank")
    found = page.evaluate(
        f"""([fours, mirrored]) => {{ {script}; return fours.map((four, k) => {{
            const f = factorsOf(...four, mirrored[k]);
            return Object.fromEntries(Object.entries(MEASURES).map(([name, measure]) => [name, measure(f)]));
        }}); }}""",
        [fours, mirrored.tolist()],
    )
    assert set(found[0]) == names
    for name in names:
        # Near 1 an RMS is the root of what cancels to 1e-16.
        scale = 1e6 if name.endswith("ppm") else 1.0
        assert np.allclose([one[name] for one in found], get_measure(name)(J), rtol=1e-9, atol=3e-8 * scale), name


def test_tables_are_sorted(page: Any) -> None:
    """By a click or by Enter: up, down, and as given; what has no value is last."""
    head, cells = page.locator("thead th").nth(1), page.locator("tbody th")
    head.locator("button").click()
    assert (head.get_attribute("aria-sort"), cells.all_inner_texts()) == ("ascending", ["a", "b", "c"])
    for order in ("descending", None):
        head.locator("button").press("Enter")
        assert (head.get_attribute("aria-sort"), cells.all_inner_texts()) == (order, ["b", "a", "c"])
    page.locator("thead button").first.click()
    assert cells.all_inner_texts() == ["a", "b", "c"]


def test_texts_are_copied(page: Any) -> None:
    page.get_by_role("button", name="Copy PROJ").click()
    page.get_by_text("Copied").wait_for()
    assert page.evaluate("navigator.clipboard.readText()") == "+proj=wintri <&>"


def test_print_is_light(page: Any) -> None:
    assert page.pdf()[:5] == b"%PDF-"
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"


def test_a_report_is_printed_on_two_pages(open_page: Any, tmp_path: Path) -> None:
    """With four maps, ten rows, zones, and who computed it."""
    run_ok("recommend", "country:KE", "-o", str(tmp_path / "x.html"))
    opened = open_page((tmp_path / "x.html").as_uri())
    opened.wait_for_selector("html[data-ready]")
    assert len(re.findall(rb"/Type\s*/Page\b", opened.pdf(format="A4"))) == 2
    assert opened.title() == "Maps for Kenya"
    assert f"with {proj_version()} on " in opened.locator(".notes").inner_text()


def test_a_sheet_to_sign_is_two_pages(open_page: Any, axe: Callable[[Any], list[str]], tmp_path: Path) -> None:
    """On A4 and on letter, beside another map; what is signed stands together, and readers find nothing in the way."""
    words = ["ldp", "box:-104.2,38.9,-103.9,39.1", "--height", "5282", "--height-units", "us-ft", "--units", "us-ft"]
    run_ok(
        *words,
        "--geoid-height",
        "-17.5",
        "--families",
        "tmerc",
        "--against",
        "EPSG:32613",
        "-o",
        str(tmp_path / "x.html"),
    )
    opened = open_page((tmp_path / "x.html").as_uri())
    opened.wait_for_selector("html[data-ready]")
    for paper in ("A4", "Letter"):
        assert len(re.findall(rb"/Type\s*/Page\b", opened.pdf(format=paper))) == 2
    assert axe(opened) == []
    opened.emulate_media(media="print")
    assert opened.evaluate("getComputedStyle(document.querySelector('.signed')).breakInside") == "avoid"


def test_nothing_hinders_readers(page: Any, axe: Callable[[Any], list[str]]) -> None:
    """axe-core finds nothing serious: names, contrasts, roles, order; nor with indicatrices and a place told."""
    assert axe(page) == []
    page.check("#ellipses")
    point(page, 0.5, 0.5)
    page.get_by_role("button", name="figure").click()
    assert axe(page) == []


def test_wide_tables_of_one_row_are_reached(open_page: Any, axe: Callable[[Any], list[str]], tmp_path: Path) -> None:
    cells = [Cell("a long text without end"), *(Cell(f"{k}.000", float(k)) for k in range(20))]
    table = PageTable(columns=[("map", True), *((f"figure {k}", False) for k in range(20))], rows=[cells])
    path = tmp_path / "x.html"
    path.write_text(page_html(Page(title="One row", tables=[table])))
    opened = open_page(path.as_uri(), viewport={"width": 390, "height": 800})
    opened.wait_for_selector("html[data-ready]")
    assert axe(opened) == []
    opened.keyboard.press("Tab")
    opened.keyboard.press("ArrowRight")
    assert opened.evaluate("document.activeElement.className") == "table"


def test_without_scripts_the_text_is_there(open_page: Any, file: Path) -> None:
    opened = open_page(file.as_uri(), java_script_enabled=False)
    text = opened.locator("body").inner_text()
    for part in ("Two maps", "figure", "10", "+proj=wintri <&>", "this browser runs none"):
        assert part in text
    assert not opened.get_by_role("button", name="Copy").is_visible()
