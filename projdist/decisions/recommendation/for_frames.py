"""Answers for geopandas; it is not imported, but asked through the frame that is given."""

from __future__ import annotations

from typing import Any

from projdist.decisions.recommendation.siting import site
from projdist.projections import CRS, crs_of, is_geographic, tell_of_frame_in_degrees, to_pyproj
from projdist.regions import Region, bounding_box
from projdist.support import quoted, tell

__all__ = ["estimate_crs"]

_MOST = 50_000  # vertices: twice the time that a box takes; more do not tell more of which CRS is the best


def estimate_crs(frame: Any, *, purpose: str = "any", **options: Any) -> CRS:
    """The best existing CRS for the data of a GeoDataFrame or GeoSeries, as pyproj's.

    The region is the polygons themselves; of points, lines, and polygons with more than 50,000 vertices it is the
    narrowest box in longitude and latitude about them, across the antimeridian where that is narrower. The CRS is on
    the data's datum and for their country where there is one, as `check` has it; a notice tells of a change of datum by
    more than two metres, and of meridians turned by more than three degrees.

    Parameters
    ----------
    frame : GeoDataFrame or GeoSeries
        Data that state their CRS.
    purpose : str
        What the map must keep, as for `recommend`.
    **options
        The others of `recommend`.

    Returns
    -------
    pyproj.CRS

    Raises
    ------
    ValueError
        For other data, data without a CRS or without a geometry that is not empty, for a purpose that no CRS serves
        there, and where `recommend` does.

    References
    ----------
    Its place in geopandas: GeoDataFrame.estimate_utm_crs, which knows zones of UTM only.

    Examples
    --------
    Points in Bern, in the Swiss agency's own system:

    >>> import geopandas
    >>> bern = geopandas.GeoSeries.from_xy([2600000, 2601000], [1200000, 1201000], crs="EPSG:2056")
    >>> estimate_crs(bern, authorities=["EPSG"]).to_epsg()
    2056
    """
    if not is_geographic(frame):
        raise ValueError(f"Invalid data {quoted(frame)}. They must be a GeoDataFrame or GeoSeries.")
    if frame.crs is None:
        raise ValueError("Invalid data. It must have a CRS: set it with frame.set_crs(...).")
    tell_of_frame_in_degrees(frame, "the data")
    shapes = frame.geometry.set_crs(crs_of(frame.crs), allow_override=True).to_crs("OGC:CRS84")
    shapes = shapes[~(shapes.isna() | shapes.is_empty)]
    if not len(shapes):
        raise ValueError("Invalid data. It must have a geometry that is not empty.")
    region, vertices = _region_of(shapes), shapes.get_coordinates()
    found = site(frame.crs, region, vertices.x.to_numpy(), vertices.y.to_numpy(), purpose=purpose, **options)
    if found is None:
        raise ValueError(f"Invalid purpose '{purpose}' for {region.name}. No CRS serves it there.")
    for note in found.warnings:
        tell(note)
    return to_pyproj(found.code)


def _region_of(shapes: Any) -> Region:
    """The region of a GeoSeries in longitude and latitude, none of it empty."""
    polygons = shapes.geom_type.isin(("Polygon", "MultiPolygon")).all() and shapes.is_valid.all()
    if polygons and len(shapes.get_coordinates()) <= _MOST:
        from projdist.regions import polygons_from_geojson  # shapely is slow to load

        return polygons_from_geojson(shapes.__geo_interface__, "the polygons")
    parts = shapes.explode(index_parts=False).bounds
    return bounding_box(*(parts[name].to_numpy() for name in ("minx", "miny", "maxx", "maxy")))
