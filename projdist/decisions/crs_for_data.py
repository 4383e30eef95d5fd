"""The best CRS for data: on their datum, and for their country."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.decisions.candidate_crs import Candidate, named, outline_keys
from projdist.decisions.recommendation import recommend
from projdist.earth import WGS84
from projdist.field import jacobian, nodes_of
from projdist.matrices import meridian_convergence
from projdist.projections import (
    CRS,
    DatumTransformation,
    Projection,
    crs_of,
    datum_transformation,
    is_geographic,
    keeps_datum,
    kept_datum,
    tell_of_frame_in_degrees,
    to_pyproj,
)
from projdist.regions import Place, Region, bounding_box
from projdist.support import quoted, tell

TURNED = 3.0
"""Degrees between grid north and true north, more than within 3 degrees of a zone's meridian anywhere."""

_UNSEEN = 2.0  # metres: the accuracy of WGS 84 if its realisation is not known
_WORSE = 2.0  # times the figure that a less turned map may have
_LOOKED_AT, _OF_ALL_DATUMS = 10, 80  # best CRSs that are looked at, on one datum and on any
_WHOLE = 0.99  # share of the region in the area of use, at least
_POINTS = 200  # of the data, and of the region
_LAND, _LEAST = 0.5, 0.1  # shares of the points that must be on land, and in a country
_FEW = 2  # countries of an area of use that is not a shared zone
_NEAR = 0.03  # degrees: a little more than the accuracy of outlines, 2 km


@dataclass(frozen=True)
class CrsForData:
    """A CRS for data, with the datum shift that it needs, if any, and the RMS convergence in degrees.

    `foreign` is a note if it is for another country, for want of one for the data's.
    """

    code: str
    shift: DatumTransformation | None
    convergence: float
    foreign: str = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks, a sentence each."""
        turned = f"Its grid north is off true north by {self.convergence:.2g} degrees in the data (RMS)."
        return tuple(filter(None, (self.foreign, str(self.shift or ""), turned)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Notes on defects: another country, a datum metres away, a convergence larger than any zone's."""
        shift = self.shift
        moved = shift is not None and not shift.metres <= _UNSEEN
        worth = (self.foreign, str(shift) if moved else "", self.notes[-1] if self.convergence > TURNED else "")
        return tuple(f"{self.code}: {note}" for note in worth if note)


