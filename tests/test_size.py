"""The budget of the package: lines and modules of each room, so that a small team can hold it."""

import ast
import collections
from pathlib import Path

from syntax import statements_of

import projdist

PACKAGE = Path(projdist.__file__).parent
SOURCES = {path: path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))}

# Lines and modules, `__init__` included. A feature makes something that is there more general; the budget grows only
# with a reason in the commit, and shrinks with each simplification.
BUDGET = {
    "answers": (3_225, 10),
    "applications": (5_695, 20),
    "cli": (5_780, 17),
    "decisions": (4_810, 14),
    "designs": (3_525, 11),
    "earth": (555, 3),
    "field": (3_900, 12),
    "gis": (1_605, 7),
    "matrices": (2_510, 10),
    "numerics": (645, 4),
    "plots": (4_040, 12),
    "projections": (5_295, 18),
    "regions": (2_865, 10),
    "support": (1_015, 7),
    "surfaces": (1_705, 7),
    "web": (2_825, 11),
}
LONGEST = 600  # lines of a module
IMPORTS = 0.04  # of the lines


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0]


def test_rooms_keep_to_their_budget() -> None:
    """The package itself has three modules more."""
    found = {
        room: [len(text.splitlines()) for path, text in SOURCES.items() if room_of(path) == room] for room in BUDGET
    }
    assert {
        room: size for room, size in found.items() if sum(size) > BUDGET[room][0] or len(size) > BUDGET[room][1]
    } == {}
    assert {room_of(path) for path in SOURCES} - {"__init__.py", "__main__.py", "_typing.py"} == set(BUDGET)


def test_modules_are_of_one_topic() -> None:
    """None is so long that a reader looks for the place."""
    assert [str(path) for path, text in SOURCES.items() if len(text.splitlines()) > LONGEST] == []


def test_few_lines_are_imports() -> None:
    """Many of them are a sign of modules that are too small."""
    nodes = [node for path in SOURCES for node in statements_of(path) if not isinstance(node, ast.ClassDef)]
    lines = sum(len(text.splitlines()) for text in SOURCES.values())
    assert sum(node.end_lineno - node.lineno + 1 for node in nodes) <= IMPORTS * lines


def test_a_class_has_a_name_of_its_own() -> None:
    """One word is one thing in the whole package; `Explorer` without anywidget only says that it needs it."""
    nodes = [node for path in SOURCES for node in statements_of(path) if isinstance(node, ast.ClassDef)]
    names = collections.Counter(node.name for node in nodes)
    assert sorted(name for name, count in names.items() if count > 1) == ["Explorer"]
