"""Criteria against hand-worked numbers, repetition of values by their weights, and numpy."""

import math
import re

import numpy as np
import pytest
import shapely
from refusals import refuses
from tables import each

import projdist
from projdist import Estimate
from projdist.numerics.statistics import CRITERIA, get_criterion, quantile, quantiles

VALUES = np.array([4.0, 1.0, 3.0, 1.0])
WEIGHTS = np.array([1.0, 2.0, 3.0, 2.0])
# By hand: the sum of weights is 8, of w v 17, of w v^2 47.
KNOWN = {"mean": 17 / 8, "rms": math.sqrt(47 / 8), "std": math.sqrt(47 / 8 - (17 / 8) ** 2), "max": 4.0, "min": 1.0}
# Middles of the weights: 1 at 1 and 3, 3 at 5.5, 4 at 7.5 of 8; the half, 4, is 1 / 2.5 of the way from 3 to 5.5; 95 %
# are 7.6, which is beyond the last middle.
KNOWN |= {"median": 1 + 2 * (4 - 3) / 2.5, "p75": 3 + (6 - 5.5) / 2, "p95": 4.0}


def test_known_values():
    """Each criterion of four weighted numbers is what comes out by hand; a function of both is a criterion itself."""
    assert get_criterion(np.average) is np.average
    assert {name: get_criterion(name)(VALUES, WEIGHTS) for name in KNOWN} == pytest.approx(KNOWN, rel=1e-14)


@each("name", CRITERIA)
def test_laws_of_all(name):
    """Neither unit nor order nor shape nor what is undefined or has no weight counts; a constant is what it is."""
    criterion = get_criterion(name)
    truth = criterion(VALUES, WEIGHTS)
    assert criterion(VALUES, 1e12 * WEIGHTS) == pytest.approx(truth, rel=1e-13)
    assert criterion(VALUES.reshape(2, 2)[::-1, ::-1], WEIGHTS[::-1]) == pytest.approx(truth, rel=1e-14)
    assert criterion(np.append(VALUES, [np.nan, 1e6]), np.append(WEIGHTS, [5.0, 0.0])) == truth
    assert math.isnan(criterion(np.array([np.nan]), np.array([1.0])))
    assert criterion(np.full(7, 2.5), np.arange(1.0, 8.0)) == pytest.approx(0.0 if name == "std" else 2.5)
    sizes = r"^Invalid weights of size 2\. There must be one for each of 3 values\.$"
    refuses(sizes, criterion, np.ones(3), np.ones(2))
    over_polygon, means = (
        (np.array([1.0, 2.0]), np.array([-1.0, 3.0])),
        {"mean": 2.5, "rms": math.sqrt(5.5), "std": math.nan},
    )
    if name in means:  # by hand
        with np.errstate(invalid="ignore"):
            assert criterion(*over_polygon) == pytest.approx(means[name], nan_ok=True)
    else:
        refuses(r"^Invalid weight '-1'", criterion, *over_polygon)


def test_weights_are_repetitions():
    """Whole weights count like repeated values; a small spread about a large mean keeps its digits."""
    rng = np.random.default_rng(2)
    values, count = rng.normal(size=50), rng.integers(1, 6, size=50)
    for name, of in {"mean": np.mean, "std": np.std, "max": np.max, "min": np.min}.items():
        assert get_criterion(name)(values, count) == pytest.approx(of(np.repeat(values, count)), rel=1e-12)
    assert get_criterion("std")(1e9 + np.array([0.0, 1.0]), np.ones(2)) == pytest.approx(0.5, rel=1e-6)


def test_quantiles():
    """Weights shift them: values v in [0, 1] of weight 2 v have sqrt(q); they ascend from the least to the largest."""
    values = (np.arange(20_000) + 0.5) / 20_000
    for name, share in (("p5", 0.05), ("median", 0.5), ("p95", 0.95), ("p99.9", 0.999)):
        assert get_criterion(name)(values, 2 * values) == pytest.approx(math.sqrt(share), abs=1e-4)
    values, weights = np.random.default_rng(4).uniform(size=(2, 31))
    shares = np.linspace(0, 1, 41).tolist()
    found = quantiles(values, weights, shares)
    assert found == sorted(found) == [quantile(values, weights, share) for share in shares]
    assert (found[0], found[-1]) == (values.min(), values.max())


ALLOWED = (
    "It must be one of mean, rms, std, median, p95, max, min, pNN (see 'projdist list criteria'), "
    "or a function of values and weights."
)
HINTS = {"maen": "mean", "medain": "median or mean", "Med": "median", "MAX": "max"}


@each("name", [*HINTS, "p123", "p", "q50", "", 95, None, ["mean"]])
def test_what_is_no_criterion(name):
    """An unknown name, and what is neither a name nor a function, is refused with close matches and all that is."""
    hint = f"Did you mean {HINTS[name]}? " if str(name) in HINTS else ""
    text = f"Invalid criterion '{name}'. {hint}{ALLOWED}"
    refuses(f"^{re.escape(text)}$", get_criterion, name)


@pytest.mark.slow
def test_samples_over_polygons_make_means_and_no_quantiles():
    """Of 1 / cos(lat) over a triangle in longitude and latitude the mean is that of a fine grid."""
    found = projdist.sample("plate-carree", shapely.Polygon([(0, 10), (20, 10), (20, 40)]))
    assert (found.weight < 0).any()
    values = projdist.get_measure("s")(found.jacobian)
    lon, lat = np.meshgrid((np.arange(2000) + 0.5) / 100, 10 + (np.arange(3000) + 0.5) / 100)
    weight = np.cos(np.radians(lat)) * (lat - 10 < 1.5 * lon)
    truth = weight.astype(bool).sum() / weight.sum()  # of 1 / cos(lat) by area
    # The grid's steps along the slanting side: half a cell of 1 / 2000 of the width, averaged over 2000 columns.
    assert get_criterion("mean")(values, found.weight) == pytest.approx(truth, rel=1e-5)
    spread = np.sqrt(np.average((1 / np.cos(np.radians(lat)) - truth) ** 2, weights=weight))
    assert get_criterion("std")(values, found.weight) == pytest.approx(spread, rel=1e-4)
    for name in ("median", "p95", "p10", "max", "min"):
        said = r"^Invalid weight '-.*as those of samples over polygons are"
        refuses(said, get_criterion(name), values, found.weight)


def test_roots_keep_their_errors():
    """To first order half of the relative error; of nothing the root of it; what is not known stays unknown."""
    roots = {(4.0, 1e-9): (2.0, 0.25e-9), (0.0, 1e-4): (0.0, 1e-2), (-1e-20, 0.0): (0.0, 0.0)}
    roots |= {(4.0, math.nan): (2.0, math.nan), (math.inf, 0.0): (math.nan, math.nan)}
    for given, root in roots.items():
        assert Estimate(*given).root() == pytest.approx(root, nan_ok=True)
