"""Make projdist/data/states-10m.npz, the states of the USA at 1 : 10 million, of an unpacked npm package.

`npm pack us-atlas@3.0.1`, unpack it, `python docs/make_states.py package/states-10m.json`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from make_countries import DATA, without_points, write


def main(file: Path) -> None:
    """Write the outlines with their FIPS codes: 29 kB, where the file has 115 and, compressed, 37."""
    content = json.loads(file.read_text(encoding="utf-8"))
    sizes = np.array([len(arc) for arc in content["arcs"]])
    states = [without_points(geometry, sizes) for geometry in content["objects"]["states"]["geometries"]]
    # Their names are in states.csv, with others.
    outlines = [{key: state[key] for key in ("type", "id", "arcs")} for state in states]
    write(content, {"states": outlines}, DATA / "states-10m.npz")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
