"""A Dask cluster in processes of its own."""

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def dask_cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers: the address for `--executor`, and the workers."""
    address_file = folder / "scheduler.json"
    paths = os.pathsep.join([str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    options = {"env": os.environ | {"DASK_DISTRIBUTED__WORKER__DAEMON": "False", "PYTHONPATH": paths}, "cwd": folder}
    options |= dict.fromkeys(("stdout", "stderr"), subprocess.DEVNULL)

    def start(*words: str) -> subprocess.Popen[bytes]:
        command = ["-m", f"distributed.cli.{words[0]}", *words[1:], "--no-dashboard", "--scheduler-file", address_file]
        return subprocess.Popen([sys.executable, *command], **options)

    processes = [start("dask_scheduler", "--host", "127.0.0.1", "--port", "0")]
    worker = ("dask_worker", "--no-nanny", "--nthreads", "1", "--host", "127.0.0.1")
    processes += [start(*worker) for _ in range(2)]
    try:
        for _ in range(300):
            if address_file.exists():
                break
            time.sleep(0.1)
        yield json.loads(address_file.read_text())["address"].replace("tcp://", "dask://"), processes[1:]
    finally:
        for process in processes:
            process.kill()  # a worker that is asked to end waits for its scheduler
            process.wait()
