"""What is no projection is refused in one line."""

import re

import numpy as np
import pyproj.list
import pytest
from projection_points import EUROPE, assert_same, make, message
from pyproj import CRS, Transformer
from refusals import says, wrong_words
from tables import each, some

from projdist.projections import ProjectionError, projection_names

EVERYTHING = (
    r"It must be a PROJ id or a name \(see 'projdist list projections'\), a PROJ string, an EPSG: or ESRI: code, "
    r"WKT, PROJJSON, the path of a \.prj or \.wkt file, a pyproj CRS, or a function of \(lon, lat\)\."
)

GEOGRAPHIC = CRS("EPSG:4326")

# Each text that the table has no form for, with what the message must say of it, besides the text itself.
ERRORS = {
    "+proj=ob_tran +o_proj=longlat +o_lat_p=30 +o_lon_p=0": r"(plane|is not a map)",
    "nul\0.prj": r"It cannot be read as text: embedded null",
    "EPSG:3035\0x": r"It has a null character\.$",
    "+proj=briesemeister": r"^(?!.*mean briesemeister).*$",  # PROJ strings have PROJ's names only
} | dict.fromkeys(("", "   "), EVERYTHING)


def assert_clear(value, text):
    """The message names what was given, or its parameter that is wrong, and is whole."""
    assert f"'{value.strip()}'" in text or text.startswith("Invalid parameter '+l"), text
    assert text.endswith((".", ")", "?")), text
    assert text.count("(") == text.count(")"), text


@each("value", ERRORS)
def test_errors_say_what_was_given_and_what_is_allowed(value):
    """Text that names no map is refused in one line with the text, the reason and what would do."""
    text = message(value)
    assert_clear(value, text)
    assert re.search(ERRORS[value], text), text


@each(("words", "code", "said"), wrong_words("_projections"))
def test_texts_of_the_table_are_refused(words, code, said):
    """In the same way."""
    value = words.removeprefix("projection ")
    text = message(value)
    assert_clear(value, text)
    assert says(said, text), text


@each("value", [None, 1.5, [], object(), b"robin", True])
def test_objects_that_are_no_maps(value):
    """None, numbers and other objects are refused in one line, with all that is allowed."""
    text = message(value)
    assert str(value) in text
    assert re.search(EVERYTHING, text)


# Suggestions, all of them in their order, and what was typed.
TYPOS = """robinsn=robinson or robin; Mollwide=mollweide; winkle-tripel=winkel-tripel; mercador=mercator;
equalearth=equal-earth or eqearth; plate caree=plate-carree; gall_petres=gall-peters; Albers=aea;
lambert conformal conic=lcc or lcca; eckert=eckert-1, eckert-2, eckert-3, eckert-4, eckert-5 or eckert-6;
web mercator=webmerc; hammer-aitoff=hammer; robinson projection=robinson; ESPG 4326=EPSG:4326;
ESPG:3035=EPSG:3035; espg3035=EPSG:3035"""


@each("text, hint", [pair.strip().split("=") for pair in TYPOS.split(";")])
def test_typos_of_names_have_a_hint(text, hint):
    """What was nearly typed, begun, or said in the words of PROJ's description is suggested, and nothing else."""
    assert f". Did you mean {hint}? It must be" in message(text)


@each(
    "text",
    "nosuch foo nothing qwerty projection sphere globe x 42 99999 EPSG:99999 ESPG:99999 nosuch:3035 dymaxion".split(),
)
def test_nonsense_has_no_hint(text):
    """What is like no name has none suggested, and a code that does not exist no other code."""
    assert "Did you mean" not in message(text)


@pytest.mark.slow
def test_one_wrong_letter_is_no_obstacle():
    """A name with one letter missing, doubled or swapped with the next is suggested, nineteen times of twenty."""
    found = []
    for name in some(projection_names(), 16):
        for k in range(len(name) - 1):
            swapped = name[:k] + name[k + 1] + name[k] + name[k + 2 :]
            typos = (name[:k] + name[k + 1 :], name[:k] + name[k] + name[k:], swapped)
            found += [name in message(typo) for typo in typos if typo not in projection_names()]
    assert np.mean(found) > 0.95


WKT = CRS("EPSG:32632").to_wkt()


