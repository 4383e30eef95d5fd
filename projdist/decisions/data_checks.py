"""Errors of areas, lengths and bearings of geographic data in a CRS, and the best CRS for data."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from projdist import earth, matrices, projections, regions, support
from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.decisions.candidate_crs import Candidate, named, outline_keys
from projdist.decisions.data_edges import Outlines, measure_chains, outlines
from projdist.decisions.ranking import get_purpose
from projdist.decisions.recommendation import ranked_crs
from projdist.field import jacobian, nodes_of

TURNED = 3.0
"""Degrees between grid north and true north, more than within 3 degrees of a zone's meridian anywhere."""

_UNSEEN = 2.0  # metres: the accuracy of WGS 84 if its realisation is not known
_WORSE = 2.0  # largest ratio of a less turned map's key to that of the best
_LOOKED_AT, _OF_ALL_DATUMS = 10, 80  # how many of the best CRSs are looked at, on one datum and on any
_WHOLE = 0.99  # share of the region in the area of use, at least
_POINTS = 200  # of the data, and of the region
_LAND, _LEAST = 0.5, 0.1  # shares of the points that must be on land, and in a country
_FEW = 2  # countries: areas of use with more are those of shared zones
_NEAR = 0.03  # degrees: a little more than the accuracy of outlines, 2 km


