"""The script for QGIS: its command lines in this Python, and all of it in QGIS where there is one."""

import importlib.util
import json
import os
import subprocess
import sys
import types
from pathlib import Path

import pytest
from typer.testing import CliRunner

from projdist.cli.app import app

SCRIPT = Path(__file__).parents[2] / "contrib" / "qgis" / "projdist_distortion.py"
QGIS_PYTHON = "/usr/bin/python3"  # Debian's, for which it has QGIS
if not SCRIPT.exists():
    pytest.skip("needs the checkout", allow_module_level=True)


class _Anything(types.ModuleType):
    """A module that has whatever is asked for, as a class that may be raised or inherited from."""

    def __getattr__(self, name: str) -> type:
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (Exception,), {})


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """The script as a module, beside a QGIS that does nothing."""
    for name in ("qgis", "qgis.core"):
        monkeypatch.setitem(sys.modules, name, _Anything(name))
    spec = importlib.util.spec_from_file_location("projdist_distortion", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def square(folder: Path) -> Path:
    """A file of a polygon of two degrees, whose bearings and areas in Web Mercator are known."""
    shape = {"type": "Polygon", "coordinates": [[[8, 48], [10, 48], [10, 50], [8, 50], [8, 48]]]}
    path = folder / "square.geojson"
    path.write_text(json.dumps({"type": "Feature", "properties": {"name": "square"}, "geometry": shape}))
    return path


@pytest.mark.slow
def test_the_command_takes_its_lines(script: types.ModuleType, tmp_path: Path) -> None:
    """Each line is one that the command runs; the region is the box of the extent."""
    pytest.importorskip("geopandas")
    pytest.importorskip("rasterio")
    data, box = str(square(tmp_path)), script.box_of(8.0, 48.0, 10.0, 50.0)
    assert box == "box:8,48,10,50"
    found = CliRunner().invoke(app, script.check_line("projdist", data, "EPSG:3857", "equal-area")[1:])
    lines = script.summary_of(json.loads(found.stdout))
    assert lines[0].startswith("EPSG:3857 (WGS 84 / Pseudo-Mercator): areas off by +132")
    assert lines[1].startswith("Recommended: EPSG:")
    for line in (
        script.report_line("projdist", data, "EPSG:3857", "any", str(tmp_path / "a.html")),
        script.tissot_line("projdist", "EPSG:3857", box, str(tmp_path / "a.gpkg")),
        script.heatmap_line("projdist", "EPSG:3857", box, "scale_error_ppm", str(tmp_path / "a.tif")),
    ):
        done = CliRunner().invoke(app, line[1:])
        assert done.exit_code == 0, done.stderr
        assert Path(line[line.index("--output") + 1]).stat().st_size > 10_000


def test_extents_of_a_point(script: types.ModuleType) -> None:
    """They are boxes, too, and end at the poles."""
    assert script.box_of(8.0, 48.0, 8.0, 48.0) == "box:7.99,47.99,8.01,48.01"
    assert script.box_of(0.0, 90.0, 1.0, 90.0) == "box:0,89.99,1,90"


def test_the_command_runs_for_itself(script: types.ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without QGIS's PROJ and Python, which are others; what fails is told in its own words, or that there is none."""
    monkeypatch.setenv("PROJ_LIB", "elsewhere")
    monkeypatch.setenv("SOMETHING", "kept")
    assert ("PROJ_LIB" in script.environment(), script.environment()["SOMETHING"]) == (False, "kept")
    for words, message in (
        (["nosuchcommand", "check"], "'nosuchcommand' cannot be run"),
        ([sys.executable, "-m", "nosuchmodule"], "No module named nosuchmodule"),
    ):
        with pytest.raises(script.QgsProcessingException, match=message):
            script.run(words)


def in_qgis(folder: Path, crs: str) -> dict:
    """What the script answers in QGIS of the square, with the command of this Python."""
    command = folder / "projdist"
    path = Path(__file__).parents[2]
    command.write_text(f'#!/bin/sh\nPYTHONPATH="{path}" exec "{sys.executable}" -m projdist "$@"\n')
    command.chmod(0o755)
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": str(folder), "XDG_RUNTIME_DIR": str(folder)}
    environment.pop("PYTHONPATH", None)
    names = [SCRIPT.with_name("headless.py"), SCRIPT, square(folder), crs, command, folder]
    words = [QGIS_PYTHON, *map(str, names)]
    done = subprocess.run(words, capture_output=True, text=True, env=environment, timeout=300, check=True)
    found: dict = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.fixture(scope="module")
def _qgis() -> None:
    try:
        tried = subprocess.run([QGIS_PYTHON, "-c", "import qgis.core"], capture_output=True, timeout=60)
    except OSError:
        pytest.skip("needs Debian's Python")
    if tried.returncode:
        pytest.skip("needs QGIS")
    pytest.importorskip("geopandas")
    pytest.importorskip("rasterio")


@pytest.mark.slow
@pytest.mark.usefixtures("_qgis")
def test_in_qgis(tmp_path: Path) -> None:
    """A layer is checked, an equal-area CRS recommended, and report, indicatrices and raster are there."""
    found = in_qgis(tmp_path, "EPSG:3857")
    assert found["good"], found["log"]
    # Between 48 and 50 degrees Web Mercator has sec^2 of areas, and a little more: 1 / (1 - e^2) at least.
    assert 1.23 < found["errors"]["area_error"] < 1.43
    assert ("Recommended: EPSG:" in found["log"], found["recommended"][:5]) == (True, "EPSG:")
    assert found["crs"] == ["EPSG:3857", "EPSG:3857"]
    assert (found["ellipses"] > 10, found["report"] > 10_000) == (True, True)
    # A layer in degrees needs a CRS, where the project has none either.

    found = in_qgis(tmp_path, "")
    assert (found["good"], "state a projected one" in found["log"]) == (False, True)
