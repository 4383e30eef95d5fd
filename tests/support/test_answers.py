"""What all answers share: one line, a table in notebooks, and equality by identity."""

import dataclasses
import math
from html.parser import HTMLParser
from typing import NamedTuple

import numpy as np
import pytest
from tables import each

import projdist
from projdist import Box
from projdist.support.answers import HIDDEN, Answer, Record, html_table, plain, schema
from projdist.support.checks import check_number, check_numbers, check_pair, check_path, check_whole_number

SQUARE = Box(8, 48, 12, 52)
ANSWERS = {
    "factors": lambda: projdist.factors("robin", [10, 20], 50),
    "summarize": lambda: projdist.summarize("robin", SQUARE, tolerance=1e-4),
    "compare": lambda: projdist.compare(["robin", "moll"], SQUARE, measures="s", tolerance=1e-4),
    "correct": lambda: projdist.correct("robin", SQUARE, tolerance=1e-4),
    "local_corrections": lambda: projdist.local_corrections("robin", 10, 50, radius_km=100),
    "indices": lambda: projdist.indices("robin", SQUARE, names="airy", tolerance=1e-3),
    "distance_distortion": lambda: projdist.distance_distortion("robin", SQUARE, tolerance=0.1),
    "mdt": lambda: projdist.mdt([np.eye(2), np.diag([2.0, 1.0])]),
    "ldp": lambda: projdist.ldp("box:8,48,8.2,48.2", height=500, families=["tmerc"]),
}


class Cells(HTMLParser):
    """Rows of cells, and the bars' lengths."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.bars, self.open = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Open a row or a cell; note a bar."""
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            style = dict(attrs).get("style")
            self.bars += [float(style.partition("#c2d8ec ")[2].partition("%")[0])] if style else []

    def handle_endtag(self, tag):
        """Each end is that of what was opened last."""
        assert self.open.pop() == tag

    def handle_data(self, data):
        """The text of a cell."""
        if self.rows and "caption" not in self.open and "tr" in self.open:
            self.rows[-1][-1] += data


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "ldp" else name for name in ANSWERS]
)
def test_an_answer_in_a_line_and_in_a_table(name):
    """The line names the class; the table has a cell for each name in each row."""
    answer = ANSWERS[name]()
    assert repr(answer).startswith(f"{type(answer).__name__}(")
    assert "\n" not in repr(answer)
    assert len(repr(answer)) < 200
    rows = Cells(answer._repr_html_()).rows
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
    assert found == {
        "where": first,
        "base": "B",
        "east": 4.0,
        "parts": [first, {"name": "B", "extent": {"west": 3.0, "east": 4.0}, "note": "far"}],
        "s": 2.0,
        "matrix": [[1.0, None]],
        "error_estimate": None,
    }
    assert list(found) == ["where", "base", "east", "parts", "s", "matrix", "error_estimate"]
    without = Sheet(one, None, (), {}, np.zeros(0), 0.0).to_dict()
    assert (without["base"], without["east"], without["matrix"]) == (None, None, [])


def test_plain_values():
    """What JSON can hold, whatever it was."""
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
        policy = cls.__dataclass_params__
        assert (policy.frozen, policy.eq, policy.repr) == (True, False, False), cls
        assert all(field.kw_only for field in dataclasses.fields(cls)), cls
        assert cls.__hash__ is object.__hash__, cls


def test_the_line_of_a_summary():
    """Its figure and the error: the plate carree's square is 0.52124046 squared, by its closed form."""
    found = projdist.summarize("plate-carree", tolerance=1e-8)
    assert repr(found).startswith(f"Summary({found.projection.name} over globe: AK 0.5212 ± ")


def test_bars_and_strange_cells():
    """Bars are shares of the largest; what is no number, or negative, has none; text is escaped and cut."""
    rows = [{"map": "<b>", "s": 1.0, "d": -1.0}, {"map": "x" * 50, "s": 4.0, "d": 2.0}, {"map": None, "s": math.nan}]
    found = Cells(html_table(rows, "a & b"))
    assert found.bars == [25.0, 100.0]
    assert found.rows == [["map", "s", "d"], ["<b>", "1", "-1"], ["x" * 40 + "…", "4", "2"], ["", "nan", ""]]


def test_many_rows():
    """The first thirty, and how many there are besides."""
    text = html_table({"n": np.arange(100.0)}, "")
    assert len(Cells(text).rows) == 31
    assert "and 70 more rows" in text


# ---- arguments that are none -----------------------------------------------------------------------
@each(
    ("check", "value", "message"),
    [
        (check_number, "1", "Invalid thing '1'. It must be a number."),
        (check_number, True, "Invalid thing 'True'. It must be a number."),
        (check_number, None, "Invalid thing 'None'. It must be a number."),
        *((check_number, [1.0, 2.0], "It must be a number."), (check_number, 1j, "It must be a number.")),
        (check_whole_number, 1.0, "Invalid thing '1.0'. It must be a whole number, 0 or more."),
        (check_whole_number, -1, "Invalid thing '-1'. It must be a whole number, 0 or more."),
        (check_whole_number, True, "It must be a whole number, 0 or more."),
        *((check_numbers, None, "Invalid thing"), (check_numbers, ["x"], "Invalid thing")),
        *((check_pair, [1.0, 2.0, 3.0], "They must be two numbers."), (check_pair, 1.0, "They must be two numbers.")),
        (check_path, 3, "Invalid thing '3'. It must be the path of a file."),
    ],
)
def test_refused(check, value, message):
    """What it is, and what it must be."""
    with pytest.raises(ValueError, match=r"^Invalid thing") as refused:
        check("thing", value)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_accepted():
    """Numbers of numpy are numbers, too."""
    assert check_number("thing", np.float32(1.5)) == 1.5
    assert check_number("thing", 2) == 2.0
    assert check_whole_number("thing", np.int8(3)) == 3
    assert check_pair("thing", (1, np.nan))[0] == 1.0
    assert check_numbers("thing", (1, 2)).dtype == float
    assert check_path("thing", "a/b").name == "b"
