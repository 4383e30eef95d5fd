"""Random dragging and switching on two live pages: `python benchmarks/explore_soak.py [SECONDS]`, 60 if not given.

Prints the memory of the first page's scripts and of the processes on the way, kills a worker in the middle, and fails
where a page says something on its console, does not come to rest, or tells figures that are not those of its map.
"""

import os
import random
import re
import signal
import sys
import time
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from explore import chromium, served, wait_for

import projdist

MAPS = (
    "robinson",
    "mollweide",
    "EPSG:3035",
    "+proj=laea +lat_0=40",
    "goode-homolosine",
    "+proj=ob_tran +o_proj=moll +o_lat_p=40",
)
REGIONS = ("globe", "country:DE", "continent:Africa", "country:New Zealand", "box:-10,30,40,70")
REPORTS = 10
MOVES = 12
AT_REST = """[...document.querySelectorAll(".card")].every(
    ({ dataset }) => Number(dataset.shown) === Number(dataset.version) + 0.5
)"""


def children(pid: int) -> list[int]:
    """The workers of a server."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(path.read_text().rpartition(")")[2].split()[1])
            if parent == pid and b"spawn_main" in (path.parent / "cmdline").read_bytes():
                found.append(int(path.parent.name))
        except OSError:
            continue  # it has ended
    return found


def megabytes(pids: list[int]) -> float:
    """What processes hold in memory together."""
    return (
        sum(int(Path(f"/proc/{pid}/statm").read_text().split()[1]) for pid in pids) * os.sysconf("SC_PAGE_SIZE") / 1e6
    )


def drag(page: Any, chance: random.Random) -> None:
    """Take a map somewhere, with pauses in which its picture may come."""
    box = page.locator("canvas.map").nth(chance.randrange(2)).bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for _ in range(MOVES):
        x, y = x + chance.uniform(-25, 25), y + chance.uniform(-15, 15)
        page.mouse.move(x, y)
        time.sleep(chance.choice((0.005, 0.03, 0.2)))
    page.mouse.up()


def switch(page: Any, chance: random.Random) -> None:
    """Do something else."""
    kind = chance.randrange(6)
    if kind == 0:
        page.locator("#measure").select_option(index=chance.randrange(8))
    elif kind == 1:
        page.locator("#ellipses").click()
    elif kind == 2:
        page.locator("#isolines").click()
    elif kind == 3:
        write(page, "#region", chance.choice(REGIONS))
    elif kind == 4:
        write(page, f".card:nth-child({1 + chance.randrange(2)}) .name input", chance.choice(MAPS))
    else:
        page.locator("canvas.map").nth(chance.randrange(2)).focus()
        page.keyboard.press(chance.choice(("Alt+ArrowLeft", "Alt+ArrowUp", "Shift+ArrowRight")))


def write(page: Any, field: str, text: str) -> None:
    page.locator(field).fill(text)
    page.locator(field).press("Enter")


def heap(session: Any) -> float:
    """Megabytes of scripts that are still of use."""
    session.send("HeapProfiler.collectGarbage")
    metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
    return float(metrics["JSHeapUsedSize"]) / 1e6


def check(page: Any) -> int:
    """How many figures at the middle of the maps are those of the maps that the address names."""
    wait_for(page, AT_REST, 180.0)
    time.sleep(1.0)
    wait_for(page, AT_REST, 180.0)
    definitions = parse_qs(page.url.partition("#")[2])["map"]
    count = 0
    for number, definition in enumerate(definitions):
        box = page.locator("canvas.map").nth(number).bounding_box()
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        told = page.locator(".told").nth(number).inner_text()
        place = re.match(r"([\d.]+)° ([NS]) ([\d.]+)° ([EW]): ~? ?(.*)", told)
        if not place:
            continue
        lat, lon = (float(place[k]) * (-1 if place[k + 1] in "SW" else 1) for k in (1, 3))
        true = projdist.factors(definition, lon, lat)
        figures = dict(text.rsplit("\N{NO-BREAK SPACE}", 1) for text in place[5].split(", "))
        for name in "hkab":
            shown = float(figures[name])
            decimals = len(figures[name].partition(".")[2])
            if abs(shown - float(getattr(true, name))) > 1.01 * 10.0**-decimals:
                raise SystemExit(
                    f"{definition} at {lon} {lat}: {name} is told as {shown}, and is {getattr(true, name)}."
                )
            count += 1
    return count


def main(seconds: float) -> None:
    """Do it, and tell what memory it takes."""
    chance, said = random.Random(1), []
    with served(MAPS[0], MAPS[1]) as (address, server), chromium() as browser:
        pages = [browser.new_page(viewport={"width": 1280, "height": 900}) for _ in range(2)]
        for page in pages:
            page.on("console", lambda message: said.append(message.text))
            page.on("pageerror", lambda error: said.append(str(error)))
            page.goto(address)
            wait_for(page, f"document.querySelectorAll('.card').length === 2 && {AT_REST}", 120.0)
        session = pages[0].context.new_cdp_session(pages[0])
        session.send("Performance.enable")
        start, killed, done = time.monotonic(), False, 0
        print("| s | actions | scripts, MB | server and workers, MB |\n| --- | --- | --- | --- |")
        for report in range(REPORTS + 1):
            while time.monotonic() < start + seconds * report / REPORTS:
                page = chance.choice(pages)
                chance.choice((drag, switch))(page, chance)
                done += 1
                if not killed and time.monotonic() > start + seconds / 2:
                    os.kill(chance.choice(children(server)), signal.SIGKILL)
                    killed = True
            memory = megabytes([server, *children(server)])
            print(f"| {time.monotonic() - start:.0f} | {done} | {heap(session):.1f} | {memory:.0f} |", flush=True)
        figures = sum(map(check, pages))
    print(f"\n{figures} figures at rest are those of projdist.factors; the consoles say {said or 'nothing'}.")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
