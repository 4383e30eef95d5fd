"""Reports as web pages: `-o FILE.html` and `--format html`."""

import base64
import re
import zlib
from html.parser import HTMLParser
from pathlib import Path

import pytest
from commands import QUICK, parse_html, parse_markdown, refusal, run_ok
from pyproj import CRS, Geod, Transformer
from tables import each

pytestmark = pytest.mark.slow

FAROES = "box:-7.2,61.3,-6.2,62.5"


class Texts(HTMLParser):
    """The text of each element by its tag, and how many canvases there are."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: dict[str, list[str]] = {}
        self.last = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list) -> None:
        """An element begins."""
        self.last = tag
        self.found.setdefault(tag, []).append("")

    def handle_data(self, data: str) -> None:
        """Its text up to the next."""
        if self.last:
            self.found[self.last][-1] += data


def page(path: Path, *words: str) -> dict[str, list[str]]:
    assert run_ok(*words, "-o", str(path)).endswith(f"Wrote: {path}\n")
    return Texts(path.read_text(encoding="utf-8")).found


@pytest.mark.usefixtures("few_cells")
def test_a_comparison_has_its_maps_and_its_table(tmp_path: Path) -> None:
    """In the order of the table, with what is to be copied; more than six are too many."""
    words = ["compare", "moll", "robin", "EPSG:3857", "-r", "box:-30,30,-10,50", "-m", "omega", *QUICK]
    path = tmp_path / "x.html"
    found = page(path, *words)
    table = run_ok(*words, "-f", "csv").splitlines()
    titles = {
        "robin": "Robinson (robin)",
        "moll": "Mollweide (moll)",
        "EPSG:3857": "WGS 84 / Pseudo-Mercator (EPSG:3857)",
    }
    order = [line.partition(",")[0] for line in table[1:]]
    assert [title.strip() for title in found["figcaption"]] == [titles[given] for given in order]
    rows = parse_html(path.read_text(encoding="utf-8"))
    assert [row["projection"] for row in rows] == order
    assert all("AK" in row and "omega mean" in row for row in rows)
    heads = [head.strip() for head in found["h2"]]
    assert {"Command", "PROJ: Mollweide (moll)", f"WKT2: {titles['EPSG:3857']}"} <= set(heads)
    assert '"measure": "angular_distortion"' in path.read_text(encoding="utf-8")
    assert any(text.startswith('PROJCRS["WGS 84 / Pseudo-Mercator"') for text in found["pre"])


@pytest.mark.usefixtures("few_cells")
def test_many_maps_are_told(tmp_path: Path) -> None:
    """A page has six, and says that there are more."""
    names = "robin moll merc eqearth sinu eck4 eck6".split()
    found = page(tmp_path / "x.html", "compare", *names, "-r", "globe", *QUICK)
    assert len(found["canvas"]) == 6 + 1
    assert any("These are the maps of the first 6 of 7." in text for text in found["li"])


@each("words", ["tables", "factors eqc 10 50", "list measures"])
def test_tables_without_maps(words: str) -> None:
    """The same rows as Markdown has, and no canvas."""
    text = run_ok(*words.split(), "-f", "html")
    assert "<canvas" not in text
    assert len(parse_html(text)) == len(parse_markdown(run_ok(*words.split(), "-f", "markdown")))


WITH_MAPS = {
    f"recommend {FAROES} --authority EPSG --datum FD54": None,
    "optimize lcc box:-10,35,30,70 --against EPSG:3034": "Optimised",
    "correct mollweide -r box:-10,35,30,70": "Corrected",
    f"design {FAROES} --degree 2 --base EPSG:5316 --against EPSG:25829": "Made to measure",
}


@pytest.mark.parametrize("words", WITH_MAPS)
def test_commands_with_maps(words: str, tmp_path: Path) -> None:
    """The answer beside what it is compared with, and the forms that it has."""
    found, title = page(tmp_path / "x.html", *words.split()), WITH_MAPS[words]
    titles = [text.strip() for text in found["figcaption"]]
    assert len(titles) == len(found["canvas"]) - 1 >= 1
    assert (tmp_path / "x.html").stat().st_size < 400_000 * len(titles)
    if title is not None:
        assert title in titles
        assert {"PROJ", "WKT2"} <= {head.strip() for head in found["h2"]}


def test_a_low_distortion_projection_has_scales_on_the_ground(tmp_path: Path) -> None:
    """At the height that is given, as the titles say; beside the map that it is compared with."""
    words = ["ldp", "box:-104.2,38.9,-103.9,39.1", "--height", "1610", "--against", "EPSG:32613"]
    found = page(tmp_path / "x.html", *words)
    titles = [title.strip() for title in found["figcaption"]]
    assert titles == ["lcc, on the ground at 1,610 m", "EPSG:32613, on the ground at 1,610 m"]
    assert '"measure": "scale_error_ppm"' in (tmp_path / "x.html").read_text(encoding="utf-8")


SHEET = "ldp box:-40,30,-39.5,30.4 --families tmerc --height 5900 --height-units ft --geoid-height -17.5 --name Sea"


@pytest.mark.usefixtures("few_cells")
def test_a_sheet_to_sign(tmp_path: Path) -> None:
    """PROJ gets the printed coordinates of its WKT, and the printed lengths, at orthometric heights and the geoid's."""
    words = [*SHEET.split(), "--units", "us-ft", "--false-northing", "500000"]
    found = page(tmp_path / "x.html", *words)
    assert (found["h1"][0].strip(), found["dt"]) == ("Sea", ["Name", "Licence number", "Signature", "Date"])
    text = (tmp_path / "x.html").read_text(encoding="utf-8")
    parameters, _, points, lines = (parse_html(table) for table in re.findall("(?s)<table>.*?</table>", text))
    stated = {row["parameter"]: row["value"] for row in parameters}
    assert stated["False northing"] == "500000 US survey feet"
    assert re.fullmatch("39°[0-5][0-9]'00\" W", stated["Central meridian"])
    assert stated["Ellipsoid"] == "WGS 84: a = 6378137 m, 1/f = 298.257223563"
    crs = CRS(next(pre for pre in found["pre"] if pre.startswith('PROJCRS["Sea"')))
    to_map = Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
    places = [[degrees(row["longitude"]), degrees(row["latitude"])] for row in points]
    for row, (lon, lat) in zip(points, places, strict=True):
        assert [row["E us-ft"], row["N us-ft"]] == [f"{value:.4f}" for value in to_map.transform(lon, lat)]
        assert float(row["h us-ft"]) == pytest.approx((5900 * 0.3048 - 17.5) * 3937 / 1200, abs=2e-3)
    assert (len(points) >= 5, len(lines)) == (True, 8)
    for row in lines:
        one, other = (places[int(word) - 1] for word in row["line"].split(" to "))
        on_ground = Geod(ellps="WGS84").inv(*one, *other)[2] * (1 + (5900 * 0.3048 - 17.5) / 6_366_000)
        assert float(row["ground us-ft"]) == pytest.approx(on_ground * 3937 / 1200, rel=1e-6)  # R is good to 2e-3
        assert 1e6 * (float(row["grid us-ft"]) / float(row["ground us-ft"]) - 1) == pytest.approx(
            float(row["difference ppm"]), abs=0.01
        )


