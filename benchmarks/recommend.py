"""`recommend` against the bare cost of its candidates' transformers, in Markdown: `python benchmarks/recommend.py`.

The floor is what any tool must do that measures the same candidates with pyproj, in one process:
`CRS` and `Transformer.from_crs` for each. Every measurement runs in a process of its own, as PROJ
keeps what it has read of its database; processor time is that of all processes.
"""

import json
import os
import subprocess
import sys

REGIONS = {
    "Germany": "box:5.9,47.3,15.0,55.1",
    "Fiji": "box:177,-20,-178,-15",
    "Antarctica": "box:-180,-90,180,-60",
    "Chile": "box:-76,-56,-66,-17.5",
    "Berlin": "cap:13.4,52.5,20",
    "world": "globe",
}
RUNS = 3

SETUP = """
import json, os, sys, time
from projdist.probe import shares_within
from projdist.projections.database import crs_records
from projdist.recommend import recommend
from projdist.regions import get_region
from pyproj import CRS, Transformer
from pyproj.exceptions import ProjError
region = get_region(sys.argv[1])
def clock():
    return time.perf_counter(), sum(os.times()[:4])
"""
FLOOR = """
records = crs_records(["EPSG", "ESRI"])
codes = [r.code for r, s in zip(records, shares_within(region, [r.area_of_use for r in records])) if s >= 0.25]
start = clock()
for code in codes:
    crs = CRS.from_user_input(code)
    try:
        Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
    except ProjError:
        pass
end = clock()
print(json.dumps([end[0] - start[0], end[1] - start[1], len(codes)]))
"""
OURS = """
start = clock()
found = recommend(region)
end = clock()
print(json.dumps([end[0] - start[0], end[1] - start[1], found.results[0].code]))
"""


def run(script: str, region: str) -> list[float]:
    """Seconds, seconds of processors, and one thing more."""
    done = subprocess.run([sys.executable, "-c", SETUP + script, region], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def main() -> None:
    print(f"\n### recommend, {os.cpu_count()} cores, best of {RUNS} runs\n")
    print("| region | candidates | first | floor s | recommend s | ratio | processor time | ratio |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, region in REGIONS.items():
        pairs = [(run(FLOOR, region), run(OURS, region)) for _ in range(RUNS)]
        floor, ours = (min(pair[i] for pair in pairs) for i in (0, 1))
        cpu = [min(pair[i][1] for pair in pairs) for i in (0, 1)]
        print(
            f"| {name} | {floor[2]} | {ours[2]} | {floor[0]:.2f} | {ours[0]:.2f} | {ours[0] / floor[0]:.2f} "
            f"| {cpu[1]:.2f} | {cpu[1] / cpu[0]:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
