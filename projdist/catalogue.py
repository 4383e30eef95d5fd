"""Friendly names of textbook map projections and the PROJ operations that they stand for."""

from __future__ import annotations

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

TEXTBOOK_PARAMETERS: dict[str, str] = {
    "wink1": NAMES["winkel-1"],
    "wink2": NAMES["winkel-2"],
}
"""PROJ ids whose PROJ defaults are not the textbook map."""

NOT_MAPS = frozenset(
    """affine axisswap cart defmodel deformation geoc geocent geogoffset gridshift helmert hgridshift horner lonlat
    latlon latlong longlat molobadekas molodensky noop pipeline pop push set tinshift topocentric unitconvert
    vertoffset vgridshift xyzgridshift""".split()
)
"""PROJ operations that are not map projections."""
