"""Draw docs/images/report.png: a page that `projdist compare` has written, in Chromium, which must be on the PATH."""

import contextlib
import shutil
import sys
import tempfile
from io import BytesIO
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from projdist.cli import main as projdist

PATH = Path(__file__).parent / "images" / "report.png"
WORDS = ["compare", "winkel-tripel", "mollweide", "robinson"]
SIZE = {"width": 1280, "height": 1296}


def draw(page: Page) -> bytes:
    """The page with the pointer over its first map."""
    page.wait_for_selector("html[data-ready]")
    box = page.locator("canvas.map").first.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.56 * box["width"], box["y"] + 0.33 * box["height"])
    return page.screenshot()


def main() -> None:
    """Write the page, and look at it."""
    chromium = shutil.which("chromium")
    if chromium is None:
        raise SystemExit("No picture of a report is drawn: there is no chromium on the PATH.")
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.html"
        sys.argv = ["projdist", *WORDS, "-o", str(report)]
        with contextlib.suppress(SystemExit):
            projdist()
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            page = browser.new_page(viewport=SIZE)
            page.goto(report.as_uri())
            picture = draw(page)
            browser.close()
    seen = Image.open(BytesIO(picture)).convert("RGB")
    seen.quantize(palette=seen.quantize()).save(PATH, optimize=True)  # with dithering, or the colour bar has bands


if __name__ == "__main__":
    main()
