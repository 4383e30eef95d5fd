"""Matrices to be measured."""

import math

import numpy as np
from hypothesis import strategies as st

from projdist.matrices.measures import MEASURES, get_measure

RNG = np.random.default_rng(20240229)
MATRICES = RNG.normal(size=(500, 2, 2))
MATRICES = MATRICES[np.linalg.cond(MATRICES) < 100]
POINTWISE = [name for name, measure in MEASURES.items() if not measure.needs_hessian]
SECOND_ORDER = [name for name, measure in MEASURES.items() if measure.needs_hessian]
MIRROR = np.diag([1.0, -1.0])


def value(name, J, H=None):
    return get_measure(name)(J, H)


def rotation(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.moveaxis(np.array([[c, -s], [s, c]]), (0, 1), (-2, -1))


@st.composite
def jacobians(draw):
    """Invertible matrices of condition up to 1e4, mirrored ones too."""
    log_a, log_ratio = draw(st.floats(-5, 5)), draw(st.floats(0, 9))
    left, right = draw(st.floats(0, 2 * math.pi)), draw(st.floats(0, 2 * math.pi))
    sign = draw(st.sampled_from([1.0, -1.0]))
    scales = np.diag([math.exp(log_a), sign * math.exp(log_a - log_ratio)])
    return rotation(left) @ scales @ rotation(right)
