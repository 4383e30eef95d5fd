"""WKT as programs write it: the same map under every spelling, or one line that names what is not understood."""

import math
import re
import warnings

import numpy as np
import pytest
from projection_points import make, message
from pyproj import CRS, Transformer
from pyproj.database import query_crs_info
from pyproj.enums import PJType
from pyproj.exceptions import CRSError
from tables import each

from projdist.projections import ProjectionError
from projdist.projections.crs import parse_crs, read_crs, registered_code
from projdist.support import Notice

GEOGCS = (
    'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],'
    'UNIT["degree",0.017453292519943295]]'
)
# Rounding of PROJ's operations, of coordinates of some 1e7 m.
ROUNDING = 1e-6

# What PROJ runs for each method, by the parameters that it is told by another door: a PROJ string.
HOTINE = "Hotine Oblique Mercator (variant A):omerc no_uoff|Hotine Oblique Mercator (variant B):omerc"
LAT, LINE = "lat_0={latitude} lon_0={longitude}", "lat_0={latitude} lonc={longitude} alpha={azimuth} gamma={skew}"
PARAMETERS = {
    f"{LAT} k_0={{scale}}": (
        "Transverse Mercator:tmerc|Gauss Schreiber Transverse Mercator:gstmerc|Oblique Stereographic:sterea|"
        "Stereographic:stere|Transverse Cylindrical Equal Area:tcea"
    ),
    f"{LAT} lat_1={{parallel_1}} lat_2={{parallel_2}}": (
        "Lambert Conic Conformal (2SP):lcc|Albers Equal Area:aea|Equidistant Conic:eqdc"
    ),
    LAT: (
        "Lambert Azimuthal Equal Area:laea|Azimuthal Equidistant:aeqd|Gnomonic:gnom|Orthographic:ortho|"
        "Cassini-Soldner:cass|American Polyconic:poly|Quadrilateralized Spherical Cube:qsc"
    ),
    "lat_1={latitude} lat_0={latitude} lon_0={longitude} k_0={scale}": "Lambert Conic Conformal (1SP):lcc",
    f"{LINE} k_0={{scale}}": HOTINE,
    "lon_0={longitude} k_0={scale}": "Mercator (variant A):merc",
    "lat_ts={parallel_1} lon_0={longitude}": (
        "Mercator (variant B):merc|Lambert Cylindrical Equal Area:cea|Equidistant Cylindrical:eqc|Winkel I:wink1|"
        "Wagner III:wag3|Polar Stereographic (variant B):stere lat_0=90"
    ),
    "lat_1={latitude} lon_0={longitude}": "Bonne:bonne|Loximuthal:loxim",
    "lat_1={parallel_1} lon_0={longitude}": "Winkel II:wink2|Winkel Tripel:wintri",
    "lon_0={longitude} h={height}": "Geostationary Satellite (Sweep Y):geos",
    "lat_1={lat_1st} lon_1={lon_1st} lat_2={lat_2nd} lon_2={lon_2nd}": "Two Point Equidistant:tpeqd",
    "lon_0={longitude} R_A": "Miller Cylindrical:mill|Van Der Grinten:vandg",
    "lon_0={longitude}": (
        "Eckert I:eck1|Eckert II:eck2|Eckert III:eck3|Eckert IV:eck4|Eckert V:eck5|Eckert VI:eck6|Mollweide:moll|"
        "Robinson:robin|Sinusoidal:sinu|Natural Earth:natearth|Natural Earth II:natearth2|Wagner I:wag1|Wagner II:wag2|"
        "Wagner IV:wag4|Wagner V:wag5|Wagner VI:wag6|Wagner VII:wag7|Aitoff:aitoff|Craster Parabolic:crast|"
        "Quartic Authalic:qua_aut|Flat Polar Quartic:mbtfpq|Compact Miller:comill|Patterson:patterson|Times:times|"
        "Gall Stereographic:gall|Goode Homolosine:goode|Interrupted Goode Homolosine:igh|"
        "Interrupted Goode Homolosine Ocean:igh_o|Equal Earth:eqearth"
    ),
}
METHODS = {}
for told, pairs in PARAMETERS.items():
    METHODS |= {name: f"{operation} {told}" for name, operation in (pair.split(":") for pair in pairs.split("|"))}

KINDS = """latitude longitude parallel_1 parallel_2 scale azimuth skew height lat_1st lon_1st lat_2nd lon_2nd easting
    northing""".split()
