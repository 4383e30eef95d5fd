"""The live page in a browser: everything that a hand can do, and what is seen and said then."""

import json
import math
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

import numpy as np
import pytest

import projdist

pytestmark = pytest.mark.slow

SETTLED = 0.6  # seconds until a view is in the address, and maps know of each other
GERMANY = "country:DE"
SQUARES = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"name": name},
            "geometry": {"type": "Polygon", "coordinates": [[[x, y], [x + 2, y], [x + 2, y + 2], [x, y + 2], [x, y]]]},
        }
        for name, x, y in (("south", 10.0, 0.0), ("north", 10.0, 60.0))
    ],
}


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The address of a server; views are chosen by what follows it."""
    command = [sys.executable, "-m", "projdist", "explore", "robinson", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
        process.terminate()


AT_REST = """(() => {
    const cards = [...document.querySelectorAll(".card")];
    return cards.length > 0 && cards.every((card) => {
        const { version, shown } = card.dataset, figures = card.querySelector(".figures").textContent;
        return Number(shown) === Number(version) + 0.5 && figures.startsWith("Airy-Kavrayskiy error over");
    });
})()"""


class Live:
    """A page, and what a person sees of it."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def until(self, condition: str, seconds: float = 60.0) -> None:
        """Wait for what the policy of the page does not let it wait for itself."""
        end = time.monotonic() + seconds
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, condition
            time.sleep(0.03)

    def rest(self) -> "Live":
        """Wait until all maps show the exact picture of what they are, with their figures."""
        self.until(AT_REST)
        return self

    def settled(self) -> dict[str, list[str]]:
        """The view that the address tells, when it has been written."""
        self.rest()
        time.sleep(SETTLED)
        self.rest()
        return parse_qs(str(self.page.evaluate("location.hash.slice(1)")))

    def map(self, number: int = 0) -> Any:
        """The canvas of a map."""
        return self.page.locator("canvas.map").nth(number)

    def card(self, number: int = 0) -> Any:
        """A map with all that belongs to it."""
        return self.page.locator(".card").nth(number)

    def place(self, across: float, down: float, number: int = 0) -> tuple[float, float]:
        """Pixels of the page of a place on a map."""
        box = self.map(number).bounding_box()
        return box["x"] + across * box["width"], box["y"] + down * box["height"]

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 6) -> None:
        """Draw the pointer from one place on the first map to another."""
        self.page.mouse.move(*self.place(*start))
        self.page.mouse.down()
        for k in range(1, steps + 1):
            across, down = (a + (b - a) * k / steps for a, b in zip(start, end, strict=True))
            self.page.mouse.move(*self.place(across, down))
            time.sleep(0.02)
        self.page.mouse.up()

    def told(self, number: int = 0) -> str:
        """What a map tells of the place that is pointed at."""
        return str(self.page.locator(".told").nth(number).inner_text())

    def said(self, number: int = 0) -> str:
        """What a map says."""
        return str(self.page.locator(".card .said").nth(number).text_content())

    def picture(self, number: int = 0) -> bytes:
        """The map as it is drawn."""
        return bytes(self.map(number).evaluate("map => map.toDataURL()"), "ascii")

    def write(self, field: str, text: str, number: int = 0) -> None:
        """Type a text in place of the one that is there, and end it with Enter."""
        self.page.locator(field).nth(number).fill(text)
        self.page.locator(field).nth(number).press("Enter")


Opener = Callable[..., Live]


@pytest.fixture
def live(open_page: Callable[..., Any], address: str) -> Opener:
    """`live(maps..., region=..., options of the context)`: a page at rest."""

    def opened(*maps: str, region: str = "globe", more: str = "", **options: Any) -> Live:
        options.setdefault("viewport", {"width": 1200, "height": 900})
        view = "".join(f"&map={quote(one, safe='')}" for one in maps or ("robinson",))
        page = Live(open_page(f"{address}&region={quote(region, safe='')}{view}{more}", **options)).rest()
        time.sleep(SETTLED)
        return page

    return opened


def read(told: str) -> tuple[float, float, dict[str, str]]:
    """Longitude, latitude and the figures of what is told."""
    place = re.match(r"([\d.]+)° ([NS]) ([\d.]+)° ([EW]): ", told)
    assert place, told
    texts = told[place.end() :].removeprefix("~ ").replace("°", "").split(", ")
    figures = dict(text.rsplit("\N{NO-BREAK SPACE}", 1) for text in texts)
    lat, lon = float(place[1]), float(place[3])
    return -lon if place[4] == "W" else lon, -lat if place[2] == "S" else lat, figures


