"""ES modules as one text, for places that take one script."""

from __future__ import annotations

import re
from collections.abc import Mapping

_IMPORT = re.compile(r'^import \{([^}]*)\} from "\./(\w+)\.js";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:async )?function|class|const) (\w+)", re.MULTILINE)


def bundled(files: Mapping[str, str], entry: str) -> str:
    """A module with all that it imports, each in a scope of its own; what the module exports itself stays exported.

    `files` are texts by names, `frames.js`. Imports are of names in braces, each ended by a semicolon, exports of
    functions, classes and constants where they are made.
    """
    order: list[str] = []
    _visit(files, entry.removesuffix(".js"), order)
    scopes = [_scope(name, files[f"{name}.js"]) for name in order[:-1]]
    return "\n".join([*scopes, _without_imports(files[entry])])


def _visit(files: Mapping[str, str], name: str, order: list[str]) -> None:
    """Add a module after those that it imports."""
    for _, other in _IMPORT.findall(files[f"{name}.js"]):
        if other not in order:
            _visit(files, other, order)
    order.append(name)


def _scope(name: str, text: str) -> str:
    exported = [found for _, found in _EXPORT.findall(text)]
    body = _EXPORT.sub(r"\1 \2", _without_imports(text))
    return f"const ${name} = (() => {{\n{body}\nreturn {{ {', '.join(exported)} }};\n}})();"


def _without_imports(text: str) -> str:
    """Names from the other modules' scopes."""
    return _IMPORT.sub(lambda found: f"const {{{found[1].replace(' as ', ': ')}}} = ${found[2]};\n", text)
