"""Tables of text: what separates their cells, and decimal commas."""

import pytest
from tables import each

from projdist import Notice
from projdist.support import rows_of_text, separator_of

WRONG = "Invalid file."


@each(
    ("line", "separator"),
    [
        ("1.5,2.5", ","),
        ("1,5;2,5", ";"),
        ("1,5\t2,5", "\t"),
        ("1,5 2,5", None),
        ("1,5 2", None),
        ("1, 5", ","),
        ("name, of 2", ","),
        ("1 2", None),
        ("1,5", ","),
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
    with pytest.raises(
        ValueError, match=r"^Invalid file\. Line 2 has 4 cells; it must have 2\. Decimal commas are read"
    ):
        rows_of_text("lat,lon\n48,25,11,5\n", WRONG)
