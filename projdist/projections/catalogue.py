"""Friendly names of textbook map projections, and what a misspelt name may have been meant for."""

from __future__ import annotations

import difflib
import functools
import re

import pyproj.database
import pyproj.list
from pyproj.enums import PJType

from projdist.projections.worldmaps import WORLD_MAPS
from projdist.support import NEAR, close_words

WINKEL_PARALLEL = 50.4597762521898
"""arccos(2 / pi) in degrees, the standard parallel of Winkel's maps (Snyder, "Flattening the Earth", 1993)."""

NAMES: dict[str, str] = {
    # cylindrical
    "plate-carree": "eqc",
    "equirectangular": "eqc",
    "gall-isographic": "eqc +lat_ts=45",
    "mercator": "merc",
    "transverse-mercator": "tmerc",
    "cassini": "cass",
    "miller": "mill",
    "compact-miller": "comill",
    "gall": "gall",
    "gall-stereographic": "gall",
    "patterson": "patterson",
    "central-cylindrical": "cc",
    "tobler-mercator": "tobmerc",
    "lambert-cylindrical": "cea",
    "cylindrical-equal-area": "cea",
    "behrmann": "cea +lat_ts=30",
    "hobo-dyer": "cea +lat_ts=37.5",
    "gall-peters": "cea +lat_ts=45",
    "peters": "cea +lat_ts=45",
    "balthasart": "cea +lat_ts=50",
    # pseudocylindrical
    "robinson": "robin",
    "natural-earth": "natearth",
    "natural-earth-2": "natearth2",
    "equal-earth": "eqearth",
    "mollweide": "moll",
    "sinusoidal": "sinu",
    "sanson-flamsteed": "sinu",
    "eckert-1": "eck1",
    "eckert-2": "eck2",
    "eckert-3": "eck3",
    "eckert-4": "eck4",
    "eckert-5": "eck5",
    "eckert-6": "eck6",
    "kavrayskiy-5": "kav5",
    "kavrayskiy-7": "kav7",
    "wagner-1": "wag1",
    "wagner-2": "wag2",
    "wagner-3": "wag3",
    "wagner-4": "wag4",
    "wagner-5": "wag5",
    "wagner-6": "wag6",
    "winkel-1": f"wink1 +lat_ts={WINKEL_PARALLEL}",
    "winkel-2": f"wink2 +lat_1={WINKEL_PARALLEL}",
    "putnins-p1": "putp1",
    "putnins-p2": "putp2",
    "putnins-p3": "putp3",
    "putnins-p5": "putp5",
    "putnins-p6": "putp6",
    "craster-parabolic": "crast",
    "quartic-authalic": "qua_aut",
    "boggs-eumorphic": "boggs",
    "hatano": "hatano",
    "collignon": "collg",
    "foucaut": "fouc",
    "nell": "nell",
    "nell-hammer": "nell_h",
    "loximuthal": "loxim",
    "times": "times",
    "fahey": "fahey",
    "ortelius": "ortel",
    "mcbryde-thomas-flat-polar-parabolic": "mbtfpp",
    "mcbryde-thomas-flat-polar-quartic": "mbtfpq",
    "mcbryde-thomas-flat-polar-sinusoidal": "mbtfps",
    "goode-homolosine": "goode",
    "interrupted-goode-homolosine": "igh",
    "interrupted-mollweide": "imoll",
    # azimuthal and modified azimuthal
    "azimuthal-equidistant": "aeqd",
    "lambert-azimuthal": "laea",
    "lambert-azimuthal-equal-area": "laea",
    "stereographic": "stere",
    "polar-stereographic": "stere +lat_0=90",
    "gnomonic": "gnom",
    "orthographic": "ortho",
    "wagner-7": "wag7",
    "aitoff": "aitoff",
    "hammer": "hammer",
    "winkel-tripel": "wintri",
    "winkel-3": "wintri",
    # polyconic, globular and others
    "polyconic": "poly",
    "rectangular-polyconic": "rpoly",
    "werner": "bonne +lat_1=90",
    "van-der-grinten": "vandg",
    "van-der-grinten-2": "vandg2",
    "van-der-grinten-3": "vandg3",
    "van-der-grinten-4": "vandg4",
    "lagrange": "lagrng",
    "august-epicycloidal": "august",
    "nicolosi": "nicol",
    "bacon-globular": "bacon",
    "apian-globular": "apian",
    "laskowski": "lask",
    "larrivee": "larr",
    "ginzburg-8": "gins8",
    "denoyer": "denoy",
    "bertin": "bertin1953",
    "guyou": "guyou",
    "peirce-quincuncial": "peirce_q",
    "icosahedral-snyder": "isea",
}

