"""Features of GeoJSON that is no file of this machine, read without GDAL."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from projdist.gis.libraries import needed_for

if TYPE_CHECKING:
    import geopandas


def frame_of_geojson(content: bytes) -> geopandas.GeoDataFrame:
    """The features of GeoJSON in longitude and latitude; raises ValueError, ImportError without geopandas."""
    with needed_for("file to check"):
        import geopandas
    try:
        document = json.loads(content)
        features = document["features"] if document["type"] == "FeatureCollection" else [document]
        if document["type"] not in ("FeatureCollection", "Feature"):
            features = [{"type": "Feature", "properties": {}, "geometry": document}]
        return geopandas.GeoDataFrame.from_features(features, crs="OGC:CRS84")
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("Invalid file. It must be GeoJSON: features of lines or polygons.") from error
