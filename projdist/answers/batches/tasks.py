"""Tasks of a batch, made of text: regions, maps, and what a worker does with them."""

from __future__ import annotations

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

from projdist.earth import Ellipsoid
from projdist.projections import Projection, ProjectionLike, proj_version
from projdist.regions import Box, Cap, Place, RegionLike, get_region, is_region_text, layer_path
from projdist.support import Answer, notices_kept, quoted, read_text, without_processes

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


# ---- maps as text --------------------------------------------------------------------------------


_FILES = (".prj", ".wkt", ".json")  # that a map may be in, and that workers may not have


def map_text(projection: ProjectionLike) -> str:
    """A projection as text: a name, a PROJ string, a code, WKT; raises ValueError for what has none."""
    if isinstance(projection, str | Path):
        path = Path(projection)
        is_file = len(str(projection)) < 4096 and path.suffix.lower() in _FILES and path.is_file()
        return read_text(path, f"Invalid projection file '{path}'.").strip() if is_file else str(projection)
    found = Projection.from_user_input(projection)
    if not _is_what_it_says(found):
        raise ValueError(
            f"Invalid projection {quoted(found.label)} of a batch. It must have a text: a name, a PROJ string, a code "
            "or WKT."
        )
    return found.definition


def _is_what_it_says(projection: Projection) -> bool:
    """Whether its definition is a text that it can be made of again, as that of a function is not."""
    try:
        again = Projection.from_user_input(projection.definition)
    except ValueError:
        return False
    lon, lat = (axis.ravel() for axis in np.meshgrid(np.linspace(-160.0, 160.0, 9), np.linspace(-70.0, 80.0, 9)))
    return all(
        np.array_equal(one, other, equal_nan=True)
        for one, other in zip(projection(lon, lat), again(lon, lat), strict=True)
    )


# ---- what a worker does --------------------------------------------------------------------------


_SLICE = 1.5  # seconds, after which a worker answers with what it has done
_KEPT = 4  # regions that a worker remembers, as those of many maps come one after the other


class Task(NamedTuple):
    """A region, by its name and in words of `get_region` or as GeoJSON, perhaps a map of it, and the task's number.

    The `figure`, a semi-major axis and a flattening, is the ellipsoid on which the regions of all maps are measured.
    """

    number: int
    name: str
    region: str
    projection: str | None = None
    figure: tuple[float, float] | None = None


class Done(NamedTuple):
    """The lines of tasks that are done, of as many as there was time for, and the seconds that they took."""

    lines: list[str]
    seconds: float


@dataclass(frozen=True)
class Job:
    """A function of regions, or of maps and regions, and its options."""

    function: Callable[..., Any]
    options: Mapping[str, Any]

    @property
    def name(self) -> str:
        """The function, by its module."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    def header(self, tasks: Sequence[Task], version: str) -> dict[str, Any]:
        """What tells it from other jobs; raises ValueError for options that are no text or numbers."""
        try:
            options = json.loads(json.dumps(self.options, sort_keys=True, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"Invalid options of a batch. They must be text, numbers, and lists of them: {error}."
            ) from error
        header = {
            "projdist": version,
            "PROJ": proj_version(),
            "function": self.name,
            "options": options,
            "tasks": len(tasks),
        }
        text = json.dumps([header, tasks], sort_keys=True)
        return {**header, "digest": hashlib.sha256(text.encode()).hexdigest()}


def run_tasks(job: Job, tasks: Sequence[Task]) -> Done:
    """What a worker does: tasks one after the other, and not for long."""
    start = time.monotonic()
    lines: list[str] = []
    with without_processes():
        for task in tasks:
            lines.append(_line(job, task))
            if time.monotonic() - start > _SLICE:
                break
    return Done(lines, time.monotonic() - start)


def failure(task: Task, reason: str, *, again: bool = False) -> str:
    """The line of a task that failed; whether it is to be tried again when the job goes on."""
    return json.dumps({"task": task.number, "error": reason} | ({"again": True} if again else {}))


def _line(job: Job, task: Task) -> str:
    """A result as a line of JSON; what is wrong with the task is one, too."""
    try:
        region, notices = _region(task.name, task.region, task.figure)
        words = (region,) if task.projection is None else (task.projection, region)
        with notices_kept() as told:
            found = job.function(*words, **job.options)
        result = {"task": task.number, "area_km2": region.area_km2, "notices": [*notices, *told]}
        return json.dumps(result | _told(found), allow_nan=False)
    except ValueError as error:
        return failure(task, str(error))


@functools.lru_cache(_KEPT)
def _region(name: str, text: str, figure: tuple[float, float] | None) -> tuple[Place, tuple[str, ...]]:
    """The region of a task, and what is to be said of it."""
    with notices_kept() as told:
        region = Area(name, text).place(None if figure is None else Ellipsoid(*figure))
    return region, (*told, *region.notes)


def _told(found: Any) -> dict[str, Any]:
    """An answer and its rows, for JSON."""
    if not isinstance(found, Answer):
        return {"answer": found, "rows": [found] if isinstance(found, dict) else []}
    return {"answer": found.to_dict(), "rows": found.plain_rows()}
