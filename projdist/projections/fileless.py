"""Checks that the text of a projection names no file, before PROJ reads it; and an environment without user files.

PROJ opens the files that a text names. So untrusted text is parsed here first against a list of what is allowed:
PROJ parameters that are numbers or words, keywords of CRSs in WKT, types of CRSs in PROJJSON. Methods and extensions
that PROJ runs are checked as PROJ strings.
"""

import json
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from pyproj.database import get_authorities
from pyproj.datadir import get_data_dir

from projdist.projections import proj_strings
from projdist.projections.catalogue import KEYWORDS
from projdist.projections.crs import WktNode, form_of, parse_wkt, with_spaces
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.projection import named_map
from projdist.support import close_words, shown

_NUMBER = r"[+-]?(?:\d+(?:_\d+)*\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_OF_CRSS = frozenset("datum geoid_crs no_defs pm type vunits wktext".split())
_PLAIN = proj_strings.KEYS | proj_strings.ELLIPSOID_KEYS | KEYWORDS["step"] | _OF_CRSS
"""Parameters whose values are numbers or words."""

_TOKEN = re.compile(r"\+?([A-Za-z]\w*)(?:=(\S+))?", re.ASCII)
_VALUE = re.compile(r"[\w.+-]+|[+-]?[\d.][\w.'\"°+-]*", re.ASCII)  # a number, an angle, a word
_RATIO = re.compile(rf"{_NUMBER}/{_NUMBER}", re.ASCII)
_LIST = re.compile(rf"{_NUMBER}(?:,{_NUMBER})*", re.ASCII)
_BLANKS = re.compile(r"[ \t\n\r\v\f]+")

_INIT = re.compile(r"\+?init=(\w+):\w+(?:\s+\+no_defs|\s+\+type=crs)*", re.ASCII)
_RUN = re.compile(r"\+?\b(?:proj|init|title)[\s+]*=", re.IGNORECASE)  # where PROJ, or pyproj, may see a PROJ string
_CODE = r"[A-Za-z]\w*:(?:\w+:)?[\w.]+"
_CODES = re.compile(rf"{_CODE}(?:\s*\+\s*{_CODE})*(?:\s*@\s*[\d.]+)?", re.ASCII)
_URN = re.compile(
    r"urn:[\w-]+:def:crs[,:][\w.,:-]*|https?://www\.opengis\.net/(?:def/crs|gml/srs)/[\w./#-]*", re.I | re.ASCII
)

_CRSS = KEYWORDS["WKT CRS"]
_IN_WKT = _CRSS | KEYWORDS["WKT"]
_QUOTED = re.compile(r'"(?:[^"]|"")*"')
_BARE_WKT = re.compile(r"[\w.,+\-:\s\[\]()\"]*", re.ASCII)
_LOOSE_QUOTE = re.compile(r'[^\[(,\s]\s*""|""\s*[^\])\],\s]')  # a quoted text with something beside it

_DEEPEST = 50


def file_named_in(text: str) -> str:
    """The part of a projection's text that names or may name a file; "" if none does. Raises ProjectionError."""
    text = text.strip()
    init = _INIT.fullmatch(text)
    if text.lower().endswith((".prj", ".wkt", ".json")):
        return text
    if init:
        return "" if init[1].upper() in get_authorities() else text
    if text.startswith("{"):
        return _in_json(text)
    keyword = re.split(r"[\s\[(]", text, maxsplit=1)[0]
    if form_of(text) == "wkt" and (keyword.upper() in _CRSS or "[" in text or _RUN.search(text)):
        return _in_wkt(text)
    if re.search(r"(?:^|\s)\+?proj=", text):
        return _in_proj_string(text)
    words = named_map(text)
    name = words.name
    if run := _RUN.search(name):
        return name[run.start() :]
    if ":" in name and not _CODES.fullmatch(name) and not _URN.fullmatch(name):
        return name
    return _in_parameters(words.parameters)


def close_parameters(token: str) -> list[str]:
    """Known parameters spelt like an unknown one."""
    key = token.lstrip("+").partition("=")[0]
    return close_words(key, sorted(_PLAIN)) if key not in _PLAIN else []


def environment_without_files() -> dict[str, str]:
    """Environment variables with which a new process's PROJ reads its own data only."""
    folders = get_data_dir().split(os.pathsep)
    own = next((folder for folder in folders if Path(folder, "proj.db").exists()), folders[0])
    # GDAL has data of its own, which the first two would hide from it.
    data = {"PROJ_DATA": own, "PROJ_LIB": own} if len(folders) > 1 else {}
    return {"PROJ_NETWORK": "OFF", "PROJ_USER_WRITABLE_DIRECTORY": own, **data}


