"""The live page in a browser: what is told where one points, and maps that are dragged."""

import re

import pytest
from browser_pages import GERMANY, Opener, check_told, read, truth

pytestmark = pytest.mark.slow


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
