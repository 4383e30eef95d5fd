"""Objectives: their best scales are best, and their figures are those of the cubature."""

from dataclasses import replace

import numpy as np
import pytest

from projdist import OBJECTIVES, Objective, get_objective, summarize
from projdist.field.at_nodes import nodes_of
from projdist.matrices import measures
from projdist.projections import Projection
from projdist.regions import Box

RNG = np.random.default_rng(3)
A = np.exp(RNG.normal(0.1, 0.2, 50))
B = A * np.exp(-RNG.random(50))
W = RNG.random(50)
W /= W.sum()


@pytest.mark.parametrize("name", OBJECTIVES)
def test_the_best_scale_is_best(name: str) -> None:
    """No scale near the closed-form one is better, and on either side the objective grows."""
    objective = get_objective(name)
    best = objective.scale(A, B, W)

    def value(scale: float) -> float:
        return objective.value(objective.terms(A, B, W, scale))

    if name in ("angular_distortion", "max_omega", "mean_omega", "airy_kavrayskiy_scaled"):
        assert value(0.5) == value(2.0)  # they do not know the scale
        return
    around = [value(best * factor) for factor in (0.9, 0.99, 0.9999, 1.0, 1.0001, 1.01, 1.1)]
    assert min(around) == around[3]
    assert around[:4] == sorted(around[:4], reverse=True)
    assert around[3:] == sorted(around[3:])


@pytest.mark.parametrize("name", OBJECTIVES)
def test_figures_are_those_of_the_cubature(name: str) -> None:
    """The nodes and the adaptive cubature agree on a smooth map; maxima on the nodes' edges."""
    objective = get_objective(name)
    projection, region = Projection.from_user_input("+proj=aeqd +lat_0=5 +lon_0=3 +R=6371000"), Box(0, 0, 20, 30)
    nodes = nodes_of(region, projection.ellipsoid, 400, edges=True)
    a, b = np.moveaxis(measures.principal_scales(nodes.jacobian(projection)[0]), -1, 0)
    found = objective.value(objective.terms(a, b, nodes.weight, 1.0))
    summary = summarize(projection, region, measures=[objective.figure.measure])
    (statistics,) = summary.measures.values()
    assert found == pytest.approx(getattr(summary, name, getattr(statistics, objective.figure.statistic)), rel=1e-6)


@pytest.mark.parametrize("name", [name for name, one in OBJECTIVES.items() if one.figure.is_maximum])
@pytest.mark.parametrize("free", [False, True])
def test_extremes_order_maps_as_the_figure_does(name: str, free: bool) -> None:
    """Of many maps the one with the least sum of extremes has the least figure, as it is or at its best scale."""
    objective = get_objective(name)
    maps = [(np.exp(RNG.normal(0.0, 0.02, 50)), RNG.uniform(0.9, 1.0, 50)) for _ in range(30)]
    pairs = []
    for a, ratio in maps:
        b = a * ratio
        scale = objective.scale(a, b, W) if free else 1.0
        figure = objective.value(objective.terms(a, b, W, scale))
        pairs.append((objective.extremes(a, b, free).max(axis=-1).sum(), figure))
    assert [figure for _, figure in sorted(pairs)] == sorted(figure for _, figure in pairs)


def test_maxima_have_extremes() -> None:
    """A maximum without them cannot be searched for."""
    one = OBJECTIVES["airy"]
    with pytest.raises(
        ValueError, match=r"^Invalid objective 'mine'. It must have extremes where its statistic is max"
    ):
        Objective(replace(one.figure, name="mine", statistic="max"), one.scale, one.terms)


def test_unknown_objectives() -> None:
    """An unknown name raises with what there is."""
    with pytest.raises(ValueError, match=r"Invalid criterion 'airykav'. Did you mean .*It must be one of airy_kavr"):
        get_objective("airykav")
    assert get_objective(OBJECTIVES["airy"]) is OBJECTIVES["airy"]