def truth(given: str, lon: float, lat: float) -> Mapping[str, float]:
    true = projdist.factors(given, lon, lat)
    named = {"h": true.h, "k": true.k, "a": true.a, "b": true.b, "s": true.s, "ω": true.omega, "Fisher": true.fisher}
    return {name: float(value) for name, value in named.items()}


def check_told(given: str, told: str) -> None:
    """To the last digit that is shown."""
    lon, lat, figures = read(told)
    for name, value in truth(given, lon, lat).items():
        decimals = len(figures[name].partition(".")[2])
        assert decimals >= 1
        assert abs(float(figures[name]) - value) <= 1.01 * 10.0**-decimals, name


# ---- pointing -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("maps", "region"),
    [(("robinson", "+proj=laea +lat_0=30 +lon_0=20"), "globe"), (("EPSG:3857", "EPSG:25832"), GERMANY)],
    ids=str,
)
def test_the_pointer_tells_the_factors_of_all_maps(maps: tuple[str, ...], region: str, live: Opener) -> None:
    page = live(*maps, region=region)
    for across, down in ((0.5, 0.5), (0.45, 0.4), (0.53, 0.61)):
        page.page.mouse.move(*page.place(across, down))
        for number, given in enumerate(maps):
            check_told(given, page.told(number))
    page.page.mouse.move(5, 5)
    assert [page.told(0), page.told(1)] == ["", ""]


def test_previews_tell_about_the_same(live: Opener) -> None:
    """While a map is dragged it is drawn by differences, good to a few per cent; the picture at rest is exact."""
    page = live("robinson")
    page.page.locator(".slider input[type=number]").first.fill("12")
    page.until("document.querySelector('.card').dataset.shown === document.querySelector('.card').dataset.version")
    x, y = page.map().evaluate("map => [map.clientWidth * 0.4, map.clientHeight * 0.4]")
    told = page.map().evaluate(
        """(map, [offsetX, offsetY]) => {
            const {left, top} = map.getBoundingClientRect();
            map.dispatchEvent(new PointerEvent("pointermove", {clientX: left + offsetX, clientY: top + offsetY}));
            return map.parentElement.querySelector(".told").textContent;
        }""",
        [x, y],
    )
    lon, lat, figures = read(told)
    for name, value in truth("robinson+lon_0=12", lon, lat).items():
        decimals = len(figures[name].partition(".")[2])
        ends = [float(end) for end in figures[name].split(" to ")]  # a span where no digit is certain
        error = max(10.0**-decimals, 0.06 * value)
        assert ends[0] - error <= value <= ends[-1] + error, name
    page.rest()
    check_told("robinson+lon_0=12", page.told())


def test_arrow_keys_point(live: Opener) -> None:
    """From the middle, further with Shift; what is said aloud waits until the keys rest."""
    page = live("robinson", "mollweide")
    page.map().focus()
    page.page.keyboard.press("ArrowRight")
    lon, lat, _ = read(page.told())
    assert 0.0 < lon < 10.0
    assert abs(lat) < 1.0
    assert page.page.locator("#spoken").text_content() == ""
    page.page.keyboard.press("Shift+ArrowUp")
    further, higher, _ = read(page.told())
    assert higher > 5.0
    assert further == pytest.approx(lon, abs=1.0)
    assert read(page.told(1))[:2] == (further, higher)
    check_told("mollweide", page.told(1))
    page.until("document.getElementById('spoken').textContent !== ''")
    assert page.page.locator("#spoken").text_content() == page.told()


def test_a_finger_points_where_it_touches(live: Opener) -> None:
    page = live("robinson", has_touch=True)
    page.page.touchscreen.tap(*page.place(0.45, 0.4))
    check_told("robinson", page.told())


# ---- dragging -------------------------------------------------------------------------------


def test_dragging_turns_a_map(live: Opener) -> None:
    """By longitude, and where the map has one by latitude, with the hand; the figures are those of the new one."""
    page = live("+proj=ortho +lat_0=50 +lon_0=10")
    page.drag((0.5, 0.5), (0.45, 0.55))
    definition = page.settled()["map"][0]
    parameters = dict(re.findall(r"\+(\w+)=([^ ]+)", definition))
    assert parameters["proj"] == "ortho"
    assert float(parameters["lon_0"]) > 11.0
    assert float(parameters["lat_0"]) > 51.0
    assert page.page.locator("[data-name=lon_0]").nth(1).input_value() == parameters["lon_0"]
    page.page.mouse.move(*page.place(0.5, 0.4))
    check_told(definition, page.told())


