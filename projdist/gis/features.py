"""Frames of features without GDAL: of GeoJSON that is no file of this machine, and of regions."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from projdist.gis.libraries import needed_for
from projdist.regions import geojson_of, get_region

if TYPE_CHECKING:
    import geopandas


def frame_of_geojson(content: bytes) -> geopandas.GeoDataFrame:
    """The features of GeoJSON in longitude and latitude; raises ValueError, ImportError without geopandas."""
    with needed_for("file to check"):
        import geopandas
        from shapely.errors import ShapelyError
    try:
        document = json.loads(content)
        features = document["features"] if document["type"] == "FeatureCollection" else [document]
        if document["type"] not in ("FeatureCollection", "Feature"):
            features = [{"type": "Feature", "properties": {}, "geometry": document}]
        return geopandas.GeoDataFrame.from_features(features, crs="OGC:CRS84")
    except (ArithmeticError, AttributeError, LookupError, RecursionError, ShapelyError, TypeError, ValueError) as error:
        raise ValueError("Invalid file. It must be GeoJSON: features of lines or polygons.") from error


def frame_of_regions(rows: Sequence[Mapping[str, Any]], regions: Sequence[Any]) -> geopandas.GeoDataFrame:
    """Rows about regions, a feature each, in longitude and latitude; ValueError for points, ImportError."""
    with needed_for("layer of regions"):
        import geopandas
    features = [
        {"type": "Feature", "properties": dict(row), "geometry": geojson_of(get_region(region))}
        for row, region in zip(rows, regions, strict=True)
    ]
    return geopandas.GeoDataFrame.from_features(features, crs="OGC:CRS84")