@each("garbage", ["garbage", "]", " x", "\n'", WKT, f",{WKT}", ",", ';PROJCS["x"]', ',VERTCS["x"] y'])
@each("version", ["WKT1_GDAL", "WKT1_ESRI", "WKT2_2019"])
def test_text_behind_wkt(version, garbage, tmp_path):
    """What stands behind the last bracket, which PROJ would pass over, is refused, in a file too."""
    text = CRS("EPSG:32632").to_wkt(version) + garbage
    (tmp_path / "map.prj").write_text(text, encoding="utf-8")
    for value in (text, tmp_path / "map.prj"):
        assert "WKT must end with its last bracket, and not with '" in message(value)


@each("space", [" ", "\n", "\r\n\t"])
def test_white_space_around_wkt(space):
    """Spaces and line ends before and behind WKT are no part of it; nor are brackets within names."""
    named = CRS("EPSG:32632").to_wkt("WKT1_GDAL").replace("WGS 84 / UTM zone 32N", 'a ]] ""b"" ([')
    for text in (WKT, CRS("EPSG:32632").to_wkt(pretty=True), named):
        assert_same(make(f"{space}{text}{space}"), make("EPSG:32632"), *EUROPE)


LONG = [GEOGRAPHIC.to_wkt(pretty=True), GEOGRAPHIC.to_json(pretty=True), GEOGRAPHIC, GEOGRAPHIC.to_json_dict()]
LETTERS, ONES = "a" * 300, "1" * 300
STRANGE = ['{"proj": true}', '{"proj": 5, "lon_0": 3}', '{"proj": []}', '{"a":' * 100_000, "PROJCS[" * 10_000]
STRANGE += [LETTERS, f"+proj={LETTERS}", f"EPSG:{ONES}", f"{LETTERS}.prj", f"+proj=merc +q={10 * ONES} +lat_ts=x"]
STRANGE += ["+proj=nosuch\n+R=1", "+proj=longlat\n +R=1", "GEOGCS[\n'x']", "no\nname"]


@each("value", [*LONG, *STRANGE])
def test_long_and_strange_input_is_refused_in_one_short_line(value):
    """However long or deep it is, and in whatever shape; WKT and JSON of many lines are quoted by their beginning."""
    text, is_long = message(value), any(value is one for one in LONG)
    assert text.endswith(".")
    assert len(text) < (300 if is_long else 500)
    assert not is_long or "Geographic 2D CRS (WGS 84), which has no map plane; it must be a projected CRS" in text


def test_errors_of_files(tmp_path):
    """Files that are missing, empty, binary, or hold no map are refused by their name."""
    empty, binary, geographic, nonsense = (tmp_path / f"{name}.prj" for name in ("empty", "binary", "geo", "nonsense"))
    empty.write_text(" \n")
    binary.write_bytes(b"\xff\xfe\x00\x01")
    geographic.write_text(GEOGRAPHIC.to_wkt("WKT1_ESRI"))
    nonsense.write_text("first line\nsecond line")
    reasons = {empty: "It must hold WKT, PROJJSON or a PROJ string.", geographic: "no map plane", nonsense: ""}
    reasons |= dict.fromkeys((binary, tmp_path), "It cannot be read as text:")
    for path, reason in (reasons | {tmp_path / "missing.prj": "No such file or directory"}).items():
        text = message(path)
        assert reason in text
        assert str(path) in text


def test_errors_are_value_errors():
    """ProjectionError is a ValueError, and keeps PROJ's own error as its cause."""
    with pytest.raises(ValueError, match=r"^Invalid PROJ string") as error:
        make("+proj=utm +zone=99")
    assert isinstance(error.value, ProjectionError)
    assert isinstance(error.value.__cause__, pyproj.exceptions.ProjError)


@pytest.mark.slow
@pytest.mark.parametrize("code", ["ESRI:102060", "ESRI:102166", "EPSG:3035", "EPSG:32661", "EPSG:27572"])
def test_the_conversion_alone(code):
    """No shift of datum, though PROJ's database has some between a CRS and its own geodetic CRS (1 cm, 4 cm)."""
    west, south, east, north = CRS(code).area_of_use.bounds
    lon, lat = (west + east) / 2, (south + north) / 2
    alone = CRS.from_wkt(CRS(code).to_wkt())
    truth = Transformer.from_crs(alone.geodetic_crs, alone, always_xy=True)
    u, v = truth.transform(*((lon - 2.33722916667) / 0.9, lat / 0.9) if code == "EPSG:27572" else (lon, lat))
    np.testing.assert_allclose(make(code)(lon, lat), [u, v], atol=1e-3)
