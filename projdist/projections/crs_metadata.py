"""Facts about a map known without measuring: CRS metadata, declared properties, discontinuities, native poles."""

import re
from dataclasses import dataclass
from typing import Any, NamedTuple

from pyproj import CRS

from projdist.earth import SMOOTH, SPHERE, WGS84, Discontinuities, data_rows
from projdist.projections import catalogue, proj_strings
from projdist.projections.crs import registered_code
from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.projection import Projection, Turned
from projdist.projections.worldmaps import WORLD_MAPS

# Tokens of a PROJ string that other fields show, or that have no meaning for the map.
_SAID = {"proj", "units", "to_meter", "type", "no_defs", "wktext", "datum", *proj_strings.ELLIPSOID_KEYS}


class CrsAxis(NamedTuple):
    """A coordinate axis: its name and direction."""

    name: str
    direction: str


class Setting(NamedTuple):
    """A parameter of a method: its value is a number, PROJ's text, or None for a flag; its unit may be ""."""

    name: str
    value: float | str | None
    unit: str


@dataclass(frozen=True, kw_only=True)
class CrsMetadata:
    """What the definition of a projection states; "" and, for `unit_metres`, NaN where it states nothing."""

    kind: str
    code: str = ""  # AUTHORITY:CODE
    area_name: str = ""
    scope: str = ""
    remarks: str = ""
    deprecated: bool = False
    replaced_by: tuple[str, ...] = ()  # codes of the successors of a deprecated CRS
    datum: str = ""
    geographic_crs: str = ""  # the base of the CRS
    ellipsoid_name: str = ""
    prime_meridian: str = ""
    unit: str = ""
    unit_metres: float = float("nan")
    axes: tuple[CrsAxis, ...] = ()
    method: str = ""
    parameters: tuple[Setting, ...] = ()


def metadata_of(projection: Projection) -> CrsMetadata:
    """The metadata of a projection of any kind."""
    function = projection.function
    if isinstance(function, CrsOperation):
        return _metadata_of_crs(projection, CRS.from_wkt(function.crs))
    if isinstance(function, Pipeline):
        return _metadata_of_string(projection, function)
    own = isinstance(function, Turned) or function in WORLD_MAPS.values()
    kind = "map that PROJ lacks" if own else "function of longitude and latitude"
    return CrsMetadata(kind=kind, ellipsoid_name=_ellipsoid_name(projection))


def _metadata_of_crs(projection: Projection, plane: CRS) -> CrsMetadata:
    """Metadata of a CRS whose projected part is `plane`."""
    stated = CRS.from_user_input(projection.definition)
    operation, geographic, meridian = plane.coordinate_operation, plane.geodetic_crs, plane.prime_meridian
    replaced = stated.get_non_deprecated() if stated.is_deprecated else []
    base = "" if geographic is None else f"{registered_code(geographic)} {geographic.name}".strip()
    kind, axes = str(stated.type_name), plane.axis_info
    return CrsMetadata(
        kind=kind[0].lower() + kind[1:],
        code=registered_code(stated),
        area_name=(stated.area_of_use.name or "") if stated.area_of_use else "",
        scope=stated.scope or "",
        remarks=stated.remarks or "",
        deprecated=stated.is_deprecated,
        replaced_by=tuple(filter(None, map(registered_code, replaced))),
        datum=plane.datum.name if plane.datum else "",
        geographic_crs=base,
        ellipsoid_name=plane.ellipsoid.name if plane.ellipsoid else "",
        prime_meridian=meridian.name if meridian and meridian.longitude else "",
        unit=axes[0].unit_name,
        unit_metres=axes[0].unit_conversion_factor,
        axes=tuple(CrsAxis(axis.name, axis.direction) for axis in axes),
        method=operation.method_name if operation else "",
        parameters=tuple(
            Setting(one.name, one.value, "" if one.unit_name in ("unity", "Unity", "unitless") else one.unit_name)
            for one in (operation.params if operation else ())
        ),
    )


