"""Texts that would make PROJ open files, in every spelling that it reads, and a process that tells what it opens.

Run as a script it takes a folder with texts, and prints of each what became of it.
"""

import contextlib
import ctypes
import itertools
import json
import os
import struct
import subprocess
import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

MARK = "h0stile"  # in all names of files

PATHS = [
    *("/h0stile/a.gsb", "h0stile.gsb", "@h0stile.gsb", "./h0stile.gsb", "../h0stile.tif", "~/h0stile.gsb"),
    *("https://h0stile.invalid/a.tif", "/vsicurl/https://h0stile.invalid/a.tif", "h0stile.gsb,@null"),
    *("@null,h0stile.gsb", '"h0stile.gsb"', "file:///h0stile/a.gsb", "C:\\h0stile\\a.gsb", "h0stile"),
]
# Operations with files, without what begins a parameter, what is before a value, and the path.
READERS = [
    *("merc {0}nadgrids{1}{2}", "merc {0}geoidgrids{1}{2}", "merc {0}datum{1}NAD27 {0}nadgrids{1}{2}"),
    *("hgridshift {0}grids{1}{2}", "vgridshift {0}grids{1}{2} {0}multiplier{1}1", "gridshift {0}grids{1}{2}"),
    *("xyzgridshift {0}grids{1}{2}", "tinshift {0}file{1}{2}", "defmodel {0}model{1}{2}"),
    *("deformation {0}t_epoch{1}2000 {0}grids{1}{2}", "deformation {0}dt{1}1 {0}xy_grids{1}{2} {0}z_grids{1}{2}"),
    *("merc {0}init{1}{2}:1", "utm {0}zone{1}32 {0}catalog{1}{2}", "ob_tran {0}o_proj{1}hgridshift {0}grids{1}{2}"),
]
SEPARATORS = [
    *(" +", " ", "+", ";", " ;", ";+", " ; ", "\t", "\n+", "\r\n", "\v", "\f", "\x1c", "\x85", "\u00a0", "\u2003"),
    *("\u3000", " ++", " + ", ", ", " ,+", ' "', "\u200b+", "|", "&", "\\n", "\u2028", " \ufeff+", "%20", "/"),
]
EQUALS = ["=", " = ", "= ", " =", "\uff1d", "=+", "==", "=\t", "\n=", "+=", '="', ":", "=;"]
KEYS = ["NADGRIDS", "Nadgrids", "n\u0430dgrids", "\uff4eadgrids", "nad\u200bgrids", "nadgrids\u0301", "+nadgrids"]

_DEGREE = "0.0174532925199433"
_DATUM1 = (
    f'GEOGCS["g",DATUM["d",SPHEROID["s",6378137,298.257]{{geo}}],PRIMEM["Greenwich",0],UNIT["degree",{_DEGREE}]{{ext}}]'
)
_BASE2 = 'BASEGEOGCRS["g",DATUM["d",ELLIPSOID["s",6378137,298.257]]]'
_PLANE2 = 'CS[Cartesian,2],AXIS["(E)",east],AXIS["(N)",north],LENGTHUNIT["metre",1]'
_MERC1 = 'PROJECTION["Mercator_1SP"],PARAMETER["central_meridian",0],PARAMETER["scale_factor",1]'
_MERC2 = 'CONVERSION["c",METHOD["Mercator (variant A)"]]'
_WKT1 = f'PROJCS["x",{_DATUM1},{{conversion}},UNIT["metre",1]{{last}}]'
_WKT2 = f'PROJCRS["x",{_BASE2},{{conversion}},{_PLANE2}{{last}}]'


def _wkt1(conversion: str = _MERC1, last: str = "", geo: str = "", ext: str = "") -> str:
    return _WKT1.format(conversion=conversion, last=last, geo=geo, ext=ext)


def _wkt2(conversion: str = _MERC2, last: str = "") -> str:
    return _WKT2.format(conversion=conversion, last=last)


