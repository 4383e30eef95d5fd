"""Files that are whole or not there, and never in the place of another unless asked."""

import contextlib
import errno
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import typer
from commands import refusal
from full_disks import room_for
from refusals import refuses
from tables import each

from projdist import Notice
from projdist.cli import report
from projdist.support import rows_of_text, separator_of
from projdist.support.files import is_stream, replacing


def texts_in(folder: Path) -> dict[str, str]:
    return {file.name: file.read_text() for file in folder.iterdir()}


def old_files(folder: Path, *names: str) -> Path:
    """The first of some files that are there."""
    for name in names:
        (folder / name).write_text("old")
    return folder / names[0]


def test_a_file_appears_when_it_is_complete(tmp_path: Path) -> None:
    """Its name is that of the new file, its permissions those of any new file, and nothing else is left."""
    path, plain = tmp_path / "x.txt", old_files(tmp_path, "plain")
    with replacing(path) as new:
        new.write_text("new")
        assert new.name == path.name
        assert not path.exists()
    assert path.stat().st_mode == plain.stat().st_mode
    assert texts_in(tmp_path) == {"plain": "old", "x.txt": "new"}


@each("error", [OSError("full"), KeyboardInterrupt()])
def test_a_failure_leaves_the_old_file(tmp_path: Path, error: BaseException) -> None:
    """Whatever happens while the new one is written."""
    path = old_files(tmp_path, "x.txt")

    def write() -> None:
        with replacing(path) as new:
            new.write_text("half")
            new.with_suffix(".journal").write_text("beside it")
            raise error

    with pytest.raises(type(error)):
        write()
    assert texts_in(tmp_path) == {"x.txt": "old"}


@each("told", [None, AttributeError("'Stream' object has no attribute 'pos'")])
def test_a_full_disk_is_told_by_no_library(tmp_path: Path, told: Exception | None) -> None:
    """What a library keeps to itself, or takes for another error, is an OSError; the files stay as they were."""
    path = old_files(tmp_path, "x.shp", "x.dbf")

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
    path = old_files(tmp_path, "x.shp", "x.dbf", "x.prj", "x.txt")
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
    for meanwhile in ("another's", ""):
        with pytest.raises(FileExistsError, match="It exists"):
            write(path, meanwhile)
    assert path.read_text() == "another's"


@pytest.mark.skipif(os.name == "nt", reason="permissions of Unix")
def test_permissions_and_links_stay(tmp_path: Path) -> None:
    """A private file stays private, and so does the one beside it; what a link names is replaced in its own folder."""
    (tmp_path / "there").mkdir()
    path, link = old_files(tmp_path / "there", "x.jpg", "x.jpgw"), tmp_path / "link.jpg"
    path.chmod(0o600)
    path.with_suffix(".jpgw").chmod(0o640)
    link.symlink_to(path)
    with replacing(path, beside=[".jpgw"]) as new:
        new.write_text("new")
        new.with_suffix(".jpgw").write_text("new")
    with replacing(link) as new:
        new.write_text("newer")
    assert texts_in(path.parent) == {"x.jpg": "newer", "x.jpgw": "new"}
    assert [one.stat().st_mode & 0o777 for one in (path, path.with_suffix(".jpgw"))] == [0o600, 0o640]
    assert link.is_symlink()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of Unix")
