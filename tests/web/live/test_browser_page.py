"""The live page in a browser: its address, its server, its screens, and who hears or prints it."""

import re
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from browser_pages import GERMANY, SETTLED, Live, Opener, check_told, press

pytestmark = pytest.mark.slow


def test_the_address_restores_the_view(live: Opener) -> None:
    page = live("mollweide", "EPSG:3035", region=GERMANY, more="&measure=areal_scale&ellipses=1&isolines=0&spacing=80")
    page.map().focus()
    page.page.keyboard.press("Alt+ArrowRight")
    view = page.settled()
    page.page.reload()
    assert page.settled() == view
    for name, value in (("region", GERMANY), ("measure", "areal_scale"), ("spacing", "80")):
        assert page.page.locator(f"#{name}").input_value() == value
    assert page.page.get_by_label("Indicatrices").is_checked()
    assert not page.page.get_by_label("Isolines").is_checked()
    assert page.page.locator(".name input").nth(1).input_value() == "EPSG:3035"


SERVER = """
import sys
from projdist import web
start = web.Start(projections=("robinson",), region="country:DE", measure="fisher")
site = web.LiveSite(start, web.InputPolicy(), token=sys.argv[2])
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


CONTROLS = """[...document.querySelectorAll('button, input, select, summary, canvas.map, pre, circle[role=button]')]
    .filter((one) => one.checkVisibility() && !one.disabled).length"""
FOCUSED = """(() => {
    const one = document.activeElement, all = [...document.querySelectorAll("*")];
    const { outlineStyle, outlineWidth } = getComputedStyle(one);
    return [all.indexOf(one), one.tagName, outlineStyle !== "none" && parseFloat(outlineWidth) >= 1];
})()"""
USUAL: Any = {"color_scheme": "light", "forced_colors": "none", "reduced_motion": "no-preference"}
OTHERS = {"color_scheme": "dark"}, {"forced_colors": "active"}, {"reduced_motion": "reduce"}


@pytest.mark.parametrize(("width", "screens"), [(1200, ({}, *OTHERS)), (390, ({},))], ids=str)
def test_the_page_is_accessible(
    width: int, screens: tuple[dict[str, str], ...], live: Opener, axe: Callable[[Any], list[str]]
) -> None:
    """With all panels open; every control has its turn with Tab, and is seen to; nothing is wider than the screen."""
    page = live("robinson", "EPSG:3035", region="country:LU", viewport={"width": width, "height": 800}, **USUAL)
    press(page, "Find the best CRSs")
    page.until("document.querySelectorAll('.best tbody tr').length > 0", 120.0)
    page.page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.until("document.querySelectorAll('.copied').length >= 6")
    for screen in screens:
        page.page.emulate_media(**USUAL | screen)
        page.rest()
        time.sleep(SETTLED)
        assert axe(page.page) == []
        assert page.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        controls = page.page.evaluate(CONTROLS)
        page.page.locator("h1").click()
        reached = set()
        for _ in range(controls + 30):
            page.page.keyboard.press("Tab")
            number, name, is_seen = page.page.evaluate(FOCUSED)
            if name == "BODY":
                break
            assert is_seen, (number, name, screen)
            reached.add(number)
        assert len(reached) >= controls
    page.page.set_viewport_size({"width": 390, "height": 800})
    page.until("document.documentElement.scrollWidth <= innerWidth")


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
    for name, is_printed in ((".name", False), ("header button", False), ("canvas.map", True), (".figures", True)):
        assert page.page.locator(name).first.is_visible() is is_printed
    colour = page.page.evaluate("getComputedStyle(document.querySelector('.projdist-explore')).backgroundColor")
    assert np.mean([int(part) for part in re.findall(r"\d+", colour)[:3]]) == 255
