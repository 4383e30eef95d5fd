"""The imports and classes of modules, looked for once for all tests of them."""

import ast
import functools
import re
from pathlib import Path

_STATEMENT = re.compile(r"^ *((?:from [\w.]+ )?import (?:\([^)]*\)|[^\n(]+)|class \w+)", re.MULTILINE)


@functools.cache
def statements_of(path: Path) -> list[ast.Import | ast.ImportFrom | ast.ClassDef]:
    """Those of a module, wherever in it, by how their lines begin: to parse all of all modules takes seconds."""
    found = _STATEMENT.findall(path.read_text(encoding="utf-8"))
    return [ast.parse(f"{one}: ..." if one.startswith("class") else one).body[0] for one in found]
