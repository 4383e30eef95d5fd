"""Execute every notebook of this directory from top to bottom; exit 1 if one fails. Nothing is written."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError

HERE = Path(__file__).parent


def main() -> int:
    failed = 0
    for path in sorted(HERE.glob("*.ipynb")):
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
            print(f"{path.name}: failed\n{error}", file=sys.stderr)
            failed += 1
        else:
            print(f"{path.name}: {time.perf_counter() - start:.1f} s")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
