"""What takes long tells how much of it is done."""

from collections.abc import Callable

import pytest

import projdist

AREA = "box:8,48,12,52"
CALLS: dict[str, Callable[[Callable[[int, int], object]], object]] = {
    "batch": lambda progress: projdist.batch(projdist.summarize, AREA, ["robin", "moll"], progress=progress),
    "compare": lambda progress: projdist.compare(["robin", "moll"], AREA, tolerance=1e-3, progress=progress),
    "mean_map": lambda progress: projdist.mean_map(["robin"], region=AREA, degree=1, progress=progress),
    "optimize": lambda progress: projdist.optimize("eqc", AREA, free=["lat_ts"], progress=progress),
    "world_map": lambda progress: projdist.world_map(cells=16, against=["robin"], progress=progress),
}


@pytest.mark.parametrize("name", CALLS)
def test_progress(name: str) -> None:
    """It rises from news to news, of one total, and never beyond it."""
    told: list[tuple[int, int]] = []
    CALLS[name](lambda done, total: told.append((done, total)))
    assert told
    assert len({total for _, total in told}) == 1
    done = [one for one, _ in told]
    assert done == sorted(set(done))
    assert 0 <= done[0] <= done[-1] <= told[0][1]
