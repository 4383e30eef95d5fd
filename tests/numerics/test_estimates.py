"""Figures with their errors."""

import math

import pytest

from projdist.numerics import Estimate


def test_roots_keep_their_errors():
    """To first order half of the relative error; of nothing the root of it; what is not known stays unknown."""
    assert Estimate(4.0, 1e-9).root() == pytest.approx((2.0, 0.25e-9))
    assert Estimate(0.0, 1e-4).root() == pytest.approx((0.0, 1e-2))
    assert Estimate(-1e-20, 0.0).root() == (0.0, 0.0)
    assert Estimate(4.0, math.nan).root() == pytest.approx((2.0, math.nan), nan_ok=True)
    assert Estimate(math.inf, 0.0).root() == pytest.approx((math.nan, math.nan), nan_ok=True)