TITLES: dict[str, str] = {
    "plate-carree": "Plate carrée",
    "equirectangular": "Equirectangular",
    "gall-isographic": "Gall isographic",
    "mercator": "Mercator",
    "transverse-mercator": "Transverse Mercator",
    "cassini": "Cassini",
    "miller": "Miller cylindrical",
    "compact-miller": "Compact Miller",
    "gall": "Gall stereographic",
    "gall-stereographic": "Gall stereographic",
    "patterson": "Patterson",
    "central-cylindrical": "Central cylindrical",
    "tobler-mercator": "Tobler-Mercator",
    "lambert-cylindrical": "Lambert cylindrical equal-area",
    "cylindrical-equal-area": "Cylindrical equal-area",
    "behrmann": "Behrmann",
    "hobo-dyer": "Hobo-Dyer",
    "gall-peters": "Gall-Peters",
    "peters": "Gall-Peters",
    "balthasart": "Balthasart",
    "robinson": "Robinson",
    "natural-earth": "Natural Earth",
    "natural-earth-2": "Natural Earth II",
    "equal-earth": "Equal Earth",
    "mollweide": "Mollweide",
    "sanson-flamsteed": "Sanson-Flamsteed",
    "sinusoidal": "Sinusoidal",
    "eckert-1": "Eckert I",
    "eckert-2": "Eckert II",
    "eckert-3": "Eckert III",
    "eckert-4": "Eckert IV",
    "eckert-5": "Eckert V",
    "eckert-6": "Eckert VI",
    "kavrayskiy-5": "Kavrayskiy V",
    "kavrayskiy-7": "Kavrayskiy VII",
    "wagner-1": "Wagner I",
    "wagner-2": "Wagner II",
    "wagner-3": "Wagner III",
    "wagner-4": "Wagner IV",
    "wagner-5": "Wagner V",
    "wagner-6": "Wagner VI",
    "winkel-1": "Winkel I",
    "winkel-2": "Winkel II",
    "putnins-p1": "Putniņš P1",
    "putnins-p2": "Putniņš P2",
    "putnins-p3": "Putniņš P3",
    "putnins-p5": "Putniņš P5",
    "putnins-p6": "Putniņš P6",
    "craster-parabolic": "Craster parabolic",
    "quartic-authalic": "Quartic authalic",
    "boggs-eumorphic": "Boggs eumorphic",
    "hatano": "Hatano asymmetrical equal-area",
    "collignon": "Collignon",
    "foucaut": "Foucaut",
    "nell": "Nell",
    "nell-hammer": "Nell-Hammer",
    "loximuthal": "Loximuthal",
    "times": "Times",
    "fahey": "Fahey",
    "ortelius": "Ortelius oval",
    "mcbryde-thomas-flat-polar-parabolic": "McBryde-Thomas flat-polar parabolic",
    "mcbryde-thomas-flat-polar-quartic": "McBryde-Thomas flat-polar quartic",
    "mcbryde-thomas-flat-polar-sinusoidal": "McBryde-Thomas flat-polar sinusoidal",
    "goode-homolosine": "Goode homolosine",
    "interrupted-goode-homolosine": "Interrupted Goode homolosine",
    "interrupted-mollweide": "Interrupted Mollweide",
    "azimuthal-equidistant": "Azimuthal equidistant",
    "lambert-azimuthal": "Lambert azimuthal equal-area",
    "lambert-azimuthal-equal-area": "Lambert azimuthal equal-area",
    "stereographic": "Stereographic",
    "polar-stereographic": "Polar stereographic",
    "gnomonic": "Gnomonic",
    "orthographic": "Orthographic",
    "wagner-7": "Wagner VII",
    "aitoff": "Aitoff",
    "hammer": "Hammer",
    "winkel-tripel": "Winkel Tripel",
    "winkel-3": "Winkel Tripel",
    "polyconic": "Polyconic",
    "rectangular-polyconic": "Rectangular polyconic",
    "werner": "Werner",
    "van-der-grinten": "Van der Grinten I",
    "van-der-grinten-2": "Van der Grinten II",
    "van-der-grinten-3": "Van der Grinten III",
    "van-der-grinten-4": "Van der Grinten IV",
    "lagrange": "Lagrange",
    "august-epicycloidal": "August epicycloidal",
    "nicolosi": "Nicolosi globular",
    "bacon-globular": "Bacon globular",
    "apian-globular": "Apian globular I",
    "laskowski": "Laskowski tri-optimal",
    "larrivee": "Larrivée",
    "ginzburg-8": "Ginzburg VIII",
    "denoyer": "Denoyer semi-elliptical",
    "bertin": "Bertin 1953",
    "guyou": "Guyou",
    "peirce-quincuncial": "Peirce quincuncial",
    "icosahedral-snyder": "Snyder icosahedral equal-area",
    "briesemeister": "Briesemeister",
    "double-sided-equal-area": "Double-sided equal-area",
    "double-sided-equidistant": "Double-sided equidistant",
    "francula-1": "Frančula I",
    "francula-2": "Frančula II",
    "gott-elliptical": "Gott equal-area elliptical",
    "gott-mugnolo-elliptical": "Gott-Mugnolo elliptical",
    "gott-wagner": "Gott-Wagner",
    "wagner-9": "Wagner IX",
}
"""Names as the literature prints them: Snyder & Voxland, "An album of map projections", 1989, and the maps' authors."""

