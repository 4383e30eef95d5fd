"""What maps keep, and the figures to rank by, from matrices whose answers are known."""

import numpy as np
import pytest

from projdist.decisions.recommendation.rankings import PURPOSES, RANKINGS, get_purpose, get_ranking, properties, suits

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


def test_figures():
    """Every figure, rewritten for diagonal matrices."""
    a, b = RNG.uniform(1.0, 1.1, 40), RNG.uniform(0.9, 1.0, 40)
    weights = RNG.uniform(0, 1, 40)
    weights /= weights.sum()
    square, log_s = np.log(a) ** 2 + np.log(b) ** 2, np.log(a * b)
    omega = np.degrees(2 * np.arcsin((a - b) / (a + b)))
    ppm = 1e6 * np.maximum(a - 1, 1 - b)
    areal = 1e6 * np.abs(a * b - 1)
    expected = {
        "airy_kavrayskiy": np.sqrt(weights @ square),
        "airy_kavrayskiy_scaled": np.sqrt(weights @ square - (weights @ log_s) ** 2 / 2),
        "max_scale_error_ppm": ppm.max(),
        "mean_scale_error_ppm": weights @ ppm,
        "max_omega": omega.max(),
        "mean_omega": weights @ omega,
        "max_areal_error_ppm": areal.max(),
        "mean_areal_error_ppm": weights @ areal,
    }
    J = diagonal(a, b)
    for name, value in expected.items():
        np.testing.assert_allclose(RANKINGS[name](J, weights), value, rtol=1e-9, err_msg=name)


def test_affine_figure():
    """One linear map for all has no affine error, and the affine figure is never above the scaled one."""
    J = np.tile(np.array([[1.3, 0.2], [0.1, 0.8]]), (40, 1, 1)) @ turned(np.tile(np.eye(2), (40, 1, 1)))
    assert RANKINGS["airy_kavrayskiy_affine"](J, WEIGHTS) < 1e-7
    J = diagonal(RNG.uniform(1.0, 1.2, 40), RNG.uniform(0.9, 1.0, 40))
    assert RANKINGS["airy_kavrayskiy_affine"](J, WEIGHTS) <= RANKINGS["airy_kavrayskiy_scaled"](J, WEIGHTS) + 1e-12


def test_unknown_names():
    """One line, with what it may have been meant for."""
    with pytest.raises(
        ValueError, match=r"^Invalid criterion 'max_omga'. Did you mean max_omega.*\? It must be one of airy"
    ):
        get_ranking("max_omga")
    with pytest.raises(ValueError, match=r"^Invalid purpose 'conformel'. Did you mean conformal\? It must be any"):
        get_purpose("conformel")
