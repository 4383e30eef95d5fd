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
from projdist.cli.app import COMMANDS, app

OVER_POINTS = [
    *("optimize eqc {} --free lat_ts", "correct robin -r {}"),
    *("design {} --degree 1 --base EPSG:32631", "mean-map robin -r {} --degree 1"),
]


def test_repairs_are_said(tmp_path: Path) -> None:
    """A repaired region is measured and the repair told."""
    path = tmp_path / "bow.geojson"
    path.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [10, 10], [10, 0], [0, 10], [0, 0]]]}')
    result = run("compare", "robin", "--region", f"file:{path}")
    assert (result.exit_code, "AK" in result.stdout) == (0, True)
    assert re.fullmatch(r"projdist: file:.*: 1 self-intersecting polygon\(s\) repaired; [^\n]*\n", result.stderr)


@pytest.mark.slow
def test_points_have_no_area(tmp_path: Path) -> None:
    """A title tells how many there are, and no area; a table tells of weights."""
    path = tmp_path / "a.csv"
    path.write_text("lon,lat,weight\n1,2,1\n3,4,5\n8,1,2\n2,9,1\n")
    shown = run_ok("compare", "robin", "--region", f"points:{path}", "--details")
    assert "(4 points)" in shown
    assert "by the points' weights" in shown
    for words in OVER_POINTS:
        answer = run(*words.format(f"points:{path}").split(), "--details").stdout
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


