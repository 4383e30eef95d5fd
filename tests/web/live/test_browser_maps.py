"""The live page in a browser: maps are added, improved, found, checked and saved."""

import json
import math
import re
import time
from pathlib import Path

import pytest
import shapely
from browser_pages import GERMANY, Opener, press

import projdist

pytestmark = pytest.mark.slow


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
    assert "at most 6 maps" in page.page.locator("#status").inner_text()
    assert page.page.locator(".card").count() == 6
    for left in (5, 4, 3, 2, 1, 1):
        if not page.card().get_by_text("Remove").is_visible():
            page.card().get_by_text("Improve").click()
        page.card().get_by_text("Remove").click()
        assert page.page.locator(".card").count() == left
    assert "One map must stay" in page.page.locator("#status").inner_text()
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


def test_texts_are_copied(live: Opener) -> None:
    page = live("robinson", region=GERMANY, permissions=["clipboard-read", "clipboard-write"])
    page.card().get_by_text("Copy and save").click()
    starts = {"Command": "projdist heatmap", "PROJ": "+proj=robin", "WKT2": "PROJCRS[", "PROJJSON": "{"}
    for name, start in starts.items():
        page.page.get_by_role("button", name=f"Copy {name}", exact=True).click()
        page.until("[...document.querySelectorAll('.copied button')].some((one) => one.textContent === 'Copied')")
        assert page.page.evaluate("navigator.clipboard.readText()").startswith(start)
        page.until("![...document.querySelectorAll('.copied button')].some((one) => one.textContent === 'Copied')")
    page.map().focus()
    page.page.keyboard.press("Alt+ArrowRight")
    page.rest()
    page.until("[...document.querySelectorAll('.copied pre')].some((one) => one.textContent.includes('+lon_0=5'))")


def test_files_are_saved(live: Opener) -> None:
    page = live("robinson", region=GERMANY, accept_downloads=True)
    page.card().get_by_text("Copy and save").click()
    for button, start in (
        ("Save what is seen", b"\x89PNG"), ("Save PNG", b"\x89PNG"), ("Save SVG", b"<?xml"), ("Save PDF", b"%PDF"),
        ("Save HTML", b"<!DOCTYPE html>"),
    ):  # fmt: skip
        with page.page.expect_download() as download:
            press(page, button)
        assert Path(download.value.path()).read_bytes().startswith(start)


SQUARES = [
    {"type": "Feature", "properties": {"name": name}, "geometry": shapely.box(10, lat, 12, lat + 2).__geo_interface__}
    for name, lat in (("south", 0.0), ("north", 60.0))
]


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
    path.write_text(json.dumps({"type": "FeatureCollection", "features": SQUARES}), encoding="utf-8")
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
    larger = 100 / math.cos(math.radians(61.0)) ** 2 - 100
    assert float(rows[0].split("\t")[1].removesuffix(" %")) == pytest.approx(larger, rel=0.03)
    before = page.picture()
    page.page.get_by_role("button", name="Show feature").first.click()
    assert page.picture() != before


def test_data_that_are_none_are_said(live: Opener, tmp_path: Path) -> None:
    page = live("mercator")
    path = tmp_path / "x.geojson"
    path.write_text("no", encoding="utf-8")
    page.page.locator("#file").set_input_files(path)
    page.until("document.querySelector('.panel > div:last-child').textContent.includes('nvalid')")
