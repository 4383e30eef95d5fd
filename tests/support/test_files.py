"""Files that are whole or not there, and never in the place of another unless asked."""

import contextlib
import errno
import os
import re
import threading
from pathlib import Path

import pytest
import typer
from commands import refusal
from full_disks import room_for
from tables import each

from projdist import Notice
from projdist.cli import report
from projdist.support import rows_of_text, separator_of
from projdist.support.files import is_stream, replacing


def texts_in(folder: Path) -> dict[str, str]:
    """The texts of all files of a folder."""
    return {file.name: file.read_text() for file in folder.iterdir()}


def test_a_file_appears_when_it_is_complete(tmp_path: Path) -> None:
    """Its name is that of the new file, its permissions those of any new file, and nothing else is left."""
    path = tmp_path / "x.txt"
    with replacing(path) as new:
        new.write_text("new")
        assert new.name == path.name
        assert not path.exists()
    plain = tmp_path / "plain"
    plain.write_text("")
    assert path.read_text() == "new"
    assert path.stat().st_mode == plain.stat().st_mode
    assert set(tmp_path.iterdir()) == {path, plain}


@pytest.mark.parametrize("error", [OSError("full"), KeyboardInterrupt()])
def test_a_failure_leaves_the_old_file(tmp_path: Path, error: BaseException) -> None:
    """Whatever happens while the new one is written."""
    path = tmp_path / "x.txt"
    path.write_text("old")

    def write() -> None:
        with replacing(path) as new:
            new.write_text("half")
            new.with_suffix(".journal").write_text("beside it")
            raise error

    with pytest.raises(type(error)):
        write()
    assert texts_in(tmp_path) == {"x.txt": "old"}


@pytest.mark.parametrize("told", [None, AttributeError("'Stream' object has no attribute 'pos'")])
def test_a_full_disk_is_told_by_no_library(tmp_path: Path, told: Exception | None) -> None:
    """What a library keeps to itself, or takes for another error, is an OSError; the files stay as they were."""
    path = tmp_path / "x.shp"
    for suffix in (".shp", ".dbf"):
        path.with_suffix(suffix).write_text("old")

    def write() -> None:
        with room_for(100), replacing(path, beside=[".dbf"]) as new:
            new.with_suffix(".dbf").write_text("new")
            with contextlib.suppress(OSError):
                new.write_bytes(bytes(1000))
            if told is not None:
                raise told

    with pytest.raises(OSError, match="File too large"):
        write()
    assert texts_in(tmp_path) == {"x.shp": "old", "x.dbf": "old"}


def test_files_beside(tmp_path: Path) -> None:
    """They come along where they are written, and old ones go."""
    path = tmp_path / "x.shp"
    for suffix in (".shp", ".dbf", ".prj", ".txt"):
        path.with_suffix(suffix).write_text("old")
    other = replacing(tmp_path / "x.tif", overwrite=False, beside=[".dbf"])
    with pytest.raises(FileExistsError, match=r"x\.dbf'"), other:
        pass
    with replacing(path, beside=[".dbf", ".prj"]) as new:
        new.write_text("new")
        new.with_suffix(".dbf").write_text("new")
    assert texts_in(tmp_path) == {"x.shp": "new", "x.dbf": "new", "x.txt": "old"}


def test_an_existing_file_is_refused(tmp_path: Path) -> None:
    """Before anything is written, and where it comes meanwhile; a dangling link counts as one."""
    path, link = tmp_path / "x.txt", tmp_path / "link"
    link.symlink_to(tmp_path / "nowhere")

    def write(target: Path, meanwhile: str = "") -> None:
        with replacing(target, overwrite=False) as new:
            new.write_text("new")
            if meanwhile:
                target.write_text(meanwhile)

    with pytest.raises(FileExistsError, match=r"Invalid output '.*link'. It exists; --overwrite replaces it."):
        write(link)
    with pytest.raises(FileExistsError, match="It exists"):
        write(path, "another's")
    with pytest.raises(FileExistsError, match="It exists"):
        write(path)
    assert path.read_text() == "another's"


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    """The file that it names is replaced, in its own folder."""
    (tmp_path / "there").mkdir()
    path, link = tmp_path / "there" / "x.txt", tmp_path / "link.txt"
    path.write_text("old")
    link.symlink_to(path)
    with replacing(link) as new:
        new.write_text("new")
    assert link.is_symlink()
    assert texts_in(path.parent) == {"x.txt": "new"}


@pytest.mark.skipif(os.name == "nt", reason="permissions of Unix")
def test_permissions_stay(tmp_path: Path) -> None:
    """A private file stays private, and so does the one beside it; also behind a link."""
    path, beside, link = tmp_path / "x.jpg", tmp_path / "x.jpgw", tmp_path / "link.jpg"
    for one, mode in ((path, 0o600), (beside, 0o640)):
        one.write_text("old")
        one.chmod(mode)
    link.symlink_to(path)
    with replacing(path, beside=[".jpgw"]) as new:
        new.write_text("new")
        new.with_suffix(".jpgw").write_text("new")
    with replacing(link) as new:
        new.write_text("newer")
    assert (path.stat().st_mode & 0o777, path.read_text()) == (0o600, "newer")
    assert (beside.stat().st_mode & 0o777, beside.read_text()) == (0o640, "new")
    assert link.is_symlink()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of Unix")
def test_a_pipe_takes_what_is_written(tmp_path: Path) -> None:
    """It exists, holds nothing to lose, and stays a pipe."""
    path, read = tmp_path / "pipe", []
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: read.append(path.read_text()))
    reader.start()
    with replacing(path, overwrite=False) as new:
        new.write_text("new")
    reader.join(10)
    assert read == ["new"]
    assert path.is_fifo()