def test_pictures_follow_the_hand(live: Opener) -> None:
    """Previews are drawn before the hand rests, nothing is told of the old map, and Escape takes the turn back."""
    page = live("robinson")
    page.page.mouse.move(*page.place(0.5, 0.5))
    before = page.picture()
    page.page.mouse.down()
    for k in range(1, 6):
        page.page.mouse.move(*page.place(0.5 + 0.03 * k, 0.5))
    page.until("Number(document.querySelector('.card').dataset.shown) > 1.5")
    assert page.told() == ""
    assert page.picture() != before
    page.page.keyboard.press("Escape")
    page.page.mouse.move(*page.place(0.6, 0.5))
    page.page.mouse.up()
    assert (
        page.settled()["map"] == ["+proj=robin +lon_0=0"]
        or page.page.locator("[data-name=lon_0]").nth(1).input_value() == "0"
    )


def test_alt_and_arrows_turn(live: Opener) -> None:
    """By 5 degrees."""
    page = live("+proj=laea +lat_0=50 +lon_0=10")
    page.map().focus()
    page.page.keyboard.press("Alt+ArrowRight")
    page.page.keyboard.press("Alt+ArrowUp")
    page.rest()
    values = [page.page.locator(f"[data-name={name}]").nth(1).input_value() for name in ("lon_0", "lat_0")]
    assert values == ["15", "55"]


# ---- measures, lines and ellipses -----------------------------------------------------------


def test_measures_isolines_and_indicatrices_change_the_picture(live: Opener) -> None:
    page = live("robinson", "mercator")
    seen = [page.picture()]

    def changes(number: int = 0) -> None:
        time.sleep(0.2)
        seen.append(page.picture(number))
        assert seen[-1] not in seen[:-1]

    page.page.locator("#measure").select_option("areal_scale")
    changes()
    assert "real scale" in page.page.locator("#scale").get_attribute("aria-label")
    page.page.get_by_label("Indicatrices").check()
    changes()
    page.page.locator("#spacing").focus()
    page.page.keyboard.press("End")
    changes()
    page.page.get_by_label("Isolines").uncheck()
    changes()
    view = page.settled()
    assert [view[name] for name in ("measure", "ellipses", "isolines", "spacing")] == [
        ["areal_scale"],
        ["1"],
        ["0"],
        ["120"],
    ]


def test_indicatrices_lie_about_the_middle_and_none_is_cut_off(live: Opener) -> None:
    """A map that is even to both sides has them so, and none reaches the side of its picture."""
    page = live("sinusoidal", more="&ellipses=1&isolines=0&measure=areal_scale&spacing=60")
    red = """map => {
        const { width, height } = map, { data } = map.getContext("2d").getImageData(0, 0, width, height);
        const counts = [0, 0], sides = [];
        for (let k = 0; k < data.length; k += 4) {
            const column = (k / 4) % width, reddish = data[k] > data[k + 2] + 60;
            if (reddish) counts[column < width / 2 ? 0 : 1]++;
            if (data[k + 3] > 0 && (column === 0 || column === width - 1)) sides.push(column);
        }
        return [counts, sides];
    }"""
    (left, right), sides = page.map().evaluate(red)
    assert not sides
    assert left > 2000
    assert abs(left - right) < 0.02 * (left + right)


@pytest.mark.parametrize("region", ["globe", GERMANY])
def test_what_stays_when_colours_change_is_what_is_drawn_anew(region: str, live: Opener) -> None:
    """A page that has changed its measure, its colours and its width shows what one shows that was opened so."""
    narrow: Any = {"viewport": {"width": 700, "height": 800}, "color_scheme": "dark"}
    page, other = (
        live("EPSG:3035", region=region),
        live("EPSG:3035", region=region, more="&measure=areal_scale", **narrow),
    )
    page.page.set_viewport_size(narrow["viewport"])
    page.page.emulate_media(color_scheme="dark")
    page.page.locator("#measure").select_option("areal_scale")
    time.sleep(SETTLED)
    assert page.picture() == other.picture()
    page.page.locator("#measure").select_option("fisher")
    time.sleep(SETTLED)
    assert page.picture() != other.picture()


