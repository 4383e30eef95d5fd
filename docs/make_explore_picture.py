"""Draw docs/images/explore.png: the live page in Chromium, which must be on the PATH, by playwright."""

import shutil
import socket
import threading
from io import BytesIO
from pathlib import Path

import uvicorn
from PIL import Image
from playwright.sync_api import Page, sync_playwright

from projdist.web import Doors, Site, Start, open_socket

PATH = Path(__file__).parent / "images" / "explore.png"
MAPS = ("winkel-tripel", "mollweide@35,-30")
COLOURS = 256


def draw(page: Page) -> bytes:
    """The page with two maps at rest, the pointer over the first."""
    cards = page.locator(".card[aria-busy=false]")
    while cards.count() < len(MAPS) or page.get_by_text("each ±").count() < len(MAPS):
        page.wait_for_timeout(200)
    box = page.locator("canvas.map").first.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.56 * box["width"], box["y"] + 0.33 * box["height"])
    page.wait_for_timeout(300)
    return page.screenshot(clip={"x": 0, "y": 0, "width": 1280, "height": 860})


def main() -> None:
    """Serve the page, look at it, and end."""
    listening: socket.socket = open_socket()
    port = listening.getsockname()[1]
    site = Site(Start(projections=MAPS, region="globe", measure="fisher"), Doors())
    server = uvicorn.Server(uvicorn.Config(site.app(port), ws="websockets-sansio", lifespan="off", log_level="error"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 860})
            page.goto(site.url(port))
            picture = draw(page)
            browser.close()
    finally:
        server.should_exit = True
        thread.join()
        site.close()
    Image.open(BytesIO(picture)).convert("RGB").quantize(COLOURS).save(PATH, optimize=True)


if __name__ == "__main__":
    main()
