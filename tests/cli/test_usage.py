"""What is no command line is refused in one line; the documentation has commands and options that there are."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from commands import refusal, refused, run, run_ok
from tables import each
from typer.main import get_command

from projdist import __version__
from projdist.cli.app import app

COMMANDS = [
    *("compare", "factors", "profile", "tissot", "heatmap", "recommend", "optimize", "ldp", "check", "correct"),
    *("world-map", "morph", "mosaic", "clouds", "oldmap", "list", "explore", "info", "find", "completion"),
]


def test_repairs_are_said(tmp_path: Path) -> None:
    """A repaired region is measured and the repair told; a table over points tells how many there are, and weights."""
    path = tmp_path / "bow.geojson"
    path.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [10, 10], [10, 0], [0, 10], [0, 0]]]}')
    result = run("compare", "robin", "--region", f"file:{path}")
    assert result.exit_code == 0
    assert re.fullmatch(r"projdist: file:.*: 1 self-intersecting polygon\(s\) repaired; [^\n]*\n", result.stderr)
    assert "AK" in result.stdout
    path = tmp_path / "a.csv"
    path.write_text("lon,lat,weight\n1,2,1\n3,4,5\n")
    shown = run_ok("compare", "robin", "--region", f"points:{path}", "--details")
    assert "(2 points)" in shown
    assert "by the points' weights" in shown


OVER_POINTS = {
    "optimize": "optimize eqc {} --free lat_ts",
    "correct": "correct robin -r {}",
    "design": "design {} --degree 1 --base EPSG:32631",
    "mean-map": "mean-map robin -r {} --degree 1",
}


@pytest.mark.parametrize("command", OVER_POINTS)
def test_points_have_no_area(command: str, tmp_path: Path) -> None:
    """A title tells how many there are, and no area."""
    path = tmp_path / "a.csv"
    path.write_text("lon,lat,weight\n1,2,1\n3,4,5\n8,1,2\n2,9,1\n")
    answer = run(*OVER_POINTS[command].format(f"points:{path}").split(), "--details").stdout
    assert "the 4 points of a.csv" in answer
    assert any(line.endswith("(4 points)") for line in answer.splitlines())


@pytest.mark.slow
@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_of_countries(tmp_path: Path, command: str) -> None:
    """Pictures show a country, also one across the antimeridian, and the surroundings of points."""
    (tmp_path / "a.csv").write_text("lon,lat\n1,2\n30,40\n")
    for region in ("country:FJ", "country:CH", f"points:{tmp_path / 'a.csv'}"):
        picture, name = tmp_path / "a.png", "robin+lon_0=178" if region == "country:FJ" else "robin"
        run_ok(command, name, "--region", region, "-o", picture, "--dpi", "40", "--overwrite")
        assert picture.stat().st_size > 2000


USAGE = {
    "compare --region glob robin": r"Invalid region 'glob'. Did you mean globe\? It must be globe, land, ocean, ",
    "compare --region= robin": r"Invalid region ''",
    "compare --region box:-10,30,20 robin": r"Invalid region 'box:-10,30,20'. It must be box:W,S,E,N, 4 numbers.",
    "compare --region box:a,b,c,d robin": r"Invalid region 'box:a,b,c,d'",
    "compare --region box:-10,30,-10,40 robin": r"Invalid box '-10,30,-10,40'. It must be wider than 0",
    "compare --region box:0,40,10,30 robin": r"Invalid box '0,40,10,30'. Did you mean 0,30,10,40\? South must be",
    "compare --region box:0,0,nan,1 robin": r"Invalid box '0,0,nan,1'",
    "compare --region box:0,0,1e400,1 robin": r"Invalid box '0,0,inf,1'",
    "compare --region cap:0,0,0 robin": r"Invalid cap '0,0,0'. Its radius must be above 0",
    "compare --region cap:0,0,-5 robin": r"Invalid cap '0,0,-5'",
    "compare --region cap:0,0,1e6 robin": r"Invalid cap '0,0,1e\+06'. .*at most 20015 km",
    "compare --region cap:0,91,10 robin": r"Invalid cap '0,91,10'",
    "compare --measure foo robin": r"Invalid measure 'foo'. It must be one of fisher, .*scale@AZIMUTH",
    "compare --measure omga robin": r"Invalid measure 'omga'. Did you mean omega",
    "compare --measure omega,,h robin": r"Invalid measure ''",
    "compare --measure scale@nan robin": r"Invalid azimuth 'nan'",
    "compare --sort foo robin": r"Invalid sort key 'foo'. It must be given, name, .*airy_kavrayskiy, .*\.median",
    "compare --sort foo nosuch": r"Invalid sort key 'foo'",
    "compare --sort omega robin": r"Invalid sort key 'omega'.*measures asked for",
    "compare --sort omega.bad -m omega robin": r"Invalid sort key 'omega.bad'",
    "compare --sort name.x robin": r"Invalid sort key 'name.x'",
    "compare --sort definition robin": r"Invalid sort key 'definition'",
    "compare --sort= robin": r"Invalid sort key ''",
    "compare --tolerance 0 robin": r"Invalid tolerance '0'. It must be a number within 1e-15 and 1.",
    "compare --tolerance -1e-3 robin": r"Invalid tolerance '-1e-3'",
    "compare --tolerance nan robin": r"Invalid tolerance 'nan'",
    "compare --tolerance inf robin": r"Invalid tolerance 'inf'",
    "compare --tolerance abc robin": r"Invalid tolerance 'abc'",
    "compare --format yaml robin": r"Invalid format 'yaml'. It must be table, json, csv, markdown or html.\n$",
    "compare --format= robin": r"Invalid format ''",
    "compare --format JSON robin": r"Invalid format 'JSON'",
    "compare robin -f json -f csv": r"Invalid option '--format'. It must be given once.",
    "compare robin --region globe -r globe": r"Invalid option '--region'. It must be given once.",
    "compare --format": r"--format.*requires an argument. See 'projdist compare --help'.",
    "compare --formt json robin": r"Invalid option '--formt'. Did you mean --format\? See 'projdist compare --help'.",
    "compare --projection robin": r"Invalid option '--projection'. See 'projdist compare --help'.",
    "compare robin -o ": r"Invalid output ''. It must be the name of a file.",
    "compare robin -o new/": r"Invalid output 'new/'. It is a directory.",
    f"compare robin -o {'x' * 300}": r"Invalid output 'x+'. It cannot be written: File name too long.",
    "compare robin --tolerance -inf": r"Invalid tolerance '-inf'. It must be a number within 1e-15 and 1.",
    "compare": r"Missing argument 'PROJECTION...'. See 'projdist compare --help'",
    "compare --": r"Missing argument 'PROJECTION...'",
    "compare robin --plot pie -o x.png": r"plot 'pie'. It must be maps, histogram, cumulative, pareto, modes or space.",
    "compare robin --plot pareto": r"Invalid option '--plot pareto'. It needs a picture to draw to: -o FILE.png.",
    "compare robin --plot pareto -o x.csv": r"Invalid picture file 'x.csv'. Its suffix must be .png, .svg or .pdf.",
    "compare robin --dpi 30": r"Invalid option '--dpi'. It needs a picture to draw: --plot maps|histogram",
    "compare robin -o x.gif": r"Its suffix must be .json, .csv, .md, .html, .png, .svg, .pdf, .txt, .log, or none.",
    "factors": r"Missing argument 'PROJECTION'",
    "factors robin": r"Invalid points. They must be LON LAT..., - for stdin, or --at FILE.",
    "factors robin 1 2 3": r"Invalid coordinates '1 2 3'. They must be pairs of LON LAT, or - for stdin.",
    "factors robin 1 2 -": r"Invalid coordinates '1 2 -'",
    "factors robin 10 90.001": r"Invalid latitude '90.001'. It must lie within -90 and 90 degrees.",
    "factors robin 10 -91": r"Invalid latitude '-91'",
    "factors robin 10 nan": r"Invalid latitude 'nan'",
    "factors robin 1e300 10": r"Invalid longitude '1e300'. It must be a number of degrees within -720 and 720.",
    "factors robin inf 10": r"Invalid longitude 'inf'",
    "factors robin -inf 5": r"Invalid longitude '-inf'. It must be a number of degrees within -720 and 720.",
    "factors robin 5 -Infinity": r"Invalid latitude '-Infinity'. It must lie within -90 and 90 degrees.",
    "factors robin -- -inf 5": r"Invalid longitude '-inf'",
    "factors robin 5 -nan": r"Invalid option '-nan'",
    "factors robin 5,6,7": r"Invalid coordinates '5,6,7'. They must be pairs of LON LAT, or - for stdin.",
    "factors robin 5": r"Invalid coordinates '5'",
    "factors robin x y": r"Invalid point 'x y'. Longitude and latitude must be numbers of degrees.",
    "factors robin 10N 20N": r"Invalid point '10N 20N'",
    "factors robin −10 20": r"Invalid point '−10 20'",
    "factors robin 1 2 --measure foo": r"Invalid measure 'foo'",
    "factors robin 1 2 --format xml": r"Invalid format 'xml'. It must be table, json, csv, markdown or html.",
    "profile robin": r"Missing option '--line'. See 'projdist profile --help'.",
    "profile robin --line 1,2": r"Invalid line '1,2'. It must be LON,LAT,LON,LAT,..., two numbers a point.",
    "profile robin --line 1,2,3": r"Invalid line '1,2,3'. It must be LON,LAT",
    "profile robin --line 1,2,3,91": r"Invalid line '1,2,3,91'. Its longitudes must lie within -360 and 360 degrees",
    "profile robin --line 1,2,1,2": r"Invalid line '1,2,1,2'. It must have two places or more.",
    "profile robin --line 9,50,x,51": r"Invalid line '9,50,x,51'. Coordinates must be numbers LON,LAT,LON",
    "profile robin --line nowhere.geojson": r"Invalid line file 'nowhere.geojson'. It cannot be read: No such file",
    "profile robin --line 1,2,3,4 --spacing 0": r"Invalid spacing '0'. It must be a number of km within 1e-06 and",
    "profile robin --line 1,2,3,4 --height 1e5": r"Invalid height '1e5'. It must be a number of metres within",
    "profile robin --line 1,2,3,4 --dpi 50": r"Invalid option '--dpi'. It needs a picture to draw to: -o FILE.",
    "profile robin --line 1,2,3,4 -o x.tif": r"Invalid output 'x.tif'. Its suffix must be .json, .csv, .md, .html",
    "profile robin --line 1,2,3,4 -m foo": r"Invalid measure 'foo'",
    "tissot robin -o x.jpg": r"Invalid output 'x.jpg'. Its suffix must be .png, .svg, .pdf, .gpkg or .geojson.",
    "tissot robin -o noname": r"Invalid output 'noname'",
    "tissot robin -o ": r"Invalid output ''",
    "tissot robin -o new.png/": r"Invalid output 'new.png/'. It is a directory.",
    "tissot robin -o x.png -o y.png": r"Invalid option '--output'. It must be given once.",
    "tissot robin --region foo": r"Invalid region 'foo'",
    "tissot robin --step 0": r"Invalid step '0'. It must be a number of degrees within 1e-05 and 90.",
    "tissot robin --step -5": r"Invalid step '-5'",
    "tissot robin --step x": r"Invalid step 'x'",
    "tissot robin --size big": r"Invalid size 'big'. It must be WIDTH,HEIGHT in inches, as 10,6.",
    "tissot robin --size 1,2,3": r"Invalid size '1,2,3'",
    "tissot robin --size 0,6": r"Invalid width '0'. It must be a number of inches within 0.5 and 200.",
    "tissot robin --size 6,nan": r"Invalid height 'nan'",
    "tissot robin --size 200,200 --dpi 1200": r"Invalid size '200,200' at 1200 dots per inch. It must have at most",
    "tissot robin --dpi 0": r"Invalid dpi '0'. It must be a number within 10 and 1200.",
    "tissot robin --dpi nan": r"Invalid dpi 'nan'",
    "tissot": r"Missing argument 'PROJECTION...'",
    "heatmap robin -o x.gif": r"Invalid output 'x.gif'. Its suffix must be .png, .svg, .pdf, .tif or .tiff.",
    "heatmap robin --against moll -o x.tif": r"Invalid option '--against' for 'x.tif'. It is for pictures.",
    "heatmap robin --measure foo": r"Invalid measure 'foo'",
    "heatmap robin --measure a,b": r"Invalid measures 'a,b' for 'heatmap.png'. A picture shows one;",
    "heatmap robin --measure=": r"Invalid measure ''",
    "heatmap robin --levels foo": r"Invalid levels 'foo'. It must be a number of them, 1 to 100, or values as 1,1.5,2.",
    "heatmap robin --levels 0": r"Invalid levels '0'",
    "heatmap robin --levels -3": r"Invalid levels '-3'",
    "heatmap robin --levels 100000": r"Invalid levels '100000'",
    "heatmap robin --levels 1,nan": r"Invalid levels '1,nan'",
    "heatmap robin --levels=": r"Invalid levels ''",
    "heatmap robin --step 100": r"Invalid step '100'",
    "heatmap robin --dpi 5000": r"Invalid dpi '5000'",
    "heatmap robin -m h -m k": r"Invalid measures 'h,k' for 'heatmap.png'.",
    "morph robin": r"Missing argument 'PROJECTION'",
    "morph robin moll -o x.png": r"Invalid film 'x.png'. Its suffix must be .gif or .mp4.",
    "morph robin moll -m h,k": r"Invalid measures 'h,k' for 'morph.gif'. A film shows one.",
    "morph robin moll -m flexion": r"Invalid measure 'flexion' for a film. It must need no second derivatives.",
    "morph robin moll --frames 1": r"Invalid frames '1'. It must be a number within 2 and 500.",
    "morph robin moll --frames 2.5": r"Invalid frames '2.5'. It must be a whole number.",
    "morph robin moll --seconds 0": r"Invalid seconds '0'. It must be a number within 0.1 and 600.",
    "morph robin moll --size 0.6,0.6": r"Invalid size '.*'. It has no room for a film.",
    "list": r"Missing argument 'projections\|measures\|figures\|criteria\|indices'. See 'projdist list --help'.",
    "list nothing": r"Invalid list 'nothing'. It must be projections, measures, figures, criteria or indices.\n$",
    "list measures criteria": r"unexpected extra argument.*criteria",
    "list measures --format xml": r"Invalid format 'xml'. It must be table, json, csv, markdown or html.",
    "list measures -o x": r"No such option:? '?-o",
    "foo": r"No such command 'foo'. See 'projdist --help'.",
    "compar robin": r"No such command 'compar'",
    "--format json list measures": r"No such option:? '?--format",
    "--foo": r"No such option:? '?--foo",
}


@each("words", USAGE)
def test_usage_errors(words: str) -> None:
    """One line that names what was wrong and what is allowed, nothing on stdout, exit code 2."""
    assert re.search(USAGE[words], refused(*words.split(" ")))


# Of a command with its first words: further ones, and what their refusal begins with, or has behind its dots.
WRONG = {
    "info": {
        "": "Missing argument 'PROJECTION'.",
        "EPSG:3035 EPSG:3034": "...unexpected extra argument",
        "robin -o x.tif": "Invalid output 'x.tif'. Its suffix must be",
        "robin --dpi 9": "Invalid option '--dpi'.",
        "robin --dpi 30": "Invalid option '--dpi'. It needs a picture",
    },
    "mosaic": {
        "": "Invalid images. There must be two or more, not 0.",
        "--correspondences none.csv": "Invalid correspondences 'none.csv'. It cannot be read as text",
    },
    "optimize": {
        "lcc box:1": "Invalid region 'box:1'",
        "lcx box:5,47,15,55": "Invalid family 'lcx'",
    },
    "optimize lcc box:5,47,15,55": {
        "--round 0": "Invalid rounding '0'",
        "--criterion x": "Invalid criterion 'x'",
        "--free alpha": "Invalid free parameter 'alpha' for lcc",
        "--format csv": "Invalid format 'csv'",
        "--criterion airy_ --against recommend": "Invalid criterion 'airy_'. Did you mean airy_kav",
        "--criterion x --against recommend": "Invalid criterion 'x'. It must be one of airy",
    },
    "ldp box:-40,30,-39.5,30.4": {
        "": "Invalid heights. There must be either --heights FILE or --height METRES.",
        "--heights none.csv": "Invalid heights 'none.csv'. It cannot be read",
        "--height x": "Invalid height 'x'",
    },
    "ldp box:-40,30,-39.5,30.4 --height 1": {
        "--heights x.csv": "Invalid heights. There must be either",
        "--round-axis 2": "Invalid rounding of the axis '2'",
        "--round-axis '1.2.3'\"'\"''": "Invalid rounding of the axis",
        "--round-k 1": "Invalid rounding of k_0 '1'",
        "--target-ppm 0": "Invalid target '0'",
        "--families merc": "Invalid families 'merc'",
        "--criterion x": "Invalid criterion 'x'",
        "--size 10": "Invalid option '--size'. It needs a picture to draw to: -o FILE.",
        "--dpi 100": "Invalid option '--dpi'. It needs a picture",
        "--size 10 -o x.png": "Invalid size '10'. It must be WIDTH,HEIGHT in inches",
        "-o x.gif": "Invalid output 'x.gif'",
    },
    "recommend box:-7.2,61.3,-6.2,62.5": {
        "--purpose pretty": "Invalid purpose 'pretty'. It must be any, equal-area,",
        "--criterion max_omeg": "Invalid criterion 'max_omeg'. Did you mean max_omega",
        "--authority IAU": "Invalid authority 'IAU'. It must be EPSG, ESRI or IGNF.",
        "--limit 0": "Invalid limit '0'. It must be a number within 1 and 10000.",
        "--limit 1.5": "Invalid limit '1.5'. It must be a whole number.",
        "--contains --intersects": "Invalid option '--intersects'. It cannot be used with --contains.",
        "--executor dask": "Invalid executor 'dask'. It must be dask://HOST:PORT",
        "--size 10": "Invalid option '--size'. It needs a picture to draw to: -o FILE.",
        "--dpi 5": "Invalid option '--dpi'. It needs a picture to draw to: -o FILE.",
        "--dpi 5 -o map.png": "Invalid dpi '5'. It must be a number within 10 and 1200.",
        "-o map.gif": "Invalid output 'map.gif'. Its suffix must be .png, .svg, .pdf or .html.",
        "--format xml": "Invalid format 'xml'.",
        "--datum Mars --authority EPSG": "Invalid datum 'Mars'. It must be a part of the name",
    },
    "correct robinson": {
        "--criterion mode": "Invalid criterion 'mode'. It must be mean or median.",
        "--criterion median --constraint scale": "Invalid constraint 'scale' with the median.",
        "--criterion median --local 500 -o x.png": "Invalid option '--criterion' with --local.",
    },
    "correct moll": {
        "--constraint shear": "Invalid constraint 'shear'. It must be affine, stretch or scale.",
        "--format csv": "Invalid format 'csv'. It must be table, json, html, proj or wkt.",
        "--local 300": "Invalid option '--local'. It needs a picture to draw to, -o FILE, or --format json.",
        "--local 300 -o x.png -f wkt": "Invalid format 'wkt' with --local.",
        "--local -3 -o x.png": "Invalid radius '-3'. It must be a number of km within",
        "-o x.gif": "Invalid output 'x.gif'. Its suffix must be .png, .svg, .pdf or .html.",
        "--region box:1,2": "Invalid region 'box:1,2'",
        "--dpi 100": "Invalid option '--dpi'. It needs a picture to draw to: -o FILE.",
        "--local 300 -o x.png --free": "Invalid option '--free' with --local.",
        "robin": "...unexpected extra argument",
    },
    "design country:CH --against EPSG:2056": {
        "--kind nice": "Invalid kind 'nice'. It must be one of any, conformal, equal-area.",
        "--degree many": "Invalid degree 'many'. It must be auto, or a whole number.",
        "--degree 0": "Invalid degree '0'. It must be auto, or a whole number from 1 to 20.",
        "--balance x": "Invalid balance 'x'. It must be a number.",
        "--background 2": "Invalid background '2.0'. It must be a number from 0 to 0.5.",
        "--north 7": "Invalid north '7'. It must be LON,LAT in degrees.",
        "--symmetric up": "Invalid symmetry 'up'. It must be none, meridian, equator or both.",
        "-o map.gif": "...Its suffix must be .json, .html, .wkt, .png, .svg, .pdf, .txt, .log, or none.",
        "-o map.png --picture b.png": "Invalid output 'map.png'. There must be one picture, and 'b.png' is one.",
        "--size 3,4": "Invalid option '--size'. It needs a picture to draw to",
    },
    "mean-map robin": {
        "moll --weights 1,x": "Invalid weights '1,x'. They must be numbers with commas",
        "moll --degree x": "Invalid degree 'x'",
        "moll --region globe": "Invalid region 'globe'",
    },
    "world-map": {
        "--cut 1,2": "Invalid cut '1,2'. It must be a longitude, or two or more points as '-170,40 -70,-62'.",
        "--cut x": "Invalid cut 'x'.",
        "--cells 7": "Invalid number of cells '7'.",
        "--cells x": "Invalid number of cells 'x'.",
        "--elsewhere 0": "Invalid weight elsewhere '0'. It must be a number within 0.0001 and 1.",
        "--until 95": "Invalid end '95'.",
        "--symmetric x": "Invalid symmetry 'x'.",
        "--weight pop.tif": "Invalid weight 'pop.tif' without a region.",
        "--tinshift x.txt": "Invalid file of triangles 'x.txt'. Its suffix must be .json",
        "nowhere": "Invalid region 'nowhere'",
    },
    "atlas": {
        "Brazl": "Invalid place 'Brazl'. Did you mean country:Brazil?",
        "box:1,2,3,4": "...It must be one of those that 'projdist atlas' (atlas_names) lists.",
        "NZ -f xml": "Invalid format 'xml'",
        "NZ AU": "...AU",
    },
    "find": {
        "": "Missing argument 'WORDS...'",
        "utm --limit 0": "Invalid limit '0'",
        "utm --authority EPGS": "Invalid authority 'EPGS'. Did you mean EPSG?",
        "'!!'": "Invalid search '!!'. It must have a word or a number.",
        "utm -f xml": "Invalid format 'xml'",
    },
    "": {
        "design globe": "...It reaches 180 degrees from its middle",
        "oldmap nosuch.csv": "Invalid points file 'nosuch.csv'. It cannot be read as text: No such file",
        "heatmap eqc -r box:0,0,4,3 --cmap nosuch": "Invalid colour map 'nosuch'. It must be a name of matplotlib",
        "recommend nowhere": "Invalid region 'nowhere'.",
    },
}
FAILING = {
    "info nosuch": "Invalid projection 'nosuch'.",
    "info EPSG:4326": "Invalid projection 'EPSG:4326'.",
    "ldp box:-40,30,-39.5,30.4 --height 1 --geodetic EPSG:32633": "...Invalid geographic CRS",
    "optimize '+proj=ortho +lat_0=0 +lon_0={170..190} +R=6371000' box:-5,-5,5,5": "...It shows no part of it",
    "correct nosuch": "Invalid projection 'nosuch'",
    "design country:CH --against EPSG:2056 --base EPSG:3857 --kind equal-area": "...It must be equal-area at scale 1.",
    "design country:CH --against EPSG:2056 --datum 'WGS 85'": "Invalid geographic CRS 'WGS 85'.",
    "mean-map robin igh": "...It is cut within",
}


CASES = [(f"{first} {words}", 2, message) for first, cases in WRONG.items() for words, message in cases.items()]


@each(("words", "code", "message"), [*CASES, *((words, 1, message) for words, message in FAILING.items())])
def test_wrong_words(words: str, code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, 2 for wrong words and 1 for what fails with right ones, and no file."""
    monkeypatch.chdir(tmp_path)
    said = refusal(*shlex.split(words), code=code)
    assert said.startswith(message) or (message[:3] == "..." and message[3:] in said), said
    assert [*tmp_path.iterdir()] == []


