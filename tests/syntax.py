"""The imports and classes of modules, parsed once for all tests of them."""

import ast
import functools
from pathlib import Path


@functools.cache
def statements_of(path: Path) -> list[ast.Import | ast.ImportFrom | ast.ClassDef]:
    """Those of a module, wherever in it."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom | ast.ClassDef)]