def degrees(text: str) -> float:
    """An angle of degrees, minutes and seconds, with its letter."""
    whole, minutes, seconds, letter = re.fullmatch("(\\d+)°(\\d\\d)'(\\d\\d)\" ([NSEW])", text).groups()
    return (int(whole) + int(minutes) / 60 + int(seconds) / 3600) * (1 if letter in "NE" else -1)


def test_published_tables_have_the_maps_of_their_rows() -> None:
    """Where figures are of the whole map, not of points."""
    maps = Texts(run_ok("tables", "canters-decleir", "-f", "html")).found["figcaption"]
    assert maps == ["Kavraiskiy VII", "Natural Earth", "Winkel Tripel", "Plate Carree"]
    assert "canvas" not in Texts(run_ok("tables", "snyder", "-f", "html")).found


def test_checked_data_are_marked(tmp_path: Path) -> None:
    """The worst features by their ranks and names, on the map about the data."""
    geopandas, shapely = pytest.importorskip("geopandas"), pytest.importorskip("shapely")
    boxes = [shapely.box(9, 50 + k, 9.5, 50.4 + k) for k in range(3)]
    data = geopandas.GeoDataFrame({"name": ["a", "b", "c"]}, geometry=boxes, crs=4326).to_crs(3857)
    data.to_file(tmp_path / "x.gpkg")
    words = ["check", str(tmp_path / "x.gpkg"), "--worst", "2", "-f", "html"]
    header = zlib.decompress(base64.b64decode(Texts(run_ok(*words)).found["script"][1]))
    assert (b'"names": [["1. c", ' in header, b'["2. b", ' in header, b"3. a" in header) == (True, True, False)


def test_a_page_is_refused_where_it_cannot_be(tmp_path: Path) -> None:
    """Another format, options of pictures, a file that is there."""
    path = tmp_path / "x.html"
    words = ["correct", "moll", "-o", path]
    assert "with --local. It must be table or json." in refusal(*words, "--local", "500")
    commands = [words, ["compare", "moll", *words[2:]], ["recommend", "globe", *words[2:]], ["check", "x", *words[2:]]]
    for command in commands:
        for form in ("json", "table"):
            message = f"Invalid format '{form}' for '{path}'. Its suffix tells the format, html."
            assert refusal(*command, "-f", form) == message
    for command in (words, commands[2]):
        for option, value in {"--size": "5,5", "--dpi": "100", "--theme": "dark"}.items():
            message = f"Invalid option '{option}'. It is for pictures, and '{path}' is a page."
            assert refusal(*command, option, value) == message
    assert "Its suffix must be" in refusal("heatmap", "robin", "-o", path)
    path.write_text("old")
    assert "It exists" in refusal(*words)
    assert path.read_text() == "old"
