"""Regions as a title has them: countries and states with their names, boxes and caps in words."""

from __future__ import annotations

import functools
import re

from projdist.earth import latitude_text, longitude_text, natural_earth, state_keys
from projdist.regions.boxes import Box
from projdist.regions.caps import Cap
from projdist.regions.language import Place

_LONGEST = 70  # letters


@functools.cache
def _country_names() -> dict[str, str]:
    return {row["iso_a2"]: row["name"] for row in natural_earth.country_keys() if row["iso_a2"]}


@functools.cache
def _state_names() -> dict[str, str]:
    return {row["postal"]: row["name"] for row in state_keys()}


_WORDS = (
    (re.compile(r"country:([A-Z]{2})(@\d+m)?(?![\w])"), lambda match: f"{_country_names()[match[1]]} ({match[1]})"),
    (re.compile(r"state:([A-Z]{2})(@\d+m)?(?![\w])"), lambda match: f"{_state_names()[match[1]]} ({match[1]})"),
    (re.compile(r"(?:country|continent|state):([\w .'-]+?)(@\d+m)?(?=$|[)@]| [&+-] )"), lambda match: match[1]),
    (re.compile(r"(?:file|geodesic|points):(?:[^\s&()]*[/\\])?([^\s/\\&()]+)"), lambda match: match[1]),
    (re.compile(r"@main(:[\d.]+)?"), lambda match: ", main part"),
    (re.compile(r"@all"), lambda match: ""),
)


def region_title(region: Place) -> str:
    """A region as a title has it: Germany (DE); 6°E to 12°E, 47°N to 55°N; 50 km around 48.85°N, 2.35°E."""
    if isinstance(region, Box) and not region.is_globe:
        west, south, east, north = region.bounds
        lon, lat = (longitude_text(west), longitude_text(east)), (latitude_text(south), latitude_text(north))
        return f"{lon[0]} to {lon[1]}, {lat[0]} to {lat[1]}"
    if isinstance(region, Cap):
        return f"{region.radius_km:.6g} km around {latitude_text(region.lat)}, {longitude_text(region.lon)}"
    text = region.name
    for pattern, word in _WORDS:
        text = pattern.sub(word, text)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
