"""Meridians and parallels at which a map is torn or bent."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["SMOOTH", "Breaks"]


class Breaks(NamedTuple):
    """Parallels, and meridians of the northern and of the southern hemisphere, in degrees."""

    parallels: tuple[float, ...]
    northern: tuple[float, ...]
    southern: tuple[float, ...]


SMOOTH = Breaks((), (), ())
"""Of a map of which nothing is known."""
