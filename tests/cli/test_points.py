"""Points on the command line as people write them, against the same in decimal degrees."""

import math

import numpy as np
import pytest
from tables import each

from projdist import Notice
from projdist.cli.factors import read_points


@each(
    ("words", "points"),
    [
        ("10 50", [(10, 50)]),
        ("10,50 -20.5,-30", [(10, 50), (-20.5, -30)]),
        ("10, 50", [(10, 50)]),
        ("50N 10E", [(10, 50)]),
        ("10W 50s", [(-10, -50)]),
        ("50N,10W", [(-10, 50)]),
        ("10d30' 50°30'", [(10.5, 50.5)]),
        ("50°30'36\"N 10°15'W", [(-10.25, 50.51)]),
        ("-10d30 0", [(-10.5, 0)]),
        ("1e1 5e1", [(10, 50)]),
    ],
)
def test_points_in_words(words: str, points: list[tuple[float, float]]) -> None:
    """Longitude first, but where letters say otherwise; minutes are sixtieths."""
    found = read_points(words.split(), [])
    assert found.lon == pytest.approx([lon for lon, _ in points], abs=1e-12)
    assert found.lat == pytest.approx([lat for _, lat in points], abs=1e-12)


@pytest.mark.parametrize("word", ["50N 10E", "50N, 10E", "10 50", "10 , 50", "50°0'N 10°0'E"])
def test_a_pair_may_be_one_word(word: str) -> None:
    """As it comes from a shell where it is quoted."""
    found = read_points([word], [])
    assert (found.lon, found.lat) == ([10], [50])


@each(
    ("words", "message"),
    [
        ("10N 50N", r"^Invalid point '10N 50N'\. One must be a longitude and one a latitude\.$"),
        ("10 50 20", r"^Invalid coordinates '10 50 20'\. They must be pairs"),
        ("10d60' 50", r"^Invalid point '10d60' 50'\. Longitude and latitude must be numbers"),
        ("10 90.5N", r"^Invalid latitude '90\.5N'\. It must lie within -90 and 90"),
        ("1,2,3 4", r"^Invalid point '1,2,3 4'\."),
        ("inf 5", r"^Invalid longitude 'inf'\."),
    ],
)
def test_words_that_are_no_points(words: str, message: str) -> None:
    """One line each."""
    with pytest.raises(ValueError, match=message):
        read_points(words.split(), [])


@each(
    ("lines", "texts"),
    [
        (["lon lat name", "10 50 A", "20 60 B"], ["A", "B"]),
        (["# sites", "Name;Latitude;Longitude", "A;50;10", "B;60;20"], ["A", "B"]),
        (["name,lon,lat,town", "A,10,50,Ulm", "B,20,60,Bern"], ["A Ulm", "B Bern"]),
        (["A 10 50", "B, 20, 60"], ["A", "B"]),
        (["10 50 at the gate", "20E 60N"], ["at the gate", ""]),
        (["10,0;50,0;A", "20;60,0;B"], ["A", "B"]),
        (["Latitude;Longitude;Name", "50,0;10,0;A", "60,0;20;B"], ["A", "B"]),
        (["lat lng name", "50,0 1,0e1 A", "60,0 20 B"], ["A", "B"]),
        (["10,50 A", "20,60\tB"], ["A", "B"]),
    ],
)
def test_lines_may_have_a_header_and_names(lines: list[str], texts: list[str]) -> None:
    """In whatever order the header has them; without one a name may stand before or behind."""
    found = read_points(["-"], lines)
    assert (found.lon, found.lat, found.text, found.problems) == ([10, 20], [50, 60], texts, [])


def test_a_missing_coordinate_keeps_its_row() -> None:
    """It is nowhere, which is told, and the others go on."""
    with pytest.warns(Notice, match=r"^1 of 3 points have no longitude or no latitude; they have no figures\.$"):
        found = read_points(["-"], ["10 50", "nan 5", "x 7", "20 60"])
    assert math.isnan(found.lon[1])
    assert found.lat == [50, 5, 60]
    assert found.problems == ["line 3: Invalid point 'x 7'. Longitude and latitude must be numbers of degrees."]


def test_an_empty_cell_is_a_missing_coordinate() -> None:
    """As in a file for `--at`: a row without figures, not a problem."""
    with pytest.warns(Notice, match=r"^2 of 3 points have no"):
        found = read_points(["-"], ["name,lon,lat", "A,10,50", "B,,51", "C,12,NA"])
    assert np.array_equal(found.lon, [10, np.nan, 12], equal_nan=True)
    assert np.array_equal(found.lat, [50, 51, np.nan], equal_nan=True)
    assert (found.text, found.problems) == (["A", "B", "C"], [])


def test_decimal_commas_between_blanks() -> None:
    """Two numbers with them may be two points with commas in between as well."""
    found = read_points(["-"], ["48,25 11,5", "10,50 7"])
    assert (found.lon, found.lat, found.text) == ([10], [50], ["7"])
    assert found.problems == [
        "line 1: Invalid point '48,25 11,5'. A semicolon must stand between numbers with decimal commas."
    ]
