"""Search of CRSs by words, against what EPSG and the mapping agencies call them."""

import pytest
from tables import each

from projdist.projections import find_crs

# What a person means who types this: the CRS that the agency of the country, or EPSG, calls so.
MEANT = {
    "3035": "EPSG:3035",
    "EPSG:3035": "EPSG:3035",
    "epsg 3035": "EPSG:3035",
    "ignf:lamb93": "IGNF:LAMB93",
    "54030": "ESRI:54030",
    "IAU_2015:49910": "IAU_2015:49910",
    "utm 33": "EPSG:32633",
    "utm33n": "EPSG:32633",
    "UTM zone 33S": "EPSG:32733",
    "etrs89 utm 32": "EPSG:25832",
    "33n utm etrs89": "EPSG:25833",
    "lambert 93": "EPSG:2154",
    "Lambert-93": "EPSG:2154",
    "france": "EPSG:2154",
    "british national grid": "EPSG:27700",
    "lv95": "EPSG:2056",
    "amersfoort rd new": "EPSG:28992",
    "new zealand transverse": "EPSG:2193",
    "NAD83 / Texas Central": "EPSG:32139",
    "california zone 5 ftus": "EPSG:2229",
    "pseudo-mercator wgs": "EPSG:3857",
    "arctic polar stereographic": "EPSG:3995",
    "reunion utm 40": "EPSG:2975",
    "réunion UTM 40": "EPSG:2975",
    "world_robinson": "ESRI:54030",
    "robinson": "robinson",
    "winkel tripel": "winkel-tripel",
    "wintri": "winkel-tripel",
}


@each("text", MEANT)
def test_what_is_meant_comes_first(text: str) -> None:
    assert find_crs(text, limit=1).results[0].code == MEANT[text]


def test_other_words_of_a_crs() -> None:
    """Methods and countries of the area of use count, too."""
    assert "EPSG:3035" in [hit.code for hit in find_crs("lambert azimuthal equal area europe", limit=20).results]
    assert "EPSG:25832" in [hit.code for hit in find_crs("austria utm").results]


def test_results() -> None:
    """Each of the words is in what is found, so many as are asked for, and the total is told."""
    found = find_crs("utm 33", limit=3)
    assert len(found.results) == 3 < found.total
    assert len(find_crs("utm 33", limit=1000).results) == found.total
    first = found.results[0]
    assert (first.name, first.area_of_use, first.deprecated) == (
        "WGS 84 / UTM zone 33N",
        (12.0, 0.0, 18.0, 84.0),
        False,
    )
    assert found.rows()[0]["east"] == 18.0
    assert repr(found).startswith("CrsSearch(3 of ")
    assert all("33" in hit.name for hit in found.results)


def test_authorities() -> None:
    assert {hit.code[:5] for hit in find_crs("lambert 93", authorities="ignf", limit=50).results} == {"IGNF:"}
    with pytest.raises(ValueError, match=r"Invalid authority 'EPGS'. Did you mean EPSG\? It must be EPSG, ESRI, "):
        find_crs("utm", authorities=["EPGS"])


def test_deprecated_ones() -> None:
    """By their code, or where they are asked for."""
    assert find_crs("2036").results[0].deprecated
    plain = find_crs("new brunswick stereo", limit=50)
    asked = find_crs("new brunswick stereo", limit=50, deprecated=True)
    assert not any(hit.deprecated for hit in plain.results)
    assert "EPSG:2036" in [hit.code for hit in asked.results if hit.deprecated]


ADVICE = {
    "amersfort": "Did you mean 'amersfoort'?",
    "utm zonne 33": "Did you mean 'utm zone 33'?",
    "moliweide": "Did you mean 'mollweide'?",
    "4326": "EPSG:4326 is a geographic CRS (WGS 84), and no map.",
    "WGS 84 world mercator grid amersfoort": "No one has all of these words: take fewer of them.",
    "xqzzyx": "No name and no area of use has 'xqzzyx'.",
    "999999": "No name and no area of use has '999999'.",
    "Qornoq 1927 Greenland zone 3 east": "Deprecated ones have these words: ask for them, too.",
}


@pytest.mark.slow
@pytest.mark.parametrize("text", ADVICE)
def test_nothing_is_found(text: str) -> None:
    """What may have been meant is told."""
    found = find_crs(text)
    assert (found.total, found.results, found.advice) == (0, (), ADVICE[text])


@pytest.mark.parametrize("text", ["", "  ", "!?", "---"])
def test_no_words(text: str) -> None:
    with pytest.raises(ValueError, match="It must have a word or a number"):
        find_crs(text)