# Of a command with its first words: further ones, and what their refusal begins with; … is anything, $ the end.
# Where several values are refused alike these stand behind the message, and {} for each of them.
WRONG: dict[str, dict[str, str | tuple[str, str]]] = {
    "compare robin": {
        "-r glob": "Invalid region 'glob'. Did you mean globe? It must be globe, land, ocean, ",
        "-r {}": ("Invalid region '{}'", "'' box:a,b,c,d"),
        "-r box:-10,30,20": "Invalid region 'box:-10,30,20'. It must be box:W,S,E,N, 4 numbers.",
        "-r box:-10,30,-10,40": "Invalid box '-10,30,-10,40'. It must be wider than 0",
        "-r box:0,40,10,30": "Invalid box '0,40,10,30'. Did you mean 0,30,10,40? South must be",
        "-r box:0,0,nan,1": "Invalid box '0,0,nan,1'",
        "-r box:0,0,1e400,1": "Invalid box '0,0,inf,1'",
        "-r cap:0,0,0": "Invalid cap '0,0,0'. Its radius must be above 0",
        "-r cap:{}": ("Invalid cap '{}'", "0,0,-5 0,91,10"),
        "-r cap:0,0,1e6": "Invalid cap '0,0,1e+06'. …at most 20015 km",
        "--measure foo": "Invalid measure 'foo'. It must be one of fisher, …scale@AZIMUTH",
        "--measure omga": "Invalid measure 'omga'. Did you mean omega",
        "--measure omega,,h": "Invalid measure ''",
        "--measure scale@nan": "Invalid azimuth 'nan'",
        "--sort foo": "Invalid sort key 'foo'. It must be given, name, …airy_kavrayskiy, ….median",
        "--sort omega": "Invalid sort key 'omega'…measures asked for",
        "-m omega --sort {}": ("Invalid sort key '{}'", "omega.bad name.x definition ''"),
        "--tolerance {}": (
            "Invalid tolerance '{}'. It must be a number within 1e-15 and 1.",
            "0 -1e-3 nan inf -inf abc",
        ),
        "--format yaml": "Invalid format 'yaml'. It must be table, json, csv, markdown or html.$",
        "--format {}": ("Invalid format '{}'", "'' JSON"),
        "-f json -f csv": "Invalid option '--format'. It must be given once.",
        "--region globe -r globe": "Invalid option '--region'. It must be given once.",
        "--formt json": "Invalid option '--formt'. Did you mean --format? See 'projdist compare --help'.",
        "--projection": "Invalid option '--projection'. See 'projdist compare --help'.",
        "-o ''": "Invalid output ''. It must be the name of a file.",
        "-o new/": "Invalid output 'new/'. It is a directory.",
        f"-o {'x' * 300}": "Invalid output 'xx…'. It cannot be written: File name too long.",
        "--plot pie -o x.png": "Invalid plot 'pie'. It must be maps, histogram, cumulative, pareto, modes or space.",
        "--plot pareto": "Invalid option '--plot pareto'. It needs a picture to draw to: -o FILE.png.",
        "--plot pareto -o x.csv": "Invalid picture file 'x.csv'. Its suffix must be .png, .svg or .pdf.",
        "--dpi 30": "Invalid option '--dpi'. It needs a picture to draw: --plot maps|histogram",
    },
    "compare": {
        "--sort foo nosuch": "Invalid sort key 'foo'",
        "--format": "…--format…requires an argument. See 'projdist compare --help'.",
        "": "Missing argument 'PROJECTION...'. See 'projdist compare --help'",
        "--": "Missing argument 'PROJECTION...'",
    },
    "factors robin": {
        "": "Invalid points. They must be LON LAT..., - for stdin, or --at FILE.",
        "{}": ("Invalid coordinates '{}'. They must be pairs of LON LAT, or - for stdin.", "5 5,6,7"),
        "1 2 3": "Invalid coordinates '1 2 3'. They must be pairs of LON LAT, or - for stdin.",
        "1 2 -": "Invalid coordinates '1 2 -'",
        "10 {}": ("Invalid latitude '{}'. It must lie within -90 and 90 degrees.", "90.001 -91 -Infinity"),
        "10 nan": "Invalid latitude 'nan'",
        "{} 10": ("Invalid longitude '{}'. It must be a number of degrees within -720 and 720.", "1e300 inf -inf"),
        "-- -inf 5": "Invalid longitude '-inf'",
        "5 -nan": "Invalid option '-nan'",
        "x y": "Invalid point 'x y'. Longitude and latitude must be numbers of degrees.",
        "−10 20": "Invalid point '−10 20'",
        "1 2 --measure foo": "Invalid measure 'foo'",
    },
    "profile robin": {
        "": "Missing option '--line'. See 'projdist profile --help'.",
        "--line {}": ("Invalid line '{}'. It must be LON,LAT,LON,LAT,..., two numbers a point.", "1,2 1,2,3"),
        "--line 1,2,3,91": "Invalid line '1,2,3,91'. Its longitudes must lie within -360 and 360 degrees",
        "--line 1,2,1,2": "Invalid line '1,2,1,2'. It must have two places or more.",
        "--line 9,50,x,51": "Invalid line '9,50,x,51'. Coordinates must be numbers LON,LAT,LON",
        "--line nowhere.geojson": "Invalid line file 'nowhere.geojson'. It cannot be read: No such file",
        "--line 1,2,3,4 --spacing 0": "Invalid spacing '0'. It must be a number of km within 1e-06 and",
        "--line 1,2,3,4 --height 1e5": "Invalid height '1e5'. It must be a number of metres within",
        "--line 1,2,3,4 --dpi 50": "Invalid option '--dpi'. It needs a picture to draw to: -o FILE.",
        "--line 1,2,3,4 -o x.tif": "Invalid output 'x.tif'. Its suffix must be .json, .csv, .md, .html",
        "--line 1,2,3,4 -m foo": "Invalid measure 'foo'",
    },
    "tissot robin": {
        "-o {}": ("Invalid output '{}'. Its suffix must be .png, .svg, .pdf, .gpkg or .geojson.", "x.jpg noname"),
        "-o ''": "Invalid output ''",
        "-o new.png/": "Invalid output 'new.png/'. It is a directory.",
        "-o x.png -o y.png": "Invalid option '--output'. It must be given once.",
        "--step {}": ("Invalid step '{}'. It must be a number of degrees within 1e-05 and 90.", "0 -5 x"),
        "--size {}": ("Invalid size '{}'. It must be WIDTH,HEIGHT in inches, as 10,6.", "big 1,2,3"),
        "--size 0,6": "Invalid width '0'. It must be a number of inches within 0.5 and 200.",
        "--size 6,nan": "Invalid height 'nan'",
        "--size 200,200 --dpi 1200": "Invalid size '200,200' at 1200 dots per inch. It must have at most",
        "--dpi {}": ("Invalid dpi '{}'. It must be a number within 10 and 1200.", "0 nan"),
    },
    "heatmap robin": {
        "-o x.gif": "Invalid output 'x.gif'. Its suffix must be .png, .svg, .pdf, .tif or .tiff.",
        "--against moll -o x.tif": "Invalid option '--against' for 'x.tif'. It is for pictures.",
        "--measure {}": ("Invalid measure '{}'", "foo ''"),
        "--measure a,b": "Invalid measures 'a,b' for 'heatmap.png'. A picture shows one;",
        "-r box:0,0,4,3 --size 0.5,0.5": "…no room",
        "-m h -m k": "Invalid measures 'h,k' for 'heatmap.png'.",
        "--levels {}": (
            "Invalid levels '{}'. It must be a number of them, 1 to 100, or values as 1,1.5,2.",
            "foo 0 -3 100000 1,nan ''",
        ),
    },
    "morph robin": {
        "": "Missing argument 'PROJECTION'",
        "moll -o x.png": "Invalid film 'x.png'. Its suffix must be .gif or .mp4.",
        "moll -m h,k": "Invalid measures 'h,k' for 'morph.gif'. A film shows one.",
        "moll -m flexion": "Invalid measure 'flexion' for a film. It must need no second derivatives.",
        "moll --frames 1": "Invalid frames '1'. It must be a number within 2 and 500.",
        "moll --frames 2.5": "Invalid frames '2.5'. It must be a whole number.",
        "moll --seconds 0": "Invalid seconds '0'. It must be a number within 0.1 and 600.",
        "moll --size 0.6,0.6": "Invalid size '…'. It has no room for a film.",
    },
    "list": {
        "": "Missing argument 'projections|measures|figures|criteria|indices|regions'. See 'projdist list --help'.",
        "nothing": "Invalid list 'nothing'. It must be projections, measures, figures, criteria, indices or regions.$",
        "measures criteria": "…unexpected extra argument…criteria",
        "measures -o x": "No such option…-o",
    },
    "info": {
        "": "Missing argument 'PROJECTION'.",
        "EPSG:3035 EPSG:3034": "…unexpected extra argument",
        "robin -o x.tif": "Invalid output 'x.tif'. Its suffix must be",
        "robin --dpi 30": "Invalid option '--dpi'. It needs a picture",
    },
    "mosaic": {
        "": "Invalid images. There must be two or more, not 0.",
        "--correspondences none.csv": "Invalid correspondences 'none.csv'. It cannot be read as text",
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
        "--dpi 5": "Invalid option '--dpi'. It needs a picture to draw to: -o FILE.",
        "--dpi 5 -o map.png": "Invalid dpi '5'. It must be a number within 10 and 1200.",
        "-o map.gif": "Invalid output 'map.gif'. Its suffix must be .png, .svg, .pdf or .html.",
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
        "robin": "…unexpected extra argument",
    },
    "design country:CH --against EPSG:2056": {
        "--kind nice": "Invalid kind 'nice'. It must be one of any, conformal, equal-area.",
        "--degree many": "Invalid degree 'many'. It must be auto, or a whole number.",
        "--degree 0": "Invalid degree '0'. It must be auto, or a whole number from 1 to 20.",
        "--balance x": "Invalid balance 'x'. It must be a number.",
        "--background 2": "Invalid background '2.0'. It must be a number from 0 to 0.5.",
        "--north 7": "Invalid north '7'. It must be LON,LAT in degrees.",
        "--symmetric up": "Invalid symmetry 'up'. It must be none, meridian, equator or both.",
        "-o map.gif": "…Its suffix must be .json, .html, .wkt, .png, .svg, .pdf, .txt, .log, or none.",
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
        "--cells {}": ("Invalid number of cells '{}'.", "7 x"),
        "--elsewhere 0": "Invalid weight elsewhere '0'. It must be a number within 0.0001 and 1.",
        "--until 95": "Invalid end '95'.",
        "--symmetric x": "Invalid symmetry 'x'.",
        "--weight pop.tif": "Invalid weight 'pop.tif' without a region.",
        "--tinshift x.txt": "Invalid file of triangles 'x.txt'. Its suffix must be .json",
        "nowhere": "Invalid region 'nowhere'",
    },
    "atlas": {
        "Brazl": "Invalid place 'Brazl'. Did you mean country:Brazil?",
        "box:1,2,3,4": "…It must be one of those that 'projdist atlas' (atlas_names) lists.",
        "NZ AU": "…AU",
    },
    "find": {
        "": "Missing argument 'WORDS...'",
        "utm --limit 0": "Invalid limit '0'",
        "utm --authority EPGS": "Invalid authority 'EPGS'. Did you mean EPSG?",
        "'!!'": "Invalid search '!!'. It must have a word or a number.",
    },
    "": {
        "foo": "No such command 'foo'. See 'projdist --help'.",
        "compar robin": "No such command 'compar'",
        "{}": ("No such option…{}", "--format --foo"),
        "{} -f xml": ("Invalid format 'xml'", "'atlas NZ' 'find utm' 'recommend box:-7.2,61.3,-6.2,62.5'"),
        "{} ": ("Missing argument 'PROJECTION", "factors tissot"),
        "optimize lcc box:1": "Invalid region 'box:1'",
        "optimize lcx box:5,47,15,55": "Invalid family 'lcx'",
        "design globe": "…It reaches 180 degrees from its middle",
        "oldmap nosuch.csv": "Invalid points file 'nosuch.csv'. It cannot be read as text: No such file",
        "heatmap eqc -r box:0,0,4,3 --cmap nosuch": "Invalid colour map 'nosuch'. It must be a name of matplotlib",
        "recommend nowhere": "Invalid region 'nowhere'.",
    },
}
FAILING = {
    "info nosuch": "Invalid projection 'nosuch'.",
    "info EPSG:4326": "Invalid projection 'EPSG:4326'.",
    "ldp box:-40,30,-39.5,30.4 --height 1 --geodetic EPSG:32633": "…Invalid geographic CRS",
    "optimize '+proj=ortho +lat_0=0 +lon_0={170..190} +R=6371000' box:-5,-5,5,5": "…It shows no part of it",
    "correct nosuch": "Invalid projection 'nosuch'",
    "design country:CH --against EPSG:2056 --base EPSG:3857 --kind equal-area": "…It must be equal-area at scale 1.",
    "design country:CH --against EPSG:2056 --datum 'WGS 85'": "Invalid geographic CRS 'WGS 85'.",
    "mean-map robin igh": "…It is cut within",
    "recommend globe --purpose equidistant --contains --authority IGNF": "No CRS serves the region 'globe' with these",
}


