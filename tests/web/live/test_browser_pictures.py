"""The live page in a browser: pictures, what is told where one points, and maps that are dragged."""

import re
import time
from typing import Any

import pytest
from browser_pages import GERMANY, SETTLED, Opener, check_told, read, truth

pytestmark = pytest.mark.slow


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
    shown = {"measure": ["areal_scale"], "ellipses": ["1"], "isolines": ["0"], "spacing": ["120"]}
    assert page.settled().items() >= shown.items()


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
    page = live("EPSG:3035", region=region)
    other = live("EPSG:3035", region=region, more="&measure=areal_scale", **narrow)
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
    "oblique": ("mollweide@45,-100", "robinson@30,60", "+proj=omerc +lat_0=40 +alpha=30 +lonc=10", "EPSG:3078",
                "EPSG:3375", "+proj=ob_tran +o_proj=eck4 +o_lat_p=30 +R=6371000"),
    "azimuthal": ("+proj=laea +lat_0=50", "+proj=aeqd +lat_0=40", "gnomonic@40,20", "+proj=ortho +lat_0=-30",
                  "EPSG:3413"),
    "conic": ("+proj=lcc +lat_1=30 +lat_2=60", "+proj=aea +lat_1=20 +lat_2=50", "+proj=bonne +lat_1=45", "+proj=poly",
              "EPSG:2154"),
    "transverse": ("+proj=tmerc", "+proj=tcc", "EPSG:32632", "EPSG:27700", "EPSG:2193", "IAU_2015:49910"),
}  # fmt: skip


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


@pytest.mark.parametrize(("maps", "region"), [
    (("robinson", "+proj=laea +lat_0=30 +lon_0=20"), "globe"), (("EPSG:3857", "EPSG:25832"), GERMANY),
], ids=str)  # fmt: skip
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
    assert (0.0 < lon < 10.0, abs(lat) < 1.0) == (True, True)
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


def test_dragging_turns_a_map(live: Opener) -> None:
    """By longitude, and where the map has one by latitude, with the hand; the figures are those of the new one."""
    page = live("+proj=ortho +lat_0=50 +lon_0=10")
    page.drag((0.5, 0.5), (0.45, 0.55))
    definition = page.settled()["map"][0]
    parameters = dict(re.findall(r"\+(\w+)=([^ ]+)", definition))
    assert parameters["proj"] == "ortho"
    assert (float(parameters["lon_0"]) > 11.0, float(parameters["lat_0"]) > 51.0) == (True, True)
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
    shown, number = page.settled()["map"], page.page.locator("[data-name=lon_0]").nth(1)
    assert shown == ["+proj=robin +lon_0=0"] or number.input_value() == "0"


def test_alt_and_arrows_turn(live: Opener) -> None:
    page = live("+proj=laea +lat_0=50 +lon_0=10")
    page.map().focus()
    page.page.keyboard.press("Alt+ArrowRight")
    page.page.keyboard.press("Alt+ArrowUp")
    page.rest()
    values = [page.page.locator(f"[data-name={name}]").nth(1).input_value() for name in ("lon_0", "lat_0")]
    assert values == ["15", "55"]
