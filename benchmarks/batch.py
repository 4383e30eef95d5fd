"""Batches on two processes against one, in Markdown: `python benchmarks/batch.py [RUNS [COUNTRIES]]`.

The same job by `processes:1` and `processes:2`, side by side and in turn; Python's start is in both. The ratio of
wall-clock times says what a second core is worth, where two are free. The first line is what it is worth to two
processes that share nothing, a loop in plain Python each: no job does better on this machine, whose cores may share
caches, heat and other users. The processor time of the tasks by two processes over that by one holds what each of them
reads and lays anew, and what the second core slows the first down by, which the loops have, too. On one core only the
former is left (the last column). Then what a task sends, and what a process needs.
"""

import json
import os
import pickle
import resource
import statistics
import subprocess
import sys
import time
from typing import Any

import projdist
from projdist.answers import areas_of, batch
from projdist.answers.batch_tasks import Job, run_tasks
from projdist.answers.batches import _tasks
from projdist.regions import region_names

LOOP = """
import sys, time
start, total = time.process_time(), 0
for k in range(int(sys.argv[1])):
    total += k * k % 7
print(time.process_time() - start)
"""
ROUNDS = 40_000_000  # of the loop, halved between two processes

MAPS = ["mollweide", "robinson", "winkel-tripel", "equal-earth", "mercator", "EPSG:3035"]


def recommended(region: Any) -> dict[str, float]:
    """`recommend`, and the processor time that it took."""
    start = time.process_time()
    projdist.recommend(region)
    return {"seconds": time.process_time() - start}


def summarized(projection: str, region: Any) -> dict[str, float]:
    """`summarize`, likewise."""
    start = time.process_time()
    projdist.summarize(projection, region)
    return {"seconds": time.process_time() - start}


def jobs(countries: int) -> dict[str, tuple]:
    """The jobs by name: the function that tells its time, the function, regions, maps."""
    names = [name for name in region_names() if name.startswith("country:")]
    some = names[:: max(len(names) // countries, 1)][:countries]
    return {
        "recommend": (recommended, projdist.recommend, some, None),
        "compare, six maps": (summarized, projdist.summarize, "countries", MAPS),
    }


def run(name: str, executor: str, countries: int, *, core: bool = False) -> list[float]:
    """Wall-clock seconds of a job in a process of its own, processor time of its tasks, and their number.

    With `core`, all of it runs on one core.
    """
    words = [sys.executable, __file__, "--core" if core else "--one", name, executor, str(countries)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # NumPy is loaded here before processes start
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True, env=environment).stdout)


def loops(processes: int) -> list[float]:
    """Wall-clock seconds of the loop divided between processes, their processor time, and how many they are."""
    words = [sys.executable, "-c", LOOP, str(ROUNDS // processes)]
    start = time.perf_counter()
    started = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(processes)]
    own = [float(one.communicate()[0]) for one in started]
    return [time.perf_counter() - start, sum(own), processes]


def one(name: str, executor: str, countries: int) -> None:
    function, _, regions, maps = jobs(countries)[name]
    start = time.perf_counter()
    found = batch(function, regions, maps, executor=executor)
    seconds = time.perf_counter() - start
    assert found.failures == ()
    print(json.dumps([seconds, sum(result.answer["seconds"] for result in found.results), len(found.results)]))


def sizes(countries: int) -> None:
    """Bytes that a task sends, there and back, and the memory of this process when it has done them all."""
    for name, (_, function, regions, maps) in jobs(countries).items():
        job, tasks = Job(function, {}), _tasks(areas_of(regions), maps)
        sent = len(pickle.dumps((run_tasks, job, tasks[:100]))) / len(tasks[:100])
        lines = [line for task in tasks for line in run_tasks(job, [task]).lines]
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        lengths = sorted(map(len, lines))
        print(
            f"| {name} | {len(pickle.dumps((run_tasks, job, tasks[:1])))} | {sent:.0f} "
            f"| {statistics.median(lengths):,.0f} | {lengths[-1]:,} | {memory:.0f} |"
        )


def told(name: str, rows: list[tuple[list[float], list[float]]], on_one: str) -> None:
    """A line of the table, from runs by one process and by two."""
    single, double = (statistics.median(row[k][0] for row in rows) for k in (0, 1))
    ratio = statistics.median(first[0] / second[0] for first, second in rows)
    work = statistics.median(second[1] / first[1] for first, second in rows)
    count = int(rows[0][0][2])
    print(f"| {name} | {count} | {single:.1f} | {double:.1f} | {ratio:.2f} | {work:.2f} | {on_one} |", flush=True)


def main(runs: int, countries: int) -> None:
    print(f"\n### Batches, {os.cpu_count()} cores, medians of {runs} runs\n")
    print("| job | results | one process s | two s | ratio | processor time of tasks, two over one | on one core |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    told("loops that share nothing", [(loops(1), loops(2)) for _ in range(runs)], "")
    for name in jobs(countries):
        rows = [(run(name, "processes:1", countries), run(name, "processes:2", countries)) for _ in range(runs)]
        on_one = run(name, "processes:2", countries, core=True)[1] / run(name, "processes:1", countries, core=True)[1]
        told(name, rows, f"{on_one:.2f}")
    print("\n| job | bytes of one task | of each of a hundred | median of its result | largest | MB of a process |")
    print("| --- | --- | --- | --- | --- | --- |")
    sizes(countries)


if __name__ == "__main__":
    if sys.argv[1:2] in (["--one"], ["--core"]):
        if sys.argv[1] == "--core":
            os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])
        one(sys.argv[2], sys.argv[3], int(sys.argv[4]))
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 3, int(sys.argv[2]) if len(sys.argv) > 2 else 40)