UNKNOWN = ["--formt", "--region-x", "-x", "--", "---", "-q5", "--formt=json"]


@pytest.mark.parametrize(
    ("command", "option"),
    [
        (command, option)
        if command == "compare" or option == "--formt"
        else pytest.param(command, option, marks=pytest.mark.slow)
        for command in COMMANDS
        for option in UNKNOWN
    ],
)
@pytest.mark.parametrize("position", ["first", "last"])
def test_unknown_options(command: str, option: str, position: str) -> None:
    """An option that there is not is refused in every command, wherever it stands."""
    arguments = {"factors": ["robin", "1", "2"], "list": ["measures"]}.get(command, ["robin"])
    if option == "--":
        arguments, option = ["--", *arguments], "--formt"
    words = [option, *arguments] if position == "first" else [*arguments, option]
    assert option.split("=")[0][:2] in refused(command, *words)


def test_no_arguments_is_help() -> None:
    """Alone, the command says what it can do; that is no success."""
    result = run()
    assert (result.exit_code, result.stdout) == (2, "")
    assert all(command in result.stderr for command in COMMANDS)
    help = run_ok("--help").partition("Look:\n")[2]
    assert re.findall(r"\n(\w.*):\n", help) == ["Choose", "Make", "Beyond maps"]
    lines = re.findall(r"  .*", help)
    assert {line.split()[0] for line in lines} >= set(COMMANDS)
    assert [line for line in lines if not re.fullmatch(r"  \S+ +[A-Z].*[^.]\.", line)] == []