def _in_proj_string(text: str) -> str:
    """Suspect parameter of a PROJ string; "" if there is none."""
    return _in_parameters(token for token in _BLANKS.split(text) if token)


def _in_parameters(tokens: Iterable[str]) -> str:
    return next((token for token in tokens if not _is_plain(token)), "")


def _is_plain(token: str) -> bool:
    """True if a PROJ parameter is known and its value a number, a word, or a list of numbers."""
    found = _TOKEN.fullmatch(token)
    if found is None:
        return False
    key, value = found[1], found[2]
    if key == "nadgrids":
        return value == "@null"  # PROJ's word for no grid
    if key in ("proj", "o_proj") and value in KEYWORDS["reader"]:
        return False
    if value is None:
        return key in _PLAIN
    if key in KEYWORDS["list"] and _LIST.fullmatch(value):
        return True
    if key == "to_meter" and _RATIO.fullmatch(value):
        return True
    return key in _PLAIN and _VALUE.fullmatch(value) is not None


def _in_method(name: str) -> str:
    """Suspect part of a method's name: PROJ runs the text after `PROJ-based operation method:` or `PROJ `."""
    words = re.sub(r"^PROJ[-_ ]based[^:=]*:[\s_]*", "", with_spaces(name), flags=re.IGNORECASE)
    if words != name or _RUN.search(words):
        return _in_proj_string(words)
    run = re.fullmatch(r"\s*PROJ[\s_]+(.*)", name, re.IGNORECASE | re.DOTALL)
    return _in_proj_string(f"proj={run[1]}") if run else ""


def _in_remark(text: str) -> str:
    """Suspect part of other text in WKT and PROJJSON, where PROJ may find a PROJ string, as in remarks."""
    run = _RUN.search(text)
    return _in_proj_string(text[run.start() :].partition(". ")[0].rstrip(".")) if run else ""


# ---- WKT ------------------------------------------------------------------------------------


def _in_wkt(text: str) -> str:
    bare = _QUOTED.sub('""', text)
    if not _BARE_WKT.fullmatch(bare) or _LOOSE_QUOTE.search(bare):
        raise ProjectionError(
            f"Invalid WKT '{shown(text)}'. Outside of straight quotation marks there must be words, numbers and "
            "brackets, with commas between them."
        )
    roots = parse_wkt(text)
    known = [root.keyword in _CRSS for root in roots]
    if not known or not all(known):
        return next((root.keyword for root in roots if root.keyword not in _CRSS), text)
    return next(filter(None, (_in_node(node) for root in roots for node in root.walk())), "")


def _in_node(node: WktNode) -> str:
    if node.keyword not in _IN_WKT:
        return f"{node.keyword}[{', '.join(node.values)}]"
    if node.keyword == "EXTENSION":
        is_string = len(node.values) == 2 and node.name.upper() == "PROJ4"
        return _in_proj_string(node.values[1]) if is_string else f"EXTENSION[{', '.join(node.values)}]"
    if node.keyword == "PARAMETER" and not all(re.fullmatch(_NUMBER, value) for value in node.values[1:]):
        return ", ".join(node.values[1:])
    rule = _in_method if node.keyword in ("METHOD", "PROJECTION") else _in_remark
    return next(filter(None, map(rule, node.values)), "")


# ---- PROJJSON -------------------------------------------------------------------------------


def _in_json(text: str) -> str:
    try:
        value = json.loads(text, object_pairs_hook=_without_repeats)
    except (ValueError, RecursionError) as error:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It is not JSON: {error}. {ALLOWED}") from error
    if "proj" in value:
        return _in_proj_string(proj_strings.string_of_parameters(value))
    if "init" in value:
        return "init"
    for inside, key, one in _members(value, text):
        if (key == "value" and inside == "parameters") or (key == "type" and one not in KEYWORDS["PROJJSON"]):
            return one or key
        if found := _in_method(one) if inside == "method" else _in_remark(one):
            return found
    return ""


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Dictionary of the members of a JSON object; raises for repeated names, of which readers take either."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("two members of an object have one name")
    return found


def _members(value: Any, text: str) -> Iterator[tuple[str, str, str]]:
    """All texts below a value: name of the enclosing object, own name, text."""
    waiting: list[tuple[str, Any, int]] = [("", value, 0)]
    while waiting:
        name, one, depth = waiting.pop()
        if depth > _DEEPEST:
            raise ProjectionError(f"Invalid projection '{shown(text)}'. Its JSON is nested more than {_DEEPEST} deep.")
        pairs = one.items() if isinstance(one, dict) else [(name, inner) for inner in one]
        for key, inner in pairs:
            if isinstance(inner, dict | list):
                waiting.append((key, inner, depth + 1))
            elif isinstance(inner, str):
                yield name, key, inner