def _metadata_of_string(projection: Projection, function: Pipeline) -> CrsMetadata:
    """Metadata of a PROJ string, without the parameters of pipelines, which the definition shows step by step."""
    tokens = [token.lstrip("+").partition("=") for token in function.definition.split()]
    operations = [value for key, _, value in tokens if key == "proj"]
    alone = len(operations) == 1
    unit = {key: value for key, _, value in tokens}.get("units", "metre" if function.to_metre == 1.0 else "")
    return CrsMetadata(
        kind="PROJ string" if alone else "PROJ pipeline",
        ellipsoid_name=_ellipsoid_name(projection),
        unit="metre" if unit == "m" else unit,
        unit_metres=function.to_metre,
        method=catalogue.operation_titles().get(operations[0], operations[0]) if alone else "",
        parameters=tuple(
            Setting(key, value if equals else None, "") for key, equals, value in tokens if alone and key not in _SAID
        ),
    )


def _ellipsoid_name(projection: Projection) -> str:
    """Name of a well-known ellipsoid, else "sphere" or ""."""
    if projection.ellipsoid.is_close(SPHERE):
        return "sphere of the Earth's mean radius"
    if projection.ellipsoid.is_close(WGS84):
        return "WGS 84"
    return "sphere" if projection.ellipsoid.is_sphere else ""


# ---- declared properties -------------------------------------------------------------------------


class DeclaredProperty(NamedTuple):
    """Name of a method or PROJ operation, and the property that it keeps: "conformal" or "equal-area"."""

    name: str
    keeps: str


# The property and the figure on which it holds ("any" or "sphere"), by kind and name of a method or operation.
_DECLARED = {(row["kind"], row["name"]): (row["keeps"], row["figure"]) for row in data_rows("declared_properties.csv")}


def declared_property_of(projection: Projection) -> DeclaredProperty | None:
    """The property that a map's method declares on its ellipsoid; None for others, pipelines and functions."""
    function = projection.function
    if isinstance(function, CrsOperation):
        key = "method", function.method
    elif isinstance(function, Pipeline):  # its first operation, which is `pipeline` if there are several
        key = "operation", proj_strings.stated_in(function.definition.split()).get("proj", "")
    else:
        return None
    keeps, figure = _DECLARED.get(key, ("", ""))
    if not keeps or (figure == "sphere" and not projection.ellipsoid.is_sphere):
        return None
    return DeclaredProperty(key[1], keeps)


# ---- discontinuities -----------------------------------------------------------------------------

_SHIFTED = ("+pm=", "+over", "+proj=pipeline", "+proj=ob_tran", "+axis=")


# Discontinuities of methods and operations with the central meridian 0.
_KNOWN: dict[tuple[str, str], Discontinuities] = {}
for _row in data_rows("discontinuities.csv"):
    _parallels, _northern, _southern = (tuple(map(float, _row[key].split())) for key in Discontinuities._fields)
    _both = tuple(sorted({*_parallels, *(-lat for lat in _parallels)}))
    _KNOWN[_row["kind"], _row["name"]] = Discontinuities(_both, _northern, _southern)
_CENTRE = re.compile(r'PARAMETER\["Longitude of natural origin",([-+.\deE]+),ANGLEUNIT\["Degree"', re.IGNORECASE)


def discontinuities_of(projection: Projection) -> Discontinuities:
    """Known discontinuities of a map; `SMOOTH` for functions, pipelines, oblique maps and CRSs of several meridians."""
    function = projection.function
    if isinstance(function, Pipeline) and not any(part in function.definition for part in _SHIFTED):
        values = _numbers_in(function.definition)
        centre = values.get("lon_0", 0.0)
        return _known_about("operation", values.get("proj"), centre) if isinstance(centre, float) else SMOOTH
    if isinstance(function, CrsOperation) and function.angles.per_degree == 1.0:
        key = "method", function.method
        if key in _KNOWN and (stated := _CENTRE.search(function.crs)):
            return _known_about(*key, float(stated[1]) + function.angles.greenwich)
    return SMOOTH


