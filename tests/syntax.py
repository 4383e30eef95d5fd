"""The imports and classes of modules, looked for once for all tests of them."""

import ast
import functools
from collections.abc import Iterable, Iterator
from pathlib import Path


@functools.cache
def statements_of(path: Path) -> list[ast.Import | ast.ImportFrom | ast.ClassDef]:
    """Those of a module, wherever in it."""
    found = _within(ast.parse(path.read_text(encoding="utf-8")).body)
    return [node for node in found if isinstance(node, ast.Import | ast.ImportFrom | ast.ClassDef)]


def _within(nodes: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Statements, and those in them, but no expressions, which are most of a tree."""
    for node in nodes:
        yield node
        for part in ("body", "handlers", "orelse", "finalbody", "cases"):
            yield from _within(getattr(node, part, ()))
