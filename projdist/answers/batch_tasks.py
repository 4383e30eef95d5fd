"""Tasks of a batch, with regions and maps as texts, and the work on them."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import os
import re
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from projdist import earth, projections, regions, support

# Words for all regions of a kind, each with one of these, by which a suffix is checked before the work.
_ALL = {"countries": "country:FR", "continents": "continent:Europe", "areas": "area:DACH", "states": "state:Ohio"}
_FROM_FILES = re.compile(r"\b(file|geodesic|points):", re.IGNORECASE)  # files that workers may not have


class Area(NamedTuple):
    """A region of a batch: its name, and its text for `get_region`, or its GeoJSON."""

    name: str
    text: str

    def place(self, ellipsoid: earth.Ellipsoid | None = None) -> regions.Place:
        """The region on the body of an ellipsoid; raises ValueError."""
        if not self.text.startswith("{"):
            return regions.get_region(self.text, ellipsoid)
        return regions.get_region(regions.polygons_from_geojson(json.loads(self.text), self.name), ellipsoid)


def areas_of(regions: regions.RegionLike | Iterable[regions.RegionLike | Area]) -> list[Area]:
    """The regions of `countries`, `continents`, `areas` or `states`, of a file or frame, or of a list of these."""
    # Equal names get a number. Raises ValueError for unknown regions, for none, and for points.
    several = [regions]
    if isinstance(regions, list | tuple):
        is_box = len(regions) == 4 and all(isinstance(number, int | float) for number in regions)
        several = several if is_box else [*regions]
    seen: Counter[str] = Counter()
    found = []
    for name, text in (area for region in several for area in _areas(region)):
        seen[name] += 1
        found.append(Area(name if seen[name] == 1 else f"{name} ({seen[name]})", text))
    if not found:
        raise ValueError("Invalid regions of a batch. There must be one at least.")
    return found


def _areas(region: Any) -> Iterable[Area]:
    if isinstance(region, Area):
        return [region]
    if isinstance(region, str | os.PathLike):
        return _named(os.fspath(region))
    shape = getattr(region, "__geo_interface__", region)
    if isinstance(shape, Mapping) and shape.get("type") == "FeatureCollection":
        return _features(shape, getattr(region, "crs", None))
    return [_area(region)]


def _named(text: str) -> Iterator[Area]:
    """The regions of a text: all countries or states, those of a file, or one."""
    word, at, resolution = text.strip().partition("@")
    if word.lower() in _ALL:
        one = _ALL[word.lower()]
        if at:
            regions.get_region(one + at + resolution)
        for name in regions.region_names():
            if name.startswith(one.partition(":")[0] + ":"):
                yield Area(name + at + resolution, name + at + resolution)
    elif not regions.is_region_text(text):
        for name, shape in regions.features_from_file(*regions.layer_path(text)):
            yield Area(name, json.dumps(shape))
    else:
        area = _area(regions.get_region(text))  # errors are raised before the work
        yield area if _FROM_FILES.search(text) else Area(text.strip(), text.strip())


def _features(collection: Mapping[str, Any], crs: Any) -> Iterator[Area]:
    """The rows of a frame or the features of GeoJSON, by name, else by id."""
    regions.tell_of_geojson_in_degrees(collection, crs, "Invalid regions.")
    stated = collection.get("crs") if crs is None else {"type": "name", "properties": {"name": crs.to_wkt()}}
    for number, feature in enumerate(collection["features"], start=1):
        fields = feature.get("properties") or {}
        name = fields.get("name") or fields.get("NAME") or feature.get("id", number)
        shape = feature.get("geometry") or {"type": "MultiPolygon", "coordinates": []}
        yield Area(str(name), json.dumps({**shape, "crs": stated} if stated else shape))


def _area(value: Any) -> Area:
    """One region, given in any form."""
    region = regions.get_region(value)
    if not region.area_km2:
        raise ValueError(f"Invalid region {support.quoted(region.name)} of a batch. It must be an area, not points.")
    if isinstance(region, regions.Box):
        return Area(region.name, f"box:{region.west!r},{region.south!r},{region.east!r},{region.north!r}")
    if isinstance(region, regions.Cap):
        return Area(region.name, f"cap:{region.lon!r},{region.lat!r},{region.radius_km!r}")
    return Area(region.name, json.dumps(regions.geojson_of(region)))


_FILES = (".prj", ".wkt", ".json")  # suffixes of files of maps, which workers may not have


def map_text(projection: projections.ProjectionLike) -> str:
    """A projection as text: a name, a PROJ string, a code, WKT; raises ValueError if there is none."""
    if isinstance(projection, str | Path):
        path = Path(projection)
        is_file = len(str(projection)) < 4096 and path.suffix.lower() in _FILES and path.is_file()
        return support.read_text(path, f"Invalid projection file '{path}'.").strip() if is_file else str(projection)
    found = projections.Projection.from_user_input(projection)
    lon, lat = (axis.ravel() for axis in np.meshgrid(np.linspace(-160.0, 160.0, 9), np.linspace(-70.0, 80.0, 9)))
    with contextlib.suppress(ValueError):  # the definition of a function does not make the projection again
        again = projections.Projection.from_user_input(found.definition)
        if np.array_equal(found(lon, lat), again(lon, lat), equal_nan=True):
            return found.definition
    raise ValueError(
        f"Invalid projection {support.quoted(found.label)} of a batch. It must have a text: a name, a PROJ string, a "
        "code or WKT."
    )


# ---- the work ------------------------------------------------------------------------------------

_SLICE = 1.5  # seconds after which a worker returns its results
_KEPT = 4  # regions that a worker keeps: tasks of many maps over one region follow each other


class Task(NamedTuple):
    """The number of a task, the name and the text (or GeoJSON) of its region, and its map, if any."""

    number: int
    name: str
    region: str
    projection: str | None = None
    figure: tuple[float, float] | None = None  # semi-major axis and flattening, for the regions of all maps


Done = tuple[list[str], float]
"""Lines of finished tasks, and the seconds that they took."""


@dataclass(frozen=True)
class Job:
    """A function of regions, or of maps and regions, and its options."""

    function: Callable[..., Any]
    options: Mapping[str, Any]

    @property
    def name(self) -> str:
        """The function with its module."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    def header(self, tasks: Sequence[Task], version: str) -> dict[str, Any]:
        """The properties and the digest that identify the job; raises ValueError for options that are not JSON."""
        try:
            options = json.loads(json.dumps(self.options, sort_keys=True, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"Invalid options of a batch. They must be text, numbers, and lists of them: {error}."
            ) from error
        header: dict[str, Any] = {"projdist": version, "PROJ": projections.proj_version(), "function": self.name}
        header |= {"options": options, "tasks": len(tasks)}
        text = json.dumps([header, tasks], sort_keys=True)
        return {**header, "digest": hashlib.sha256(text.encode()).hexdigest()}


def run_tasks(job: Job, tasks: Sequence[Task]) -> Done:
    """The work of a worker: tasks one after the other, for `_SLICE` seconds."""
    start = time.monotonic()
    lines: list[str] = []
    with support.without_processes():
        for task in tasks:
            lines.append(_line(job, task))
            if time.monotonic() - start > _SLICE:
                break
    return lines, time.monotonic() - start


def failure(task: Task, reason: str, *, again: bool = False) -> str:
    """The line of a failed task; with `again` it is repeated when the job goes on."""
    return json.dumps({"task": task.number, "error": reason} | ({"again": True} if again else {}))


def _line(job: Job, task: Task) -> str:
    """A result or an error as a line of JSON."""
    try:
        region, notices = _region(task.name, task.region, task.figure)
        words = (region,) if task.projection is None else (task.projection, region)
        with support.notices_kept() as messages:
            found = job.function(*words, **job.options)
        result = {"task": task.number, "area_km2": region.area_km2, "notices": [*notices, *messages]}
        if isinstance(found, support.Answer):
            result |= {"answer": found.to_dict(), "rows": found.plain_rows()}
        else:
            result |= {"answer": found, "rows": [found] if isinstance(found, dict) else []}
        return json.dumps(result, allow_nan=False)
    except ValueError as error:
        return failure(task, str(error))


@functools.lru_cache(_KEPT)
def _region(name: str, text: str, figure: tuple[float, float] | None) -> tuple[regions.Place, tuple[str, ...]]:
    """The region of a task, and its notices."""
    with support.notices_kept() as messages:
        region = Area(name, text).place(None if figure is None else earth.Ellipsoid(*figure))
    return region, (*messages, *region.notes)
