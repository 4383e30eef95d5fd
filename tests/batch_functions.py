"""Functions of regions that processes of tests can import, and that tell what became of them."""

import contextlib
import os
import signal
import time
from pathlib import Path
from typing import Any


def name_of(region: Any, suffix: str = "") -> dict[str, Any]:
    """What there is to say of a region."""
    return {"name": f"{region.name}{suffix}", "third": region.area_km2 / 3.0}


def once_killed(region: Any, trap: str, at: str) -> dict[str, Any]:
    """The same; the first to come to a region ends its process."""
    if region.name == at:
        with contextlib.suppress(FileExistsError):
            os.close(os.open(trap, os.O_CREAT | os.O_EXCL))
            kill_itself()
    return name_of(region)


def always_killed(region: Any, at: str, log: str) -> dict[str, Any]:
    """The same, but of one region, which ends each process that comes to it; all is written to a log."""
    with Path(log).open("a") as lines:
        lines.write(f"{region.name}\n")
    if region.name == at:
        kill_itself()
    return name_of(region)


def slow(region: Any, log: str, seconds: float = 0.2) -> dict[str, Any]:
    """The same, slowly; each process that works on it is written to a log."""
    with Path(log).open("a") as lines:
        lines.write(f"{os.getpid()} {region.name}\n")
    time.sleep(seconds)
    return name_of(region)


def wrong(region: Any) -> dict[str, Any]:
    """The same, with errors of two kinds."""
    if region.name == "box:0,0,1,1":
        raise ValueError("It is the first.")
    if region.name == "box:1,0,2,1":
        raise KeyError("second")
    if region.name == "box:2,0,3,1":
        return {"third": float("nan")}
    return name_of(region)


def kill_itself() -> None:
    os.kill(os.getpid(), signal.SIGKILL)
