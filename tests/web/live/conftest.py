"""The live page of `projdist explore`, opened in a browser."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import quote

import pytest
from browser_pages import SETTLED, Live, Opener


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The address of a server; views are chosen by what follows it."""
    command = [sys.executable, "-m", "projdist", "explore", "robinson", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
        process.terminate()


@pytest.fixture
def live(open_page: Callable[..., Any], address: str) -> Opener:
    """`live(maps..., region=..., options of the context)`: a page at rest."""

    def opened(*maps: str, region: str = "globe", more: str = "", **options: Any) -> Live:
        options.setdefault("viewport", {"width": 1200, "height": 900})
        view = "".join(f"&map={quote(one, safe='')}" for one in maps or ("robinson",))
        page = Live(open_page(f"{address}&region={quote(region, safe='')}{view}{more}", **options)).rest()
        time.sleep(SETTLED)
        return page

    return opened
