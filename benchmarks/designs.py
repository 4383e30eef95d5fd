"""Maps made to measure: what they gain over the best member of PROJ's families, degree by degree, and what that costs.

    python benchmarks/designs.py

Times are processor seconds of the fit alone, the region's nodes and the base given; medians of three runs.
"""

from __future__ import annotations

import functools
import statistics
import time
from collections.abc import Callable

import numpy as np

from projdist import get_region, summarize
from projdist.designs.bases import best_base
from projdist.designs.degrees import stage_of
from projdist.designs.kinds import get_kind
from projdist.designs.making import design
from projdist.designs.sites import site_of
from projdist.designs.wishes import wish_of
from projdist.earth import WGS84
from projdist.field import nodes_of

GENERAL = (
    "country:US & box:-125,24,-66,50",
    "continent:Europe & box:-26,34,60,72",
    "country:CA",
    "continent:Africa",
)
CONFORMAL = (
    "country:NZ & box:166,-48,179,-34",
    "country:JP & box:128,30,146,46",
    "country:CL & box:-77,-57,-66,-17",
    "country:DE",
    "country:CH",
    "country:US & box:-125,24,-66,50",
)
EQUAL_AREA = GENERAL[:2] + GENERAL[3:]
DEGREES = (2, 4, 6, 8)
RUNS = 3


def main() -> None:
    """Print the tables in Markdown."""
    table("any", "airy_kavrayskiy", GENERAL)
    table("conformal", "max_scale_error_ppm", CONFORMAL)
    table("conformal", "airy_kavrayskiy", CONFORMAL)
    table("equal-area", "airy_kavrayskiy", EQUAL_AREA)


def table(kind: str, criterion: str, regions: tuple[str, ...]) -> None:
    """A row a region: the figure by degree as `summarize` measures it, and the seconds of the fits."""
    heads = " | ".join(f"degree {degree} (s)" for degree in DEGREES)
    print(f"\n### {kind}, by {criterion}\n\n| region | best of the families | {heads} | less at {DEGREES[-1]} |")
    print(f"| --- | --- |{' --- |' * (len(DEGREES) + 1)}")
    for region in regions:
        nodes = nodes_of(get_region(region), WGS84, 3000, edges=True)
        wanted, wish = get_kind(kind), wish_of(get_kind(kind), criterion, 0.5, None)
        base = best_base(wanted, get_region(region), wish, nodes, "none")
        site = site_of(base, nodes, None)
        cells, value = [], np.nan
        for degree in DEGREES:
            made = design(
                region, kind=kind, criterion=criterion, degree=degree, base=base, background=0.0, against=base
            )
            value, member = made.value, made.rivals[0].value
            if kind != "equal-area" and criterion == "airy_kavrayskiy":
                member = summarize(base, region).airy_kavrayskiy_scaled
            cells.append(
                f"{value:.5g} ({seconds(functools.partial(stage_of, site, wanted, wish, degree, (0.0,))):.2g})"
            )
        print(
            f"| {region} | {member:.5g} | {' | '.join(cells)} | {100.0 * (1.0 - value / member):.0f} % |",
            flush=True,
        )


def seconds(work: Callable[[], object]) -> float:
    """The median of some runs."""
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times)


if __name__ == "__main__":
    main()