FORTY = {
    "pseudocylindrical": ("robinson", "mollweide", "equal-earth", "natural-earth", "sinusoidal", "winkel-tripel"),
    "interrupted": ("igh", "igh_o", "+proj=imoll", "+proj=imoll_o", "interrupted-mollweide", "goode-homolosine"),
    "polyhedral": ("healpix", "rhealpix", "isea", "peirce_q", "adams_ws1", "van-der-grinten"),
    "oblique": (
        "mollweide@45,-100",
        "robinson@30,60",
        "+proj=omerc +lat_0=40 +alpha=30 +lonc=10",
        "EPSG:3078",
        "EPSG:3375",
        "+proj=ob_tran +o_proj=eck4 +o_lat_p=30 +R=6371000",
    ),
    "azimuthal": (
        "+proj=laea +lat_0=50",
        "+proj=aeqd +lat_0=40",
        "gnomonic@40,20",
        "+proj=ortho +lat_0=-30",
        "EPSG:3413",
    ),
    "conic": (
        "+proj=lcc +lat_1=30 +lat_2=60",
        "+proj=aea +lat_1=20 +lat_2=50",
        "+proj=bonne +lat_1=45",
        "+proj=poly",
        "EPSG:2154",
    ),
    "transverse": ("+proj=tmerc", "+proj=tcc", "EPSG:32632", "EPSG:27700", "EPSG:2193", "IAU_2015:49910"),
}


@pytest.mark.parametrize("kind", FORTY)
def test_forty_maps_are_seen(kind: str, live: Opener) -> None:
    """Each has colours in its middle half, its figures, and nothing to complain of, nor has the console."""
    page = live(*FORTY[kind])
    coloured = """map => {
        const { width, height } = map, step = 4 * 97;
        const { data } = map.getContext("2d").getImageData(0, height / 4, width, height / 2);
        let count = 0;
        for (let k = 0; k < data.length; k += step) count += data[k + 3] === 255;
        return (count * step) / data.length;
    }"""
    for number in range(len(FORTY[kind])):
        assert page.said(number) == ""
        assert page.map(number).evaluate(coloured) > 0.2


# ---- parameters -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "name", "value"),
    [
        ("+proj=lcc +lat_1=30 +lat_2=60", "lat_1", "44"),
        ("+proj=omerc +lonc=10 +lat_0=50 +alpha=30", "alpha", "60"),
        ("+proj=nsper +h=5000000", "h", "9000000"),
        ("+proj=natearth2", "lon_0", "25"),
    ],
    ids=str,
)
def test_number_boxes_set_parameters(given: str, name: str, value: str, live: Opener) -> None:
    page = live(given, region=GERMANY)
    number = page.page.locator(f"input[type=number][data-name={name}]")
    number.fill(value)
    definition = page.settled()["map"][0]
    assert f"+{name}={value}" in definition
    assert page.page.locator(f"input[type=range][data-name={name}]").input_value() == value
    page.page.mouse.move(*page.place(0.5, 0.5))
    check_told(definition, page.told())


def test_sliders_turn_with_the_keys(live: Opener) -> None:
    page = live("robinson", region=GERMANY)
    slider = page.page.locator("input[type=range][data-name=lon_0]")
    slider.focus()
    for _ in range(3):
        page.page.keyboard.press("ArrowRight")
    page.rest()
    assert slider.input_value() != "0"
    assert slider.input_value() == page.page.locator("input[type=number][data-name=lon_0]").input_value()
    assert page.page.evaluate("document.activeElement.dataset.name") == "lon_0"


def test_a_value_that_no_map_has_is_said(live: Opener) -> None:
    """Beyond its range nothing happens; two parallels that cancel are told in words, and the picture stays."""
    page = live("+proj=lcc +lat_1=30 +lat_2=60", region=GERMANY)
    before = page.picture()
    number = page.page.locator("input[type=number][data-name=lat_1]")
    number.fill("1000")
    time.sleep(0.4)
    assert page.picture() == before
    assert number.evaluate("box => !box.checkValidity()")
    number.fill("-60")
    page.until("document.querySelector('.card .said').textContent !== ''")
    assert "Invalid" in page.said()
    assert page.picture() == before
    number.fill("40")
    assert "+lat_1=40" in page.settled()["map"][0]
    assert page.said() == ""


# ---- typing ---------------------------------------------------------------------------------

WKT = 'PROJCRS["x",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]]],'
WKT += 'CONVERSION["y",METHOD["Mercator (variant A)"],PARAMETER["Longitude of natural origin",0],'
WKT += 'PARAMETER["Scale factor at natural origin",1]],CS[Cartesian,2],AXIS["e",east],AXIS["n",north],'
WKT += 'LENGTHUNIT["metre",1]]'


