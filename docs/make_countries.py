"""Make projdist/data/countries-10m.npz, land and countries at 1 : 10 million, of an unpacked npm package.

`npm pack world-atlas@2.0.2`, unpack it, `python docs/make_countries.py package/countries-10m.json`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

DATA = Path(__file__).parents[1] / "projdist" / "data"
# Leased places and a buffer zone, which the data at 1 : 50 million has as parts of these countries.
PARTS = {"Baikonur": "398", "USNB Guantanamo Bay": "192", "Cyprus U.N. Buffer Zone": "196"}


def main(file: Path) -> None:
    """Write the arcs as bytes that compress well: 0.7 MB, where the file has 3.7 and, compressed, 0.9."""
    content = json.loads(file.read_text(encoding="utf-8"))
    sizes = np.array([len(arc) for arc in content["arcs"]])
    objects = {
        name: [thinned for geometry in one["geometries"] if (thinned := without_points(geometry, sizes))["arcs"]]
        for name, one in content["objects"].items()
    }
    for geometry in objects["countries"]:
        geometry |= {"id": PARTS[geometry["properties"]["name"]]} if geometry["properties"]["name"] in PARTS else {}
    write(content, objects, DATA / "countries-10m.npz")


def write(content: dict[str, Any], objects: dict[str, Any], file: Path) -> None:
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


if __name__ == "__main__":
    main(Path(sys.argv[1]))
