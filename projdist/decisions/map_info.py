"""A card of one map: what it states, its errors, and what it keeps true (angles, areas up to a constant, distances).

A map keeps a property if it departs from it by less than a limit in 99 % of the region; the rest allows for singular
points, as poles. The limit is 1e-5: PROJ's iterations leave 2e-6, formulas of a sphere on an ellipsoid 1e-3.
In a small region every map departs little: by about the mean square of the distances across the region, in units of the
Earth's radius, and by a twentieth of that at least. There the limit is a thousandth of that square, and at least 1e-9,
the accuracy of derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from projdist import earth, matrices, numerics, projections, support
from projdist._typing import FloatArray
from projdist.field import AiryKavrayskiy, Extreme, nodes_of, sample
from projdist.regions import Place, RegionLike, region_for
from projdist.support import Answer, FieldSchema, Record, plain, schema

_SHARE = 0.99  # of the region, in which a property must be kept
_LARGEST, _LEAST = 1e-5, 1e-9  # limits of departures, as scales less 1
_CURVED = 1e-3  # of the mean square across a region


@dataclass(frozen=True)
class WeightedPoints:
    """Points in degrees with their shares of the area, each (n,); those of weight 0 lie on edges and do not count."""

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray


@dataclass(frozen=True, kw_only=True)
class Properties:
    """Properties that a map keeps, and its departures from each of `PROPERTIES`, as logarithms of scales."""

    keeps: tuple[str, ...]
    departures: dict[str, float]


def properties_of(J: FloatArray, points: WeightedPoints) -> Properties:
    """Properties of a map with Jacobians (n, 2, 2) at points; none, with departures NaN, if all are undefined."""
    counts = (points.weight > 0.0) & np.isfinite(matrices.fisher(J))
    if not counts.any():
        return Properties(keeps=(), departures=dict.fromkeys(PROPERTIES, float("nan")))
    J, weight = J[counts], points.weight[counts]
    departures = {name: numerics.quantile(off(J, weight), weight, _SHARE) for name, off in PROPERTIES.items()}
    limit = np.clip(_CURVED * _square_across(points.lon[counts], points.lat[counts], weight), _LEAST, _LARGEST)
    return Properties(keeps=tuple(name for name, off in departures.items() if off <= limit), departures=departures)


def _square_across(lon: FloatArray, lat: FloatArray, weight: FloatArray) -> float:
    """Mean square of the distances of points from the great circle nearest to them, on a sphere of radius 1."""
    vectors = earth.unit_vectors(lon, lat)
    return float(np.linalg.eigvalsh(weight * vectors @ vectors.T)[0] / weight.sum())


def _off_areas(J: FloatArray, weight: FloatArray) -> FloatArray:
    """Departure of the areal scale from its median, which need not be 1."""
    scale = matrices.log_areal_scale(J)
    return np.abs(scale - numerics.quantile(scale, weight, 0.5))


PROPERTIES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "equal-area": _off_areas,
    "conformal": lambda J, weight: matrices.log_anisotropy(J),
    # The departure of the principal scale that is nearest to 1: along meridians, from a point, or from a line.
    "equidistant": lambda J, weight: np.min(np.abs(np.log(matrices.principal_scales(J))), axis=-1),
}


# ---- map info ------------------------------------------------------------------------------------

INFO_MEASURES = ("scale_error_ppm", "omega", "s", "h", "k")
"""Measures of a map over its area of use."""

INFO_TOLERANCE = 1e-4
_NODES = 400


def _at(name: str) -> dict[str, FieldSchema]:
    """Metadata of an extreme: its value, error and place."""
    keys = {name: "value", f"{name}_error": "error", f"{name}_lon": "lon", f"{name}_lat": "lat"}
    return schema(of=keys, spread=True)


@dataclass(frozen=True, kw_only=True)
class MeasureRange(Record):
    """Mean, minimum and maximum of a measure over a region, each with its error; infinite if it diverges."""

    mean: support.Estimate = field(metadata=schema(of={"mean": "value", "mean_error": "error"}, spread=True))
    minimum: Extreme = field(metadata=_at("min"))
    maximum: Extreme = field(metadata=_at("max"))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MapInfo(Answer):
    """A projection by itself; `projection` and `given` are what was asked for."""

    projection: projections.Projection
    given: str
    crs_metadata: projections.CrsMetadata  #: what is stated: kind, code, area, datum, ellipsoid, unit, axes, method
    keeps: tuple[str, ...]  #: as measured: "equal-area", "conformal", "equidistant"
    #: The largest departure from each property in 99 % of the area of use, as a ratio of scales less 1; NaN if unknown.
    departures: dict[str, float]
    promises: str  #: the property that the method is known to keep, "conformal" or "equal-area", or ""
    #: Names of CRSs that draw the same map, by code: on other datums, or with other false origins, axes or units.
    same_map: dict[str, str]
    region: Place  #: where the errors are measured
    coverage: float  #: share of the region that can be projected
    airy_kavrayskiy: AiryKavrayskiy  #: with the largest of their errors
    measures: dict[str, MeasureRange]  #: by the names in `INFO_MEASURES`

    def _line(self) -> str:
        kept = " and ".join(self.keeps) or "keeps nothing"
        return f"{self.projection.name}, {kept}; AK {self.airy_kavrayskiy.raw:.4g} over {self.region.name}"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; NaN and infinity become None."""
        given, stated, ellipsoid = self.projection, self.crs_metadata, self.projection.ellipsoid
        inverse = 1.0 / ellipsoid.f if ellipsoid.f else None

        def of(source: Any, *names: str) -> dict[str, Any]:
            return {name: getattr(source, name) for name in names}

        found = {
            **{"projection": self.given, "code": stated.code, "name": given.name, "kind": stated.kind},
            **{"definition": given.definition, **of(stated, "deprecated", "replaced_by")},
            **of(self, "keeps", "departures", "promises"),
            "area_of_use": {"name": stated.area_name, "bounds": given.area_of_use},
            **of(stated, "scope", "remarks", "datum", "geographic_crs", "prime_meridian"),
            "ellipsoid": {"name": stated.ellipsoid_name, "a": ellipsoid.a, "inverse_flattening": inverse},
            "unit": {"name": stated.unit, "metres": stated.unit_metres},
            **of(stated, "axes", "method", "parameters"),
            "same_map": [{"code": code, "name": name} for code, name in self.same_map.items()],
            "region": {"name": self.region.name},
            "errors": self._figures() | self.measures,
        }
        return plain(found)

    def _figures(self) -> dict[str, Any]:
        found = self.airy_kavrayskiy
        return {
            "coverage": self.coverage,
            "airy_kavrayskiy": found.raw,
            "airy_kavrayskiy_scaled": found.scaled,
            "airy_kavrayskiy_affine": found.affine,
            "error_estimate": found.error,
        }

    def row(self) -> dict[str, Any]:
        """The card as a flat row, as in a frame; NaN and infinity become None, lists become texts."""
        card = self.to_dict()
        area, ellipsoid = card["area_of_use"], card["ellipsoid"]
        row = {key: card[key] for key in ("projection", "code", "name", "kind", "deprecated", "method")}
        row |= {"replaced_by": ";".join(card["replaced_by"]), "keeps": ";".join(self.keeps)}
        row |= {"area_of_use": area["name"]}
        row |= dict(zip(("west", "south", "east", "north"), area["bounds"] or (None,) * 4, strict=True))
        row |= {"datum": card["datum"], "geographic_crs": card["geographic_crs"], "ellipsoid": ellipsoid["name"]}
        row |= {"a": ellipsoid["a"], "inverse_flattening": ellipsoid["inverse_flattening"]}
        row |= {"unit": card["unit"]["name"], "axes": ";".join(axis["direction"] for axis in card["axes"])}
        row["region"] = self.region.name
        measures = {
            f"{name}_{key}": value for name, found in self.measures.items() for key, value in found.to_dict().items()
        }
        return plain(row | self._figures() | measures)

    def _table(self) -> list[dict[str, Any]]:
        return [self.row()]


