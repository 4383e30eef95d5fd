"""Whole commands, as people wait for them: `python benchmarks/commands.py [other checkout]`, as a Markdown table.

With another checkout of projdist, its package is run in turn with this one.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

RUNS = 5
COMMANDS = {
    "heatmap EPSG:2154 -r country:FR": ".png",
    "heatmap EPSG:3035 -r country:DE": ".png",
    "heatmap EPSG:2193 -r country:NZ": ".png",
    "tissot EPSG:3857 -r continent:Africa": ".png",
    "heatmap robinson": ".png",
    "compare robinson winkel-tripel": "",
    "--help": "",
}


def user_seconds(package: Path, words: list[str]) -> float:
    """Processor time of a command outside of the system."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command = [sys.executable, "-P", "-m", "projdist", *words]
    environment = {**os.environ, "PYTHONPATH": str(package), "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(command, env=environment, capture_output=True, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main(packages: list[Path]) -> None:
    """A row of medians for each command, after a run to compile modules and to warm the disk's cache."""
    print(f"| command | {' | '.join(f'user s, {package.name}' for package in packages)} |")
    print(f"| --- |{' --- |' * len(packages)}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for command, suffix in COMMANDS.items():
            output = ["-o", str(Path(folder) / f"picture{suffix}"), "--overwrite"] if suffix else []
            words = command.split() + output
            times = [[user_seconds(package, words) for package in packages] for _ in range(RUNS + 1)][1:]
            medians = [statistics.median(column) for column in zip(*times, strict=True)]
            print(f"| `{command}` | {' | '.join(f'{seconds:.2f}' for seconds in medians)} |", flush=True)


if __name__ == "__main__":
    main([Path(__file__).resolve().parents[1], *(Path(word).resolve() for word in sys.argv[1:])])
