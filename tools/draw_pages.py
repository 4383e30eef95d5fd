"""Draw docs/images/explore.png and report.png: the live page and a report in Chromium, which must be on the PATH.

`python tools/draw_pages.py [explore] [report]`; both if none is named.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import uvicorn
from docs_files import IMAGES
from PIL import Image
from playwright.sync_api import Page, sync_playwright

from projdist.cli import main as projdist
from projdist.web import InputPolicy, LiveSite, Start, open_socket

MAPS = ("winkel-tripel", "mollweide@35,-30")
EXPLORE_SIZE = 1280, 860
REPORT = ["compare", "winkel-tripel", "mollweide", "robinson"]
REPORT_SIZE = 1280, 1296


@contextlib.contextmanager
def opened(url: str, size: tuple[int, int]) -> Iterator[Page]:
    """A page in a window of a size."""
    chromium = shutil.which("chromium")
    if chromium is None:
        raise SystemExit("No page is drawn: there is no chromium on the PATH.")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        page.goto(url)
        yield page
        browser.close()


def point_at_first_map(page: Page) -> None:
    """The pointer over the first map."""
    box = page.locator("canvas.map").first.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.56 * box["width"], box["y"] + 0.33 * box["height"])


def draw_explore() -> None:
    """The live page with two maps at rest."""
    listening = open_socket()
    port = listening.getsockname()[1]
    site = LiveSite(Start(projections=MAPS, region="globe", measure="fisher"), InputPolicy())
    server = uvicorn.Server(uvicorn.Config(site.app(port), ws="websockets-sansio", lifespan="off", log_level="error"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    try:
        with opened(site.url(port), EXPLORE_SIZE) as page:
            cards = page.locator(".card[aria-busy=false]")
            while cards.count() < len(MAPS) or page.get_by_text("each ±").count() < len(MAPS):
                page.wait_for_timeout(200)
            point_at_first_map(page)
            page.wait_for_timeout(300)
            picture = page.screenshot(clip={"x": 0, "y": 0, "width": EXPLORE_SIZE[0], "height": EXPLORE_SIZE[1]})
    finally:
        server.should_exit = True
        thread.join()
        site.close()
    Image.open(BytesIO(picture)).convert("RGB").quantize(256).save(IMAGES / "explore.png", optimize=True)


def draw_report() -> None:
    """A page that `projdist compare` has written."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.html"
        sys.argv = ["projdist", *REPORT, "-o", str(report)]
        with contextlib.suppress(SystemExit):
            projdist()
        with opened(report.as_uri(), REPORT_SIZE) as page:
            page.wait_for_selector("html[data-ready]")
            point_at_first_map(page)
            picture = page.screenshot()
    seen = Image.open(BytesIO(picture)).convert("RGB")
    # With dithering, or the colour bar has bands.
    seen.quantize(palette=seen.quantize()).save(IMAGES / "report.png", optimize=True)


PICTURES: dict[str, Callable[[], None]] = {"explore": draw_explore, "report": draw_report}

if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()
