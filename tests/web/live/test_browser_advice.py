"""The live page in a browser: the best maps are found, and data are checked."""

import json
import math
import time
from pathlib import Path

import pytest
from browser_pages import Opener, press

import projdist

pytestmark = pytest.mark.slow


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
