"""The committed table of factors: what the methods promise, and what is measured today; and the page about it."""

import doctest
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS
from pyproj.database import query_crs_info
from tables import each

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


def test_how_sure_it_is(table: "pd.DataFrame") -> None:
    """As the page says."""
    assert table.crs.nunique() > 8000
    assert (table.error < 1e-11).mean() > 0.99
    assert table.error.max() < 1e-8


@pytest.mark.parametrize(
    ("methods", "least", "promised"),
    [
        (("Transverse Mercator", "Lambert Conic Conformal", "Hotine Oblique", "Mercator (variant"), 5000, "omega"),
        (("Albers Equal Area", "Lambert Azimuthal Equal Area", "Lambert Cylindrical Equal Area"), 200, "s"),
    ],
)
def test_what_methods_promise(table: "pd.DataFrame", methods: tuple[str, ...], least: int, promised: str) -> None:
    """Equal angles and equal areas, where PROJ's own series keep them to that."""
    some = of_methods(table, *methods)
    assert len(some) > least
    off = some.a / some.b - 1.0 if promised == "omega" else some.s - 1.0
    assert np.quantile(np.abs(off), 0.99) < AGREE


@pytest.mark.slow
def test_convergences_of_cones(table: "pd.DataFrame") -> None:
    """Of Lambert's with one parallel, sin(lat_1) of the difference of longitudes."""
    checked = 0
    for code, rows in of_methods(table, "Lambert Conic Conformal (1SP)").groupby("crs"):
        crs = CRS(code)
        if crs.prime_meridian.longitude or crs.axis_info[0].direction != "east":
            continue
        named = {one.name: one.value for one in crs.coordinate_operation.params if one.unit_name == "degree"}
        if "Latitude of natural origin" not in named:
            continue
        east = (rows.lon - named["Longitude of natural origin"] + 180.0) % 360.0 - 180.0
        truth = east * np.sin(np.radians(named["Latitude of natural origin"]))
        np.testing.assert_allclose(rows.convergence, truth, atol=1e-8)
        checked += len(rows)
    assert checked > 100


@pytest.mark.parametrize("part", [200, pytest.param(3, marks=pytest.mark.slow)])
def test_it_is_measured_so_today(table: "pd.DataFrame", part: int) -> None:
    """Every `part`-th CRS, but for what other releases of PROJ have changed."""
    different = []
    for code in table.crs.unique()[::part]:
        rows = table[(table.crs == code) & (table.error < CERTAIN)]
        found = projdist.factors(code, rows.lon, rows.lat)
        if any(np.abs(getattr(found, name) / rows[name] - 1.0).max() > AGREE for name in FIGURES if len(rows)):
            different.append(code)
    assert len(different) <= 0.01 * table.crs.nunique() / part, different


BLOCKS: Callable[[str], list[str]] = re.compile(r"```python\n(>>>.*?)```", re.DOTALL).findall


@each("number", range(len(BLOCKS((DOCS / "others.md").read_text(encoding="utf-8")))))
def test_lines_of_the_page_print_what_it_says(number: int) -> None:
    text = BLOCKS((DOCS / "others.md").read_text(encoding="utf-8"))[number]
    example = doctest.DocTestParser().get_doctest(text, {}, f"others {number}", None, None)
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
