"""The explorer of notebooks in a browser: with a model of a notebook, and in marimo, which no extra brings."""

import base64
import importlib.util
import json
import os
import queue
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import projdist

pytest.importorskip("anywidget")

pytestmark = pytest.mark.slow

MODEL = Path(__file__).with_name("model.js").read_text(encoding="utf-8")


class Notebook:
    """A widget and its page."""

    def __init__(self, widget: Any, open_page: Callable[..., Any], path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.widget, self.replies = widget, queue.Queue[tuple[Any, bytes]]()
        monkeypatch.setattr(widget, "send", lambda content, buffers: self.replies.put((content["view"], buffers[0])))
        monkeypatch.setattr(widget, "send_state", self._put)
        state = json.dumps({name: getattr(widget, name) for name in ("projections", "region", "measure", "_words")})
        script = widget._esm.replace("export default { render };", MODEL.replace("STATE", state))
        path.write_text(
            '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>A notebook</title></head><body '
            f'data-jp-theme-light="false"><div id="cell"></div><script type="module">{script}</script></body></html>',
            encoding="utf-8",
        )
        self.states: list[tuple[str, Any]] = []
        self.page = open_page(path.as_uri())

    def _put(self, key: str) -> None:
        self.states.append((key, getattr(self.widget, key)))

    def until(self, reached: Callable[[], bool]) -> None:
        """Carry messages until something is so."""
        end = time.monotonic() + 60.0
        while not reached():
            assert time.monotonic() < end, self.page.locator(".projdist-explore").inner_text()
            for message in self.page.evaluate("window.taken()"):
                if "state" in message:
                    self.widget.set_state(message["state"])
                else:
                    self.widget._handle_custom_msg(message["content"], [])
            while self.states:
                self.page.evaluate("([name, value]) => window.put(name, value)", list(self.states.pop(0)))
            while not self.replies.empty():
                view, block = self.replies.get()
                content = [view, base64.b64encode(block).decode("ascii")]
                self.page.evaluate("([view, text]) => window.deliver(view, text)", content)
            self.page.wait_for_timeout(20)


@pytest.fixture
def notebook(open_page: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Notebook]:
    """One with Robinson's map."""
    widget = projdist.Explorer("robinson")
    yield Notebook(widget, open_page, tmp_path / "notebook.html", monkeypatch)
    widget.close()


def drag(page: Any, canvas: Any, down: float) -> None:
    """Draw a map by its middle to the right and down, and hold it."""
    box = canvas.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y + down, steps=4)


def test_what_is_dragged_is_set_and_what_is_set_is_shown(notebook: Notebook, axe: Callable[[Any], list[str]]) -> None:
    """With the figures of `sample`; in the colours of the notebook, without keys for it, and with an end."""
    page, widget = notebook.page, notebook.widget
    figures, title, canvas = (page.locator(f".card {name}").first for name in (".figures", "h2", "canvas.map"))
    notebook.until(lambda: "each ±" in figures.inner_text())
    error = projdist.sample("robinson", "globe").airy_kavrayskiy.raw
    assert f"over the globe: {error:.3f}" in figures.inner_text()
    colour = page.locator(".projdist-explore").evaluate("(node) => getComputedStyle(node).backgroundColor")
    assert (colour, axe(page)) == ("rgb(20, 24, 29)", [])
    drag(page, canvas, 0)
    notebook.until(lambda: "(a preview)" in figures.inner_text())
    page.mouse.up()
    notebook.until(lambda: widget.projection != "robinson")
    assert widget.maps[0](*projdist.projections.tunable(widget.projection).centre) == pytest.approx((0, 0), abs=1e-6)
    widget.projections = ["EPSG:3035", "mollweide"]
    widget.region, widget.measure = "country:DE", "omega"
    notebook.until(lambda: page.locator(".card").count() == 2 and "over Germany" in figures.inner_text())
    assert "EPSG:3035" in title.inner_text()
    assert page.locator("#measure").input_value() == "angular_distortion"
    page.evaluate("window.keys = 0; document.addEventListener('keydown', () => window.keys++)")
    page.locator(".card input").first.press("d")
    assert page.evaluate("window.keys") == 0
    page.evaluate("window.leave()")
    assert page.evaluate("window.taken()")[-1]["content"]["closed"] is True


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


@pytest.mark.skipif(importlib.util.find_spec("marimo") is None, reason="needs marimo")
def test_what_is_dragged_is_in_python_and_what_python_sets_is_shown(page: Any) -> None:
    """Cells that name the widget run again when the map rests; no picture is drawn for the notebook's file."""
    figures, box = page.locator(".card .figures").first, page.locator(".card input").first
    page.get_by_text("Python has robinson over country:DE, with 0 pictures.").wait_for()
    figures.get_by_text("each ±").wait_for()
    error = projdist.sample("robinson", "country:DE").airy_kavrayskiy.raw
    assert f"over Germany (DE): {error:.6f}" in figures.inner_text()
    drag(page, page.locator(".card canvas.map").first, 20)
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
