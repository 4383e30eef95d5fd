"""Families of projections with free parameters, and the extent of a region that bounds them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from projdist import field, projections, regions, support
from projdist.earth import WGS84, Ellipsoid, unit_vectors, wrapped


@dataclass(frozen=True, kw_only=True)
class Extent:
    """Bounds, middle, radius (greatest distance from the middle) and azimuth of the long axis of a region, degrees."""

    west: float
    south: float
    east: float
    north: float
    lon: float
    lat: float
    radius: float
    azimuth: float


def extent_of(region: regions.Place) -> Extent:
    """The extent of a region."""
    nodes = field.nodes_of(region, WGS84, 400, edges=True)
    points = unit_vectors(nodes.lon, nodes.lat)
    middle = points @ nodes.weight
    west, south, east, north = region.bounds
    bounds = {"west": west, "south": south, "east": east, "north": north}
    if np.linalg.norm(middle) < 1e-6:  # the globe has no middle
        return Extent(**bounds, lon=0.5 * (west + east), lat=0.0, radius=180.0, azimuth=90.0)
    middle /= np.linalg.norm(middle)
    lon, lat = np.degrees(np.arctan2(middle[1], middle[0])), np.degrees(np.arcsin(np.clip(middle[2], -1.0, 1.0)))
    sin, cos = np.sin(np.radians(lon)), np.cos(np.radians(lon))
    east_part = points.T @ np.array([-sin, cos, 0.0])
    north_part = points.T @ np.cross(middle, np.array([-sin, cos, 0.0]))
    parts = np.stack([east_part, north_part])
    parts = parts - (parts @ nodes.weight)[:, None]
    axes = np.linalg.eigh((parts * nodes.weight) @ parts.T)[1]
    azimuth = float(np.mod(np.degrees(np.arctan2(axes[0, 1], axes[1, 1])) + 90.0, 180.0) - 90.0)
    radius = float(np.degrees(np.arccos(np.clip((middle @ points).min(), -1.0, 1.0))))
    # Next to a pole the middle has any longitude.
    lon = float(west + np.mod(lon - west, 360.0)) if abs(lat) < 89.9 else 0.5 * (west + east)
    return Extent(**bounds, lon=lon, lat=float(lat), radius=radius, azimuth=azimuth)


def usual_crs(extent: Extent) -> tuple[str, str]:
    """Name and code of the UTM zone of the region's middle; beyond 84 degrees those of the polar stereographic map."""
    if abs(extent.lat) > 84.0:
        return "UPS", "EPSG:32661" if extent.lat > 0 else "EPSG:32761"
    zone = int((extent.lon + 180.0) % 360.0 // 6.0) + 1
    hemisphere, letter = ("326", "N") if extent.lat >= 0 else ("327", "S")
    return f"UTM {zone}{letter}", f"EPSG:{hemisphere}{zone:02d}"


# ---- families ------------------------------------------------------------------------------------

Limits = tuple[float, float]
"""Lowest and highest value of a parameter."""
_MOST = 89.5  # degrees: a cone that touches nearer to a pole is as good as a plane
_OVER = 20.0  # degrees beyond a pole to which a centre is searched, so that the pole itself is no limit
_BESIDE = 2.0  # radii of the region from its middle within which a centre is searched
_STEEPEST = 89.9999  # degrees of azimuth: PROJ's omerc breaks down at 90; 4 m on a line of 2500 km
_LINE = 45.0  # degrees of azimuth of the region's long axis, below which an oblique line moves east and west
_WORLD = 100.0  # degrees from the middle, beyond which regions need world maps
_WHOLE_WORLD = 170.0  # degrees from the middle, beyond which azimuthal maps are useless
_ROUND = 360.0  # degrees of longitude of a region around a pole
_CONTINENT = 30.0  # degrees from the middle, below which the flattening counts in a map's distortion
_CROSSES = 15.0  # degrees of latitude from the equator within which cylinders are tried


@dataclass(frozen=True, kw_only=True)
class Family:
    """A method with free parameters."""

    name: str
    text: str = ""  # the PROJ string without ellipsoid, by default only the method's name
    limits: dict[str, Limits]  # ranges of parameters that may be free
    fixed: dict[str, float]  # values of all parameters
    free: tuple[str, ...]  # names that are free by default
    scale: str = ""  # the parameter that multiplies the map, "" if there is none
    rule: str = ""  # the rule of thumb that `fixed` follows, or ""
    states_ellipsoid: bool = False

    @property
    def is_spherical(self) -> bool:
        """True for methods with formulas for a sphere only."""
        return self.name in _SPHERICAL or self.name.startswith("ob_tran:")

    def normalised(self, values: Mapping[str, float]) -> dict[str, float]:
        """Parameters in their usual range: centres beyond a pole go to the other side, parallels ascend."""
        result = dict(values)
        longitude = next((name for name in ("lon_0", "lonc") if name in result), None)
        if longitude and self.name not in _CONES and abs(result.get("lat_0", 0.0)) > 90.0:
            result["lat_0"] = np.copysign(180.0, result["lat_0"]) - result["lat_0"]
            result[longitude] += 180.0
        for name in {"lon_0", "lonc", "o_lon_p"} & set(result):
            result[name] = float(wrapped(result[name]))
        if "alpha" in result:
            alpha = 0.5 * float(wrapped(2.0 * result["alpha"]))
            result["alpha"] = float(np.copysign(min(abs(alpha), _STEEPEST), alpha))
        if {"lat_1", "lat_2"} <= set(result) and result["lat_1"] > result["lat_2"]:
            result["lat_1"], result["lat_2"] = result["lat_2"], result["lat_1"]
        return result


_CONES = ("lcc", "aea", "eqdc")
_AZIMUTHALS = ("laea", "aeqd", "stere", "airy")
_SPHERICAL = ("airy", "wintri", "eqc")  # PROJ has eqc on ellipsoids since 9.8; on the sphere all versions agree


def _cone(name: str, e: Extent) -> Family:
    low, high = max(e.south, -_MOST), min(e.north, _MOST)
    sixth = (high - low) / 6.0
    return Family(
        name=name,
        limits={"lat_1": (low, high), "lat_2": (low, high)},
        fixed={"lat_1": low + sixth, "lat_2": high - sixth, "lat_0": 0.5 * (e.south + e.north), "lon_0": e.lon},
        free=("lat_1", "lat_2"),
        scale="k_0" if name == "lcc" else "",
        rule="one-sixth rule",
    )


_CYLINDERS = {"lcc": "merc", "aea": "cea", "eqdc": "eqc"}
_CONSTANT = 1e-3  # of a cone, below which it is as good as a cylinder


def cylinder_of(family: str, parameters: Mapping[str, float]) -> str:
    """A sentence about a conic map that is nearly a cylindrical one; else ""."""
    if family not in _CYLINDERS or not {"lat_1", "lat_2"} <= set(parameters):
        return ""
    low, high = parameters["lat_1"], parameters["lat_2"]
    constant = 0.5 * (np.sin(np.radians(low)) + np.sin(np.radians(high)))
    if not abs(constant) < _CONSTANT:
        return ""
    true = 0.5 * (abs(low) + abs(high))
    return (
        f"The cone is nearly a cylinder (n = {constant:.1g}): the map is that of {_CYLINDERS[family]}, true at "
        f"{true:.4g} degrees, which is simpler."
    )


def _azimuthal(name: str, e: Extent) -> Family:
    limits, middle = _centre_limits(e), {"lat_0": e.lat, "lon_0": e.lon}
    text, scale, rule = "", "k_0" if name == "stere" else "", "centred on the region"
    if name == "airy":
        limits["lat_b"] = (-80.0, 89.9)
        middle["lat_b"] = float(np.clip(90.0 - e.radius, -80.0, 89.9))
        text, rule = "+proj=airy +no_cut", "centred on the region, for its greatest radius"
    free = (*limits, scale) if scale else tuple(limits)
    return Family(name=name, text=text, limits=limits, fixed=middle, free=free, scale=scale, rule=rule)


def _centre_limits(e: Extent) -> dict[str, Limits]:
    """Limits of a centre, which may lie beside the region: where an arc of land bends around."""
    side = _BESIDE * e.radius
    across = side / max(np.cos(np.radians(e.lat)), 0.1)
    west, east = min(e.west, e.lon - across), max(e.east, e.lon + across)
    if east - west > 360.0:
        west, east = e.lon - 180.0, e.lon + 180.0
    south, north = min(e.south, e.lat - side), max(e.north, e.lat + side)
    return {"lat_0": (max(south, -90.0 - _OVER), min(north, 90.0 + _OVER)), "lon_0": (west, east)}


def _cylinder(name: str, e: Extent) -> Family:
    middle = {"lon_0": e.lon}
    farthest = min(max(abs(e.south), abs(e.north)), _MOST)
    nearest = 0.0 if e.south <= 0.0 <= e.north else min(abs(e.south), abs(e.north))
    if name == "merc":
        return Family(name=name, limits={}, fixed=middle, free=("k_0",), scale="k_0")
    return Family(
        name=name,
        limits={"lat_ts": (0.0, farthest)},
        fixed={"lat_ts": 0.5 * (nearest + farthest)} | middle,
        free=("lat_ts",),
        rule="true in the middle latitude",
    )


def _transverse(name: str, e: Extent) -> Family:
    return Family(
        name=name,
        limits={"lon_0": (e.west, e.east)},
        fixed={"lat_0": 0.5 * (e.south + e.north), "lon_0": e.lon},
        free=("lon_0", "k_0"),
        scale="k_0",
        rule="true on the middle meridian",
    )


def _oblique(name: str, e: Extent) -> Family:
    middle = {"lat_0": float(np.clip(e.lat, -_MOST, _MOST)), "lonc": e.lon, "alpha": e.azimuth}
    # Great circles have two degrees of freedom: the line's centre moves across the line only.
    across = "lonc" if abs(e.azimuth) < _LINE else "lat_0"
    side = min(1.5 * e.radius, 80.0)
    east = side / max(np.cos(np.radians(e.lat)), 0.1)
    reach = {
        "lat_0": (max(e.lat - side, -_MOST), min(e.lat + side, _MOST)),
        "lonc": (e.lon - east, e.lon + east),
        "alpha": (e.azimuth - 90.0, e.azimuth + 90.0),
    }
    return Family(
        name=name,
        limits=reach,
        fixed=middle,
        free=(across, "alpha", "k_0"),
        scale="k_0",
        rule="along the region's long axis",
    )


def _rotated(name: str, e: Extent) -> Family:
    """A world map in any aspect, by PROJ's ob_tran."""
    text = projections.projection_names().get(name.partition(":")[2], "")
    operation = re.match(r"\+proj=(\S+)(.*)", re.sub(r"\s*\+R=\S+", "", text))
    if not operation or operation[1] == "ob_tran":
        raise ValueError(
            f"Invalid family '{name}'. After ob_tran: there must be a name from 'projdist list projections'."
        )
    about = (e.lon - 180, e.lon + 180)
    limits: dict[str, Limits] = {"o_lat_p": (-90.0, 90.0), "o_lon_p": (-180.0, 180.0), "lon_0": about}
    free = tuple(limits)
    middle = {"o_lat_p": 90.0, "o_lon_p": 0.0, "lon_0": e.lon}  # the plain aspect, its middle meridian in the region
    for key in ("lat_1", "lat_2", "lat_ts"):
        stated = re.search(rf"\+{key}=(\S+)", operation[2])
        if stated or (key, operation[1]) in _INNER:
            limits[key] = (0.0, _MOST)
            middle[key] = float(stated[1]) if stated else _INNER[key, operation[1]]
    return Family(
        name=name,
        text=f"+proj=ob_tran +o_proj={operation[1]}{operation[2]}",
        limits=limits,
        fixed=middle,
        free=free,
        rule="in its plain aspect",
    )


_INNER = {
    ("lat_ts", "eqc"): 0.0,
    ("lat_ts", "cea"): 0.0,
    ("lat_1", "wintri"): projections.WINKEL_PARALLEL,
    ("lat_ts", "wag3"): 0.0,
    ("lat_1", "bonne"): 45.0,
}


def _winkel(name: str, e: Extent) -> Family:
    fixed = {"lat_1": projections.WINKEL_PARALLEL, "lon_0": e.lon}
    return Family(name=name, limits={"lat_1": (0.0, _MOST)}, fixed=fixed, free=("lat_1",), rule="Winkel's parallel")


FAMILIES = (*_CONES, "tmerc", "omerc", *_AZIMUTHALS, "merc", "cea", "eqc", "wintri", "ob_tran:NAME")


_MAKERS: support.Registry[Callable[[str, Extent], Family]] = support.Registry(
    "family",
    {
        **dict.fromkeys(_CONES, _cone),
        **dict.fromkeys(_AZIMUTHALS, _azimuthal),
        **dict.fromkeys(("merc", "cea", "eqc"), _cylinder),
        **{"tmerc": _transverse, "omerc": _oblique, "wintri": _winkel},
    },
    suggested=FAMILIES,
    rule=f"It must be auto, one of {', '.join(FAMILIES)}, or a PROJ string with free parameters, as +proj=lcc "
    "+lat_1={30..50} +lat_2={40..60}.",
)


def get_family(name: str, extent: Extent) -> Family:
    """The family of a name, or of a PROJ string with slots such as `{lat_1:20..60}`; raises ValueError."""
    if "=" in name:
        return _template(name)
    if name.startswith("ob_tran:"):
        return _rotated(name, extent)
    return _MAKERS.named(name)(name, extent)


def sensible_families(extent: Extent, ellipsoid: Ellipsoid | None) -> list[str]:
    """Families worth trying for a region; those with spherical formulas only where the flattening matters little."""
    # Cones and cylinders are left out around a pole, where they would be cut.
    if extent.radius > _WORLD:
        return ["wintri", "eqc", "cea", "merc", *(["aeqd", "laea", "airy"] if extent.radius < _WHOLE_WORLD else [])]
    names = ["laea", "aeqd", "stere", "omerc"]
    spherical = extent.radius > _CONTINENT or (ellipsoid is not None and ellipsoid.is_sphere)
    if spherical:
        names.append("airy")
    if extent.east - extent.west >= _ROUND:
        return names
    if extent.south < 85.0 and extent.north > -85.0:
        names += _CONES
    if extent.east - extent.west < 170.0:
        names.append("tmerc")
    if extent.south < _CROSSES and extent.north > -_CROSSES:
        names += ["merc", "cea", *(["eqc"] if spherical else [])]
    return names


_SLOT = re.compile(r"\{(?:(\w+):)?([^{}]*)\}")


def _template(text: str) -> Family:
    """A PROJ string with slots: `+lat_1={20..60}`, `+lat_1={lat_1:20..60}`, or `{lat_1:20..60}` alone."""
    limits: dict[str, Limits] = {}
    words = []
    for word in text.split():
        slot = _SLOT.search(word)
        if not slot:
            words.append(word)
            continue
        name = slot[1] or word.partition("=")[0].lstrip("+")
        stated = word[: slot.start()]
        if word[slot.end() :] or stated.lstrip("+") not in ("", f"{name}=") or name in limits:
            raise ValueError(f"Invalid free parameter '{word}'. It must be +{name}={{LOW..HIGH}}, once.")
        low, dots, high = slot[2].partition("..")
        try:
            limits[name] = float(low), float(high)
        except ValueError:
            limits[name] = np.nan, np.nan
        if not dots or not np.isfinite(limits[name]).all() or not limits[name][0] < limits[name][1]:
            raise ValueError(f"Invalid range '{slot[2]}' in '{word}'. It must be LOW..HIGH, numbers such as 20..60.")
    if not limits:
        raise ValueError(f"Invalid family '{text}'. A PROJ string must have free parameters, like +lat_1={{20..60}}.")
    middle = {name: 0.5 * (low + high) for name, (low, high) in limits.items()}
    family = Family(
        name=text, text=" ".join(words), limits=limits, fixed=middle, free=tuple(limits), states_ellipsoid=True
    )
    scale = next((name for name in ("k_0", "k") if name in limits and _is_scale(family, name)), "")
    return replace(family, scale=scale)


def _is_scale(family: Family, name: str) -> bool:
    """True if a parameter multiplies the map."""
    low, high = family.limits[name]
    values = {key: value for key, value in family.fixed.items() if key != name}
    words = " ".join(f"+{key}={value!r}" for key, value in values.items())
    lon, lat = np.array([3.0, 21.0, -14.0]), np.array([11.0, 37.0, 48.0])
    try:
        one, two = (
            np.array(projections.Projection.from_user_input(f"{family.text} {words} +{name}={value!r}")(lon, lat))
            for value in (low, high)
        )
    except projections.ProjectionError:
        return False
    one, two = one - one[:, :1], two - two[:, :1]
    return bool(low > 0 and np.allclose(two * low, one * high, rtol=1e-9, atol=1e-6))


def ellipsoid_text(ellipsoid: Ellipsoid) -> str:
    """The ellipsoid as PROJ's parameters."""
    for name, known in (("WGS84", WGS84), ("GRS80", Ellipsoid(6378137.0, 1.0 / 298.257222101))):
        if ellipsoid.is_close(known):
            return f"+ellps={name}"
    return f"+R={ellipsoid.a!r}" if ellipsoid.is_sphere else f"+a={ellipsoid.a!r} +rf={1.0 / ellipsoid.f!r}"