NUMBERS = 41.25, 11.5, 38.5, 52.75, 0.97, 31.0, 29.0, 35786023.0, 37.0, 3.0, 51.0, 21.0, 250000.0, 75000.0
VALUES = dict(zip(KINDS, NUMBERS, strict=True))


def names(text):
    """Names of kinds by kind, of `kind=name` separated by semicolons."""
    return dict(pair.strip().split("=") for pair in text.split(";"))


# How GDAL, Esri, GeoTools and WKT 2 call a kind; of those that EPSG has three names for, each is tried.
GDAL = names(
    """latitude=latitude_of_origin; longitude=central_meridian; parallel_1=standard_parallel_1;
    parallel_2=standard_parallel_2; scale=scale_factor; azimuth=azimuth; skew=rectified_grid_angle;
    height=satellite_height; lat_1st=Latitude_Of_1st_Point; lon_1st=Longitude_Of_1st_Point;
    lat_2nd=Latitude_Of_2nd_Point; lon_2nd=Longitude_Of_2nd_Point; easting=false_easting; northing=false_northing"""
)
NATURAL = GDAL | names(
    """latitude=Latitude of natural origin; longitude=Longitude of natural origin;
    parallel_1=Latitude of 1st standard parallel; parallel_2=Latitude of 2nd standard parallel;
    scale=Scale factor at natural origin; azimuth=Azimuth of initial line; skew=Angle from Rectified to Skew Grid;
    easting=False easting; northing=False northing"""
)
SPELLINGS = {
    "gdal": GDAL,
    "centres": GDAL | {"latitude": "latitude_of_center", "longitude": "longitude_of_center"},
    "geotools": {kind: name.replace("_", " ") for kind, name in GDAL.items()},
    "esri": {kind: name.title() for kind, name in GDAL.items()} | {"height": "Height"},
    "capitals": {kind: name.upper() for kind, name in GDAL.items()},
    "natural": NATURAL,
    "false": NATURAL
    | names(
        """latitude=Latitude of false origin; longitude=Longitude of false origin; easting=Easting at false origin;
        northing=Northing at false origin"""
    ),
    "centre": NATURAL
    | names(
        """latitude=Latitude of projection centre; longitude=Longitude of projection centre;
        scale=Scale factor at projection centre; azimuth=Azimuth at projection centre"""
    ),
}
LON, LAT_POINTS = (values.ravel() for values in np.meshgrid(np.linspace(-9.0, 33.0, 8), np.linspace(31.0, 62.0, 7)))


def assert_map(found, pipeline, lon=LON, lat=LAT_POINTS):
    """Coordinates are those of a PROJ string."""
    truth = np.array(Transformer.from_pipeline(pipeline).transform(lon, lat))
    np.testing.assert_allclose(found(lon, lat), np.where(np.isfinite(truth), truth, np.nan), rtol=0, atol=ROUNDING)


def kinds_of(method):
    """The kinds of parameters of a method, with those of the false origin."""
    named = [kind for kind in VALUES if f"{{{kind}}}" in METHODS[method]]
    return [*named, "easting", "northing"]


def proj_string(method):
    """The PROJ string of a method with its parameters."""
    operation, *others = METHODS[method].format(**VALUES).split()
    text = " ".join([f"+proj={operation}", *(f"+{other}" for other in others)])
    return f"{text} +x_0={VALUES['easting']} +y_0={VALUES['northing']} +ellps=WGS84"


def wkt1(method, parameters, geogcs=GEOGCS):
    """A PROJCS of a method and its parameters by name."""
    texts = [f'PARAMETER["{name}",{value!r}]' for name, value in parameters.items()]
    return f'PROJCS["map",{geogcs},PROJECTION["{method}"],{",".join(texts)},UNIT["metre",1.0]]'


def wkt2(method, parameters):
    """A PROJCRS of the same."""
    base = CRS("EPSG:4326").to_wkt().replace("GEOGCRS[", "BASEGEOGCRS[", 1).split(",CS[")[0] + "]"
    units = {"scale": 'SCALEUNIT["unity",1]', "height": 'LENGTHUNIT["metre",1]'}
    units |= dict.fromkeys(("easting", "northing"), 'LENGTHUNIT["metre",1]')
    degree = 'ANGLEUNIT["degree",0.0174532925199433]'
    texts = [f'PARAMETER["{name}",{VALUES[kind]!r},{units.get(kind, degree)}]' for kind, name in parameters.items()]
    plane = 'CS[Cartesian,2],AXIS["E",east],AXIS["N",north],LENGTHUNIT["metre",1]'
    return f'PROJCRS["map",{base},CONVERSION["map",METHOD["{method}"],{",".join(texts)}],{plane}]'