def _axes(subtype: str, unit: str) -> dict[str, object]:
    axes = [{"name": name, "abbreviation": name, "direction": name, "unit": unit} for name in ("east", "north")]
    return {"subtype": subtype, "axis": axes}


def _json(method: str, remarks: str = "") -> str:
    ellipsoid = {"name": "s", "semi_major_axis": 6378137, "inverse_flattening": 298.257}
    datum = {"type": "GeodeticReferenceFrame", "name": "d", "ellipsoid": ellipsoid}
    base = {"type": "GeographicCRS", "name": "g", "datum": datum, "coordinate_system": _axes("ellipsoidal", "degree")}
    conversion = {"name": "c", "method": {"name": method}, "parameters": []}
    crs = {"type": "ProjectedCRS", "name": "x", "base_crs": base, "conversion": conversion}
    crs |= {"coordinate_system": _axes("Cartesian", "metre")} | ({"remarks": remarks} if remarks else {})
    return json.dumps(crs)


def _bound(path: str, form: str) -> str:
    if form == "wkt":
        method = f'METHOD["NTv2",ID["EPSG",9615]],PARAMETERFILE["Latitude and longitude difference file","{path}"]'
        axes = f'CS[ellipsoidal,2],AXIS["lat",north],AXIS["lon",east],ANGLEUNIT["degree",{_DEGREE}]'
        target = f'GEOGCRS["t",DATUM["d",ELLIPSOID["s",6378137,298.257]],{axes}]'
        return f'BOUNDCRS[SOURCECRS[{_wkt2()}],TARGETCRS[{target}],ABRIDGEDTRANSFORMATION["t",{method}]]'
    source = json.loads(_json("Mercator (variant A)"))
    method = {"name": "NTv2", "id": {"authority": "EPSG", "code": 9615}}
    parameters = [{"name": "Latitude and longitude difference file", "value": path}]
    bound = {"type": "BoundCRS", "source_crs": source, "target_crs": source["base_crs"]}
    return json.dumps(bound | {"transformation": {"name": "t", "method": method, "parameters": parameters}})


def _quoted(text: str) -> str:
    return text.replace('"', '""')


def _own(words: str) -> str:
    return _wkt2(f'CONVERSION["c",METHOD["PROJ {_quoted(words)}"]]')


