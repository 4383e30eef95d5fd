"""Whether a region is a state or a far part of its country, and which areas of use are those of such a part."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from projdist._typing import FloatArray
from projdist.decisions.recommendation.nations import USA, outline_of, words_in
from projdist.projections import CrsRecord
from projdist.regions import Region, main_part

__all__ = ["CountryPart", "part_of"]

Bounds = tuple[float, float, float, float]

_IS_IN = 0.9  # of the region is in a state: outlines differ
_IS_MOST = 0.5  # of the state is the region: it is that state; of the country's points in the region: these are far


@dataclass(frozen=True, kw_only=True)
class CountryPart:
    """A part of a country by its `state`, or by the `middle` of the main part in degrees, which it is far from."""

    state: str = ""
    middle: tuple[float, float] | None = None

    def is_elsewhere(self, extents: Sequence[str]) -> bool:
        """Whether an area of use is that of other states."""
        return bool(self.state) and any(set(words_in(name)) & _states() - {self.state} for name in extents[:1])

    def has(self, record: CrsRecord, extents: Sequence[str]) -> bool:
        """Whether an area of use is this part's, not the country's: its name has the state's, or it has no middle."""
        if self.state:
            return any(self.state in words_in(name) for name in extents[:1])
        if self.middle is None:
            return True
        return not _is_within(record.area_of_use, *self.middle)


def part_of(home: str, region: Region, lon: FloatArray, lat: FloatArray, weight: FloatArray) -> CountryPart:
    """What part of its country, or of none (""), a region is, by points of it with weights whose sum is 1."""
    if not home:
        return CountryPart()
    state = _state(region.area_km2, lon, lat, weight) if home == USA else ""
    if state:
        return CountryPart(state=state)
    country = outline_of(home)
    main = main_part(country)
    if main is country or weight @ main.contains(lon, lat) >= _IS_MOST * (weight @ country.contains(lon, lat)):
        return CountryPart()
    west, south, east, north = main.bounds
    return CountryPart(middle=(0.5 * (west + east), 0.5 * (south + north)))


@functools.cache
def _states() -> frozenset[str]:
    from projdist.earth import state_keys  # shapely is slow to load

    return frozenset(row["name"] for row in state_keys())


def _state(area_km2: float, lon: FloatArray, lat: FloatArray, weight: FloatArray) -> str:
    """The state that a region of some area is, or ""."""
    from projdist.earth import state_keys, state_outline  # as above
    from projdist.regions import Polygons

    for row in state_keys():
        outline = state_outline(row["fips"])
        if weight @ _is_within(outline.bounds, lon, lat) < _IS_IN:
            continue
        state = Polygons(outline, row["name"])
        share = float(weight @ state.contains(lon, lat))
        if share >= _IS_IN and share * area_km2 >= _IS_MOST * state.area_km2:
            return row["name"]
    return ""


def _is_within(bounds: Bounds, lon: Any, lat: Any) -> Any:
    """Whether places lie within west, south, east, north in degrees."""
    west, south, east, north = bounds
    return ((lon - west) % 360.0 <= ((east - west) % 360.0 or 360.0)) & (lat >= south) & (lat <= north)
