"""What maps keep, from matrices whose answers are known."""

import numpy as np
import pytest

from projdist.decisions.recommendation.purposes import PURPOSES, get_purpose, properties, suits

RNG = np.random.default_rng(5)
WEIGHTS = np.full(40, 1 / 40)


def turned(matrices):
    """Matrices times random rotations, which change no figure."""
    angle = RNG.uniform(0, 2 * np.pi, len(matrices))
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    return rotation @ matrices


def diagonal(a, b):
    J = np.zeros((len(a), 2, 2))
    J[:, 0, 0], J[:, 1, 1] = a, b
    return turned(J)


K = RNG.uniform(0.99, 1.02, 40)
FIELDS = {
    "conformal": (diagonal(K, K), ("conformal",)),
    "equal-area": (diagonal(K, 0.819 / K), ("equal-area",)),
    "equidistant": (diagonal(np.ones(40), K), ("equidistant",)),
    "true": (diagonal(np.ones(40), np.ones(40)), ("equal-area", "conformal", "equidistant")),
    "compromise": (diagonal(K, RNG.uniform(0.98, 0.985, 40)), ()),
}


@pytest.mark.parametrize("name", FIELDS)
def test_properties(name):
    """Equal-area is a constant areal scale, whatever it is; conformal a = b; equidistant a or b = 1 everywhere."""
    J, kept = FIELDS[name]
    assert properties(J, WEIGHTS) == kept


@pytest.mark.parametrize("error", [1e-9, 1e-5])
def test_tolerance(error):
    """A part in 1e9 is rounding, ten in a million is not."""
    J = diagonal(K * (1 + error * np.linspace(-1, 1, 40)), K)
    assert ("conformal" in properties(J, WEIGHTS)) == (error < 1e-6)


def test_purposes():
    """Each purpose takes what keeps it; a compromise keeps nothing, and any takes all."""
    for name in PURPOSES[1:-1]:
        assert suits(FIELDS[name][1], name)
        assert not suits((), name)
        assert not suits(FIELDS[name][1], "compromise")
    assert suits((), "compromise")
    assert suits((), "any")


def test_unknown_names():
    """One line, with what it may have been meant for."""
    with pytest.raises(ValueError, match=r"^Invalid purpose 'conformel'. Did you mean conformal\? It must be any"):
        get_purpose("conformel")