@pytest.mark.parametrize(
    ("typed", "shown"),
    [
        ("mollweide", "Mollweide"),
        ("EPSG:2154", "EPSG:2154"),
        ("+proj=lcc +lat_1=44 +lat_2=49 +lon_0=3", "Lambert"),
        ("  +proj=eqc   +lat_ts=40 ", "qui"),
        (WKT, "x"),
    ],
    ids=lambda text: str(text)[:20],
)
def test_projections_are_typed(typed: str, shown: str, live: Opener) -> None:
    page = live("robinson", region="country:FR")
    before = page.picture()
    page.write(".name input", typed)
    page.rest()
    page.until("document.querySelector('.card h2').textContent !== 'Robinson'")
    page.rest()
    assert shown in page.page.locator(".card h2").inner_text()
    assert page.picture() != before
    assert page.said() == ""


@pytest.mark.parametrize(
    "typed",
    ["robinsn", "EPSG:1", "+proj=nix", "+proj=lcc, +lat_1=4,", "file.prj", "+proj=hgridshift +grids=/etc/passwd"],
)
def test_a_wrong_projection_is_said_at_its_map(typed: str, live: Opener) -> None:
    """The picture before stays, with its own figures, in the address, too, and can be dragged on."""
    page = live("robinson", "mollweide", region=GERMANY)
    before = page.picture()
    page.write(".name input", typed)
    page.until("document.querySelector('.card .said').textContent !== ''")
    assert "nvalid" in page.said()
    assert page.said(1) == ""
    assert page.page.locator(".name input").first.get_attribute("aria-invalid") == "true"
    assert page.page.locator(".name input").first.input_value() == typed
    assert page.picture() == before
    page.page.mouse.move(*page.place(0.5, 0.5))
    check_told("robinson", page.told())
    page.map().focus()
    page.page.keyboard.press("Alt+ArrowRight")
    assert "robin" in page.settled()["map"][0]
    assert page.said() == ""


def test_regions_are_typed_and_chosen(live: Opener) -> None:
    page = live("robinson")
    page.write("#region", "country:Chile")
    page.until("document.querySelector('.figures').textContent.includes('Chile')")
    page.page.locator("#atlas").select_option("continent:Africa")
    page.until("document.querySelector('.figures').textContent.includes('Africa')")
    assert page.settled()["region"] == ["continent:Africa"]
    page.page.locator("#atlas").select_option("state:Ohio")
    page.until("document.querySelector('.figures').textContent.includes('Ohio')")


@pytest.mark.parametrize("typed", ["country:Atlantis", "box:1,2", "file:/etc/passwd", "nowhere"])
def test_a_wrong_region_is_said_beside_it(typed: str, live: Opener) -> None:
    page = live("robinson", region=GERMANY)
    before = page.picture()
    page.write("#region", typed)
    page.until("document.getElementById('status').textContent !== ''")
    assert "nvalid" in page.page.locator("#status").inner_text()
    assert page.page.locator("#region").get_attribute("aria-invalid") is not None
    assert page.picture() == before
    assert page.settled()["region"] == [GERMANY]


# ---- drawing regions ------------------------------------------------------------------------


def press(page: Live, name: str) -> None:
    page.page.get_by_role("button", name=name, exact=True).click()


def test_a_box_is_drawn(live: Opener) -> None:
    page = live("+proj=eqc")
    press(page, "Draw a box")
    page.drag((0.5, 0.5), (0.6, 0.4))
    page.until("document.getElementById('region').value.startsWith('box:')")
    west, south, east, north = map(float, page.page.locator("#region").input_value()[4:].split(","))
    assert (west, south) == pytest.approx((0.0, 0.0), abs=1.0)
    assert east > 10.0
    assert north > 5.0
    page.until("location.hash.includes('region=box')")
    page.rest()
    assert page.page.get_by_role("button", name="Draw a box").get_attribute("aria-pressed") == "false"


def test_a_circle_is_drawn_with_the_keys(live: Opener) -> None:
    page = live("+proj=eqc")
    press(page, "Draw a circle")
    page.map().focus()
    for key in ("ArrowRight", "Enter", *["Shift+ArrowRight"] * 3, "Enter"):
        page.page.keyboard.press(key)
    page.until("document.getElementById('region').value.startsWith('cap:')")
    lon, lat, km = map(float, page.page.locator("#region").input_value()[4:].split(","))
    assert abs(lat) < 1.0
    assert 0.0 < lon < 10.0
    assert km > 1000.0
    page.rest()


def test_the_region_is_moved_until_escape(live: Opener) -> None:
    page = live("mercator", region=GERMANY)
    page.write("#region", "country:France")
    page.until("document.querySelector('.figures').textContent.includes('France')")
    page.rest()
    before = page.picture()
    press(page, "Move the region")
    page.until("document.getElementById('status').textContent.includes('France')")
    page.drag((0.5, 0.5), (0.55, 0.6))
    assert page.picture() != before
    page.page.keyboard.press("Escape")
    page.page.mouse.move(5, 5)
    assert page.picture() == before
    assert page.page.locator("#status").inner_text() == ""


