"""Maps made to measure: what they gain over the best member of PROJ's families, degree by degree, and what that costs.

    python benchmarks/designs.py

Times are processor seconds of the fit alone, the region's nodes and the base given; medians of three runs. Equal-area
maps are also fitted by SciPy's `least_squares` (MINPACK's, with the same terms and slopes), side by side.
"""

from __future__ import annotations

import functools
import statistics
import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares as scipys

from projdist import get_region, summarize
from projdist.designs import design, fits as equal_area_maps
from projdist.designs.base_maps import BaseNodes, DesignObjective, base_nodes_of, best_base, design_objective
from projdist.designs.fits import stage_of
from projdist.earth import WGS84
from projdist.field import nodes_of
from projdist.projections import Projection

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
    against_scipy(EQUAL_AREA)


def table(kind: str, criterion: str, regions: tuple[str, ...]) -> None:
    """A row a region: the figure by degree as `summarize` measures it, and the seconds of the fits."""
    heads = " | ".join(f"degree {degree} (s)" for degree in DEGREES)
    print(f"\n### {kind}, by {criterion}\n\n| region | best of the families | {heads} | less at {DEGREES[-1]} |")
    print(f"| --- | --- |{' --- |' * (len(DEGREES) + 1)}")
    for region in regions:
        base, nodes, objective = prepared(kind, criterion, region)
        cells, value = [], np.nan
        for degree in DEGREES:
            made = design(
                region, kind=kind, criterion=criterion, degree=degree, base=base, background=0.0, against=base
            )
            value, member = made.value, made.rivals[0].value
            if kind != "equal-area" and criterion == "airy_kavrayskiy":
                member = summarize(base, region).airy_kavrayskiy_scaled
            cells.append(f"{value:.5g} ({seconds(functools.partial(stage_of, nodes, objective, degree, (0.0,))):.2g})")
        print(
            f"| {region} | {member:.5g} | {' | '.join(cells)} | {100.0 * (1.0 - value / member):.0f} % |",
            flush=True,
        )


def prepared(kind: str, criterion: str, region: str) -> tuple[Projection, BaseNodes, DesignObjective]:
    """What a fit starts from: the best base, the region's nodes on it, and what is wished for."""
    nodes = nodes_of(get_region(region), WGS84, 3000, edges=True)
    objective = design_objective(kind, criterion)
    base = best_base(get_region(region), objective, nodes, "none")
    return base, base_nodes_of(base, nodes, None), objective


def fit_of(kind: str, criterion: str, region: str, degree: int) -> Callable[[], object]:
    """A fit alone, as `check.py` takes its time."""
    _, base_nodes, objective = prepared(kind, criterion, region)
    return functools.partial(stage_of, base_nodes, objective, degree, (0.0,))


def against_scipy(regions: tuple[str, ...]) -> None:
    """Equal-area fits by projdist's Levenberg-Marquardt and by SciPy's, of the same terms: figures, and times."""
    print("\n### equal-area, by projdist's least squares and by SciPy's\n")
    print("| region | degree | figure | SciPy's | s | SciPy's | ratio |\n| --- | --- | --- | --- | --- | --- | --- |")
    own = equal_area_maps.least_squares
    for region in regions:
        for degree in DEGREES:
            fit = fit_of("equal-area", "airy_kavrayskiy", region, degree)

            def theirs(fit: Callable[[], object] = fit) -> object:
                equal_area_maps.least_squares = _by_scipy
                try:
                    return fit()
                finally:
                    equal_area_maps.least_squares = own

            values = fit().value, theirs().value
            pairs = [(seconds(fit, 1), seconds(theirs, 1)) for _ in range(RUNS)]
            times = [statistics.median(column) for column in zip(*pairs, strict=True)]
            ratio = statistics.median(one / other for one, other in pairs)
            cells = [*(f"{value:.8g}" for value in values), *(f"{time:.2g}" for time in times), f"{ratio:.2f}"]
            print(f"| {region} | {degree} | {' | '.join(cells)} |", flush=True)


def _by_scipy(terms: Callable, start: np.ndarray) -> np.ndarray:
    """MINPACK's least squares; terms and slopes of a place are worked out once."""
    known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if place.tobytes() not in known:
            known.clear()
            known[place.tobytes()] = terms(place)
        return known[place.tobytes()]

    return scipys(lambda place: at(place)[0], start, jac=lambda place: at(place)[1], method="lm").x


def seconds(work: Callable[[], object], runs: int = RUNS) -> float:
    """The median of some runs."""
    times = []
    for _ in range(runs):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times)


if __name__ == "__main__":
    main()