def info(
    projection: projections.ProjectionLike, region: RegionLike | None = None, *, tolerance: float = INFO_TOLERANCE
) -> MapInfo:
    """A card of one map: what it states, what it keeps as measured, and its errors over its area of use.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes: a name, a PROJ string, the code of a CRS, WKT, a file, a
        function.
    region : RegionLike, optional
        The region of the errors, by default the area of use of a CRS, or the globe for other projections. What a map
        keeps is always measured over these.
    tolerance : float, default 1e-4
        Relative tolerance of the Airy-Kavrayskiy errors and the means: four digits of a card.

    Returns
    -------
    MapInfo
        What is stated (`crs_metadata`), what is kept (`keeps`, `departures`), CRSs that draw the same map (`same_map`),
        and the errors (`airy_kavrayskiy`, and `measures`, those of `INFO_MEASURES`).

    Raises
    ------
    ProjectionError
        For what is no projection, or cannot be computed in the region.
    ValueError
        For an unknown region, and a tolerance that is not positive.

    References
    ----------
    - J. P. Snyder 1987, Map Projections: A Working Manual, USGS Professional Paper 1395, pages 3-6 and 20-24.
    - EPSG Geodetic Parameter Dataset, https://epsg.org.

    Examples
    --------
    >>> europe = info("EPSG:3035")
    >>> europe.keeps, europe.crs_metadata.ellipsoid_name, [axis.direction for axis in europe.crs_metadata.axes]
    (('equal-area',), 'GRS 1980', ['north', 'east'])
    """
    measured = projections.Projection.from_user_input(projection)
    place = region_for(region, [measured])
    field = sample(measured, place, measures=INFO_MEASURES, tolerance=tolerance)
    extremes = field.extremes(INFO_MEASURES)
    stated, declared = projections.metadata_of(measured), projections.declared_property_of(measured)
    nodes = nodes_of(region_for(None, [measured]), measured.ellipsoid, _NODES)
    properties = properties_of(nodes.jacobian(measured)[0], WeightedPoints(nodes.lon, nodes.lat, nodes.weight))
    return MapInfo(
        projection=measured,
        given=projection if isinstance(projection, str) else measured.label,
        crs_metadata=stated,
        keeps=properties.keeps,
        departures=properties.departures,
        promises=declared.keeps if declared else "",
        same_map=projections.codes_of_same_map(stated.code) if stated.code else {},
        region=place,
        coverage=field.coverage,
        airy_kavrayskiy=field.airy_kavrayskiy,
        measures={
            name: MeasureRange(mean=field.mean(name), minimum=least, maximum=largest)
            for name, (least, largest) in zip(INFO_MEASURES, extremes, strict=True)
        },
    )