ID_TITLES = {NAMES[name]: title for name, title in TITLES.items() if name in NAMES and " " not in NAMES[name]}
"""The same of PROJ's ids, described in PROJ in several styles; the last name of an id is its general one."""

TEXTBOOK_PARAMETERS: dict[str, str] = {
    "wink1": NAMES["winkel-1"],
    "wink2": NAMES["winkel-2"],
}
"""PROJ ids whose PROJ defaults are not the textbook map."""

NEEDED_PARAMETERS: dict[str, str] = {
    "aea": "+lat_1=29.5 +lat_2=45.5",
    "bonne": "+lat_1=45",
    "ccon": "+lat_1=45",
    "chamb": "+lat_1=55 +lon_1=10 +lat_2=10 +lon_2=-20 +lat_3=10 +lon_3=50",
    "eqdc": "+lat_1=30 +lat_2=60",
    "etmerc": "+ellps=WGS84",
    "euler": "+lat_1=30 +lat_2=60",
    "geos": "+h=35785831",
    "gn_sinu": "+m=2 +n=3",
    "imw_p": "+lat_1=48 +lat_2=52",
    "labrd": "+lat_0=-18.9 +azi=18.9",
    "lcc": "+lat_1=30 +lat_2=60",
    "lcca": "+lat_0=45",
    "lsat": "+lsat=5 +path=177",
    "misrsom": "+path=177",
    "murd1": "+lat_1=30 +lat_2=60",
    "murd2": "+lat_1=30 +lat_2=60",
    "murd3": "+lat_1=30 +lat_2=60",
    "nsper": "+h=3000000",
    "ob_tran": "+o_proj=moll +o_lat_p=45",
    "oea": "+m=1 +n=2",
    "omerc": "+lat_0=45 +alpha=30",
    "pconic": "+lat_1=30 +lat_2=60",
    "sch": "+plat_0=30 +plon_0=45 +phdg_0=-12",
    "tissot": "+lat_1=30 +lat_2=60",
    "tpeqd": "+lat_1=40 +lon_1=-100 +lat_2=50 +lon_2=10",
    "tpers": "+h=3000000",
    "ups": "+ellps=WGS84",
    "urm5": "+n=0.9",
    "urmfps": "+n=0.5",
    "utm": "+zone=33 +ellps=WGS84",
    "vitk1": "+lat_1=30 +lat_2=60",
}
"""What PROJ ids need to be a map, as an example; without it PROJ refuses them, at least on a sphere."""

NOT_MAPS = frozenset(
    """affine axisswap cart defmodel deformation geoc geocent geogoffset gridshift helmert hgridshift horner lonlat
    latlon latlong longlat molobadekas molodensky noop pipeline pop push set tinshift topocentric unitconvert
    vertoffset vgridshift xyzgridshift""".split()
)
"""PROJ operations that are not map projections."""

