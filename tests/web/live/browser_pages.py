"""Pages of `projdist explore` in a browser: what a person does, sees and is told there."""

import re
import time
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import parse_qs

import projdist

SETTLED = 0.6  # seconds until a view is in the address, and maps know of each other
GERMANY = "country:DE"

AT_REST = """(() => {
    const cards = [...document.querySelectorAll(".card")];
    return cards.length > 0 && cards.every((card) => {
        const { version, shown } = card.dataset, figures = card.querySelector(".figures").textContent;
        return Number(shown) === Number(version) + 0.5 && figures.startsWith("Airy-Kavrayskiy error over");
    });
})()"""


class Live:
    """A page, and what a person sees of it."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def until(self, condition: str, seconds: float = 60.0) -> None:
        """Wait for what the policy of the page does not let it wait for itself."""
        end = time.monotonic() + seconds
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, condition
            time.sleep(0.03)

    def rest(self) -> "Live":
        """Wait until all maps show the exact picture of what they are, with their figures."""
        self.until(AT_REST)
        return self

    def settled(self) -> dict[str, list[str]]:
        """The view that the address tells, when it has been written."""
        self.rest()
        time.sleep(SETTLED)
        self.rest()
        return parse_qs(str(self.page.evaluate("location.hash.slice(1)")))

    def map(self, number: int = 0) -> Any:
        """The canvas of a map."""
        return self.page.locator("canvas.map").nth(number)

    def card(self, number: int = 0) -> Any:
        """A map with all that belongs to it."""
        return self.page.locator(".card").nth(number)

    def place(self, across: float, down: float, number: int = 0) -> tuple[float, float]:
        """Pixels of the page of a place on a map."""
        box = self.map(number).bounding_box()
        return box["x"] + across * box["width"], box["y"] + down * box["height"]

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 6) -> None:
        """Draw the pointer from one place on the first map to another."""
        self.page.mouse.move(*self.place(*start))
        self.page.mouse.down()
        for k in range(1, steps + 1):
            across, down = (a + (b - a) * k / steps for a, b in zip(start, end, strict=True))
            self.page.mouse.move(*self.place(across, down))
            time.sleep(0.02)
        self.page.mouse.up()

    def told(self, number: int = 0) -> str:
        """What a map tells of the place that is pointed at."""
        return str(self.page.locator(".told").nth(number).inner_text())

    def said(self, number: int = 0) -> str:
        """What a map says."""
        return str(self.page.locator(".card .said").nth(number).text_content())

    def picture(self, number: int = 0) -> bytes:
        """The map as it is drawn."""
        return bytes(self.map(number).evaluate("map => map.toDataURL()"), "ascii")

    def write(self, field: str, text: str, number: int = 0) -> None:
        """Type a text in place of the one that is there, and end it with Enter."""
        self.page.locator(field).nth(number).fill(text)
        self.page.locator(field).nth(number).press("Enter")


Opener = Callable[..., Live]


def read(told: str) -> tuple[float, float, dict[str, str]]:
    """Longitude, latitude and the figures of what is told; beside a cut they stand behind a ~."""
    place = re.match(r"([\d.]+)° ([NS]) ([\d.]+)° ([EW]): ", told)
    assert place, told
    texts = told[place.end() :].removeprefix("~ ").replace("°", "").split(", ")
    figures = dict(text.rsplit("\N{NO-BREAK SPACE}", 1) for text in texts)
    lat, lon = float(place[1]), float(place[3])
    return -lon if place[4] == "W" else lon, -lat if place[2] == "S" else lat, figures


def truth(given: str, lon: float, lat: float) -> Mapping[str, float]:
    true = projdist.factors(given, lon, lat)
    named = {"h": true.h, "k": true.k, "a": true.a, "b": true.b, "s": true.s, "ω": true.omega, "Fisher": true.fisher}
    return {name: float(value) for name, value in named.items()}


def check_told(given: str, told: str, least: int = 1) -> None:
    """To the last digit that is shown, behind so many decimals."""
    lon, lat, figures = read(told)
    for name, value in truth(given, lon, lat).items():
        decimals = len(figures[name].partition(".")[2])
        assert decimals >= least
        assert abs(float(figures[name]) - value) <= 1.01 * 10.0**-decimals, name


def press(page: Live, name: str) -> None:
    page.page.get_by_role("button", name=name, exact=True).click()
