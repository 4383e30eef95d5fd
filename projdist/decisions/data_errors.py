"""Errors of areas, lengths and bearings of geographic data in a CRS, against those on the ellipsoid.

Edges are straight in the data's own coordinates: in longitude and latitude, as in GeoJSON, or on the plane of the
data's CRS. In the CRS that is checked they are the same curves, so that errors are the map's alone, however far apart
the vertices are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.decisions.crs_for_data import crs_for_data
from projdist.decisions.data_edges import measure_chains
from projdist.decisions.ranking import get_purpose
from projdist.earth import MEAN_EARTH_RADIUS
from projdist.projections import (
    DataCrs,
    Projection,
    ProjectionLike,
    data_crs_of,
    is_geographic,
    tell_of_frame_in_degrees,
)
from projdist.regions import Box, bounding_box
from projdist.support import Answer, listed, plain

FAIL_ON = ("worst", "overall")
"""Errors to compare with a limit: those of every feature, or those of the totals."""

OUTSIDE = "beyond the edge of the CRS"
TORN = "torn by a cut of the CRS"

_EARTHLY = 1e-2  # relative difference of the radius from the Earth's, at most
_NAMES = ("name", "name_en", "title", "label", "id", "code", "geoid", "iso_a3", "fid")


@dataclass(frozen=True, kw_only=True)
class Totals:
    """Figures of all features that could be measured; errors are map / ground - 1, bearings in degrees.

    `undrawn` is the number of features beyond the edge of the CRS or torn by a cut of it. `worst` errors are the
    largest by absolute value, `rms` weights all features alike; `bearing_error` is the RMS along all edges,
    `largest_bearing_error` the largest anywhere on them. Figures that no feature has, as the area of lines, are NaN.
    """

    measured: int
    undrawn: int
    area_km2: float
    map_area_km2: float
    area_error: float
    worst_area_error: float
    rms_area_error: float
    length_km: float
    map_length_km: float
    length_error: float
    worst_length_error: float
    rms_length_error: float
    bearing_error: float
    worst_bearing_error: float
    largest_bearing_error: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Check(Answer):
    """The errors of data in a CRS: arrays (n,) with a value for each feature, by name, and totals.

    `features` has `index` (the frame's), `name`, `area_km2` and `length_km` (perimeters and lines) on the ground, the
    same on the map, the errors map / ground - 1, `bearing_error` (RMS of grid less true bearing along the edges, in
    degrees), `largest_bearing_error` and a `note`; NaN where there is nothing to measure. `recommended` is the check of
    the recommended CRS; `notes` give the reason if there is none. `region` is the narrowest box about the data, None if
    they have no place.
    """

    projection: Projection
    data_crs: str
    features: dict[str, AnyArray]
    overall: Totals
    recommended: Check | None = None
    notes: tuple[str, ...] = ()
    region: Box | None = field(default=None, repr=False, compare=False)

    def _line(self) -> str:
        return f"{len(self.features['index'])} features in {self.projection.name}"

    def to_dict(self) -> dict[str, Any]:
        """`{"crs", "name", "data_crs", "overall", "recommended", "notes", "results": [...]}`, a result a feature."""
        best = self.recommended
        return {
            **self._head(),
            "data_crs": self.data_crs,
            "recommended": best._head() if best else None,
            "notes": list(self.notes),
            "results": self.rows(range(len(self.features["index"]))),
        }

    def _head(self) -> dict[str, Any]:
        overall = {name: plain(value) for name, value in asdict(self.overall).items()}
        return {"crs": self.projection.definition, "name": self.projection.name, "overall": overall}

    def _table(self) -> dict[str, AnyArray]:
        return self.features

    def rows(self, numbers: Sequence[int] | range) -> list[dict[str, Any]]:
        """Features by their numbers, 0 for the first, as dictionaries; NaN and infinity become None."""
        columns = {name: values[list(numbers)].tolist() for name, values in self.features.items()}
        return [dict(zip(columns, map(plain, row), strict=True)) for row in zip(*columns.values(), strict=True)]

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

        `on` is worst for the errors of every feature, overall for those of the totals. A feature that cannot be drawn
        is above every limit.
        """
        if on not in FAIL_ON:
            raise ValueError(f"Invalid choice '{on}' of what to fail on. It must be {listed(FAIL_ON, 'or')}.")
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
    crs: ProjectionLike | None = None,
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
    from projdist.decisions.data_edges import outlines  # shapely is slow to load

    if not is_geographic(data):
        raise ValueError(f"Invalid data of type '{type(data).__name__}'. They must be a GeoDataFrame or GeoSeries.")
    if data.crs is None:
        raise ValueError("Invalid data. They state no CRS; they must state the one that they are in.")
    if crs is None and data.crs.is_geographic:
        raise ValueError(
            f"Invalid CRS '{data.crs.name}' of the data to check. It has longitudes and latitudes, and no map plane: "
            "name the projected CRS to check them in, crs= or --crs."
        )
    tell_of_frame_in_degrees(data, "the data")
    if purpose is not None:
        get_purpose(purpose)
    projection = Projection.from_user_input(data.crs if crs is None else crs)
    source = data_crs_of(projection, data.crs, "the data")
    drawn = outlines(data.geometry.to_numpy(), has_degrees=source.has_degrees)
    if not len(drawn.edges):
        kinds = ", ".join(sorted({note for note in drawn.notes if note})) or "no features"
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
    return replace(result, recommended=_measured(best, data_crs_of(best, data.crs, "the data"), drawn, labels))


def _names(data: Any, column: str | None) -> tuple[AnyArray, tuple[str, ...]]:
    """The values of a column as text, "" where missing, and a note on the choice.

    By default it is the first column with a usual name, else the only one of texts for all features, if all differ.
    """
    columns = [str(name) for name in getattr(data, "columns", ())]
    if column is not None and column not in columns:
        raise ValueError(f"Invalid column '{column}'. It must be {listed(columns, 'or') or 'left out'}.")
    usual = sorted((_NAMES.index(name.lower()), name) for name in columns if name.lower() in _NAMES)
    chosen = column or (usual[0][1] if usual else None)
    note: tuple[str, ...] = ()
    if chosen is None:
        texts = [name for name in columns if name in data and all(isinstance(one, str) for one in data[name].tolist())]
        if len(texts) == 1 and len(data) and data[texts[0]].is_unique:
            chosen = texts[0]
            note = (f"Names are those of '{chosen}', the only column of texts.",)
    if chosen is None:
        return np.array([""] * len(data), dtype=object), note
    missing = data[chosen].isna().tolist()
    names = ["" if none else text for text, none in zip(data[chosen].astype(str).tolist(), missing, strict=True)]
    return np.array(names, dtype=object), note


def _recommended(
    projection: Projection,
    source: DataCrs,
    crs: Any,
    edges: FloatArray,
    region: Box | None,
    purpose: str,
    options: dict[str, Any],
) -> tuple[Projection | None, tuple[str, ...]]:
    """The best CRS for data of edges, with notes on it, or None with the reason."""
    if region is None:
        return None, ("No CRS is recommended: the data have no place on the Earth.",)
    if abs(projection.ellipsoid.a / MEAN_EARTH_RADIUS - 1.0) > _EARTHLY:
        return None, ("No CRS is recommended: that is done for the Earth only.",)
    lon, lat = source.degrees(edges[:, 0], edges[:, 1])
    known = np.isfinite(lon) & (np.abs(lat) <= 90.0)
    found = crs_for_data(crs, region, lon[known], lat[known], purpose=purpose, **options)
    if found is None:
        return None, (f"No CRS is recommended: none serves '{purpose}' in {region.name}.",)
    return Projection.from_user_input(found.code), tuple(f"{found.code}: {note}" for note in found.notes)


def _extent(source: DataCrs, edges: FloatArray) -> Box | None:
    """The narrowest box about the ends of edges; None if they have no place."""
    (lon0, lat0), (lon1, lat1) = (source.degrees(edges[:, k], edges[:, k + 1]) for k in (0, 2))
    east = (lon1 - lon0 + 180.0) % 360.0 - 180.0
    known = np.isfinite(east) & (np.abs(lat0) <= 90.0) & (np.abs(lat1) <= 90.0)
    if not known.any():
        return None
    west = np.where(east < 0.0, lon0 + east, lon0)
    south, north = np.minimum(lat0, lat1), np.maximum(lat0, lat1)
    return bounding_box(west[known], south[known], (west + np.abs(east))[known], north[known])


# ---- measurement ----------------------------------------------------------------------------


def _measured(projection: Projection, source: DataCrs, drawn: Any, labels: dict[str, AnyArray]) -> Check:
    """The errors of outlines in a map."""
    found = measure_chains(projection, source.degrees_on_map, drawn.edges, drawn.chain)
    count = len(drawn.notes)
    notes = np.array(drawn.notes, dtype=object)

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
    return Check(
        projection=projection, data_crs=source.name, features=features, overall=_totals(features, outside | torn)
    )


def _totals(features: dict[str, AnyArray], undrawn: BoolArray) -> Totals:
    # The sums of finite values, NaN if there are none.
    area, map_area, length, map_length = (
        float(np.nansum(features[name])) if np.isfinite(features[name]).any() else np.nan
        for name in ("area_km2", "map_area_km2", "length_km", "map_length_km")
    )
    square = float(np.nansum(features["bearing_error"] ** 2 * features["length_km"]))
    worst_area, rms_area = _worst_and_rms(features["area_error"])
    worst_length, rms_length = _worst_and_rms(features["length_error"])
    return Totals(
        measured=int(np.isfinite(features["length_km"]).sum()),
        undrawn=int(undrawn.sum()),
        area_km2=area,
        map_area_km2=map_area,
        area_error=float(_error(map_area, area)),
        worst_area_error=worst_area,
        rms_area_error=rms_area,
        length_km=length,
        map_length_km=map_length,
        length_error=float(_error(map_length, length)),
        worst_length_error=worst_length,
        rms_length_error=rms_length,
        bearing_error=float(np.sqrt(_ratio(square, length))),
        worst_bearing_error=_worst_and_rms(features["bearing_error"])[0],
        largest_bearing_error=_worst_and_rms(features["largest_bearing_error"])[0],
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
