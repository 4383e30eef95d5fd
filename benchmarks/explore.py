"""The live page in headless Chromium: `python benchmarks/explore.py [PROJECTION...]`, as a Markdown table of medians.

It needs `projdist[explore]`, playwright and Chromium. Where other programs run on the machine, the times on the
processor tell more than those on the clock.
"""

import contextlib
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

from projdist.web.live.dispatcher import Dispatcher, Request

MAPS = ("robinson", "winkel-tripel", "EPSG:3035", "+proj=aeqd +lat_0=40", "goode-homolosine", "isea")
MOVES = 40
PAUSE = 0.05  # seconds between moves of the mouse
COLUMNS = ("mouse to picture", "page's CPU a move", "server's CPU a preview", "rest to exact picture", "measure change")
TIMES = 7  # of what is not a move
ARGUMENTS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader-webgl", "--enable-unsafe-swiftshader")

# Moves, and when the first picture of that move or of a later one is presented: after the next frame was made.
WATCH = """() => {
    const map = document.querySelector(".card"), moves = [], shown = [];
    window.watched = { moves, shown };
    addEventListener("pointermove", (event) => moves.push([Number(map.dataset.version), event.timeStamp]));
    new MutationObserver(() => {
        const version = Number(map.dataset.shown);
        requestAnimationFrame(() => setTimeout(() => shown.push([version, performance.now()])));
    }).observe(map, { attributeFilter: ["data-shown"] });
}"""
MEASURE = """(name) => new Promise((done) => {
    const menu = document.getElementById("measure"), start = performance.now();
    menu.value = name;
    menu.dispatchEvent(new Event("change"));
    requestAnimationFrame(() => setTimeout(() => done(performance.now() - start)));
})"""


@contextlib.contextmanager
def served(*words: str) -> Iterator[tuple[str, int]]:
    """The address of a page, and the number of the process that serves it."""
    command = [sys.executable, "-m", "projdist", "explore", "--no-browser", *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield process.stdout.readline().strip(), process.pid
    finally:
        process.terminate()
        process.wait(timeout=30)


@contextlib.contextmanager
def chromium() -> Iterator[Any]:
    """A browser without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = shutil.which("chromium") or shutil.which("google-chrome")
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()


def wait_for(page: Any, condition: str, seconds: float = 60.0) -> None:
    """Wait until a condition of the page holds; its policy forbids that it is evaluated there."""
    until = time.monotonic() + seconds
    while not page.evaluate(condition):
        if time.monotonic() > until:
            raise TimeoutError(condition)
        time.sleep(0.02)


AT_REST = """() => {
    const { dataset } = document.querySelector(".card");
    return Number(dataset.shown) === Number(dataset.version) + 0.5;
}"""


def drag(page: Any) -> tuple[list[float], list[float], float]:
    """Milliseconds from moves to pictures, from the last of them to the exact one, and on the processor for a move."""
    box = page.locator("canvas.map").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    before = script_seconds(session)
    page.evaluate(WATCH)
    for k in range(1, MOVES + 1):
        page.mouse.move(x + 4 * k, y)
        time.sleep(PAUSE)
    page.mouse.up()
    wait_for(page, AT_REST)
    spent = script_seconds(session) - before
    time.sleep(0.2)
    moves, shown = (page.evaluate(f"watched.{name}") for name in ("moves", "shown"))
    waits = [min(at for seen, at in shown if seen >= version) - moved for version, moved in moves]
    exact = [shown[-1][1] - moves[-1][1]]
    return waits, exact, 1000 * spent / MOVES


def script_seconds(session: Any) -> float:
    """Seconds on the processor that the page's process was at work."""
    metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
    return float(metrics["TaskDuration"])


def server_share(given: str) -> float:
    """Milliseconds on the processor that the server takes for a preview."""
    desk, times = Dispatcher(), []
    for k in range(MOVES):
        request = Request(id=k, kind="preview", projection=given, centre=(0.3 * k, 0.0), region="globe")
        start = time.process_time()
        desk.answer(request)
        times.append(time.process_time() - start)
    return 1000 * statistics.median(times[1:])


def main(maps: list[str]) -> None:
    """A row of medians for each map."""
    heads = (
        "mouse to picture",
        "page's CPU a move",
        "server's CPU a preview",
        "rest to exact picture",
        "measure to picture",
    )
    print(f"| map, ms | {' | '.join(heads)} |")
    print(f"| --- |{' --- |' * len(heads)}", flush=True)
    with chromium() as browser:
        for given in maps:
            with served(given) as (address, _):
                page = browser.new_page(viewport={"width": 1280, "height": 900})
                page.goto(address)
                wait_for(page, "document.querySelector('.card') !== null")
                wait_for(page, AT_REST)
                drag(page)
                waits, rests, spent = drag(page)
                rests += [drag(page)[1][0] for _ in range(2)]
                names = ["areal_scale", "angular_distortion", "fisher"] * TIMES
                changes = [page.evaluate(MEASURE, name) for name in names[:TIMES]]
                page.close()
            figures = [
                statistics.median(waits),
                spent,
                server_share(given),
                statistics.median(rests),
                statistics.median(changes),
            ]
            print(f"| `{given}` | {' | '.join(f'{figure:.0f}' for figure in figures)} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or list(MAPS))
