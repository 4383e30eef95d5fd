"""The regions of a batch as text, which is what workers are sent."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from projdist.earth import Ellipsoid
from projdist.regions import Box, Cap, Place, RegionLike, get_region, is_region_text, layer_path
from projdist.support import quoted

# Words for all regions of a kind, and one of these, by which a suffix is checked before the work.
_ALL = {"countries": "country:France", "continents": "continent:Europe", "states": "state:Ohio"}
_FROM_FILES = re.compile(r"\b(file|geodesic|points):", re.IGNORECASE)  # which workers may not have


class Area(NamedTuple):
    """A region of a batch: what it is called, and a text in the language of regions, or GeoJSON."""

    name: str
    text: str

    def place(self, ellipsoid: Ellipsoid | None = None) -> Place:
        """The region itself, on the body of an ellipsoid; raises ValueError."""
        if not self.text.startswith("{"):
            return get_region(self.text, ellipsoid)
        from projdist.regions import polygons_from_geojson  # shapely is slow to load

        return get_region(polygons_from_geojson(json.loads(self.text), self.name), ellipsoid)


def areas_of(regions: RegionLike | Iterable[RegionLike | Area]) -> list[Area]:
    """The regions of `countries`, `continents`, `states`, of the features of a file or frame, or of a list of these.

    Names are told apart by numbers. Raises ValueError for what is no region, for none, and for points.
    """
    several = regions if isinstance(regions, list | tuple) and not _is_box(regions) else [regions]
    found = [area for region in several for area in _areas(region)]
    if not found:
        raise ValueError("Invalid regions of a batch. There must be one at least.")
    return _told_apart(found)


def _is_box(value: list[Any] | tuple[Any, ...]) -> bool:
    """Whether it is the bounds of one box."""
    return len(value) == 4 and all(isinstance(number, int | float) for number in value)


def _told_apart(areas: list[Area]) -> list[Area]:
    """The same with names that are different, the second of a name with 2 behind it."""
    seen: Counter[str] = Counter()
    found = []
    for name, text in areas:
        seen[name] += 1
        found.append(Area(name if seen[name] == 1 else f"{name} ({seen[name]})", text))
    return found


def _areas(region: Any) -> Iterator[Area]:
    if isinstance(region, Area):
        yield region
        return
    if isinstance(region, str | os.PathLike):
        yield from _named(os.fspath(region))
        return
    shape = getattr(region, "__geo_interface__", region)
    if isinstance(shape, Mapping) and shape.get("type") == "FeatureCollection":
        yield from _features(shape, getattr(region, "crs", None))
        return
    yield _area(region)


def _named(text: str) -> Iterator[Area]:
    """The regions of a text: all countries or states, those of a file, or one."""
    from projdist.regions import features_from_file, region_names  # as above

    word, at, resolution = text.strip().partition("@")
    if word.lower() in _ALL:
        one = _ALL[word.lower()]
        if at:
            get_region(one + at + resolution)
        for name in region_names():
            if name.startswith(one.partition(":")[0] + ":"):
                yield Area(name + at + resolution, name + at + resolution)
    elif not is_region_text(text):
        yield from (Area(name, json.dumps(shape)) for name, shape in features_from_file(*layer_path(text)))
    else:
        area = _area(get_region(text))  # a wrong word is refused before the work
        yield area if _FROM_FILES.search(text) else Area(text.strip(), text.strip())


def _features(collection: Mapping[str, Any], crs: Any) -> Iterator[Area]:
    """The rows of a frame, or the features of GeoJSON; by their names, else by their ids."""
    from projdist.regions import tell_of_geojson_in_degrees  # as above

    tell_of_geojson_in_degrees(collection, crs, "Invalid regions.")
    stated = collection.get("crs") if crs is None else {"type": "name", "properties": {"name": crs.to_wkt()}}
    for number, feature in enumerate(collection["features"], start=1):
        fields = feature.get("properties") or {}
        name = fields.get("name") or fields.get("NAME") or feature.get("id", number)
        shape = feature.get("geometry") or {"type": "MultiPolygon", "coordinates": []}
        yield Area(str(name), json.dumps({**shape, "crs": stated} if stated else shape))


def _area(value: Any) -> Area:
    """One region, however it was given."""
    region = get_region(value)
    if not region.area_km2:
        raise ValueError(f"Invalid region {quoted(region.name)} of a batch. It must be an area, not points.")
    if isinstance(region, Box):
        return Area(region.name, f"box:{region.west!r},{region.south!r},{region.east!r},{region.north!r}")
    if isinstance(region, Cap):
        return Area(region.name, f"cap:{region.lon!r},{region.lat!r},{region.radius_km!r}")
    from projdist.regions import geojson_of  # as above

    return Area(region.name, json.dumps(geojson_of(region)))
