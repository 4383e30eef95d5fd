"""The live page in a browser: measures, isolines and ellipses, and forty maps that are seen."""

import time
from typing import Any

import pytest
from browser_pages import GERMANY, SETTLED, Opener

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