def _known_about(kind: str, name: Any, centre: float) -> Discontinuities:
    """Discontinuities of a method or operation about a central meridian, with the meridian opposite."""
    parallels, *hemispheres = _KNOWN.get((kind, name), SMOOTH)
    turned = ([(lon + centre + 180.0) % 360.0 - 180.0 for lon in (*lons, 180.0)] for lons in hemispheres)
    return Discontinuities(parallels, *(tuple(sorted(lons)) for lons in turned))


def _numbers_in(pipeline: str) -> dict[str, float | str]:
    """The parameters of a PROJ string, numbers as numbers."""
    found: dict[str, float | str] = {}
    for key, text in proj_strings.stated_in(pipeline.split()).items():
        try:
            found[key] = float(text)
        except ValueError:
            found[key] = text
    return found


# ---- native poles --------------------------------------------------------------------------------

_AZIMUTHAL = frozenset("laea aeqd stere ortho gnom airy nsper".split())  # centred on lon_0, lat_0
_ENDLESS = frozenset("stere merc webmerc cc lcc".split())  # unbounded at a pole
_TRANSVERSE = frozenset("tmerc cass tcea".split())  # cylinders about the point 90 degrees east of lon_0
_ON_ELLIPSOIDS = frozenset(["laea", "ortho"])  # others show rounding at their poles that graded panels would resolve
_SHIFTING = frozenset(["pm", "over", "axis"])
_OBLIQUE = frozenset("proj o_proj o_lat_p o_lon_p lon_0 R a b ellps units x_0 y_0 no_defs".split())
_QUARTER = 90.0  # degrees of azimuth over which a panel resolves its sine and cosine


class NativePole(NamedTuple):
    """A pole in degrees, and the panels about it."""

    lon: float
    lat: float
    discontinuities: Discontinuities  # in longitude and latitude about it, from its southern meridian on
    widest: float  # degrees, of the widest panel
    # True if panels are graded towards the pole and its antipode, where the map grows without bound. In other maps,
    # nodes so close to these points would only see how PROJ snaps to them.
    graded: bool


def native_pole_of(projection: Projection) -> NativePole | None:
    """The native pole of a map by its PROJ string; None if it is the Earth's pole or unknown."""
    function = projection.function
    if not isinstance(function, Pipeline):
        return None
    values, sphere = _numbers_in(function.definition), projection.ellipsoid.is_sphere
    name, lon, lat = values.get("proj"), values.get("lon_0", 0.0), values.get("lat_0", 0.0)
    if values.keys() & _SHIFTING or not (sphere or name in _ON_ELLIPSOIDS):
        return None
    if not isinstance(lon, float) or not isinstance(lat, float):
        return None
    if name in _AZIMUTHAL:
        return NativePole(lon, lat, SMOOTH, _QUARTER, name in _ENDLESS) if abs(lat) < 90.0 else None
    if name in _TRANSVERSE:
        return NativePole(lon + 90.0, 0.0, SMOOTH, _QUARTER, True)
    if name != "ob_tran" or not values.keys() <= _OBLIQUE:
        return None
    base, pole, turn = values.get("o_proj"), values.get("o_lat_p"), values.get("o_lon_p", 0.0)
    if not isinstance(pole, float) or not isinstance(turn, float) or abs(pole) >= 90.0:
        return None
    if not isinstance(base, str) or base in _AZIMUTHAL | _TRANSVERSE | _ENDLESS:
        return None
    # The map's own longitudes are half a turn less than those from the southern meridian.
    return NativePole(lon + 180.0, pole, _known_about("operation", base, 180.0 - turn), 180.0, False)