@dataclass(frozen=True)
class CrsForData:
    """A CRS for data, with the datum shift that it needs, if any, and the RMS convergence in degrees."""

    code: str
    shift: projections.DatumTransformation | None
    convergence: float
    foreign: str = ""  # a note that it is for another country, as none was found for the data's own

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
    crs: Any, region: regions.Place, lon: FloatArray, lat: FloatArray, *, purpose: str = "any", **options: Any
) -> CrsForData | None:
    """The CRS for data in a CRS, with vertices (n,) in degrees, over a region; None if none serves the purpose."""
    # The best by `recommend`, which takes `options`, on the data's datum or one within 2 m of it, and not for other
    # countries. If its convergence is above `TURNED`, the next takes its place that is below, with a key at most twice.
    step = max(1, len(lon) // _POINTS)
    lon, lat = np.mod(lon[::step] + 180.0, 360.0) - 180.0, lat[::step]
    found = _candidates(crs, region, purpose, options)
    if not found:
        return None
    nodes = nodes_of(region, earth.WGS84, _POINTS)
    everywhere = np.append(lon, np.mod(nodes.lon + 180.0, 360.0) - 180.0), np.append(lat, nodes.lat)
    own = [one for one in found if not _is_foreign(one.area_name, *everywhere)]
    first = float(lon[0]), float(lat[0])
    own = _of_near_datum(crs, own, *first)
    best = (own or found)[0]
    if own and _turned(best.code, lon, lat) > TURNED:
        close = (one for one in own if one.key[0] <= _WORSE * best.key[0])
        best = next((one for one in close if _turned(one.code, lon, lat) <= TURNED), best)
    code = best.code if projections.keeps_datum(crs, best.code) else _twin_on_datum(crs, best)
    foreign = "" if own else f"None was found for the country of the data; this one is for {best.area_name}"
    shift = projections.datum_transformation(crs, code, *first)
    return CrsForData(code, shift, _turned(code, lon, lat), foreign)


def _candidates(crs: Any, region: regions.Place, purpose: str, options: dict[str, Any]) -> tuple[Candidate, ...]:
    """The best CRSs on the data's datum, else on a datum of that name, else on any."""
    wanted = projections.kept_datum(crs)
    if wanted and options.get("datum") is None:
        try:
            found = ranked_crs(region, purpose=purpose, **(options | {"datum": wanted, "limit": _LOOKED_AT}))
        except ValueError as error:
            if "Invalid datum" not in str(error):
                raise
            found = ()
        exact = tuple(one for one in found if _twin_on_datum(crs, one, ""))
        if found:
            return exact or found
    return ranked_crs(region, purpose=purpose, **(options | {"limit": _OF_ALL_DATUMS}))


def _of_near_datum(crs: Any, found: list[Candidate], lon: float, lat: float) -> list[Candidate]:
    """National CRSs on the data's datum to 2 m, else national ones on the latest datum, else others near, else all."""

    @functools.cache
    def metres(code: str) -> float:
        shift = projections.datum_transformation(crs, code, lon, lat)
        return 0.0 if shift is None else shift.metres

    def known(some: Iterable[Candidate], most: float = float(np.finfo(float).max)) -> list[Candidate]:
        return [one for one in some if metres(_twin_on_datum(crs, one)) <= most]

    def near(some: Iterable[Candidate]) -> list[Candidate]:
        return known((one for one in some if one.share >= _WHOLE and not one.wide), _UNSEEN)

    national = known(one for one in found if one.national)
    latest = max((one.since for one in national), default=0)
    current = [one for one in national if one.since == latest]
    return near(national) or current or near(found) or known(found) or found


def _twin_on_datum(crs: Any, one: Candidate, default: str | None = None) -> str:
    """The code of the map's CRS on the data's datum; else `default`, or the map's first code if that is None."""
    otherwise = one.code if default is None else default
    return next((code for code in one.codes if projections.keeps_datum(crs, code)), otherwise)


def _turned(code: str, lon: FloatArray, lat: FloatArray) -> float:
    """RMS convergence at points, in degrees."""
    turns = matrices.meridian_convergence(jacobian(projections.Projection.from_user_input(code), lon, lat))
    return float(np.sqrt(np.nanmean(turns**2))) if np.isfinite(turns).any() else np.nan


def _is_foreign(area_name: str, lon: FloatArray, lat: FloatArray) -> bool:
    """True if an area of use names one or two countries, and hardly any of the points on land are in them."""
    # If it names more, it is that of a shared zone, and its list may be incomplete.
    names = named([area_name], at_sea=True)
    if not 0 < len(names) <= _FEW:
        return False
    world = earth.natural_earth
    known = filter(None, (world.country(outline_keys()[name]) for name in names))
    if np.any([world.near(outline, lon, lat, _NEAR) for outline in known], axis=0).mean() >= _LEAST:
        return False
    box = lon.min() - _NEAR, lat.min() - _NEAR, lon.max() + _NEAR, lat.max() + _NEAR
    return bool(world.near(world.polygons_within("land", box, "50m"), lon, lat, _NEAR).mean() > _LAND)


_MOST = 50_000  # vertices of polygons, at which they take twice the time of a box; a box then finds the same CRS


def estimate_crs(frame: Any, *, purpose: str = "any", **options: Any) -> projections.CRS:
    """The best existing CRS for the data of a GeoDataFrame or GeoSeries, as pyproj's.

    The region is the polygons themselves; for points, lines, and polygons with more than 50,000 vertices it is the
    narrowest box in longitude and latitude about them, across the antimeridian if that is narrower. The CRS is on the
    data's datum and for their country if there is one, as in `check`; notices report shifts and convergences.

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
        For other data, without a CRS or any geometry, a purpose that no CRS serves there, and where `recommend` does.

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
    if not projections.is_geographic(frame):
        raise ValueError(f"Invalid data {support.quoted(frame)}. They must be a GeoDataFrame or GeoSeries.")
    if frame.crs is None:
        raise ValueError("Invalid data. It must have a CRS: set it with frame.set_crs(...).")
    projections.tell_of_frame_in_degrees(frame, "the data")
    shapes = frame.geometry.set_crs(projections.crs_of(frame.crs), allow_override=True).to_crs("OGC:CRS84")
    shapes = shapes[~(shapes.isna() | shapes.is_empty)]
    if not len(shapes):
        raise ValueError("Invalid data. It must have a geometry that is not empty.")
    vertices = shapes.get_coordinates()
    polygons = shapes.geom_type.isin(("Polygon", "MultiPolygon")).all() and shapes.is_valid.all()
    if polygons and len(vertices) <= _MOST:
        region: regions.Region = regions.polygons_from_geojson(shapes.__geo_interface__, "the polygons")
    else:
        parts = shapes.explode(index_parts=False).bounds
        region = regions.bounding_box(*(parts[name].to_numpy() for name in ("minx", "miny", "maxx", "maxy")))
    found = crs_for_data(frame.crs, region, vertices.x.to_numpy(), vertices.y.to_numpy(), purpose=purpose, **options)
    if found is None:
        raise ValueError(f"Invalid purpose '{purpose}' for {region.name}. No CRS serves it there.")
    for note in found.warnings:
        support.tell(note)
    return projections.CRS.from_user_input(found.code)


# ---- data errors ---------------------------------------------------------------------------------

FAIL_ON = ("worst", "overall")
"""Errors to compare with a limit: those of every feature, or those of the totals."""

OUTSIDE = "beyond the edge of the CRS"
TORN = "torn by a cut of the CRS"

_EARTHLY = 1e-2  # relative difference of the radius from the Earth's, at most
_NAMES = ("name", "name_en", "title", "label", "id", "code", "geoid", "iso_a3", "fid")


@dataclass(frozen=True, kw_only=True)
class Totals(support.Record):
    """Figures of all features that could be measured; NaN if no feature has them, as the area of lines."""

    measured: int
    undrawn: int  # beyond the edge of the CRS, or torn by a cut of it
    area_km2: float
    map_area_km2: float
    area_error: float  # map / ground - 1
    worst_area_error: float  # of any feature, by absolute value
    rms_area_error: float  # of all features alike
    length_km: float
    map_length_km: float
    length_error: float
    worst_length_error: float
    rms_length_error: float
    bearing_error: float  # degrees, the RMS along all edges
    worst_bearing_error: float
    largest_bearing_error: float  # anywhere on the edges


_NAMED = {"crs": "definition", "name": "name"}
_RECOMMENDED = {"crs": "projection.definition", "name": "projection.name", "overall": "overall"}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Check(support.Answer):
    """The errors of data in a CRS: arrays (n,) with a value for each feature, by name, and totals.

    `features` has `index` (the frame's), `name`, `area_km2` and `length_km` (perimeters and lines) on the ground, the
    same on the map, the errors map / ground - 1, `bearing_error` (RMS of grid less true bearing along the edges, in
    degrees), `largest_bearing_error` and a `note`; NaN where there is nothing to measure. `recommended` is the check of
    the recommended CRS; `notes` give the reason if there is none. `region` is the narrowest box about them, or None.
    """

    projection: projections.Projection = field(metadata=support.schema(of=_NAMED, spread=True))
    overall: Totals
    data_crs: str
    recommended: Check | None = field(default=None, metadata=support.schema(of=_RECOMMENDED))
    notes: tuple[str, ...] = ()
    features: dict[str, AnyArray] = field(metadata=support.HIDDEN)
    region: regions.Box | None = field(default=None, metadata=support.HIDDEN)

    def _line(self) -> str:
        return f"{len(self.features['index'])} features in {self.projection.name}"

    def to_dict(self) -> dict[str, Any]:
        """`{"crs", "name", "data_crs", "overall", "recommended", "notes", "results": [...]}`, a result a feature."""
        return super().to_dict() | {"results": self.plain_rows()}

    def _table(self) -> dict[str, AnyArray]:
        return self.features

    def rows(self, numbers: Sequence[int] | range) -> list[dict[str, Any]]:
        """Features by their numbers, 0 for the first, as dictionaries; NaN and infinity become None."""
        columns = {name: values[list(numbers)].tolist() for name, values in self.features.items()}
        return [dict(zip(columns, map(support.plain, row), strict=True)) for row in zip(*columns.values(), strict=True)]

    def worst(self, count: int) -> list[int]:
        """The numbers of the features with the largest error of area or length, the worst first."""
        errors = np.fmax(np.abs(self.features["area_error"]), np.abs(self.features["length_error"]))
        order = np.argsort(-np.nan_to_num(errors, nan=-1.0), kind="stable")
        return [int(number) for number in order[:count] if errors[number] == errors[number]]

    def undrawn(self) -> list[int]:
        """The numbers of the features that the CRS cannot draw."""
        return [number for number, note in enumerate(self.features["note"]) if OUTSIDE in note or TORN in note]

    def above(self, limit: float | None = None, *, bearing: float | None = None, on: str = "worst") -> bool:
        """True if an error of area or length is above the limit, or one of bearing above its limit in degrees.

        `on`: worst for errors of every feature, overall for totals. Features that cannot be drawn are above any limit.
        """
        if on not in FAIL_ON:
            raise ValueError(f"Invalid choice '{on}' of what to fail on. It must be {support.listed(FAIL_ON, 'or')}.")
        total = self.overall
        if on == "worst":
            sizes, turn = [total.worst_area_error, total.worst_length_error], total.worst_bearing_error
        else:
            sizes, turn = [total.area_error, total.length_error], total.bearing_error
        return bool(
            (total.undrawn and (limit is not None or bearing is not None))
            or (limit is not None and any(abs(size) > limit for size in sizes))
            or (bearing is not None and turn > bearing)
        )


def check(
    data: Any,
    crs: projections.ProjectionLike | None = None,
    *,
    column: str | None = None,
    purpose: str | None = "any",
    **options: Any,
) -> Check:
    """The errors of area, length and bearing that a GeoDataFrame or GeoSeries has in a CRS.

    They are relative to the ellipsoid; edges are straight in the data's own coordinates.

    Parameters
    ----------
    data : GeoDataFrame or GeoSeries
        Lines and polygons that state their CRS.
    crs : ProjectionLike, optional
        The CRS to check, whatever `Projection.from_user_input` takes; by default the data's own. Data in longitude and
        latitude need one.
    column : str, optional
        The column of the features' names; by default one with a usual name, or the only one of texts.
    purpose : str or None
        The purpose of the recommended CRS, as for `recommend`; None leaves that CRS out.
    **options
        Other options of `recommend`, which is asked for the narrowest box about the data.

    Returns
    -------
    Check
        Errors map / ground - 1 of each feature and of all, bearings in degrees, and the same in the recommended CRS.

    Raises
    ------
    ValueError
        For other data, without a CRS, lines or polygons, for an unknown column or purpose, for data in longitude and
        latitude without `crs`, and where `recommend` does.
    ProjectionError
        For a CRS that PROJ refuses.

    References
    ----------
    Edges: RFC 7946, The GeoJSON Format, section 3.1.1.

    Examples
    --------
    Along the central meridian of a zone of UTM the scale is 0.9996:

    >>> import geopandas, shapely
    >>> line = geopandas.GeoSeries([shapely.LineString([(9, 47), (9, 48)])], crs="EPSG:4326")
    >>> round(check(line, "EPSG:32632", purpose=None).overall.length_error, 9)
    -0.0004
    """
    if not projections.is_geographic(data):
        raise ValueError(f"Invalid data of type '{type(data).__name__}'. They must be a GeoDataFrame or GeoSeries.")
    if data.crs is None:
        raise ValueError("Invalid data. They state no CRS; they must state the one that they are in.")
    if not len(data):
        raise ValueError("Invalid data. They have no features.")
    if crs is None and data.crs.is_geographic:
        raise ValueError(
            f"Invalid CRS '{data.crs.name}' of the data to check. It has longitudes and latitudes, and no map plane: "
            "name the projected CRS to check them in, crs= or --crs."
        )
    projections.tell_of_frame_in_degrees(data, "the data")
    if purpose is not None:
        get_purpose(purpose)
    projection = projections.Projection.from_user_input(data.crs if crs is None else crs)
    source = projections.data_crs_of(projection, data.crs, "the data")
    drawn = outlines(data.geometry.to_numpy(), has_degrees=source.has_degrees)
    if not len(drawn.edges):
        kinds = ", ".join(sorted({note for note in drawn.notes if note}))
        raise ValueError(f"Invalid data. They have no lines and no polygons to measure, but {kinds}.")
    names, note_on_names = _names(data, column)
    index = [value if isinstance(value, int | str) else str(value) for value in data.index.tolist()]
    labels: dict[str, AnyArray] = {"index": np.array(index, dtype=object), "name": names}
    extent = _extent(source, drawn.edges)
    result = replace(_measured(projection, source, drawn, labels), notes=note_on_names, region=extent)
    if purpose is None:
        return result
    best, notes = _recommended(projection, source, data.crs, drawn.edges, extent, purpose, options)
    result = replace(result, notes=(*result.notes, *notes))
    if best is None:
        return result
    plane = projections.data_crs_of(best, data.crs, "the data")
    return replace(result, recommended=_measured(best, plane, drawn, labels))


def _names(data: Any, column: str | None) -> tuple[AnyArray, tuple[str, ...]]:
    """The values of a column as text, "" where missing, and a note on the choice."""
    # By default it is the first column with a usual name, else the only one of texts for all features, if all differ.
    columns = [str(name) for name in getattr(data, "columns", ())]
    if column is not None and column not in columns:
        raise ValueError(f"Invalid column '{column}'. It must be {support.listed(columns, 'or') or 'left out'}.")
    usual = sorted((_NAMES.index(name.lower()), name) for name in columns if name.lower() in _NAMES)
    chosen = column or (usual[0][1] if usual else None)
    note: tuple[str, ...] = ()
    if chosen is None:
        texts = [name for name in columns if name in data and all(isinstance(one, str) for one in data[name].tolist())]
        if len(texts) == 1 and len(data) and data[texts[0]].is_unique:
            chosen = texts[0]
            note = (f"Names are those of '{chosen}', the only column of texts.",)
    none = np.full(len(data), "", dtype=object)
    return (none if chosen is None else np.where(data[chosen].isna(), none, data[chosen].astype(str))), note


def _recommended(
    projection: projections.Projection,
    source: projections.DataCrs,
    crs: Any,
    edges: FloatArray,
    region: regions.Box | None,
    purpose: str,
    options: dict[str, Any],
) -> tuple[projections.Projection | None, tuple[str, ...]]:
    """The best CRS for data of edges, with notes on it, or None with the reason."""
    if region is None:
        return None, ("No CRS is recommended: the data have no place on the Earth.",)
    if abs(projection.ellipsoid.a / earth.MEAN_EARTH_RADIUS - 1.0) > _EARTHLY:
        return None, ("No CRS is recommended: that is done for the Earth only.",)
    lon, lat = source.degrees(edges[:, 0], edges[:, 1])
    known = np.isfinite(lon) & (np.abs(lat) <= 90.0)
    found = crs_for_data(crs, region, lon[known], lat[known], purpose=purpose, **options)
    if found is None:
        return None, (f"No CRS is recommended: none serves '{purpose}' in {region.name}.",)
    return projections.Projection.from_user_input(found.code), tuple(f"{found.code}: {note}" for note in found.notes)


def _extent(source: projections.DataCrs, edges: FloatArray) -> regions.Box | None:
    """The narrowest box about the ends of edges; None if they have no place."""
    (lon0, lat0), (lon1, lat1) = (source.degrees(edges[:, k], edges[:, k + 1]) for k in (0, 2))
    east = (lon1 - lon0 + 180.0) % 360.0 - 180.0
    known = np.isfinite(east) & (np.abs(lat0) <= 90.0) & (np.abs(lat1) <= 90.0)
    if not known.any():
        return None
    west = np.where(east < 0.0, lon0 + east, lon0)
    south, north = np.minimum(lat0, lat1), np.maximum(lat0, lat1)
    return regions.bounding_box(west[known], south[known], (west + np.abs(east))[known], north[known])


# ---- measurement ----------------------------------------------------------------------------


def _measured(
    projection: projections.Projection, source: projections.DataCrs, drawn: Outlines, labels: dict[str, AnyArray]
) -> Check:
    """The errors of outlines in a map."""
    found = measure_chains(projection, source.degrees_on_map, drawn.edges, drawn.chain)
    count, notes = len(drawn.notes), drawn.notes.copy()

    def total(values: FloatArray | BoolArray) -> FloatArray:
        return np.bincount(drawn.feature, weights=values, minlength=count).astype(float)

    outside, torn = total(found.outside) > 0, total(found.torn) > 0
    for text, chosen in ((OUTSIDE, outside), (TORN, torn & ~outside)):
        notes[chosen] = [f"{note}; {text}" if note else text for note in notes[chosen]]
    polygons = total(drawn.sign > 0) > 0
    known = ~(outside | torn) & (total(np.ones(len(drawn.feature))) > 0)
    area, map_area = (
        np.where(polygons & known, 1e-6 * total(drawn.sign * np.abs(values)), np.nan)
        for values in (found.area, found.map_area)
    )
    length, map_length = (np.where(known, 1e-3 * total(values), np.nan) for values in (found.length, found.map_length))
    square = total(found.bearing_square) * 1e-3
    most = np.zeros(count)
    np.maximum.at(most, drawn.feature, found.bearing_most)
    features = labels | {
        "area_km2": area,
        "map_area_km2": map_area,
        "area_error": _error(map_area, area),
        "length_km": length,
        "map_length_km": map_length,
        "length_error": _error(map_length, length),
        "bearing_error": np.sqrt(_ratio(np.where(known, square, np.nan), length)),
        "largest_bearing_error": np.where(known, most, np.nan),
        "note": notes,
    }
    overall = _totals(features, outside | torn)
    return Check(projection=projection, data_crs=source.name, features=features, overall=overall)


def _totals(features: dict[str, AnyArray], undrawn: BoolArray) -> Totals:
    figures: dict[str, float] = {}
    for what, unit in (("area", "km2"), ("length", "km")):
        names = (f"{what}_{unit}", f"map_{what}_{unit}")
        ground, drawn = (  # the sums of finite values, NaN if there are none
            float(np.nansum(features[name])) if np.isfinite(features[name]).any() else np.nan for name in names
        )
        figures |= dict(zip(names, (ground, drawn), strict=True)) | {f"{what}_error": float(_error(drawn, ground))}
        worst, rms = _worst_and_rms(features[f"{what}_error"])
        figures |= {f"worst_{what}_error": worst, f"rms_{what}_error": rms}
    square = float(np.nansum(features["bearing_error"] ** 2 * features["length_km"]))
    return Totals(
        measured=int(np.isfinite(features["length_km"]).sum()),
        undrawn=int(undrawn.sum()),
        bearing_error=float(np.sqrt(_ratio(square, figures["length_km"]))),
        worst_bearing_error=_worst_and_rms(features["bearing_error"])[0],
        largest_bearing_error=_worst_and_rms(features["largest_bearing_error"])[0],
        **figures,
    )


def _worst_and_rms(errors: FloatArray) -> tuple[float, float]:
    known = errors[np.isfinite(errors)]
    if not known.size:
        return np.nan, np.nan
    return float(known[np.argmax(np.abs(known))]), float(np.sqrt(np.mean(known**2)))


def _ratio(over: Any, under: Any) -> FloatArray:
    """A ratio, NaN where the denominator is not positive."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.asarray(under) > 0.0, np.divide(over, under), np.nan)


def _error(on_map: Any, on_ground: Any) -> FloatArray:
    return _ratio(on_map, on_ground) - 1.0
