"""The live page in a browser: parameters that are set, projections that are typed, regions that are drawn."""

import json
import time

import pytest
from browser_pages import GERMANY, Opener, check_told, press

pytestmark = pytest.mark.slow


NUMBERS = {
    "+proj=lcc +lat_1=30 +lat_2=60": ("lat_1", "44"), "+proj=omerc +lonc=10 +lat_0=50 +alpha=30": ("alpha", "60"),
    "+proj=nsper +h=5000000": ("h", "9000000"), "+proj=natearth2": ("lon_0", "25"),
}  # fmt: skip


def test_number_boxes_set_parameters(live: Opener) -> None:
    page = live(*NUMBERS, region=GERMANY)
    for number, (name, value) in enumerate(NUMBERS.values()):
        page.card(number).locator(f"input[type=number][data-name={name}]").fill(value)
    maps = page.settled()["map"]
    for number, (name, value) in enumerate(NUMBERS.values()):
        assert f"+{name}={value}" in maps[number]
        assert page.card(number).locator(f"input[type=range][data-name={name}]").input_value() == value
        page.map(number).hover()
        check_told(maps[number], page.told(number))


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


WKT = 'PROJCRS["x",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]]],'
WKT += 'CONVERSION["y",METHOD["Mercator (variant A)"],PARAMETER["Longitude of natural origin",0],'
WKT += 'PARAMETER["Scale factor at natural origin",1]],CS[Cartesian,2],AXIS["e",east],AXIS["n",north],'
WKT += 'LENGTHUNIT["metre",1]]'


def test_projections_are_typed(live: Opener) -> None:
    page = live("robinson", region="country:FR")
    heading = page.page.locator(".card h2")
    for typed, shown in (
        ("mollweide", "Mollweide"), ("EPSG:2154", "EPSG:2154"), ("+proj=lcc +lat_1=44 +lat_2=49 +lon_0=3", "Lambert"),
        ("  +proj=eqc   +lat_ts=40 ", "qui"), (WKT, "x"),
    ):  # fmt: skip
        before, title = page.picture(), heading.inner_text()
        page.write(".name input", typed)
        page.until(f"document.querySelector('.card h2').textContent !== {title!r}")
        page.rest()
        assert shown in heading.inner_text()
        assert page.picture() != before
        assert page.said() == ""


def test_a_wrong_projection_is_said_at_its_map(live: Opener) -> None:
    """The picture before stays, with its own figures, in the address, too, and can be dragged on."""
    page, shown = live("robinson", "mollweide", region=GERMANY), "robinson"
    name = page.page.locator(".name input").first
    for typed in (
        "robinsn", "EPSG:1", "+proj=nix", "+proj=lcc, +lat_1=4,", "file.prj", "+proj=hgridshift +grids=/etc/passwd",
    ):  # fmt: skip
        before = page.picture()
        page.write(".name input", typed)
        page.until("document.querySelector('.card .said').textContent !== ''")
        assert "nvalid" in page.said()
        assert page.said(1) == ""
        assert (name.get_attribute("aria-invalid"), name.input_value(), page.picture()) == ("true", typed, before)
        page.page.mouse.move(*page.place(0.5, 0.5))
        check_told(shown, page.told())
        page.map().focus()
        page.page.keyboard.press("Alt+ArrowRight")
        shown = page.settled()["map"][0]
        assert "robin" in shown
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


def test_a_wrong_region_is_said_beside_it(live: Opener) -> None:
    page = live("robinson", region=GERMANY)
    before, said, status = page.picture(), "", page.page.locator("#status")
    for typed in ("country:Atlantis", "box:1,2", "file:/etc/passwd", "nowhere"):
        page.write("#region", typed)
        page.until(f"!['', {json.dumps(said)}].includes(document.getElementById('status').textContent)")
        said = status.inner_text()
        assert "nvalid" in said
        assert page.page.locator("#region").get_attribute("aria-invalid") is not None
        assert page.picture() == before
        assert page.settled()["region"] == [GERMANY]
    page.write("#region", GERMANY)  # the one that is shown
    page.until("document.getElementById('status').textContent === ''")
    assert page.page.locator("#region").get_attribute("aria-invalid") is None


def test_a_box_is_drawn(live: Opener) -> None:
    page = live("+proj=eqc")
    press(page, "Draw a box")
    page.drag((0.5, 0.5), (0.6, 0.4))
    page.until("document.getElementById('region').value.startsWith('box:')")
    west, south, east, north = map(float, page.page.locator("#region").input_value()[4:].split(","))
    assert (west, south) == pytest.approx((0.0, 0.0), abs=1.0)
    assert (east > 10.0, north > 5.0) == (True, True)
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
    assert (abs(lat) < 1.0, 0.0 < lon < 10.0, km > 1000.0) == (True, True, True)
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
