"""Execute all notebooks of this directory from top to bottom, one on each core; exit 1 if one fails. Write nothing."""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError

HERE = Path(__file__).parent


def failure(path: Path) -> str:
    """Execute a notebook; what is wrong with it, or nothing."""
    start = time.perf_counter()
    client = NotebookClient(
        nbformat.read(path, as_version=4),
        timeout=120,
        kernel_name="python3",
        resources={"metadata": {"path": str(HERE)}},
    )
    try:
        client.execute()
    except (CellExecutionError, CellTimeoutError) as error:
        return f"{path.name}: failed\n{error}"
    print(f"{path.name}: {time.perf_counter() - start:.1f} s")
    return ""


def main() -> int:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the kernels' BLAS threads would only wait for each other
    with ThreadPoolExecutor(os.cpu_count()) as kernels:
        failures = [text for text in kernels.map(failure, sorted(HERE.glob("*.ipynb"))) if text]
    print("\n".join(failures), file=sys.stderr, end="\n" if failures else "")
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