def spelt(method, spelling):
    """Parameters of a method by their stated in a spelling."""
    stated = SPELLINGS[spelling]
    return {stated[kind]: VALUES[kind] for kind in kinds_of(method)}


# Esri's Orthographic, which is told by these names, is that of a sphere.
ESRIS = "Orthographic", "centres"
PAIRS = [(method, spelling) for spelling in SPELLINGS for method in METHODS if (method, spelling) != ESRIS]


@pytest.mark.slow
@each(("method", "spelling"), PAIRS[::3])
def test_one_map_by_any_spelling(method, spelling):
    """Parameters as any program calls them make the map of the PROJ string, in WKT 1 and 2, without a word."""
    stated = {kind: SPELLINGS[spelling][kind] for kind in kinds_of(method)}
    for text in (wkt1(method, spelt(method, spelling)), wkt2(method, stated)):
        assert_map(make(text), proj_string(method))


def test_units_of_parameters_by_other_names():
    """Each is in the unit that it states, also where PROJ does not know its name and others have another unit."""
    text = wkt2("Transverse Mercator", {kind: GDAL[kind] for kind in kinds_of("Transverse Mercator")})
    for stated, same in (
        ('11.5,ANGLEUNIT["degree",0.0174532925199433]', '12.777777777777779,ANGLEUNIT["grad",0.015707963267948967]'),
        ('250000.0,LENGTHUNIT["metre",1]', '250.0,LENGTHUNIT["kilometre",1000]'),
    ):
        assert stated in text
        text = text.replace(stated, same)
    assert_map(make(text), proj_string("Transverse Mercator"))


@pytest.mark.slow
@each("method", METHODS)
def test_a_missing_or_misspelt_parameter_is_named(method):
    """Without one that is needed a CRS is refused, or a scale told to be 1; a wrong word is told in a line."""
    for kind in kinds_of(method):
        rest = {name: value for name, value in spelt(method, "geotools").items() if name != SPELLINGS["geotools"][kind]}
        if kind == "scale":
            with pytest.warns(Notice, match="scale_factor"):
                read_crs(wkt2(method, {kind: GDAL[kind] for kind in kinds_of(method) if kind != "scale"}))
        elif kind not in ("easting", "northing"):
            assert GDAL[kind].lower() in message(wkt1(method, rest)).lower()
        wrong = GDAL[kind][0] + GDAL[kind][2:]
        parameters = {wrong if key == GDAL[kind] else key: value for key, value in spelt(method, "gdal").items()}
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            try:
                read_crs(wkt1(method, parameters))
                lines = [str(warning.message) for warning in told]
            except ProjectionError as error:
                lines = [str(error)]
        assert any(f"'{wrong}'" in line and "\n" not in line for line in lines), (kind, lines)


# PROJ has changed the formulas of these since 9.5, and GDAL brings a PROJ of its own.
@pytest.mark.slow
@each("method", METHODS.keys() - {"Wagner VI", "Equidistant Cylindrical"})
def test_as_gdal_reads_gdals(method):
    """The WKT 1 that GDAL writes of a map gives GDAL's own coordinates."""
    warp = pytest.importorskip("rasterio.warp")
    crs = pytest.importorskip("rasterio.crs").CRS
    wanted = crs.from_string(proj_string(method))
    there = warp.transform(crs.from_epsg(4326), wanted, LON, LAT_POINTS)
    np.testing.assert_allclose(make(wanted.to_wkt())(LON, LAT_POINTS), there[:2], rtol=0, atol=ROUNDING)


