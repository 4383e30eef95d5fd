"""The explorer in marimo: an app that it serves, in a browser. Skipped where marimo is not, which no extra brings."""

import importlib.util
import os
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import projdist

pytest.importorskip("anywidget")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(importlib.util.find_spec("marimo") is None, reason="needs marimo"),
]

APP = """
import marimo

app = marimo.App()

@app.cell
def _():
    import marimo
    import projdist
    from projdist.web.live.widget import Explorer
    return Explorer, marimo, projdist

@app.cell
def _(Explorer, marimo, projdist):
    pictures = []
    Explorer._picture = lambda self: pictures.append(self) or ""
    explorer = marimo.ui.anywidget(projdist.Explorer("robinson", region="country:DE"))
    explorer
    return explorer, pictures

@app.cell
def _(explorer, marimo, pictures):
    marimo.md(f"Python has {explorer.projection} over {explorer.place.name}, with {len(pictures)} pictures.")

@app.cell
def _(marimo):
    button = marimo.ui.run_button(label="Set by Python")
    button
    return button,

@app.cell
def _(button, explorer):
    if button.value:
        explorer.region = "country:IT"
        explorer.projections = ["EPSG:3035", lambda lon, lat: (1e5 * lon, 1e5 * lat)]
"""
PATIENCE = 60.0  # seconds


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """Of the app, while it is served."""
    (tmp_path / "app.py").write_text(APP, encoding="utf-8")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    served = f"--headless --no-token --host 127.0.0.1 --port {port}".split()
    own = os.environ | {"XDG_CONFIG_HOME": str(tmp_path)}
    with (tmp_path / "said.txt").open("w", encoding="utf-8") as said:
        command = [sys.executable, "-m", "marimo", "run", "app.py", *served]
        process = subprocess.Popen(command, cwd=tmp_path, env=own, stdout=said, stderr=subprocess.STDOUT)
    try:
        end = time.monotonic() + PATIENCE
        while not answers(f"http://127.0.0.1:{port}/health"):
            ended = process.poll() is not None or time.monotonic() > end
            assert not ended, (tmp_path / "said.txt").read_text(encoding="utf-8")
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}/"
    finally:
        process.terminate()
        process.wait(PATIENCE)


def answers(url: str) -> bool:
    try:
        with urllib.request.urlopen(url, timeout=5):
            return True
    except urllib.error.URLError:
        return False


@pytest.fixture
def page(browser: Any, address: str) -> Iterator[Any]:
    """The app's page, which says no errors but one of marimo 0.15 about its own service worker."""
    opened, said = browser.new_page(), []
    opened.set_default_timeout(1000.0 * PATIENCE)
    opened.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.goto(address)
    yield opened
    opened.close()
    assert [text for text in said if "service worker" not in text] == []


def test_what_is_dragged_is_in_python_and_what_python_sets_is_shown(page: Any) -> None:
    """Cells that name the widget run again when the map rests; no picture is drawn for the notebook's file."""
    figures, box = page.locator(".card .figures").first, page.locator(".card input").first
    page.get_by_text("Python has robinson over country:DE, with 0 pictures.").wait_for()
    figures.get_by_text("each ±").wait_for()
    error = projdist.sample("robinson", "country:DE").airy_kavrayskiy.raw
    assert f"over Germany (DE): {error:.6f}" in figures.inner_text()

    place = page.locator(".card canvas.map").first.bounding_box()
    middle = place["x"] + place["width"] / 2, place["y"] + place["height"] / 2
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 80, middle[1] + 20, steps=4)
    figures.get_by_text("(a preview)").wait_for()
    page.mouse.up()
    page.get_by_text(re.compile("Python has robinson@.* over country:DE")).wait_for()
    assert page.get_by_text(f"Python has {box.input_value()} over country:DE").is_visible()

    # Keys that mean something in marimo are no commands while they are typed.
    box.fill("")
    box.press_sequentially("mollweide")
    box.press("Enter")
    page.get_by_text("Python has mollweide over country:DE, with 0 pictures.").wait_for()

    page.get_by_role("button", name="Set by Python").click()
    for k in range(2):
        page.locator(".card .figures").nth(k).get_by_text("over Italy").wait_for()
    assert "EPSG:3035" in page.locator(".card h2").first.inner_text()
