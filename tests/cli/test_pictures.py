"""The commands `tissot` and `heatmap`."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from commands import HIDDEN, QUICK, run, run_ok, told
from matplotlib.image import imread
from tables import some

from projdist import projection_names

pytestmark = pytest.mark.slow

SMALL = ["eqc", "--dpi", "30"]
PATCH = ["-r", "box:0,0,40,30"]


def check_picture(path: Path, size: tuple[float, float] | None = None, dpi: float = 150) -> None:
    """The file is what its suffix says, and as large as asked."""
    data = path.read_bytes()
    if path.suffix.lower() == ".png":
        pixels = imread(path)
        assert pixels[..., :3].std() > 0.02, "an empty picture"
        if size:
            assert pixels.shape[:2] == (round(size[1] * dpi), round(size[0] * dpi))
    elif path.suffix == ".svg":
        root = ElementTree.fromstring(data)
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        if size:  # SVG and PDF are in points, 72 in an inch
            assert [float(root.get(key).removesuffix("pt")) for key in ("width", "height")] == [72 * x for x in size]
    else:
        assert data.startswith(b"%PDF-")
        assert data.rstrip().endswith(b"%%EOF")
        if size:
            box = re.search(rb"/MediaBox \[ ?([\d. ]+) ?\]", data)
            assert [float(x) for x in box[1].split()][2:] == [72 * x for x in size]


@pytest.mark.parametrize(
    ("command", "suffix"), [("heatmap", "PNG"), ("heatmap", "svg"), ("heatmap", "pdf"), ("tissot", "png")]
)
@pytest.mark.usefixtures("few_cells")
def test_pictures(command: str, suffix: str, tmp_path: Path) -> None:
    """PNG, SVG and PDF by suffix, of the size and dots asked for; the error and the path are printed."""
    path = tmp_path / f"map.{suffix}"
    words = ["eqc", "-r", "box:0,0,40,30", "--size", "5,4", "--dpi", "50", "-o", path]
    # The RMS of ln(1 / cos lat) by true area is 0.0617; of a and b, e^(0.0617 / sqrt(2)) - 1 is 0.0446.
    said = "On Equirectangular, scales are off by 4.5 % (RMS) over 0° to 40°E, 0° to 30°N.\n"
    assert run_ok(command, *words) == f"{said}Wrote: {path}\n"
    check_picture(path, (5, 4), 50)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_beside_failures(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Good projections are drawn, each bad one has its line, the exit code is 1; the usual name is the command's."""
    monkeypatch.chdir(tmp_path)
    code, out, err = told(command, "nosuch", "eqc", *HIDDEN, "--dpi", "20")
    assert (code, out.splitlines()[-1]) == (1, f"Wrote: {command}.png")
    unknown, outside = err.splitlines()
    assert ("'nosuch'" in unknown, "No point of it can be projected" in outside) == (True, True)
    check_picture(tmp_path / f"{command}.png")


@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_of_nothing_but_failures(command: str, tmp_path: Path) -> None:
    code, out, err = told(command, "nosuch", "EPSG:4326", "-o", tmp_path / "map.png")
    assert (code, out, err.count("\n")) == (1, "", 2)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A picture of each kind without any option beyond `SMALL` and `PATCH`."""
    folder = tmp_path_factory.mktemp("plain")
    for command in ("tissot", "heatmap"):
        run_ok(command, *SMALL, *PATCH, "-o", str(folder / f"{command}.png"))
    return {path.stem: path.read_bytes() for path in folder.iterdir()}


CHANGED = [
    *(f"heatmap {words}" for words in ("--levels 5", "--levels 0.1,0.12", "--cmap cividis", "--step 7", "--size 6x4")),
    *("heatmap --measure convergence", "heatmap --region cap:-10,-40,2000"),
    *("tissot --size 6x4", "tissot --step 5", "tissot -r cap:0,40,2000"),
]


@pytest.mark.parametrize("words", CHANGED)
def test_options_change_the_picture(words: str, plain: dict[str, bytes], tmp_path: Path) -> None:
    command, *options = words.split()
    where = [] if "cap:" in words else PATCH
    run_ok(command, *SMALL, *where, *options, "-o", tmp_path / "x.png")
    assert (tmp_path / "x.png").read_bytes() != plain[command]


@pytest.mark.parametrize("projection", some([*{text: name for name, text in projection_names().items()}.values()], 6))
def test_every_name_makes_numbers_and_a_picture(
    projection: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One in six of what `list projections` names is compared and drawn, or asks for parameters.

    On stderr there is no word, unless on a map of one region that is no longer conformal around the globe.
    """
    monkeypatch.setattr("projdist.surfaces.surface._GLOBE_STEP", 2.0)  # a ninth of the cells
    result = run("compare", projection, *QUICK)
    if result.exit_code:
        assert re.fullmatch(r"projdist: [^\n]* needs [^\n]*: give a PROJ string[^\n]*\n", result.stderr)
        return
    drawn = run("heatmap", projection, "--dpi", "30", "-o", str(tmp_path / "map.png"))
    assert drawn.exit_code == 0
    for text in (result.stderr, drawn.stderr):
        assert re.fullmatch(r"(projdist: \+proj=(alsk|gs48|gs50|nzmg) [^\n]* too far from [^\n]*\n)?", text)


@pytest.mark.usefixtures("few_cells")
def test_compare_draws_maps(tmp_path: Path) -> None:
    """A picture as output is of the maps, as by --plot maps; the figures are printed as ever."""
    path = tmp_path / "maps.png"
    words = ("compare", *SMALL, *PATCH, *QUICK, "--overwrite", "-o", path)
    printed, drawn = run_ok(*words), path.read_bytes()
    check_picture(path)
    assert (printed, drawn) == (run_ok(*words, "--plot", "maps"), path.read_bytes())
    assert printed == f"{run_ok('compare', 'eqc', *PATCH, *QUICK)}Wrote: {path}\n"