# What is made of an operation with its parameters.
WRAPS = {
    "string": lambda words: f"+proj={words}",
    "bare": lambda words: f"proj={words}",
    "quotes": lambda words: f'"+proj={words}"',
    "title": lambda words: f"+title=x +proj={words}",
    "last": lambda words: f"{words.partition(' ')[2]} +proj={words.partition(' ')[0]}",
    "pipeline": lambda words: f"+proj=pipeline +step +proj={words} +step +proj=merc",
    "steps": lambda words: f"+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj={words}",
    "step": lambda words: f"step proj=merc step proj={words}",
    "oblique": lambda words: f"+proj=ob_tran +o_proj=moll +o_lat_p=45 {words.partition(' ')[2]}",
    "name": lambda words: f"robinson+{words.partition(' ')[2].lstrip('+')}",
    "centre": lambda words: f"mollweide+{words.partition(' ')[2].lstrip('+')}@45,3",
    "code": lambda words: f"EPSG:3035 {words.partition(' ')[2]} +proj={words.partition(' ')[0]}",
    "crs": lambda words: f"+proj={words} +type=crs",
    "json-proj": lambda words: json.dumps({"proj": words}),
    "json-double": lambda words: f'{{"proj": "merc", "pr\\u006fj": {json.dumps(words)}}}',
    "method": lambda words: _wkt2(f'CONVERSION["c",METHOD["PROJ-based operation method: +proj={_quoted(words)}"]]'),
    "method-1": lambda words: _wkt1(f'PROJECTION["PROJ-based operation method: +proj={_quoted(words)}"]'),
    "underscores": lambda words: _wkt1(
        f'PROJECTION["PROJ-based_operation_method:_+proj={_quoted(words)}"]'.replace(" ", "_")
    ),
    "own": _own,
    "own-1": lambda words: _wkt1(f'PROJECTION["PROJ {_quoted(words)}"]'),
    "split": lambda words: _wkt2(f'CONVERSION["c",METHOD["PROJ ""{_quoted(words)}"]]'),
    "round": lambda words: _own(words).replace("[", "(").replace("]", ")"),
    "small": lambda words: _own(words).replace("METHOD", "method"),
    "extension": lambda words: _wkt1(last=f',EXTENSION["PROJ4","+proj={_quoted(words)}"]'),
    "extension-bare": lambda words: _wkt1(last=f',EXTENSION["PROJ4","proj={_quoted(words)}"]'),
    "extension-2": lambda words: _wkt2(last=f',EXTENSION["PROJ4","proj={_quoted(words)}"]'),
    "extension-geo": lambda words: _wkt1(ext=f',EXTENSION["PROJ4","+proj=longlat {_quoted(words.partition(" ")[2])}"]'),
    "extension-datum": lambda words: _wkt1(geo=f',EXTENSION["PROJ4_GRIDS","{_quoted(words)}"]'),
    "custom": lambda words: _wkt1('PROJECTION["custom_proj4"]', f',EXTENSION["PROJ4","+proj={_quoted(words)}"]'),
    "remark": lambda words: _wkt2(last=f',REMARK["PROJ CRS string: +proj={_quoted(words)}"]'),
    "remark-end": lambda words: _wkt2(last=f',REMARK["a. PROJ CRS string: +proj={_quoted(words)}. b"]'),
    "no-wkt": lambda words: f'FOO["a +proj={words} "]',
    "behind-wkt": lambda words: f"{_wkt2()} +proj={words}",
    "printed": lambda words: _wkt2(f"CONVERSION[“c”,METHOD[“PROJ {words}”]]"),
    "json-method": lambda words: _json(f"PROJ-based operation method: +proj={words}"),
    "json-own": lambda words: _json(f"PROJ {words}"),
    "json-remark": lambda words: _json("Mercator (variant A)", f"PROJ CRS string: +proj={words}"),
    "compound": lambda words: (
        f'COMPD_CS["x",{_wkt1()},VERT_CS["v",VERT_DATUM["d",2005,EXTENSION["PROJ4_GRIDS","{_quoted(words)}"]],UNIT["metre",1]]]'
    ),
}


def hostile_texts() -> list[str]:
    """Every wrap of every operation with every path, of two operations with every separator and sign, and others."""
    ways = itertools.product(WRAPS.values(), READERS, PATHS)
    of_paths = [wrap(words.format("+", "=", path)) for wrap, words, path in ways]
    return list(dict.fromkeys([*of_paths, *_of_spellings(), *_others()]))


def _of_spellings() -> Iterator[str]:
    path = "/h0stile/a.gsb"
    for wrap, words in itertools.product(WRAPS.values(), (READERS[0], READERS[3])):
        for separator, equals in itertools.product(SEPARATORS, EQUALS):
            if separator == " +" or equals == "=" or (SEPARATORS.index(separator) + EQUALS.index(equals)) % 5 == 0:
                operation, _, rest = words.partition(" ")
                yield wrap(f"{operation}{separator}{rest.format('', equals, path)}")
        for key in KEYS:
            yield wrap(words.format("+", "=", path).replace("nadgrids", key).replace("grids", key))


