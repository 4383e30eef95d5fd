"""The committed table of factors: what the methods promise, and what is measured today; and the page about it."""

import doctest
import re
from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS
from pyproj.database import query_crs_info
from tables import each, some

import projdist

pd = pytest.importorskip("pandas")

DOCS = Path(__file__).parents[1] / "docs"
FIGURES = ["h", "k", "s", "a", "b"]
CERTAIN = 2e-11  # of J: the errors of 99.9 % are below 1.5e-11
AGREE = 5e-11  # of two runs, each good to that
SPHERES = "(Spherical)"  # in the names of methods that are not what they are called on an ellipsoid


@pytest.fixture(scope="module")
def table() -> "pd.DataFrame":
    found = pd.read_csv(DOCS / "reference_factors.csv.gz")
    methods = {
        f"{name}:{info.code}": info.projection_method_name or ""
        for name in ("EPSG", "ESRI", "IGNF")
        for info in query_crs_info(name, pj_types=["PROJECTED_CRS"], allow_deprecated=True)
    }
    return found.assign(method=found.crs.map(methods))[found.quality == "ok"]


def of_methods(table: "pd.DataFrame", *starts: str) -> "pd.DataFrame":
    """Rows of methods on ellipsoids whose names start so."""
    named = table.method.str.startswith(starts, na=False) & ~table.method.str.contains(SPHERES, regex=False, na=False)
    return table[named & (table.error < CERTAIN)]


CONFORMAL = "Transverse Mercator", "Lambert Conic Conformal", "Hotine Oblique", "Mercator (variant"
EQUAL_AREA = "Albers Equal Area", "Lambert Azimuthal Equal Area", "Lambert Cylindrical Equal Area"


@pytest.mark.slow
def test_how_sure_it_is(table: "pd.DataFrame") -> None:
    """As the page says; methods have equal angles or equal areas, where PROJ's own series keep them to that."""
    assert table.crs.nunique() > 8000
    assert (table.error < 1e-11).mean() > 0.99
    assert table.error.max() < 1e-8
    conformal, equal_area = of_methods(table, *CONFORMAL), of_methods(table, *EQUAL_AREA)
    assert len(conformal) > 5000
    assert len(equal_area) > 200
    for off in (conformal.a / conformal.b - 1.0, equal_area.s - 1.0):
        assert np.quantile(np.abs(off), 0.99) < AGREE


@pytest.mark.slow
def test_convergences_of_cones(table: "pd.DataFrame") -> None:
    """Of Lambert's with one parallel, sin(lat_1) of the difference of longitudes."""
    checked = 0
    for code, rows in of_methods(table, "Lambert Conic Conformal (1SP)").groupby("crs"):
        crs = CRS(code)
        named = {one.name: one.value for one in crs.coordinate_operation.params if one.unit_name == "degree"}
        usual = not crs.prime_meridian.longitude and crs.axis_info[0].direction == "east"
        if usual and (lat := named.get("Latitude of natural origin")) is not None:
            east = (rows.lon - named["Longitude of natural origin"] + 180.0) % 360.0 - 180.0
            np.testing.assert_allclose(rows.convergence, east * np.sin(np.radians(lat)), atol=1e-8)
            checked += len(rows)
    assert checked > 100


@pytest.mark.slow
def test_it_is_measured_so_today(table: "pd.DataFrame") -> None:
    """Every ninth CRS, or all, but for what other releases of PROJ have changed."""
    different, chosen = [], some(table.crs.unique(), 9)
    for code, rows in table[table.crs.isin(chosen) & (table.error < CERTAIN)].groupby("crs"):
        found = projdist.factors(code, rows.lon.values, rows.lat.values)
        if any(np.abs(getattr(found, name) / rows[name].values - 1.0).max() > AGREE for name in FIGURES):
            different.append(code)
    assert len(different) <= 0.01 * len(chosen), different


@each("text", re.findall(r"```python\n(>>>.*?)```", (DOCS / "others.md").read_text(encoding="utf-8"), re.DOTALL))
def test_lines_of_the_page_print_what_it_says(text: str) -> None:
    example = doctest.DocTestParser().get_doctest(text, {}, "others", None, None)
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