@pytest.mark.skipif(os.name == "nt", reason="devices of Unix")
def test_streams(tmp_path: Path) -> None:
    """Devices and open streams are, files, folders and new names are not."""
    assert all(is_stream(Path(name)) for name in ("/dev/null", "/dev/stdout", "/dev/fd/1"))
    assert not any(is_stream(path) for path in (tmp_path, tmp_path / "new", Path(__file__)))


# ---- what a command prints ------------------------------------------------------------------
FULL = "Invalid output 'standard output'. It cannot be written: No space left on device."


@each(
    ("error", "message"),
    [
        (FileExistsError("Invalid output 'x'. It exists."), "projdist: Invalid output 'x'. It exists.\n"),
        (OSError(errno.ENOSPC, "No space left on device"), f"projdist: {FULL}\n"),
        (OSError(errno.EPIPE, "Broken pipe"), ""),
    ],
)
def test_what_cannot_be_printed(error, message, monkeypatch, capsys):
    """Ends the command with 2, and a line; who runs the command line knows how to end on a closed pipe."""

    def failing(*_):
        raise error

    monkeypatch.setattr(report, "write", failing)
    with pytest.raises(typer.Exit if message else BrokenPipeError) as ended:
        report.emit("text", None)
    assert (getattr(ended.value, "exit_code", 2), capsys.readouterr().err) == (2, message)


def test_pictures_without_memory(capsys):
    """Say what would help."""
    with pytest.raises(typer.Exit), report.drawing(Path("x.png")):
        raise MemoryError
    assert capsys.readouterr().err.startswith("projdist: Invalid picture 'x.png'. It needs more memory than there is")


NO_TEXT, GPX = os.fsdecode(b"a\xff."), r"'a\\xff\.gpx'"


@pytest.mark.skipif(os.name == "nt", reason="names of Unix")
@pytest.mark.parametrize(
    ("words", "suffix", "message"),
    [
        ("factors EPSG:25832 --at {}", "gpx", r"Invalid file\. 'a\\xff\.gpx' is no text in UTF-8, as the name of such"),
        ("check {}", "geojson", r"Invalid file\. 'a\\xff\.geojson' is no text"),
        ("convert {} --to EPSG:3035 -o x.tif", "tif", r"Invalid file\. 'a\\xff\.tif' is no text"),
        ("convert p.geojson --to EPSG:3035 -o {}", "gpkg", r"Invalid file\. 'a\\xff\.gpkg' is no text"),
        ("profile EPSG:25832 --line {}", "gpx", rf"Invalid line file {GPX}\. It cannot be read: {GPX} is"),
        ("factors EPSG:25832 --at {}", "csv", r"Invalid points file 'a\\xff\.csv'\. Its header must have lon and lat"),
        ("oldmap {}", "points", r"Invalid points file 'a\\xff\.points'\. Its header must name x_old"),
    ],
)
def test_names_that_are_no_text(words, suffix, message, tmp_path, monkeypatch):
    """Bytes that are no UTF-8 are shown as such, in a line that names the file, whatever library cannot open it."""
    pytest.importorskip("geopandas")
    pytest.importorskip("rasterio")
    monkeypatch.chdir(tmp_path)
    Path("p.geojson").write_text('{"type": "Point", "coordinates": [11, 48]}')
    if suffix != "gpkg":
        Path(NO_TEXT + suffix).write_text("a,b\n")
    assert re.match(message, refusal(*words.format(NO_TEXT + suffix).split()))


# ---- tables of text --------------------------------------------------------------------------------
WRONG = "Invalid file."


@each(
    ("line", "separator"),
    [
        *(("1.5,2.5", ","), ("1,5;2,5", ";"), ("1,5\t2,5", "\t"), ("1,5 2,5", None), ("1,5 2", None), ("1, 5", ",")),
        *(("name, of 2", ","), ("1 2", None), ("1,5", ",")),
    ],
)
def test_what_separates_cells(line, separator):
    """Semicolons and tabs come before commas, and blanks where all commas are within numbers."""
    assert separator_of(line) == separator


@pytest.mark.parametrize("mark", [";", "\t", " "])
def test_decimal_commas(mark):
    """Numbers with them have points afterwards, whole numbers and texts are what they were."""
    lines = [["x", "y", "name"], ["-0,25", "1,5e3", "a"], ["7", "+2,0", "b,c"]]
    rows = rows_of_text("\n".join(map(mark.join, lines)), WRONG)
    assert rows == [(1, ["x", "y", "name"]), (2, ["-0.25", "1.5e3", "a"]), (3, ["7", "+2.0", "b,c"])]


@pytest.mark.parametrize("text", ["x;y\n1,5;2.5\n", 'x,y\n"1,5;2",2.5\n'])
def test_commas_beside_points_stay(text):
    """Of numbers some of which have decimal points the commas are not decimal ones."""
    assert rows_of_text(text, WRONG)[1][1][0].startswith("1,5")


def test_what_may_be_thousands():
    """Where all commas stand before three digits, how they are read is told."""
    with pytest.warns(Notice, match=r"^'500,187' is read as a number with a decimal comma, not as thousands\.$"):
        assert rows_of_text("500,187\t400,250\n", WRONG) == [(1, ["500.187", "400.250"])]


def test_decimal_commas_between_commas():
    """They are no rows, and named."""
    said = r"^Invalid file\. Line 2 has 4 cells; it must have 2\. Decimal commas are read"
    with pytest.raises(ValueError, match=said):
        rows_of_text("lat,lon\n48,25,11,5\n", WRONG)
