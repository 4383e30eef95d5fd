"""What all answers share: one line, a table in notebooks, and equality by identity."""

import dataclasses
import math
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest
from public_calls import CALLS
from tables import each

import projdist
from projdist.support.answers import HIDDEN, Answer, Record, html_table, plain, schema
from projdist.support.checks import check_number, check_numbers, check_pair, check_path, check_whole_number

NAMES = "factors summarize compare correct local_corrections indices distance_distortion mdt ldp".split()


def cells_of(text):
    """The rows of a table, which is well-formed, and the lengths of its bars."""
    rows = [*ElementTree.fromstring(f"<div>{text}</div>").iter("tr")]
    styles = [cell.get("style") for row in rows for cell in row if cell.get("style")]
    bars = [float(style.partition("#c2d8ec ")[2].partition("%")[0]) for style in styles]
    return [["".join(cell.itertext()) for cell in row] for row in rows], bars


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_an_answer_in_a_line_and_in_a_table(name):
    """The line names the class; the table has a cell for each name in each row."""
    answer = getattr(projdist, name)(**CALLS[name]())
    assert repr(answer).startswith(f"{type(answer).__name__}(")
    assert "\n" not in repr(answer)
    assert len(repr(answer)) < 200
    rows, _ = cells_of(answer._repr_html_())
    assert len(rows) > 1
    assert {len(row) for row in rows} == {len(rows[0])}


class Extent(NamedTuple):
    """A part without a schema."""

    west: float
    east: float


@dataclasses.dataclass(frozen=True)
class Place:
    """A part with one."""

    name: str
    extent: Extent
    note: str | None = dataclasses.field(default=None, metadata=schema(optional=True))


@dataclasses.dataclass(frozen=True)
class Sheet(Record):
    """A value of each sort."""

    place: Place = dataclasses.field(metadata=schema("where", of=("name", "extent")))
    base: Place | None = dataclasses.field(metadata=schema(of={"base": "name", "east": "extent.east"}, spread=True))
    parts: tuple[Place, ...]
    figures: dict[str, float] = dataclasses.field(metadata=schema(spread=True))
    matrix: np.ndarray
    error: float = dataclasses.field(metadata=schema("error_estimate"))
    secret: float = dataclasses.field(default=1.0, metadata=HIDDEN)


def test_json_follows_from_the_fields():
    """Keys in the order of the fields; attributes, spread, optional and hidden ones; what is not finite is None."""
    one, other = Place("A", Extent(1.0, math.nan)), Place("B", Extent(3.0, 4.0), "far")
    found = Sheet(one, other, (one, other), {"s": np.float64(2.0)}, np.array([[1.0, np.inf]]), math.inf).to_dict()
    first = {"name": "A", "extent": {"west": 1.0, "east": None}}
    parts = [first, {"name": "B", "extent": {"west": 3.0, "east": 4.0}, "note": "far"}]
    expected = {"where": first, "base": "B", "east": 4.0, "parts": parts, "s": 2.0, "matrix": [[1.0, None]]}
    assert [*found.items()] == [*(expected | {"error_estimate": None}).items()]
    without = Sheet(one, None, (), {}, np.zeros(0), 0.0).to_dict()
    assert (without["base"], without["east"], without["matrix"]) == (None, None, [])


def test_plain_values():
    given = (np.int64(3), np.bool_(True), np.float32(0.5), -math.inf, "x", None, 7, np.arange(2))
    found = plain(given)
    assert found == [3, True, 0.5, None, "x", None, 7, [0, 1]]
    assert list(map(type, found[:3])) == [int, bool, float]


def test_one_policy():
    """Every answer is frozen, made by keywords, and equal to itself only."""

    def below(cls):
        return [cls] + [deeper for one in cls.__subclasses__() for deeper in below(one)]

    classes = [cls for cls in below(Answer)[1:] if cls.__module__.startswith("projdist")]
    assert len(classes) > 5
    for cls in classes:
        policy, hashed = cls.__dataclass_params__, cls.__hash__ is object.__hash__
        assert (policy.frozen, policy.eq, policy.repr, hashed) == (True, False, False, True), cls
        assert all(field.kw_only for field in dataclasses.fields(cls)), cls


def test_the_line_of_a_summary():
    """Its figure and the error: the plate carree's square is 0.52124046 squared, by its closed form."""
    found = projdist.summarize("plate-carree", tolerance=1e-8)
    assert repr(found).startswith(f"Summary({found.projection.name} over globe: AK 0.5212 ± ")


def test_bars_and_strange_cells():
    """Bars are shares of the largest; what is no number, or negative, has none; text is escaped and cut."""
    rows = [{"map": "<b>", "s": 1.0, "d": -1.0}, {"map": "x" * 50, "s": 4.0, "d": 2.0}, {"map": None, "s": math.nan}]
    found = [["map", "s", "d"], ["<b>", "1", "-1"], ["x" * 40 + "…", "4", "2"], ["", "nan", ""]]
    assert cells_of(html_table(rows, "a & b")) == (found, [25.0, 100.0])
    # The first thirty, and how many there are besides.
    text = html_table({"n": np.arange(100.0)}, "")
    assert len(cells_of(text)[0]) == 31
    assert "and 70 more rows" in text


# ---- arguments that are none -----------------------------------------------------------------------
@each(("check", "value", "message"), [
    *((check_number, value, f"Invalid thing '{value}'. It must be a number.") for value in ("1", True, None, 1j)),
    *(
        (check_whole_number, value, f"'{value}'. It must be a whole number, 0 or more.")
        for value in (1.0, -1, True)
    ),
    *((check_numbers, None, "Invalid thing"), (check_numbers, ["x"], "Invalid thing")),
    *((check_pair, [1.0, 2.0, 3.0], "They must be two numbers."), (check_pair, 1.0, "They must be two numbers.")),
    *((check_number, [1.0, 2.0], "It must be a number."), (check_path, 3, "'3'. It must be the path of a file.")),
])  # fmt: skip
def test_refused(check, value, message):
    with pytest.raises(ValueError, match=r"^Invalid thing") as refused:
        check("thing", value)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_accepted():
    """Numbers of numpy are numbers, too."""
    assert (check_number("thing", np.float32(1.5)), check_number("thing", 2)) == (1.5, 2.0)
    assert (check_whole_number("thing", np.int8(3)), check_pair("thing", (1, np.nan))[0]) == (3, 1.0)
    assert check_numbers("thing", (1, 2)).dtype == float
    assert check_path("thing", "a/b").name == "b"