NOT_IN_METRES = {
    "calcofi": "lines and stations of a survey off California",
    "s2": "places on the face of a cube, from 0 to 1",
}
"""PROJ operations whose plane has a unit of its own, whatever the size of the Earth, by what they give."""


# ---- hints ---------------------------------------------------------------------------------------


_OF_THE_EARTH = ("EPSG", "ESRI", "IGNF")
_MOST = 6  # as many as Eckert and Wagner made maps


def normalised(text: str) -> str:
    """A name in the catalogue's spelling: small letters and hyphens."""
    return re.sub(r"[\s_]+", "-", text.lower())


@functools.cache
def operation_titles() -> dict[str, str]:
    """What PROJ's operations are called, by their ids."""
    return pyproj.list.get_proj_operations_map() | ID_TITLES


def close_names(text: str) -> list[str]:
    """Names that begin with the text, or are spelt nearly so, or that it begins with; none for nonsense."""
    known, wanted = _spellings(), normalised(text)
    found = close_words(wanted, known) or [key for key in known if wanted.startswith(f"{key}-")]
    return list(dict.fromkeys(known[key] for key in found))[:_MOST]


def close_ids(text: str) -> list[str]:
    """PROJ ids of the maps of `close_names`."""
    return list(dict.fromkeys(NAMES.get(name, name).split()[0] for name in close_names(text) if name not in WORLD_MAPS))


def close_codes(text: str) -> list[str]:
    """The CRS code that is meant by `ESPG:3035`, `epsg3035`, `3035` or `102003`; none if there is no such code."""
    match = re.fullmatch(r"(?:([A-Za-z]+)[\s:_-]*)?(\d+)", text)
    if not match:
        return []
    authorities = ["EPSG", "ESRI"]
    if match[1]:
        authorities = difflib.get_close_matches(match[1].upper(), pyproj.database.get_authorities(), n=1, cutoff=NEAR)
    known = (f"{name}:{match[2]}" for name in authorities if match[2] in pyproj.database.get_codes(name, PJType.CRS))
    return list(known)[:1]


def codes_elsewhere(authority: str, number: str) -> list[str]:
    """The codes of projected CRSs of the Earth that other authorities have with the number."""
    others = (name for name in _OF_THE_EARTH if name != authority)
    kinds = (PJType.PROJECTED_CRS, PJType.GEOGRAPHIC_2D_CRS, PJType.COMPOUND_CRS)
    return [
        f"{name}:{number}"
        for name in others
        if any(number in pyproj.database.get_codes(name, kind, allow_deprecated=True) for kind in kinds)
    ]


def crs_code(text: str) -> str:
    """The code of the projected CRS of a name, in capitals or not; nothing where there is none."""
    return _crs_names().get(folded(text), ("", ""))[0]


def close_crs_names(text: str) -> list[str]:
    """Names of projected CRSs that are spelt nearly so."""
    known = _crs_names()
    return [known[name][1] for name in close_words(folded(text), known)][:_MOST]


def folded(text: str) -> str:
    """A name without what programs spell in different ways: capitals, spaces, underscores, brackets."""
    return re.sub(r"[^a-z0-9+]+", "", text.lower())


@functools.cache
def _crs_names() -> dict[str, tuple[str, str]]:
    """Codes and names of the projected CRSs of the Earth by their folded names; of a name of several, EPSG's code."""
    found: dict[str, tuple[str, str]] = {}
    for authority in _OF_THE_EARTH:
        for info in pyproj.database.query_crs_info(authority, PJType.PROJECTED_CRS):
            found.setdefault(folded(info.name), (f"{authority}:{info.code}", info.name))
    return found


@functools.cache
def _spellings() -> dict[str, str]:
    """Names by what they may be called: by themselves, and by PROJ's descriptions of its ids."""
    operations = {key: text for key, text in pyproj.list.get_proj_operations_map().items() if key not in NOT_MAPS}
    spellings = {normalised(name): name for name in [*NAMES, *WORLD_MAPS, *operations]}
    friendly = {operation: name for name, operation in NAMES.items()}
    for key, text in operations.items():
        spellings.setdefault(re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-"), friendly.get(key, key))
    return spellings