def test_a_pipe_takes_what_is_written(tmp_path: Path) -> None:
    """It exists, holds nothing to lose, and stays a pipe."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with ThreadPoolExecutor(1) as pool:
        read = pool.submit(path.read_text)
        with replacing(path, overwrite=False) as new:
            new.write_text("new")
        assert read.result(10) == "new"
    assert path.is_fifo()


@pytest.mark.skipif(os.name == "nt", reason="devices of Unix")
def test_streams(tmp_path: Path) -> None:
    """Devices and open streams are, files, folders and new names are not."""
    assert all(is_stream(Path(name)) for name in ("/dev/null", "/dev/stdout", "/dev/fd/1"))
    assert not any(is_stream(path) for path in (tmp_path, tmp_path / "new", Path(__file__)))


# ---- what a command prints ------------------------------------------------------------------
FULL = "Invalid output 'standard output'. It cannot be written: No space left on device."


@each(("error", "message"), [
    (FileExistsError("Invalid output 'x'. It exists."), "projdist: Invalid output 'x'. It exists.\n"),
    (OSError(errno.ENOSPC, "No space left on device"), f"projdist: {FULL}\n"),
    (OSError(errno.EPIPE, "Broken pipe"), ""),
])  # fmt: skip
def test_what_cannot_be_printed(error, message, monkeypatch, capsys):
    """Ends the command with 2, and a line; who runs the command line knows how to end on a closed pipe."""

    monkeypatch.setattr(report.sys, "stdout", SimpleNamespace(write=Mock(side_effect=error)))
    with pytest.raises(typer.Exit if message else BrokenPipeError) as ended:
        report.emit("text", None)
    assert (getattr(ended.value, "exit_code", 2), capsys.readouterr().err) == (2, message)


def test_pictures_without_memory(capsys):
    with pytest.raises(typer.Exit), report.drawing(Path("x.png")):
        raise MemoryError
    assert capsys.readouterr().err.startswith("projdist: Invalid picture 'x.png'. It needs more memory than there is")


@pytest.mark.skipif(os.name == "nt", reason="names of Unix")
@each(("words", "suffix", "message"), [
    ("factors EPSG:25832 --at {}", "gpx", "Invalid file. {} is not text in UTF-8, as the name of such"),
    ("check {}", "geojson", "Invalid file. {} is not text"),
    ("convert {} --to EPSG:3035 -o x.tif", "tif", "Invalid file. {} is not text"),
    ("convert p.geojson --to EPSG:3035 -o {}", "gpkg", "Invalid file. {} is not text"),
    ("profile EPSG:25832 --line {}", "gpx", "Invalid line file {0}. It cannot be read: {0} is"),
    ("factors EPSG:25832 --at {}", "csv", "Invalid points file {}. Its header must have lon and lat"),
    ("oldmap {}", "points", "Invalid points file {}. Its header must name x_old"),
])  # fmt: skip
def test_names_that_are_no_text(words, suffix, message, tmp_path, monkeypatch):
    """Bytes that are no UTF-8 are shown as such, in a line that names the file, whatever library cannot open it."""
    pytest.importorskip("geopandas")
    pytest.importorskip("rasterio")
    monkeypatch.chdir(tmp_path)
    Path("p.geojson").write_text('{"type": "Point", "coordinates": [11, 48]}')
    name = os.fsdecode(b"a\xff.") + suffix
    if suffix != "gpkg":
        Path(name).write_text("a,b\n")
    assert refusal(*words.format(name).split()).startswith(message.format(rf"'a\xff.{suffix}'"))


# ---- tables of text --------------------------------------------------------------------------------
WRONG = "Invalid file."


def test_what_separates_cells():
    """Semicolons and tabs come before commas, and blanks where all commas are within numbers."""
    commas = dict.fromkeys(["1.5,2.5", "1, 5", "name, of 2", "1,5"], ",")
    separators = commas | {"1,5;2,5": ";", "1,5\t2,5": "\t", "1,5 2,5": None, "1,5 2": None, "1 2": None}
    assert {line: separator_of(line) for line in separators} == separators


def test_decimal_commas():
    """Numbers with them have points afterwards, whole numbers and texts are what they were; between commas none are."""
    lines = [["x", "y", "name"], ["-0,25", "1,5e3", "a"], ["7", "+2,0", "b,c"]]
    for mark in ";\t ":
        rows = rows_of_text("\n".join(map(mark.join, lines)), WRONG)
        assert rows == [(1, ["x", "y", "name"]), (2, ["-0.25", "1.5e3", "a"]), (3, ["7", "+2.0", "b,c"])]
    said = r"^Invalid file\. Line 2 has 4 cells; it must have 2\. Decimal commas are read"
    refuses(said, rows_of_text, "lat,lon\n48,25,11,5\n", WRONG)
    # Of numbers some of which have decimal points the commas are not decimal ones.
    for text in ("x;y\n1,5;2.5\n", 'x,y\n"1,5;2",2.5\n'):
        assert rows_of_text(text, WRONG)[1][1][0].startswith("1,5")
    # Where all commas stand before three digits, how they are read is told.
    with pytest.warns(Notice, match=r"^'500,187' is read as a number with a decimal comma, not as thousands\.$"):
        assert rows_of_text("500,187\t400,250\n", WRONG) == [(1, ["500.187", "400.250"])]
