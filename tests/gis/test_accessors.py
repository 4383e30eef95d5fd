"""`frame.projdist`: the same answers as the functions give, and registered only with pandas there."""

import subprocess
import sys

import pytest

import projdist

geopandas = pytest.importorskip("geopandas")
shapely = pytest.importorskip("shapely")

import projdist.gis.accessors  # noqa: E402  (whatever imported projdist.gis before pandas)

SQUARES = geopandas.GeoDataFrame(
    {"name": ["a", "b"]}, geometry=[shapely.box(7, 47, 7.1, 47.1), shapely.box(8, 47, 8.1, 47.1)], crs="EPSG:4326"
)


def test_frames_and_series_have_it() -> None:
    """A check by the accessor is the check of the function; web maps enlarge areas by 1 / cos(lat)^2, about 2.15."""
    for data in (SQUARES, SQUARES.geometry):
        found = data.projdist.check("EPSG:3857", purpose=None)
        assert found.overall.area_error == projdist.check(data, "EPSG:3857", purpose=None).overall.area_error
        assert found.overall.area_error == pytest.approx(1.15, abs=0.02)


@pytest.mark.slow
def test_estimates() -> None:
    """Data in Switzerland's own CRS have that."""
    bern = geopandas.GeoSeries.from_xy([2600000, 2601000], [1200000, 1201000], crs="EPSG:2056")
    assert bern.projdist.estimate_crs(authorities=["EPSG"]).to_epsg() == 2056


def test_factors_of_points() -> None:
    """Also of a plain table with lon and lat: Mercator's scale is 1 / cos(lat)."""
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"lon": [10.0], "lat": [60.0]})
    assert table.projdist.factors("mercator", prefix="m_")["m_k"][0] == pytest.approx(2.0, rel=1e-9)


def test_what_is_no_data_is_refused() -> None:
    pandas = pytest.importorskip("pandas")
    with pytest.raises(ValueError, match=r"They must be a GeoDataFrame or GeoSeries\.$"):
        pandas.DataFrame({"lon": [10.0]}).projdist.check("EPSG:3857")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("imports", "has"),
    [
        ("geopandas, projdist.gis", True),
        ("projdist.gis, pandas", False),
        ("projdist.gis.accessors, geopandas", True),
    ],
)
def test_it_is_registered_with_pandas(imports: str, has: bool) -> None:
    """Importing projdist.gis alone loads no pandas, and registers nothing."""
    code = f"import sys, {imports}; import pandas; print(hasattr(pandas.DataFrame, 'projdist'))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(has)


def test_import_loads_no_pandas() -> None:
    code = "import sys, projdist.gis; print('pandas' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