def test_version() -> None:
    """The version of the package, and nothing is done besides."""
    assert run_ok("--version") == f"projdist {__version__}\n"
    assert run_ok("--version", "compare", "robin") == f"projdist {__version__}\n"


@each("command", [[], *([command] for command in COMMANDS)])
@each("option", ["--help", "-h"])
def test_help(command: list[str], option: str) -> None:
    """Every command has help with its usage, and tells what to write, not Python's types."""
    text = run_ok(*command, option)
    assert text.startswith("Usage: projdist ")
    assert not re.search(r"<\w|list\[|\[\[", text)
    assert "{" not in text.splitlines()[0]


# ---- commands in the documentation ---------------------------------------------------------------


ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
_BLOCK = re.compile(r"^```(?:sh|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_LINE = re.compile(r"^(?:\$ )?projdist (?:\\\n|.)*", re.MULTILINE)
_INLINE = re.compile(r"`(projdist [^`\n]+)`")


def commands(text: str) -> Iterator[list[str]]:
    """The words of each command, without comments and what it is piped to."""
    for found in [*_LINE.findall("\n".join(_BLOCK.findall(text))), *_INLINE.findall(text)]:
        line = found.removeprefix("$ ").replace("\\\n", " ").split(" | ")[0].split(" > ")[0]
        yield shlex.split(line, comments=True)[1:]


@each("page", PAGES)
def test_commands_are_those_that_there_are(page: Path) -> None:
    group = get_command(app)
    for words in commands(page.read_text(encoding="utf-8")):
        name = words[0].rstrip(",")
        if name.isupper() or name.startswith("-"):
            continue
        command = group.commands[name]
        options = {"--help", "-h", *(option for one in command.params for option in [*one.opts, *one.secondary_opts])}
        used = {word.partition("=")[0] for word in words if re.fullmatch(r"--?[a-z][\w-]*(=.*)?", word)}
        assert used <= options, (name, used - options)


def test_there_are_some() -> None:
    """The patterns find commands in blocks and in lines of text."""
    text = "```sh\nprojdist compare a b \\\n  -r globe  # it's\n```\nor `projdist list figures`, `projdist ldp REGION`."
    assert [*commands(text)] == [["compare", "a", "b", "-r", "globe"], ["list", "figures"], ["ldp", "REGION"]]
