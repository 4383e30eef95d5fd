"""Make docs/reference_factors.csv.gz: certified factors at five points of the area of use of every projected CRS.

`python tools/make_reference_factors.py`, which takes some minutes. The points are the middle of the area of use of the
CRS and those a quarter of its width and height from the sides, to four decimals of a degree.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import pyproj
from pyproj.database import query_crs_info
from pyproj.enums import PJType

import projdist

FILE = Path(__file__).parents[1] / "docs" / "reference_factors.csv.gz"
AUTHORITIES = ("EPSG", "ESRI", "IGNF")
SHARES = ((0.5, 0.5), (0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75))
FIGURES = ("h", "k", "s", "a", "b", "omega", "theta", "convergence")
DECIMALS = 4  # of longitudes and latitudes
DIGITS = 13
CHUNK = 100  # CRSs of a task


def points(area: Any) -> list[tuple[float, float]]:
    """Five longitudes and latitudes within an area of use."""
    width = (area.east - area.west) % 360.0 or 360.0
    lons = [(area.west + x * width + 180.0) % 360.0 - 180.0 for x, _ in SHARES]
    lats = [area.south + y * (area.north - area.south) for _, y in SHARES]
    return [(round(lon, DECIMALS), round(lat, DECIMALS)) for lon, lat in zip(lons, lats, strict=True)]


def rows_of(asked: list[tuple[str, list[tuple[float, float]]]]) -> list[dict[str, Any]]:
    """The rows of CRSs; those that PROJ cannot compute have none."""
    rows: list[dict[str, Any]] = []
    for code, places in asked:
        try:
            found = projdist.factors(code, *zip(*places, strict=True))
        except projdist.ProjectionError:
            continue
        for n, (lon, lat) in enumerate(places):
            figures = {name: float(getattr(found, name)[n]) for name in FIGURES}
            place = {"crs": code, "lon": lon, "lat": lat, "x": float(found.x[n]), "y": float(found.y[n])}
            rows.append(place | figures | {"error": float(found.error[n]), "quality": str(found.quality[n])})
    return rows


def table() -> pd.DataFrame:
    """All rows, by authority and code."""
    asked = [
        (f"{authority}:{info.code}", points(info.area_of_use))
        for authority in AUTHORITIES
        for info in query_crs_info(authority, pj_types=[PJType.PROJECTED_CRS], allow_deprecated=True)
        if info.area_of_use is not None
    ]
    tasks = [asked[k : k + CHUNK] for k in range(0, len(asked), CHUNK)]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        rows = [row for found in pool.map(rows_of, tasks) for row in found]
    return pd.DataFrame(rows)


def main() -> None:
    frame = table()
    versions = {"proj": pyproj.proj_version_str, "epsg": pyproj.database.get_database_metadata("EPSG.VERSION")}
    frame.to_csv(FILE, index=False, float_format=f"%.{DIGITS}g", compression={"method": "gzip", "mtime": 0})
    print(f"{frame.crs.nunique()} CRSs, {len(frame)} points, PROJ {versions['proj']}, EPSG {versions['epsg']}")
    print(frame.quality.value_counts().to_string())
    print(f"largest error where ok: {frame.error[frame.quality == 'ok'].max():.1e}")


if __name__ == "__main__":
    main()