@each("pole", [90.0, -90.0])
def test_polar_stereographic_by_other_names(pole):
    """Its parallel by each name, and in CF; the pole beside it says nothing new, the other pole contradicts it."""
    parallel, variant_b = math.copysign(71.0, pole), "Polar Stereographic (variant B)"
    lon_5 = {"straight_vertical_longitude_from_pole": 5.0}
    both = {"standard_parallel_1": parallel, "central_meridian": 5.0, "latitude_of_origin": pole}
    grid = {"grid_mapping_name": "polar_stereographic", "horizontal_datum_name": "WGS 84", **lon_5}
    grid |= {"latitude_of_projection_origin": pole, "standard_parallel": parallel}
    names = ("latitude_of_origin", "Standard_Parallel_1", "Latitude of standard parallel")
    found = [wkt1(variant_b, {**lon_5, name: parallel}) for name in names]
    old = wkt1("Polar_Stereographic", {names[0]: parallel, "central_meridian": 5.0, "scale_factor": 0.97})
    with pytest.warns(Notice, match=r"'scale_factor' \(0\.97\), of which Polar Stereographic \(variant B\)"):
        found.append(make(old))
    for given in (*found, wkt1(variant_b, both), grid):
        truth = f"+proj=stere +lat_0={pole} +lat_ts={parallel} +lon_0=5 +ellps=WGS84"
        assert_map(make(given), truth, 10.0, math.copysign(75.0, pole))
    said = f"'latitude_of_origin' is {-pole:g}, and its standard parallel is on the other side"
    assert said in message(wkt1(variant_b, both | {"latitude_of_origin": -pole}))
    assert "is on the other side of the equator" in message(grid | {"standard_parallel": -parallel})


TM = {"latitude_of_origin": 0.0, "central_meridian": 9.0, "scale_factor": 0.9996}
# The last three are by another name, and other quantities with the value of a parameter that is used.
UNUSED = {"semi_major": 6371200.0, "longitude of natural origin": 12.0, "Scale factor at natural origin": 0.9}
UNUSED |= {"false_eastng": 500000.0, "FE": 9.0}


@pytest.mark.slow
@each(("name", "value"), UNUSED.items())
def test_what_a_method_makes_no_use_of_is_told(name, value):
    """By its name and value; not what changes nothing, as a scale of 1 and latitudes of 0, which Esri always writes."""
    stated = TM | {"false_northing": 500000.0}
    with pytest.warns(Notice, match=rf"states '{name}' \({value:.12g}\), of which Transverse Mercator makes no use"):
        found = make(wkt1("Transverse_Mercator", stated | {name: value}))
    assert_map(found, "+proj=tmerc +lon_0=9 +k=.9996 +y_0=500000 +ellps=WGS84", 10.0, 50.0)
    with pytest.warns(Notice, match=r"^The CRS 'map' .* 'standard_parallel_1' \(41\), of which Mercator \(variant A\)"):
        make(wkt1("Mercator_1SP", TM | {"standard_parallel_1": 41.0}))
    make(wkt1("Transverse_Mercator", stated | {"longitude of natural origin": 9.0}))
    make(wkt1("Lambert_Conformal_Conic_2SP", spelt("Lambert Conic Conformal (2SP)", "gdal") | {"scale_factor": 1.0}))


TMERC = wkt1("Transverse_Mercator", spelt("Transverse Mercator", "gdal"))
BOUNDS = "24.6", "-35.58", "84.73", "44.83"
COMMAS = [
    ('["central_meridian",11.5]', '["central_meridian",11,5]', "PARAMETER 'central_meridian'.*11,5:"),
    ("6378137.0,298.257223563", "6378137,0,298,257223563", "SPHEROID 'WGS 84'.*6378137,0,298,257223563:"),
    ('PRIMEM["Greenwich",0.0]', 'PRIMEM["Greenwich",0,0]', "PRIMEM 'Greenwich'.*0,0:"),
    ("0.017453292519943295", "0,017453292519943295", "UNIT 'degree'.*0,017453292519943295:"),
]
for point in BOUNDS:
    comma = point.replace(".", ",")
    COMMAS += [(point, comma, re.escape(f"within a number, {','.join(BOUNDS).replace(point, comma)}:"))]


@each(("right", "wrong", "words"), COMMAS)
def test_decimal_commas(right, wrong, words):
    """A comma in a number, which PROJ takes for the end of it, is refused with the place and the figure."""
    text = TMERC
    if right in BOUNDS:
        text = f"{wkt2('Mollweide', {'longitude': 'Longitude of natural origin'})[:-1]},BBOX[{','.join(BOUNDS)}]]"
    assert right in text
    assert re.search(rf"{words} write a point\.$", message(text.replace(right, wrong)))


SIDEWAYS = ',AXIS["Easting","North along 90 deg East"],AXIS["Northing","North along 0 deg"]]'
DRAWN = r"As longitudes and latitudes are drawn for x and y it is 'plate-carree'\.$"


