"""Every published figure that is shipped with the package: it comes out, or is explained by one that does."""

import csv
import functools
import io
import json
import math

import mpmath
import numpy as np
import pytest
from commands import command
from refusals import refuses
from tables import each

from projdist import get_measure, tables
from projdist.answers.published_indices import INDICES
from projdist.answers.published_tables import TABLES, conventions, printed

AT_POINTS = [name for name in TABLES if printed(name)[0].at_point]
OF_GLOBES = [name for name in TABLES if name not in AT_POINTS]

# The only figures that nothing explains: distances of three maps, of the Winkel tripel by 2 per cent.
UNEXPLAINED = {("goldberg-gott", name, "D") for name in ("Winkel-Tripel", "Polyconic", "Mercator")}

# Two figures that their source rounded down where it should have rounded up: source and point to the exact value,
# which `test_misrounded_figures` derives in forty digits. They miss the printed figure by 0.520 and 0.514 units.
MISROUNDED = {
    ("PP1395 Table 25 polar stereographic (Intl)", 30.0, 70.0, "k"): 1.03107852043,
    ("PP1395 Table 19 Polyconic", 2.0, 36.0, "h"): 1.00040051389,
}


computed = functools.cache(tables)


def agrees(figure, value, slack=0.0):
    """To half a unit of the last digit printed."""
    return abs(figure - value.value) <= 0.5000001 * 10.0**-value.decimals + slack


def key(row):
    return row.source, row.lon, row.lat, row.measure


@each("name", AT_POINTS)
def test_figures_at_points(name):
    """Each printed figure is met within half a unit of its last decimal; a misrounded one at its exact value."""
    for row in computed(name).rows:
        if key(row.printed) in MISROUNDED:
            assert row.value == pytest.approx(MISROUNDED[key(row.printed)], abs=0.5e-11)
            assert (row.reproduced, row.explained, row.printed.convention) == (False, True, "cut-off")
            assert row.value_by_convention == pytest.approx(row.printed.value, abs=1e-12)
        else:
            assert agrees(row.value, row.printed), row
            assert row.reproduced
        assert row.error < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_GLOBES)
def test_figures_of_globes(name):
    """Each printed figure is met, or the one by the convention that it names is, as far as that is said to go."""
    if name == "goldberg-gott":  # as defined, 47 of the 72 figures; three remain without an explanation
        rows = computed(name).rows
        assert sum(row.reproduced for row in rows) == 47
        assert sum(not row.reproduced and not row.explained for row in rows) == 3
    for row in computed(name).rows:
        if agrees(row.value, row.printed):
            assert row.reproduced
            assert not row.printed.convention, row
        elif (name, row.printed.projection, row.printed.measure) in UNEXPLAINED:
            assert (row.reproduced, row.explained) == (False, False)
            assert row.explanation.startswith("Not reproduced")
            assert math.isnan(row.value_by_convention)
        else:
            assert (row.reproduced, row.explained) == (False, True), row
            slack, text = conventions()[row.printed.convention]
            assert agrees(row.value_by_convention, row.printed, slack), row
            assert text.endswith(".")
        # B of Hammer's map, whose cut fades at its ends, has the largest, and Q, in per cent.
        assert row.error < (0.05 if row.printed.measure == "Q" else 3e-3)


def polar_stereographic_k(lat, f):
    """Snyder 1987, equations 15-9, 21-33 and 21-32 with k_0 = 1."""
    e, phi = mpmath.sqrt(f * (2 - f)), mpmath.radians(lat)
    sin = mpmath.sin(phi)
    t = mpmath.tan(mpmath.pi / 4 - phi / 2) / ((1 - e * sin) / (1 + e * sin)) ** (e / 2)
    m = mpmath.cos(phi) / mpmath.sqrt(1 - e**2 * sin**2)
    return 2 * t / mpmath.sqrt((1 + e) ** (1 + e) * (1 - e) ** (1 - e)) / m