def crs_for_data(
    crs: Any, region: Place, lon: FloatArray, lat: FloatArray, *, purpose: str = "any", **options: Any
) -> CrsForData | None:
    """The CRS for data in a CRS, with vertices (n,) in degrees, over a region; None if none serves the purpose.

    It is the best by `recommend` (which takes `options`) on the data's datum, else on one that is the same to 2 m, and
    not for other countries. If its convergence over the data is above `TURNED`, the next with less takes its place,
    provided that its figure is at most twice as large.
    """
    step = max(1, len(lon) // _POINTS)
    lon, lat = np.mod(lon[::step] + 180.0, 360.0) - 180.0, lat[::step]
    found = _candidates(crs, region, purpose, options)
    if not found:
        return None
    nodes = nodes_of(region, WGS84, _POINTS)
    everywhere = np.append(lon, np.mod(nodes.lon + 180.0, 360.0) - 180.0), np.append(lat, nodes.lat)
    own = [one for one in found if not _is_foreign(one.area_name, *everywhere)]
    own = _of_near_datum(crs, own, float(lon[0]), float(lat[0]))
    best = (own or found)[0]
    turned = {one.code: _turned(one.code, lon, lat) for one in own}
    if own and turned[best.code] > TURNED:
        less = [one for one in own if turned[one.code] <= TURNED and one.value <= _WORSE * best.value]
        best = less[0] if less else best
    code = best.code if keeps_datum(crs, best.code) else _twin_on_datum(crs, best)
    foreign = "" if own else f"None was found for the country of the data; this one is for {best.area_name}"
    return CrsForData(
        code, datum_transformation(crs, code, float(lon[0]), float(lat[0])), _turned(code, lon, lat), foreign
    )


def _candidates(crs: Any, region: Place, purpose: str, options: dict[str, Any]) -> tuple[Candidate, ...]:
    """The best CRSs on the data's datum, else on one of its name, else on any."""
    wanted = kept_datum(crs)
    if wanted and options.get("datum") is None:
        try:
            found = recommend(region, purpose=purpose, **(options | {"datum": wanted, "limit": _LOOKED_AT})).results
        except ValueError as error:
            if "Invalid datum" not in str(error):
                raise
            found = ()
        exact = tuple(one for one in found if _twin_on_datum(crs, one, ""))
        if found:
            return exact or found
    return recommend(region, purpose=purpose, **(options | {"limit": _OF_ALL_DATUMS})).results


def _of_near_datum(crs: Any, found: list[Candidate], lon: float, lat: float) -> list[Candidate]:
    """National CRSs on the data's datum to 2 m, else national ones on the latest datum, else others near, else all."""
    metres = {}
    for one in found:
        shift = datum_transformation(crs, _twin_on_datum(crs, one), lon, lat)
        metres[one.code] = 0.0 if shift is None else shift.metres
    known = [one for one in found if np.isfinite(metres[one.code])]
    near = [one for one in known if metres[one.code] <= _UNSEEN and one.share >= _WHOLE and not one.wide]
    national = [one for one in known if one.national]
    latest = max((one.datum_since or 0 for one in national), default=0)
    current = [one for one in national if (one.datum_since or 0) == latest]
    choices = ([one for one in near if one.national], current, near, known, found)
    return next(filter(None, choices), [])


def _twin_on_datum(crs: Any, one: Candidate, default: str | None = None) -> str:
    """The code of the map's CRS on the data's datum, else the default or the first."""
    return next((code for code in one.codes if keeps_datum(crs, code)), one.code if default is None else default)


def _turned(code: str, lon: FloatArray, lat: FloatArray) -> float:
    """RMS convergence at points, in degrees."""
    turns = meridian_convergence(jacobian(Projection.from_user_input(code), lon, lat))
    return float(np.sqrt(np.nanmean(turns**2))) if np.isfinite(turns).any() else np.nan


# ---- countries ------------------------------------------------------------------------------


def _is_foreign(area_name: str, lon: FloatArray, lat: FloatArray) -> bool:
    """True if an area of use names one or two countries, and hardly any of the points, which are on land, is in them.

    More countries share a zone, and the registry's list need not be complete.
    """
    from projdist.earth import natural_earth  # shapely is slow to load

    names = named([area_name], at_sea=True)
    if not 0 < len(names) <= _FEW:
        return False
    within = np.zeros(len(lon), dtype=bool)
    for name in names:
        outline = natural_earth.country(outline_keys()[name])
        if outline is not None:
            within |= natural_earth.near(outline, lon, lat, _NEAR)
    if within.mean() >= _LEAST:
        return False
    return bool(natural_earth.near(natural_earth.land("50m"), lon, lat, _NEAR).mean() > _LAND)


# ---- frames --------------------------------------------------------------------------------------


_MOST = 50_000  # vertices of polygons, which take twice the time of a box; more do not change which CRS is the best


def estimate_crs(frame: Any, *, purpose: str = "any", **options: Any) -> CRS:
    """The best existing CRS for the data of a GeoDataFrame or GeoSeries, as pyproj's.

    The region is the polygons themselves; for points, lines, and polygons with more than 50,000 vertices it is the
    narrowest box in longitude and latitude about them, across the antimeridian if that is narrower. The CRS is on the
    data's datum and for their country if there is one, as in `check`; a notice reports a datum shift of more than two
    metres, and a convergence of more than three degrees.

    Parameters
    ----------
    frame : GeoDataFrame or GeoSeries
        Data that state their CRS.
    purpose : str
        What the map must keep, as for `recommend`.
    **options
        Other options of `recommend`.

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
    found = crs_for_data(frame.crs, region, vertices.x.to_numpy(), vertices.y.to_numpy(), purpose=purpose, **options)
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
