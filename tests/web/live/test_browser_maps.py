"""The live page in a browser: maps are added, removed and improved, and leave it as texts and files."""

import re
from pathlib import Path

import pytest
from browser_pages import GERMANY, Opener, press

pytestmark = pytest.mark.slow


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