@each(("text", "said"), [
    (TMERC.replace("298.257223563", "0.00335281066"), r"a flattening of 0\.00335281066 is written as 298\.257224"),
    (TMERC[:-1], r"The closing bracket of PROJCS is missing\.$"),
    (TMERC.replace('"metre"', '"metre'), "or a quotation mark before"),
    (TMERC[:-1] + SIDEWAYS, r'PROJ says: unhandled axis direction: "North along 90 deg East"\.$'),
    (wkt1("Unknown", {"central_meridian": 9.0}), r"PROJ does not know the method 'Unknown' of map\.$"),
    # A number that another authority has, and what has no map.
    ("EPSG:102008", r"it is ESRI:102008 \(North_America_Albers_Equal_Area_Conic\)\.$"),
    ("ESRI:3857", r"it is EPSG:3857 \(WGS 84 / Pseudo-Mercator\)\.$"),
    *(("EPSG:4326", DRAWN), (GEOGCS, DRAWN)),
])  # fmt: skip
def test_mistakes_are_named(text, said):
    assert re.search(said, message(text))


def test_a_method_with_an_id_of_projs_is_left_alone():
    """Robinson's has one, and none of EPSG's: what PROJ has read of it is not written anew."""
    text = CRS("IAU_2015:1055").to_wkt()
    assert 'METHOD["Robinson",ID["PROJ"' in text
    assert read_crs(text).to_wkt() == CRS.from_wkt(text).to_wkt()


@pytest.mark.slow
@pytest.mark.parametrize("version", ["WKT2_2019", "WKT1_GDAL", "WKT1_ESRI"])
def test_registered_crss_are_read_as_by_proj(version):
    """WKT that PROJ writes of every 57th CRS is PROJ's reading of it, without a word."""
    read = 0
    for info in query_crs_info(pj_types=PJType.PROJECTED_CRS)[::57]:
        try:
            text = CRS(f"{info.auth_name}:{info.code}").to_wkt(version)
        except CRSError:
            continue
        assert read_crs(text).to_wkt() == CRS.from_wkt(text).to_wkt(), info
        read += 1
    assert read > 130


@each("method", ["Lambert_Conformal_Conic", "Lambert_Conformal_Conic_1SP"])
@each("origin", [0.0, 40.0, 45.0])
def test_one_parallel_and_another_latitude_of_origin(method, origin):
    """Esri's conic touches at its parallel, whatever its latitude of origin, which PROJ would take for it."""
    stated = {"Central_Meridian": 10.0, "Standard_Parallel_1": 45.0, "Scale_Factor": 0.9996}
    text = wkt1(method, stated | {"Latitude_Of_Origin": origin})
    assert_map(make(text), f"+proj=lcc +lat_1=45 +lat_0={origin} +lon_0=10 +k_0=.9996 +ellps=WGS84")


def test_round_brackets_and_degrees_with_few_digits():
    """The standard allows the first, and within names they stay; points are in true degrees, as GDAL takes them."""
    text = wkt1("Transverse_Mercator", TM).replace("[", "(").replace("]", ")").replace('"map"', '"a (b) [c]"')
    assert_map(make(text), "+proj=tmerc +lon_0=9 +k=.9996 +ellps=WGS84", 10.0, 50.0)
    assert make(text).name == "a (b) [c]"
    few = GEOGCS.replace("0.017453292519943295", "0.01745")
    text = wkt1("Transverse_Mercator", TM | {"central_meridian": 0.0}, few)
    assert_map(make(text), "+proj=tmerc +k=.9996 +ellps=WGS84", 1.0, 50.0)


CODES = ["EPSG:25832", "EPSG:2154", "ESRI:102003", "IGNF:LAMB93", "IAU_2015:49910", "EPSG:4258"]
MINE = [(code, "A map of mine") for code in CODES]


def without_id(code, **others):
    return CRS.from_json_dict({key: value for key, value in (CRS(code).to_json_dict() | others).items() if key != "id"})


@pytest.mark.slow
@each(("code", "name"), [*((code, "") for code in CODES), (CODES[0], "unknown"), *MINE])
def test_the_code_of_a_crs_is_that_which_proj_is_sure_of(code, name):
    """By its id, by its registered name, and none for another name, for which PROJ would search its whole database."""
    assert registered_code(CRS(code)) == code
    crs = without_id(code, name=name) if name else without_id(code)
    assert registered_code(crs) == ":".join(crs.to_authority(min_confidence=100) or ()) == ("" if name else code)


def test_another_name_does_not_send_proj_searching(monkeypatch):
    """The search takes 0.1 s, and longer for a long name."""
    crs = without_id("EPSG:25832", name="nonsense " * 9999)
    monkeypatch.setattr(CRS, "to_authority", None)
    assert parse_crs(crs).definition.startswith('PROJCRS["nonsense')
