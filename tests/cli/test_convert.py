"""The command `convert`."""

from pathlib import Path

import pytest
import shapely
from commands import refusal as refused
from commands import run_ok
from commands import told as run

from projdist import gis
from projdist.cli import data

geopandas = pytest.importorskip("geopandas")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a map made to measure and a point."""
    monkeypatch.chdir(tmp_path)
    run_ok("design", "country:CH", "--degree", "2", "--base", "EPSG:3035", "--against", "EPSG:2056", "-o", "map.wkt")
    frame = geopandas.GeoDataFrame({"name": ["a"]}, geometry=geopandas.points_from_xy([8.0], [47.0]), crs="EPSG:4326")
    frame.to_file(tmp_path / "data.geojson")
    return tmp_path


@pytest.mark.slow
def test_there_and_back(folder: Path) -> None:
    """The CRS that other programs do not read is beside the file, which a line says; the data come back by either."""
    code, out, err = run("convert", "data.geojson", "--to", "map.wkt", "-o", "new.shp")
    assert (code, out) == (0, "Wrote: new.shp\nWrote: new.wkt\n")
    assert err.startswith(
        "projdist: Note: Other programs than projdist do not understand this CRS in 'new.shp'. It is in"
    )
    assert err.count("\n") == 1
    for k, source in enumerate((["--from", "new.wkt"], [])):
        name = f"{k}.gpkg"
        assert run_ok("convert", "new.shp", *source, "--to", "EPSG:4326", "-o", name) == f"Wrote: {name}\n"
        back = shapely.get_coordinates(geopandas.read_file(name).geometry.array)
        assert back.ravel() == pytest.approx([8.0, 47.0], abs=1e-8)


def test_what_is_refused(folder: Path) -> None:
    """One line each, and no file."""
    words = ("convert", "data.geojson", "--to", "map.wkt")
    assert refused("convert", "data.geojson", "-o", "x.gpkg") == "Invalid option '--to'. It must name a CRS."
    assert refused(*words) == "Invalid option '--output'. It must name a file."
    assert "Its suffix must be" in refused(*words, "-o", "x.kml")
    assert "Invalid resampling 'lanczo'" in refused(*words, "-o", "x.tif", "--resampling", "lanczo")
    assert "Invalid distance '-1'" in refused(*words, "-o", "x.gpkg", "--densify", "-1")
    assert "Invalid CRS 'EPSG:0'" in refused("convert", "data.geojson", "--to", "EPSG:0", "-o", "x.gpkg")
    assert not list(folder.glob("x.*"))


def test_words() -> None:
    """Those of the command, which loads nothing for its help, are the library's."""
    assert data._RESAMPLINGS == gis.RESAMPLINGS
    assert set(data._CONVERTED_SUFFIXES) == set(gis.CONVERTED_SUFFIXES)