def _others() -> Iterator[str]:
    for path in PATHS:
        plain = path.strip('"@')
        yield from (_bound(path.replace('"', ""), form) for form in ("wkt", "json"))
        yield from (f"{plain}{suffix}" for suffix in (".prj", ".WKT", ".json", ".prj ", ".PRJ\n"))
        yield from (f"{sign}init={plain}:1{end}" for sign in ("", "+", "x +", "title=a ") for end in ("", " +no_defs"))
        yield from (f"{plain}:1", f"urn:ogc:def:crs:{plain}::1", f"urn:ogc:def:coordinateOperation:{plain}::1", plain)
        yield json.dumps({"init": f"{plain}:1"})
        yield json.dumps({"proj": "merc", "nadgrids": [plain]})
        yield json.dumps({"proj": "merc", "x_0": {"nadgrids": plain}})


# ---- in a process of its own ------------------------------------------------------------------
# Folders of PATHS: absolute, of the process and the one above, the user's, and that of his grids.
_PLACES = ("h0stile", "work", "work/here", "home", "user")
_NAMES = ("a.gsb", "h0stile.gsb", "h0stile.tif", "h0stile", "C:\\h0stile\\a.gsb")
_IN_OPEN, _EVENT = 0x20, struct.Struct("iIII")  # of inotify(7)


class Watch:
    """What is opened in folders, as Linux tells it."""

    def __init__(self, folders: Iterable[Path]) -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        self.number = libc.inotify_init1(os.O_NONBLOCK)
        for folder in folders:
            assert libc.inotify_add_watch(self.number, os.fsencode(folder), _IN_OPEN) >= 0

    def names(self) -> list[str]:
        """The names of files that were opened since the last time."""
        found = []
        with contextlib.suppress(BlockingIOError):
            while block := os.read(self.number, 65536):
                while block:
                    length = _EVENT.unpack_from(block)[3]
                    name, block = block[_EVENT.size : _EVENT.size + length], block[_EVENT.size + length :]
                    found.append(os.fsdecode(name.rstrip(b"\0")))
        return [name for name in found if name]


def outcomes(
    closed: Sequence[str], opened: Sequence[str], folder: Path, before: Sequence[str] = ()
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """What becomes of texts behind closed and open policy: map or problem, and the files that were opened.

    In one process without a network, the closed ones first.
    """
    for place, name in itertools.product(_PLACES, _NAMES):
        (folder / place).mkdir(parents=True, exist_ok=True)
        (folder / place / name).write_bytes(b"no grid")
    given = folder / "texts.json"
    given.write_text(json.dumps([closed, opened]).replace("/h0stile/", f"{folder}/h0stile/"))
    env = os.environ | {"PROJ_NETWORK": "OFF", "HOME": str(folder / "home")}
    env |= {"PROJ_USER_WRITABLE_DIRECTORY": str(folder / "user"), "PYTHONPATH": str(Path(__file__).parents[3])}
    command, here = [*before, sys.executable, str(Path(__file__).resolve()), str(folder)], folder / "work" / "here"
    found = subprocess.run(command, env=env, cwd=here, capture_output=True, text=True, check=True)
    told = [json.loads(line) for line in found.stdout.splitlines()]
    return told[: len(closed)], told[len(closed) :]


def main(path: str) -> None:
    """Tell of each text, of a file in JSON, what becomes of it behind closed, then behind open policy."""
    from projdist.web.live.dispatcher import InputPolicy

    folder = Path(path)
    closed, opened = json.loads((folder / "texts.json").read_text())
    policies = (InputPolicy(), InputPolicy(is_open=True))
    warnings.simplefilter("ignore")
    watch = Watch(folder / place for place in _PLACES)
    for policy, text in [(policies[0], text) for text in closed] + [(policies[1], text) for text in opened]:
        found: dict[str, Any] = {}
        for kind, ask, given in (("map", policy.projection, text), ("region", policy.region, f"crs:{text}")):
            try:
                found[kind] = ask(given).name
            except ValueError as error:
                found[f"{kind} problem"] = str(error)
        sys.stdout.write(f"{json.dumps(found | {'opened': watch.names()})}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