def test_the_region_is_moved_by_keys(live: Opener) -> None:
    """Enter takes it, arrows move it."""
    page = live("mercator", region="country:FR")
    press(page, "Move the region")
    page.until("document.getElementById('status').textContent.includes('France')")
    page.map().focus()
    page.page.keyboard.press("ArrowRight")
    seen = [page.picture()]
    for key in ("Enter", "Shift+ArrowRight", "Shift+ArrowUp"):
        page.page.keyboard.press(key)
        assert page.picture() not in seen
        seen.append(page.picture())


# ---- advice ---------------------------------------------------------------------------------


def test_the_best_maps_are_found_shown_and_pointed_at(live: Opener) -> None:
    page = live("robinson", region="country:LU")
    press(page, "Find the best CRSs")
    assert page.page.get_by_role("button", name="Stop", exact=True).first.is_visible()
    page.until("document.querySelectorAll('.best tbody tr').length > 3", 120.0)
    codes = page.page.locator(".best tbody tr td:first-child").all_inner_texts()
    true = projdist.recommend("country:LU", criterion="airy_kavrayskiy", limit=12)
    assert codes == [one.code for one in true.results]
    page.page.get_by_role("button", name=f"Show {codes[0]}", exact=True).click()
    page.until("document.querySelectorAll('.card').length === 2")
    assert codes[0] in page.rest().page.locator(".card h2").nth(1).inner_text()
    legend = page.page.locator(".scatter .key + text")
    assert legend.all_text_contents() == ["a map of this page", "one of the best CRSs"]
    others = page.page.locator(".scatter .other[role=button]")
    others.first.focus()
    page.page.keyboard.press("Enter")
    page.until("document.querySelectorAll('.card').length === 3")
    page.rest()
    others.last.click(force=True)
    page.until("document.querySelectorAll('.card').length === 4")
    page.rest()


def test_the_search_is_stopped(live: Opener) -> None:
    page = live("robinson", region="continent:Europe")
    press(page, "Find the best CRSs")
    page.until("document.querySelector('progress').value > 0 || document.querySelectorAll('.best tbody tr').length > 0")
    page.page.locator(".best").get_by_role("button", name="Stop").click()
    assert "Stopped." in page.page.locator(".best .said").inner_text()
    assert page.page.get_by_role("button", name="Find the best CRSs").is_enabled()
    time.sleep(1.0)
    assert page.page.locator(".best tbody tr").count() == 0
    page.page.locator("#purpose").select_option("conformal")
    page.write("#region", "country:LU")
    page.until("document.querySelector('.figures').textContent.includes('Luxembourg')")
    press(page, "Find the best CRSs")
    page.until("document.querySelectorAll('.best tbody tr').length > 0", 120.0)


@pytest.mark.parametrize("way", ["chosen", "dropped"])
def test_data_are_checked(way: str, live: Opener, tmp_path: Path) -> None:
    page = live("mercator")
    path = tmp_path / "squares.geojson"
    path.write_text(json.dumps(SQUARES), encoding="utf-8")
    if way == "chosen":
        page.page.locator("#file").set_input_files(path)
    else:
        page.page.locator(".drop").evaluate(
            """(drop, text) => {
                const dataTransfer = new DataTransfer();
                dataTransfer.items.add(new File([text], "squares.geojson"));
                drop.dispatchEvent(new DragEvent("drop", {dataTransfer, bubbles: true, cancelable: true}));
            }""",
            path.read_text(encoding="utf-8"),
        )
    page.until("document.querySelectorAll('.panel td').length > 5")
    rows = page.page.locator(".panel > div:last-child tbody tr").all_inner_texts()
    assert [row.split()[1] for row in rows] == ["north", "south"]
    # Mercator's map enlarges areas by about 1 / cos(latitude)^2.
    assert float(rows[0].split("\t")[1].removesuffix(" %")) == pytest.approx(
        100 / math.cos(math.radians(61.0)) ** 2 - 100, rel=0.03
    )
    before = page.picture()
    page.page.get_by_role("button", name="Show feature").first.click()
    assert page.picture() != before


def test_data_that_are_none_are_said(live: Opener, tmp_path: Path) -> None:
    page = live("mercator")
    path = tmp_path / "x.geojson"
    path.write_text("no", encoding="utf-8")
    page.page.locator("#file").set_input_files(path)
    page.until("document.querySelector('.panel > div:last-child').textContent.includes('nvalid')")