def polyconic_h(lon, lat, e2):
    """The length of the derivative along the meridian of Snyder 1987, equations 18-2, 18-12 and 18-13."""
    phi, lam = mpmath.radians(lat), mpmath.radians(lon)

    def radius(p):
        return mpmath.cot(p) / mpmath.sqrt(1 - e2 * mpmath.sin(p) ** 2)

    def x(p):
        return radius(p) * mpmath.sin(lam * mpmath.sin(p))

    def y_less_arc(p):
        return radius(p) * (1 - mpmath.cos(lam * mpmath.sin(p)))

    # The derivative of the meridian's arc is its radius of curvature.
    M = (1 - e2) / (1 - e2 * mpmath.sin(phi) ** 2) ** mpmath.mpf("1.5")
    return mpmath.hypot(mpmath.diff(x, phi), M + mpmath.diff(y_less_arc, phi)) / M


def test_misrounded_figures():
    """The two figures called misrounded differ, by the closed forms in 40 digits, from what was printed."""
    with mpmath.workdps(40):
        international = 1 / mpmath.mpf(297)
        clarke = 1 - (mpmath.mpf("6356583.8") / mpmath.mpf("6378206.4")) ** 2
        exact = [polar_stereographic_k(70, international), polyconic_h(2, 36, clarke)]
    rows = {key(row): row for row in printed("snyder") if key(row) in MISROUNDED}
    for where, value in zip(MISROUNDED, exact, strict=True):
        assert abs(value - MISROUNDED[where]) < 0.5e-11
        assert abs(value - mpmath.mpf(repr(rows[where].value))) > 0.5 * 10.0 ** -rows[where].decimals


def test_the_data_are_complete():
    """360 figures at points and 96 of globes, each of a known measure and a known convention."""
    rows = [row for name in TABLES for row in printed(name)]
    assert len(rows) == 456
    assert sum(row.at_point for row in rows) == 360
    for row in rows:
        assert get_measure(row.measure).name if row.at_point else INDICES.named(row.measure).name
        assert row.source
        assert row.status
    assert {row.convention for row in rows} == {"", *conventions()}


def test_an_answer():
    """A dictionary, JSON, a frame; an unknown table has close matches."""
    pytest.importorskip("pandas")
    table = tables("francula")
    found = json.loads(table.to_json())
    assert (found["name"], found["source"], len(found["results"])) == ("francula", TABLES["francula"], 2)
    # Francula 1971, after a secondary source.
    assert [row["published"] for row in found["results"]] == [0.3087, 0.3115]
    assert found["results"][0]["lat"] is None
    frame = table.to_frame()
    np.testing.assert_allclose(frame["difference"], frame["value"] - frame["published"])
    refuses(r"Invalid table 'snider'\. Did you mean snyder\? It must be one of goldberg-", tables, "snider")


# ---- on the command line --------------------------------------------------------------------
run, *_ = command("tables")


@each("form", ["table", "markdown"])
def test_printed_tables(form):
    """What does not come out has a figure by another convention beside it, which is told below."""
    code, out, err = run("francula", "-f", form)
    assert (code, err) == (0, "")
    (row,) = (line for line in out.splitlines() if "Francula II " in line)
    assert all(text in row for text in ("0.3115", "0.310989", "-0.000511", "otherwise", "0.311430"))
    assert "band-85.05: Between 85.05 degrees" in out
    code, out, _ = run("proj", "-f", form)
    assert code == 0
    assert "lat" in out
    assert "otherwise" not in out


def test_csv_json_and_files(tmp_path):
    """All columns, in full; without a name the tables are listed; files must be new, an unknown name is a line."""
    code, out, _ = run("-f", "json")
    assert (code, [row["name"] for row in json.loads(out)]) == (0, list(TABLES))
    _, out, _ = run("proj", "-f", "csv")
    rows = list(csv.DictReader(io.StringIO(out)))
    assert (len(rows), rows[0]["reproduced"]) == (19, "True")
    _, out, _ = run("proj", "-f", "json")
    assert json.loads(out) == tables("proj").to_dict()
    path = tmp_path / "table.md"
    assert run("proj", "-f", "markdown", "-o", str(path))[0] == 0
    assert path.read_text().startswith("| projection | lon | lat |")
    assert run("proj", "-o", str(path))[0] == 2
    code, out, err = run("cantres")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "Invalid table 'cantres'. " in err
