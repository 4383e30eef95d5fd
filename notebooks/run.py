"""Execute all notebooks of this directory, one on each core: write them with their outputs, or check those that they have.

`python notebooks/run.py` writes; with `--check` nothing is written, and what a cell says must be what stands there:
the same words, and the same numbers but for their last digit. What is below 1e-5 is an error or rounding and may
differ, as may all numbers of cells with the tag "varies", such as counts. Exit 1 where a notebook fails.
"""

from __future__ import annotations

import base64
import io
import itertools
import os
import re
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError
from PIL import Image

HERE = Path(__file__).parent
COLOURS, WIDTH = 200, 900  # of the pictures that are written, at most, which makes them small enough to commit
NOISE = 1e-5
_CELL = re.compile(r"\S*ipykernel_\d+/\d+\.py:\d+: ")  # the file that a notice says it comes from
_NUMBER = re.compile(r"[-+−]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")
_MARKS = re.compile(r"[\s\d─━┏┓┗┛┃│┡┩┳┻╇┴└┘]+|0x[0-9a-f]+")  # frames of tables move with the width of numbers


def executed(path: Path) -> Any:
    """A notebook after all its cells were run; raises CellExecutionError, CellTimeoutError."""
    notebook = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(HERE)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            if "text" in output:
                output["text"] = _CELL.sub("", output["text"])
    return notebook


def written(notebook: Any) -> str:
    """The text of a notebook, without what differs from run to run, and with small pictures."""
    notebook.metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    for cell in notebook.cells:
        cell.metadata = {"tags": cell.metadata["tags"]} if cell.metadata.get("tags") else {}
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            data.pop("application/vnd.jupyter.widget-view+json", None)  # which is of this run's kernel
            if "image/png" in data:
                data["image/png"] = _small(data["image/png"])
            output.pop("transient", None)
    return nbformat.writes(notebook) + "\n"


def _small(png: str) -> str:
    picture = io.BytesIO()
    image = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    image.thumbnail((WIDTH, 4 * WIDTH), Image.Resampling.LANCZOS)
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(picture, "png", optimize=True)
    return base64.b64encode(picture.getvalue()).decode()


def differences(old: Any, new: Any) -> Iterator[str]:
    """What two runs of a notebook say otherwise, a line each."""
    for number, (before, after) in enumerate(zip(old.cells, new.cells, strict=True), start=1):
        if before.cell_type != "code":
            continue
        if _kinds(before) != _kinds(after):
            yield f"cell {number} has other outputs: {_kinds(after)} for {_kinds(before)}"
        elif not _alike(said := _said(before), now := _said(after), "varies" in before.metadata.get("tags", ())):
            yield f"cell {number} says\n{now}\nfor\n{said}"


def _kinds(cell: Any) -> list[str]:
    """The kinds of outputs, each once where several follow each other."""
    kinds = ["picture" if "image/png" in one.get("data", {}) else one.output_type for one in cell.outputs]
    return [kind for kind, _ in itertools.groupby(kinds)]


def _said(cell: Any) -> str:
    """What a cell prints, and its value as text; what it says on standard error last, as that may come at any time."""
    outputs = sorted(cell.outputs, key=lambda one: one.get("name") == "stderr")
    return "".join(one.get("text") or one.get("data", {}).get("text/plain", "") for one in outputs)


def _alike(before: str, after: str, varies: bool) -> bool:
    """Whether two texts have the same words, and the same numbers to their last digit but one unit."""
    if _MARKS.sub("", _NUMBER.sub("", before)) != _MARKS.sub("", _NUMBER.sub("", after)):
        return False
    numbers = zip(_NUMBER.findall(before), _NUMBER.findall(after), strict=False)
    return varies or all(_same(*pair) for pair in numbers)


def _same(before: str, after: str) -> bool:
    one, other = (float(text.replace(",", "").replace("−", "-")) for text in (before, after))
    fraction = re.search(r"\.(\d+)", before)
    unit = 10.0 ** -len(fraction[1]) if fraction and "e" not in before else 0.1 * abs(one) if "e" in before else 0.0
    return abs(one - other) <= max(1.5 * unit, 1e-9 * abs(one)) or max(abs(one), abs(other)) < NOISE


def problem(path: Path, check: bool) -> str:
    """Execute a notebook, and write or check it; what is wrong with it, or nothing."""
    start = time.perf_counter()
    try:
        new = executed(path)
    except (CellExecutionError, CellTimeoutError) as error:
        return f"{path.name}: failed\n{error}"
    print(f"{path.name}: {time.perf_counter() - start:.1f} s")
    if not check:
        path.write_text(written(new))
        return ""
    found = "\n".join(differences(nbformat.read(path, as_version=4), new))
    return f"{path.name}: {found}\n`make notebooks` writes it anew." if found else ""


def main() -> int:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the kernels' BLAS threads would only wait for each other
    check = "--check" in sys.argv[1:]
    with ThreadPoolExecutor(os.cpu_count()) as kernels:
        problems = kernels.map(lambda path: problem(path, check), sorted(HERE.glob("*.ipynb")))
        told = [text for text in problems if text]
    print("\n".join(told), file=sys.stderr, end="\n" if told else "")
    return int(bool(told))


if __name__ == "__main__":
    sys.exit(main())