# ---- maps -----------------------------------------------------------------------------------


def test_maps_are_added_doubled_and_removed(live: Opener) -> None:
    """Six at most, one at least."""
    page = live("robinson", region=GERMANY)
    press(page, "Add a map")
    page.card().get_by_text("Improve").click()
    press(page, "Duplicate")
    page.rest()
    for _ in range(3):
        press(page, "Add a map")
    page.rest()
    assert page.page.locator(".card").count() == 6
    press(page, "Add a map")
    assert "At most 6" in page.page.locator("#status").inner_text()
    assert page.page.locator(".card").count() == 6
    for left in (5, 4, 3, 2, 1, 1):
        if not page.card().get_by_text("Remove").is_visible():
            page.card().get_by_text("Improve").click()
        page.card().get_by_text("Remove").click()
        assert page.page.locator(".card").count() == left
    assert "One map stays" in page.page.locator("#status").inner_text()
    page.rest()


def test_maps_are_corrected_and_designed_beside(live: Opener) -> None:
    page = live("mercator", region=GERMANY)
    page.card().get_by_text("Improve").click()
    press(page, "Correct linearly")
    page.until("document.querySelectorAll('.card').length === 2")
    page.rest()
    assert re.search(r"error is 0\.0\d+, before 0\.\d+", page.said(1))
    texts = page.page.locator(".figures").all_inner_texts()
    before, after = (float(text.partition("DE): ")[2].partition(";")[0]) for text in texts)
    assert after < 0.2 * before
    press(page, "Design, conformal")
    page.until("document.querySelectorAll('.card').length === 3", 120.0)
    page.rest()
    assert "Degree" in page.said(1)


# ---- what leaves the page -------------------------------------------------------------------


def test_texts_are_copied(live: Opener) -> None:
    page = live("robinson", region=GERMANY, permissions=["clipboard-read", "clipboard-write"])
    page.card().get_by_text("Copy and save").click()
    for name, start in (
        ("Command", "projdist heatmap"),
        ("PROJ", "+proj=robin"),
        ("WKT2", "PROJCRS["),
        ("PROJJSON", "{"),
    ):
        page.page.get_by_role("button", name=f"Copy {name}", exact=True).click()
        page.until("[...document.querySelectorAll('.copied button')].some((one) => one.textContent === 'Copied')")
        assert page.page.evaluate("navigator.clipboard.readText()").startswith(start)
        page.until("![...document.querySelectorAll('.copied button')].some((one) => one.textContent === 'Copied')")
    page.map().focus()
    page.page.keyboard.press("Alt+ArrowRight")
    page.rest()
    page.until("[...document.querySelectorAll('.copied pre')].some((one) => one.textContent.includes('+lon_0=5'))")


@pytest.mark.parametrize(
    ("button", "start"),
    [
        ("Save what is seen", b"\x89PNG"),
        ("Save PNG", b"\x89PNG"),
        ("Save SVG", b"<?xml"),
        ("Save PDF", b"%PDF"),
        ("Save HTML", b"<!DOCTYPE html>"),
    ],
)
def test_files_are_saved(button: str, start: bytes, live: Opener) -> None:
    page = live("robinson", region=GERMANY, accept_downloads=True)
    page.card().get_by_text("Copy and save").click()
    with page.page.expect_download() as download:
        press(page, button)
    assert Path(download.value.path()).read_bytes().startswith(start)


# ---- the page itself ------------------------------------------------------------------------


def test_the_address_restores_the_view(live: Opener) -> None:
    page = live("mollweide", "EPSG:3035", region=GERMANY, more="&measure=areal_scale&ellipses=1&isolines=0&spacing=80")
    page.map().focus()
    page.page.keyboard.press("Alt+ArrowRight")
    view = page.settled()
    page.page.reload()
    assert page.settled() == view
    assert page.page.locator("#region").input_value() == GERMANY
    assert page.page.locator("#measure").input_value() == "areal_scale"
    assert page.page.get_by_label("Indicatrices").is_checked()
    assert not page.page.get_by_label("Isolines").is_checked()
    assert page.page.locator("#spacing").input_value() == "80"
    assert page.page.locator(".name input").nth(1).input_value() == "EPSG:3035"


SERVER = """
import sys
from projdist import web
start = web.Start(projections=("robinson",), region="country:DE", measure="fisher")
site = web.Site(start, web.Doors(), token=sys.argv[2])
listening = web.open_socket(int(sys.argv[1]))
print(site.url(listening.getsockname()[1]), flush=True)
web.serve(site, listening)
"""


