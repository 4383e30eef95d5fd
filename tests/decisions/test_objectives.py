"""Objectives: their best scales are best, and their figures are those of the cubature."""

import numpy as np
import pytest
from tables import each

from projdist import FIGURES, Figure, get_figure, sample
from projdist.decisions.family_search import Objective
from projdist.field.given_fields import nodes_of
from projdist.projections import Projection
from projdist.regions import Box

RNG = np.random.default_rng(3)
A = np.exp(RNG.normal(0.1, 0.2, 50))
B = A * np.exp(-RNG.random(50))
W = RNG.random(50)
W /= W.sum()


def matrices(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """With principal scales a and b, turned every way."""
    angle = RNG.uniform(0.0, 2.0 * np.pi, a.size)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    return turn @ (np.stack([a, b], axis=-1)[:, :, None] * np.eye(2))


def squares(J: np.ndarray) -> np.ndarray:
    """A figure of a user."""
    return (np.linalg.det(J) - 1.0) ** 2


@each("criterion", [*FIGURES, squares])
def test_the_best_scale_is_best(criterion: object) -> None:
    """No scale near the closed-form one is better, and on either side the objective grows."""
    objective, J = Objective(get_figure(criterion)), matrices(A, B)
    best = objective.scale(J, W)

    def value(scale: float) -> float:
        return objective.value(objective.terms(J, W, scale))

    if objective.figure.aspect == "angles" or objective.figure.version:
        assert value(0.5) == pytest.approx(value(2.0), rel=1e-12)  # they do not know the scale
        return
    around = [value(best * factor) for factor in (0.9, 0.99, 0.9999, 1.0, 1.0001, 1.01, 1.1)]
    assert min(around) == around[3]
    assert around[:4] == sorted(around[:4], reverse=True)
    assert around[3:] == sorted(around[3:])


@each("name", FIGURES)
def test_other_names_have_the_same_scale(name: str) -> None:
    """A figure of a user that is one of ours is searched as ours is; one that is not is not, whatever it is called."""
    ours, J = FIGURES[name], matrices(A, B)
    same = Figure(name="own", measure=ours.measure, statistic=ours.statistic, version=ours.version)
    assert Objective(same).scale(J, W) == Objective(ours).scale(J, W)
    other = Figure(name=name, measure=squares, statistic="mean")
    assert Objective(other).scale(J, W) == Objective(get_figure(squares)).scale(J, W)


@each("name", FIGURES)
def test_figures_are_those_of_the_cubature(name: str) -> None:
    """The nodes and the adaptive cubature agree on a smooth map; maxima on the nodes' edges."""
    objective = Objective(FIGURES[name])
    projection, region = Projection.from_user_input("+proj=aeqd +lat_0=5 +lon_0=3 +R=6371000"), Box(0, 0, 20, 30)
    nodes = nodes_of(region, projection.ellipsoid, 400, edges=True)
    found = objective.value(objective.terms(nodes.jacobian(projection)[0], nodes.weight, 1.0))
    field = sample(projection, region, measures=[objective.figure.measure])
    assert found == pytest.approx(field.figure(name).value, rel=1e-6)


@each("name", [name for name, one in FIGURES.items() if one.is_maximum])
@each("free", [False, True])
def test_extremes_order_maps_as_the_figure_does(name: str, free: bool) -> None:
    """Of many maps the one with the least sum of extremes has the least figure, as it is or at its best scale."""
    objective = Objective(FIGURES[name])
    maps = [(np.exp(RNG.normal(0.0, 0.02, 50)), RNG.uniform(0.9, 1.0, 50)) for _ in range(30)]
    pairs = []
    for a, ratio in maps:
        J = matrices(a, a * ratio)
        scale = objective.scale(J, W) if free else 1.0
        figure = objective.value(objective.terms(J, W, scale))
        pairs.append((objective.extremes(J, W, free).max(axis=-1).sum(), figure))
    assert [figure for _, figure in sorted(pairs)] == sorted(figure for _, figure in pairs)
