"""`recommend` against the bare cost of its candidates' transformers, in Markdown: `python benchmarks/recommend.py`.

The floor is what any tool must do that measures the same candidates with pyproj, in one process: `CRS` and
`Transformer.from_crs` for each. The strict floor leaves out spheres and other bodies, which `recommend` refuses by
the text of PROJ's database and never builds. Every measurement runs in a process of its own, as PROJ keeps what it has
read of its database. Ratios are the medians of those of runs side by side; processor time is that of all processes.
"""

import json
import os
import statistics
import subprocess
import sys

REGIONS = {
    "Germany": "box:5.9,47.3,15.0,55.1",
    "Switzerland": "country:CH",
    "Chile": "box:-76,-56,-66,-17.5",
    "Berlin": "cap:13.4,52.5,20",
    "Svalbard": "box:10,76,35,81",
    "Chukotka": "box:158,62,-170,70",
    "Fiji": "box:177,-20,-178,-15",
    "Indonesia": "country:ID",
    "Antarctica": "box:-180,-90,180,-60",
    "world": "globe",
}
RUNS = 5

SETUP = """
import json, os, sys, time
from projdist.decisions.candidate_crs import CandidatePool
from projdist.projections.database import crs_records, reasons_against
from projdist.decisions.recommendation import recommend
from projdist.regions import get_region
from pyproj import CRS, Transformer
from pyproj.exceptions import ProjError
region = get_region(sys.argv[1])
def clock():
    return time.perf_counter(), sum(os.times()[:4])
"""
FLOOR = """
codes = list(CandidatePool(region, crs_records(["EPSG", "ESRI"]), "preferred").records)
refused, seconds = reasons_against(codes), {}
start = clock()
for code in codes:
    before = time.perf_counter()
    crs = CRS.from_user_input(code)
    try:
        Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
    except ProjError:
        pass
    seconds[code] = time.perf_counter() - before
end = clock()
strict = sum(value for code, value in seconds.items() if code not in refused)
print(json.dumps([end[0] - start[0], end[1] - start[1], strict, len(codes)]))
"""
OURS = """
start = clock()
found = recommend(region)
end = clock()
print(json.dumps([end[0] - start[0], end[1] - start[1], found.results[0].code]))
"""
ONE_CORE = "os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])"


def run(script: str, region: str) -> list:
    """Seconds, seconds of processors, and what else the script tells."""
    done = subprocess.run([sys.executable, "-c", SETUP + script, region], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def main() -> None:
    print(f"\n### recommend, {os.cpu_count()} cores, medians of {RUNS} runs\n")
    print("| region | candidates | first | floor s | recommend s | over the floor | over the strict floor ", end="")
    print("| processor time over the floor | one core over two |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, region in REGIONS.items():
        rows = [(run(FLOOR, region), run(OURS, region), run(ONE_CORE + OURS, region)) for _ in range(RUNS)]
        ratios = [
            (floor[0], ours[0], ours[0] / floor[0], ours[0] / floor[2], ours[1] / floor[1], one[0] / ours[0])
            for floor, ours, one in rows
        ]
        figures = " | ".join(f"{statistics.median(column):.2f}" for column in zip(*ratios, strict=True))
        print(f"| {name} | {rows[0][0][3]} | {rows[0][1][2]} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