def cases() -> Iterator[tuple[str, int, str]]:
    """Command lines, their exit codes, and the patterns of what is said."""
    yield from ((words, 1, message) for words, message in FAILING.items())
    for first, given in WRONG.items():
        for words, said in given.items():
            message, values = (said, "-") if isinstance(said, str) else said
            for value in shlex.split(values):
                words_of_value = words.replace("{}", value or "''")
                yield f"{first} {words_of_value}", 2, message.replace("{}", value)


@pytest.mark.slow
@each(("words", "code", "message"), cases())
def test_wrong_words(words: str, code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, 2 for wrong words and 1 for what fails with right ones, and no file."""
    monkeypatch.chdir(tmp_path)
    pattern = re.escape(message).replace("…", ".*").replace(r"\$", "$")
    assert re.match(pattern, refusal(*shlex.split(words), code=code))
    assert [*tmp_path.iterdir()] == []


UNKNOWN = ["--formt", "--region-x", "-x", "--", "---", "-q5", "--formt=json"]


@each("command", COMMANDS)
@each("option", UNKNOWN)
def test_unknown_options(command: str, option: str) -> None:
    """An option that there is not is refused in every command, wherever it stands."""
    if command not in ("compare", "factors") and option != "--formt":
        return  # read by the same parser
    arguments = {"factors": ["robin", "1", "2"], "list": ["measures"]}.get(command, ["robin"])
    if option == "--":
        arguments, option = ["--", *arguments], "--formt"
    for words in ([option, *arguments], [*arguments, option]):
        assert option.split("=")[0][:2] in refused(command, *words)


def test_no_arguments_is_help() -> None:
    """Alone, the command says what it can do, which is no success; asked for its version, it says that and no more."""
    assert run_ok("--version") == run_ok("--version", "compare", "robin") == f"projdist {__version__}\n"
    result = run()
    assert (result.exit_code, result.stdout) == (2, "")
    assert all(command in result.stderr for command in COMMANDS)
    help = run_ok("--help").partition("Look:\n")[2]
    assert re.findall(r"\n(\w.*):\n", help) == ["Choose", "Make", "Beyond maps"]
    lines = re.findall(r"  .*", help)
    assert {line.split()[0] for line in lines} >= set(COMMANDS)
    assert [line for line in lines if not re.fullmatch(r"  \S+ +[A-Z].*[^.]\.", line)] == []


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


@pytest.mark.slow
@each("page", PAGES)
def test_commands_are_those_that_there_are(page: Path) -> None:
    """Those in blocks and in lines of text, both of which the patterns find."""
    text = "```sh\nprojdist compare a b \\\n  -r globe  # it's\n```\nor `projdist list figures`, `projdist ldp REGION`."
    assert [*commands(text)] == [["compare", "a", "b", "-r", "globe"], ["list", "figures"], ["ldp", "REGION"]]
    group = get_command(app)
    for words in commands(page.read_text(encoding="utf-8")):
        name = words[0].rstrip(",")
        if name.isupper() or name.startswith("-"):
            continue
        command = group.commands[name]
        options = {"--help", "-h", *(option for one in command.params for option in [*one.opts, *one.secondary_opts])}
        used = {word.partition("=")[0] for word in words if re.fullmatch(r"--?[a-z][\w-]*(=.*)?", word)}
        assert used <= options, (name, used - options)
