"""A browser for tests of pages: Debian's Chromium, pages that fail on what they say or ask for, and axe-core.

Without Chromium, playwright or axe-core their tests are skipped, with the reason.
"""

import importlib.util
import os
import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
# WebGL is drawn by ANGLE on one core or two; plain SwiftShader takes seven times as long.
ARGUMENTS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader-webgl", "--enable-unsafe-swiftshader")
AXE = "axe-core@4.14.1"
GRAVE = ("serious", "critical")

Opener = Callable[..., Any]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium without a window."""
    if CHROMIUM is None:
        pytest.skip("no chromium or google-chrome is on the PATH")
    if importlib.util.find_spec("playwright") is None:
        pytest.skip("needs playwright")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield running
        running.close()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Opener]:
    """`open_page(address, **options of the context)`: a page, of which the following is a failure at the end.

    What it says on the console, errors of its scripts, and what it asks of others than its file or its server.
    """
    contexts, said = [], []

    def opener(address: str, **options: Any) -> Any:
        context = browser.new_context(**options)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        for event in ("request", "websocket"):
            page.on(event, lambda wanted: None if _is_own(wanted.url, address) else said.append(wanted.url))
        page.goto(address)
        return page

    yield opener
    for context in contexts:
        context.close()
    assert said == []


def _is_own(url: str, address: str) -> bool:
    """Whether an address is that of the page, of its server, or of what the page has made itself."""
    wanted, own = urlsplit(url), urlsplit(address)
    if wanted.scheme in ("blob", "data"):
        return True
    return url == address if own.scheme == "file" else wanted.netloc == own.netloc


@pytest.fixture(scope="session")
def axe_script() -> str:
    """axe-core's script, which npm brings into a folder of caches once."""
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "projdist-tests"
    path = folder / f"{AXE}.js"
    if not path.exists():
        if shutil.which("npm") is None:
            pytest.skip("needs npm, for axe-core")
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as place:
            packed = subprocess.run(
                ["npm", "pack", AXE, "--silent"], cwd=place, capture_output=True, text=True, timeout=120, check=False
            )
            if packed.returncode:
                pytest.skip(f"npm has no {AXE}: {packed.stderr.strip()}")
            with tarfile.open(next(Path(place).glob("*.tgz"))) as package:
                script = package.extractfile("package/axe.min.js")
                assert script is not None
                (Path(place) / "axe.js").write_bytes(script.read())
            # At once, as other processes may do the same.
            (Path(place) / "axe.js").replace(path)
    return path.read_text(encoding="utf-8")


@pytest.fixture
def axe(axe_script: str) -> Callable[[Any], list[str]]:
    """`axe(page)`: the serious and critical findings of axe-core, each with its elements."""

    def findings(page: Any) -> list[str]:
        page.evaluate(axe_script)  # by the debugger: no policy of the page forbids that
        found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")["violations"]
        return [
            f"{one['id']} ({one['impact']}): {node['html']} {node['failureSummary']}"
            for one in found
            if one["impact"] in GRAVE
            for node in one["nodes"]
        ]

    return findings