def test_the_page_goes_on_when_the_server_comes_back(browser: Any) -> None:
    """With what was done before; with another token it says so, and the maps stay."""

    def started(port: str, token: str) -> subprocess.Popen[str]:
        return subprocess.Popen([sys.executable, "-c", SERVER, port, token], stdout=subprocess.PIPE, text=True)

    context = browser.new_context()
    page = Live(context.new_page())
    with started("0", "x") as server:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        page.page.goto(address)
        page.rest().map().focus()
        page.page.keyboard.press("Alt+ArrowRight")
        page.rest()
        server.terminate()
    page.until("document.getElementById('status').textContent.includes('does not answer')")
    port = str(urlsplit(address).port)
    with started(port, "x") as server:
        page.until("document.getElementById('status').textContent === ''")
        page.page.keyboard.press("Alt+ArrowRight")
        page.rest()
        assert page.page.locator("[data-name=lon_0]").nth(1).input_value() == "10"
        server.terminate()
    with started(port, "y") as server:
        page.until("document.getElementById('status').textContent.startsWith('Another server')")
        assert page.page.locator(".card").count() == 1
        server.terminate()
    context.close()


def test_two_pages_do_not_know_of_each_other(live: Opener) -> None:
    one, other = live("robinson", region=GERMANY), live("mollweide", region="country:FR")
    for page in (one, other):
        page.map().focus()
        page.page.keyboard.press("Alt+ArrowRight")
    for page, name in ((one, "robinson"), (other, "mollweide")):
        definition = page.settled()["map"][0]
        assert definition.startswith(name)
        page.page.mouse.move(*page.place(0.5, 0.5))
        check_told(definition, page.told())


SCREENS: list[dict[str, Any]] = [
    {},
    {"color_scheme": "dark"},
    {"viewport": {"width": 390, "height": 800}},
    {"forced_colors": "active"},
    {"reduced_motion": "reduce"},
]


@pytest.mark.parametrize("screen", SCREENS, ids=str)
def test_the_page_is_accessible(screen: dict[str, Any], live: Opener, axe: Callable[[Any], list[str]]) -> None:
    """With all panels open; every control has its turn with Tab, and is seen to; nothing is wider than the screen."""
    page = live("robinson", "EPSG:3035", region="country:LU", **screen)
    press(page, "Find the best CRSs")
    page.until("document.querySelectorAll('.best tbody tr').length > 0", 120.0)
    page.page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.until("document.querySelectorAll('.copied').length >= 6")
    assert axe(page.page) == []
    assert page.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    controls = page.page.evaluate(
        "[...document.querySelectorAll('button, input, select, summary, canvas.map, pre, circle[role=button]')]"
        ".filter((one) => one.checkVisibility() && !one.disabled).length"
    )
    page.page.locator("h1").click()
    reached = set()
    for _ in range(controls + 30):
        page.page.keyboard.press("Tab")
        found = page.page.evaluate(
            """(() => {
                const one = document.activeElement, all = [...document.querySelectorAll("*")];
                const { outlineStyle, outlineWidth } = getComputedStyle(one);
                return [all.indexOf(one), one.tagName, outlineStyle !== "none" && parseFloat(outlineWidth) >= 1];
            })()"""
        )
        if found[1] == "BODY":
            break
        assert found[2], found
        reached.add(found[0])
    assert len(reached) >= controls


def test_nothing_is_said_while_the_mouse_moves(live: Opener) -> None:
    """No live region changes with the pointer: a screen reader would not stop talking."""
    page = live("robinson")
    page.page.evaluate(
        """() => {
            window.changes = 0;
            const watched = {childList: true, characterData: true, subtree: true};
            for (const one of document.querySelectorAll("[aria-live], [role=status]")) {
                new MutationObserver(() => window.changes++).observe(one, watched);
            }
        }"""
    )
    for k in range(30):
        page.page.mouse.move(*page.place(0.3 + 0.01 * k, 0.5))
    time.sleep(0.5)
    assert page.told() != ""
    assert page.page.evaluate("changes") == 0


def test_what_is_printed_is_the_maps(live: Opener) -> None:
    page = live("robinson", color_scheme="dark")
    page.page.emulate_media(media="print")
    assert not page.page.locator(".name").first.is_visible()
    assert not page.page.locator("header button").first.is_visible()
    assert page.map().is_visible()
    assert page.page.locator(".figures").is_visible()
    colour = page.page.evaluate("getComputedStyle(document.querySelector('.projdist-explore')).backgroundColor")
    assert np.mean([int(part) for part in re.findall(r"\d+", colour)[:3]]) == 255
