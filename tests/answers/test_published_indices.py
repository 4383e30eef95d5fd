"""The published indices as means by adaptive quadrature, their best scales by a search; `test_published` has tables."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
from gis_files import some_slow
from refusals import refuses
from scipy.special import ellipe
from tables import each

from projdist import FIGURES, Projection, distance_distortion, sample
from projdist.answers import index_terms as terms
from projdist.answers.index_terms import ScaleField, boundary_cuts
from projdist.answers.published_indices import GROUPS, INDICES, NORMALISERS, get_indices, goldberg_gott_score, indices
from projdist.projections import compose
from projdist.regions import GLOBE, get_region
from projdist.support import Estimate

HALF_PI = math.pi / 2
MEAN = 3e-6  # The cubature resolves means to 1e-6 and says so; roots of small means lose no more than that here.
KINKED = 3e-5  # Panels are split at the kinks of a scale near the best, of which the best may move away.


def sec(x):
    return 1 / math.cos(x)


BELT, CAP = "box:-180,-60,180,60", "cap:0,90,10007.557221"
MAPS = {  # (projection, region): h, k, density, end; of azimuthal maps scales along and across, by the distance
    ("+proj=eqc +R=1", BELT): (lambda _: 1.0, sec, math.cos, math.pi / 3),
    ("+proj=merc +R=1", BELT): (sec, sec, math.cos, math.pi / 3),
    ("+proj=cea +R=1", BELT): (math.cos, sec, math.cos, math.pi / 3),
    ("+proj=aeqd +lat_0=90 +R=1", CAP): (lambda _: 1.0, lambda c: c / math.sin(c), math.sin, HALF_PI),
    ("+proj=stere +lat_0=90 +R=1", CAP): (lambda c: sec(c / 2) ** 2, lambda c: sec(c / 2) ** 2, math.sin, HALF_PI),
}

# The equidistant cylindrical map's scales h, k differ by the most: for it alone, all indices.
ONE_IS_FAST = some_slow(MAPS, {*MAPS} - {("+proj=eqc +R=1", BELT)})


def mean(term, h, k, density, end):
    """The mean of term(a, b) by true area."""

    def weighted(x):
        scales = h(x), k(x)
        return term(max(scales), min(scales)) * density(x)

    return (
        scipy.integrate.quad(weighted, 0, end, epsabs=1e-12, epsrel=1e-12, limit=400)[0]
        / scipy.integrate.quad(density, 0, end)[0]
    )


def directions(term, a, b):
    """The mean over all directions of a function of the scale."""
    angle = (np.arange(400) + 0.5) * HALF_PI / 400
    return float(np.mean(term(np.hypot(a * np.cos(angle), b * np.sin(angle)))))


ln = math.log
MEANS = {  # index: (root of it or not, the term)
    "airy": (True, lambda a, b: ((a - 1) ** 2 + (b - 1) ** 2) / 2),
    "airy_balance": (True, lambda a, b: ((a / b - 1) ** 2 + (a * b - 1) ** 2) / 2),
    "jordan": (True, lambda a, b: (a * a + b * b) / 2 - 4 / math.pi * a * ellipe(1 - (b / a) ** 2) + 1),
    "jordan_kavrayskiy": (True, lambda a, b: directions(lambda m: np.log(m) ** 2, a, b)),
    "airy_kavrayskiy": (True, lambda a, b: ln(a) ** 2 + ln(b) ** 2),
    "airy_kavrayskiy_half": (True, lambda a, b: (ln(a) ** 2 + ln(b) ** 2) / 2),
    "airy_kavrayskiy_double": (True, lambda a, b: ln(a / b) ** 2 + ln(a * b) ** 2),
    "klingatsch_angles": (True, lambda a, b: (2 * ln(a / b) ** 2 + ln(a * b) ** 2) / 3),
    "klingatsch_areas": (True, lambda a, b: (ln(a / b) ** 2 + 2 * ln(a * b) ** 2) / 3),
    "canters_ab": (False, lambda a, b: (max(a, 1 / a) + max(b, 1 / b)) / 2 - 1),
    "canters_ar": (False, lambda a, b: max(a * b, 1 / (a * b)) - 1),
    "canters_an": (False, lambda a, b: 2 * math.degrees(math.asin((a - b) / (a + b)))),
    "francula": (True, lambda a, b: ((a - 1) ** 2 + (b - 1) ** 2) / 2),
    "kunimune_shape": (False, lambda a, b: ln(a / b)),
    "isotropy": (True, lambda a, b: ln(a / b) ** 2),
}


def mean_index(name, scales, scale=1.0):
    root, term = MEANS[name]
    value = mean(lambda a, b: term(scale * a, scale * b), *scales)
    return math.sqrt(max(value, 0.0)) if root else value


@each("key", ONE_IS_FAST)
def test_means_at_the_nominal_and_at_the_best_scale(key):
    """Each index is its textbook integral; at the best scale, the least that a search finds."""
    found = indices(*key, names=MEANS)
    for name in MEANS:
        value = found[name]
        # The root of a mean of zero, on maps that an index calls perfect, is the root of rounding.
        assert value.value == pytest.approx(mean_index(name, MAPS[key]), abs=MEAN), name
        if INDICES[name].best_scale is None:
            assert (value.best, value.best_scale) == (value.value, 1.0)
            continue
        search = scipy.optimize.minimize_scalar(
            lambda x, name=name: mean_index(name, MAPS[key], math.exp(x)), bounds=(-1.5, 1.5), method="bounded"
        )
        assert value.best == pytest.approx(search.fun, abs=KINKED if INDICES[name].kinked else MEAN), name
        assert value.best <= value.value + MEAN


@each("key", ONE_IS_FAST)
def test_deviations_and_extremes(key):
    """The standard deviation of ln s, and the largest scale over the smallest, in the ends of monotonic scales."""
    h, k, _, end = MAPS[key]
    found = indices(*key, names=["area", "kunimune_area", "chebyshev", "milnor", "chebyshev_ratio"])
    level = mean(lambda a, b: ln(a * b), *MAPS[key])
    square = mean(lambda a, b: ln(a * b) ** 2, *MAPS[key])
    assert found["A"].value == pytest.approx(math.sqrt(max(square - level**2, 0)), abs=MEAN)
    assert found["kunimune_area"] == found["A"]
    logs = [ln(scale) for scale in (h(1e-9), k(1e-9), h(end), k(end))]
    reach = max(logs) - min(logs)  # of azimuthal equidistant caps that of Milnor, the least of all maps
    assert found["chebyshev_ratio"].value == pytest.approx(math.exp(reach), rel=1e-6)
    values = found["milnor"].value, found["chebyshev"].value, found["chebyshev"].best
    assert values == pytest.approx((reach, max(map(abs, logs)), reach / 2), abs=1e-6)


@pytest.mark.slow
def test_closed_forms_of_the_plate_carree():
    """I, A, F, S, Dab, Dar, mean |ln(a/b)| and Q of the plate carree's globe are elementary; Airy's error diverges."""
    found = indices("plate-carree", names=["goldberg-gott", "canters", "kunimune", "capek", "airy", "milnor"])
    # Means of sec - 1 over the sphere are pi / 2 - 1.
    truths = {"A": math.sqrt(1 - math.pi**2 / 12), "Dar": HALF_PI - 1, "Dab": (HALF_PI - 1) / 2}
    truths |= {"I": math.sqrt(2 - 2 * ln(2) + ln(2) ** 2 - math.pi**2 / 12), "kunimune_shape": 1 - ln(2)}
    assert {name: found[name].value for name in truths} == pytest.approx(truths, abs=MEAN)
    assert [found[symbol].value for symbol in "FS"] == pytest.approx([2 / math.pi] * 2, abs=1e-5)
    # s = sec <= 1.5 is the stricter limit: sin(arccos(2/3)) of the sphere. The lattice of points is good to 0.01 %.
    assert found["Q"].value == pytest.approx(100 * math.sqrt(5) / 3, abs=0.02)
    # With pole lines the largest scale has no bound, which is null in JSON.
    assert math.isnan(found["airy"].value)
    assert found["milnor"].value == math.inf
    assert found.to_dict()["indices"]["milnor"]["value"] is None
    # The score is that of its figures, with an error that all of theirs may make; without one of them there is none.
    assert found["score"].value == goldberg_gott_score({symbol: found[symbol].value for symbol in "IAFSDB"})
    up = {symbol: found[symbol].value + found[symbol].error for symbol in "IAFSDB"}
    assert found["score"].error == pytest.approx(goldberg_gott_score(up) - found["score"].value, rel=1e-3)
    # Half of a globe has no cuts of its own.
    assert math.isnan(indices("plate-carree", "box:-180,0,180,90", "score")["score"].value)


@pytest.mark.slow
def test_closed_forms_of_the_equal_area_azimuthal():
    """I of Lambert's map is sqrt(2), its F 1; Q the cap with omega <= 40 degrees, areas being true."""
    found = indices("+proj=laea +lat_0=90 +R=1", names=["I", "A", "flexion", "capek", "capek_nominal"], tolerance=1e-6)
    assert found["I"].value == pytest.approx(math.sqrt(2), abs=MEAN)
    assert [found[symbol].value for symbol in "AF"] == pytest.approx([0, 1], abs=1e-5)
    # tan(omega / 4 + 45 degrees) = sqrt(a / b) = sec(c / 2), and the cap's share is sin^2(c / 2).
    share = 100 * (1 - math.tan(math.radians(40 / 4 + 45)) ** -2)
    assert [found[name].value for name in ("capek_nominal", "Q")] == pytest.approx([share] * 2, abs=0.1)


def test_the_registry_is_complete():
    """Each index says what it is, how it is normalised, and where from; Goldberg and Gott's are of |lat| <= 88."""
    assert list(GROUPS) == list(dict.fromkeys(index.group for index in INDICES.values()))
    for name, index in INDICES.items():
        assert index.name == name
        assert index.definition.endswith(".")
        assert all((index.normalisation, index.source, index.symbol, index.scale_dependence)), name
    symbols = [index.symbol for index in INDICES.values()]
    assert len({*symbols, *INDICES}) == len(symbols) + len(INDICES)
    parts = {name: index.published_over for name, index in INDICES.items() if index.published_over}
    assert parts == dict.fromkeys(("isotropy", "area", "flexion", "skewness", "goldberg_gott_score"), "|lat| <= 88")


def test_names_symbols_and_groups():
    assert [index.symbol for index in get_indices("goldberg-gott")] == [*"IAFSDB", "score"]
    chosen = [index.name for index in get_indices(["I", "isotropy", "canters"])]
    assert chosen == ["isotropy", "canters_ab", "canters_ar", "canters_an"]
    assert len(get_indices()) == len(INDICES)
    refuses(r"Invalid index 'goldberg'\. Did you mean goldberg-gott", get_indices, ["goldberg"])


class Known:
    """A field of which some means and extremes are known, with their errors."""

    def __init__(self, means, largest=None, smallest=None, dense=None):
        self.means, self.largest, self.smallest, self.dense = means, largest, smallest, dense

    def mean(self, term, scale=1.0):
        """As it is known."""
        return self.means[term]

    once = mean


def test_errors_are_what_errors_of_parts_make():
    """Of figures made of others, each off by its error; to first order, as errors are small."""
    level, square = Estimate(0.3, 1e-7), Estimate(0.4, 2e-7)
    found = terms.deviation_of_log_area(Known({terms.log_area: level, terms.log_area_squared: square}), 1.0)
    furthest = math.sqrt(0.4 + 2e-7 - (0.3 - 1e-7) ** 2)
    assert found.value == pytest.approx(math.sqrt(0.31), rel=1e-12)
    assert found.error == pytest.approx(furthest - found.value, rel=1e-5)
    largest, smallest = Estimate(3.0, 3e-7), Estimate(0.2, 1e-7)
    furthest = (3.0 + 3e-7) / (0.2 - 1e-7)
    found = terms.scale_ratio(Known({}, largest, smallest), 1.0)
    assert (found.value, found.error) == (pytest.approx(15.0), pytest.approx(furthest - 15.0, rel=1e-5))
    found = terms.log_scale_ratio(Known({}, largest, smallest), 1.0)
    assert (found.value, found.error) == (pytest.approx(ln(15.0)), pytest.approx(ln(furthest / 15.0), rel=1e-5))
    # Canters' mean factor of Peters' index.
    field = Known({terms.pairs: [Estimate(0.5, 1e-3), Estimate(0.2, 1e-7), Estimate(0.1, 0.0)]})
    found = terms.finite_scale_factor(field, 1.0)
    assert found.value == pytest.approx(1.5)
    assert found.error == pytest.approx((1.2 + 1e-7) / (0.8 - 1e-7) - 1.5, rel=1e-5)
    assert terms.BEST_SCALES["distances"](field) == pytest.approx(math.exp(0.1))


def test_shares_near_nominal():
    """Four places: a good one, one turned out of shape, one too large, and one that is only too large for the scale."""
    a, b = np.array([1.0, 3.0, 2.0, 1.2]), np.array([1.0, 0.5, 1.0, 1.2])
    field = Known({}, dense=(a, b, np.array([0.1, 0.2, 0.3, 0.4])))
    assert terms.share_near_nominal(field, 1.0).value == pytest.approx(50.0)
    # Areas are larger by the square of the scale: 1.44 and 2.07.
    assert terms.share_near_nominal(field, 1.2).value == pytest.approx(10.0)
    # And smaller: 0.64, 1.28 with an omega of 39 degrees, 0.92.
    assert terms.share_near_nominal(field, 0.8).value == pytest.approx(70.0)
    # The best scale: the middle of areas that lie within a factor of 2.25 of each other where angles are not far off.
    areas, weights = np.array([1.0, 2.0, 2.2, 9.0, 12.0, 1.5]), np.array([0.1, 0.2, 0.2, 0.25, 0.2, 0.05])
    a, b = np.sqrt(areas) * [[1, 1, 1, 1, 12**0.5, 1], [1, 1, 1, 1, 12**-0.5, 1]]  # one out of shape
    field = Known({}, dense=(a, b, weights))
    # 0.55 of the weight is within 1 and 2.2, which become 1 / 1.48 and 1.48.
    assert terms.best_for_share(field) == pytest.approx(2.2**-0.25)
    best = terms.share_near_nominal(field, terms.best_for_share(field)).value
    assert best == pytest.approx(55.0)
    assert max(terms.share_near_nominal(field, scale).value for scale in np.geomspace(0.2, 2.0, 400)) == best
    assert math.isnan(terms.best_for_share(Known({}, dense=(np.full(2, 9.0), np.ones(2), np.full(2, 0.5)))))


def test_the_score(monkeypatch):
    """The plate carree's own row has one for each figure; there must be all six, and all of their errors add to its."""
    assert goldberg_gott_score(NORMALISERS) == 6.0
    assert goldberg_gott_score(NORMALISERS | {"D": 0.898}) == pytest.approx(9.0)
    refuses("D is missing", goldberg_gott_score, dict.fromkeys("IAFSB", 1))
    # The error is what the score gains when all are larger by their errors, but for these errors' squares.
    values = {symbol: 0.3 + 0.1 * k for k, symbol in enumerate("IAFSDB")}
    errors = {symbol: 1e-7 * (k + 1) for k, symbol in enumerate("IAFSDB")}
    figures = {symbol: lambda *_, s=symbol: Estimate(values[s], errors[s]) for symbol in values}
    monkeypatch.setattr("projdist.answers.published_indices._SCORE", figures)
    found = INDICES["goldberg_gott_score"].value(ScaleField(None, None, None), 1.0)
    up = goldberg_gott_score({symbol: values[symbol] + errors[symbol] for symbol in values})
    assert found.value == goldberg_gott_score(values)
    assert found.error == pytest.approx(up - found.value, rel=1e-5)


@pytest.mark.slow
def test_distances_are_those_of_the_library():
    """D is `distance_distortion`, and scale-free; Peters' and Canters' indices of a scaled small map are elementary."""
    d = indices("mollweide", names="D")["D"].value
    assert d == pytest.approx(distance_distortion("mollweide").value, rel=1e-12)
    local = Projection.from_user_input("+proj=aeqd +lon_0=10 +lat_0=20 +R=6371008.7714")
    twice = compose(local, 2.0 * np.eye(2), "twice as large")
    found = indices(twice, "cap:10,20,20", ["D", "finite"], tolerance=1e-4)
    small = 4e-6  # (20 km / R)^2
    assert [found[name].value for name in ("D", "DI", "bend")] == pytest.approx([0, 1 / 3, 0], abs=small)
    assert [found["K1"].value, found["K1"].best] == pytest.approx([2, 1], abs=4 * small)
    assert found["DI"].best == pytest.approx(0, abs=small)
    assert found["DI"].best_scale == found["K1"].best_scale == pytest.approx(0.5, abs=small)


LOBES = {  # by south and north: west, east and central meridian of the interrupted Mollweide map's
    (0, 90): [(-180, -40, -100), (-40, 180, 30)],
    (-90, 0): [(-180, -100, -160), (-100, -20, -60), (-20, 80, 20), (80, 180, 140)],
}


@pytest.mark.slow
def test_an_interrupted_map_is_the_mean_of_its_lobes():
    """Along cuts and where lobes meet nothing is added: F and S of the interrupted map are those of its lobes."""
    truths = np.zeros(2)
    for (south, north), lobes in LOBES.items():
        for west, east, lon in lobes:
            lobe = indices(f"+proj=moll +lon_0={lon} +R=1", f"box:{west},{south},{east},{north}", [*"FS"])
            truths += [(east - west) * lobe[symbol].value / 720 for symbol in "FS"]
    whole = indices("+proj=imoll +R=1", names=[*"FS"])
    # Means of second derivatives are good to 1e-5.
    assert [whole[symbol].value for symbol in "FS"] == pytest.approx(truths, abs=3e-5)


@each("name", some_slow(["cea", "eckert-4", "mollweide"], {"eckert-4", "mollweide"}))
def test_equal_area_maps_have_no_deviation_of_areas(name):
    """The deviation of ln s of an equal-area map is 0 to rounding, without a warning of what PROJ does at poles."""
    found = indices(name, names=["kunimune", "canters", "capek", "francula"])
    assert found["sd ln s"].value == 0.0
    assert found["sd ln s"].error < 2e-4
    assert found["canters_ar"].value == pytest.approx(0.0, abs=1e-6)


def test_cuts_are_of_the_globe():
    """Over a box, and on a map of a part of the globe, there is no B, and nothing is looked for."""
    mercator = Projection.from_user_input("mercator")
    for region, coverage in ((get_region("box:0,0,10,10"), 1.0), (GLOBE, 0.5)):
        assert np.isnan(boundary_cuts(ScaleField(mercator, region, SimpleNamespace(coverage=coverage)), 1.0)).all()


def test_names_are_those_of_figures():
    """An index with the name of a figure is that figure, of the field that all figures are of."""
    belt, same = "box:-20,0,20,60", [name for name in INDICES if name in FIGURES]
    found = indices("eck4", belt, [*(INDICES[name].symbol for name in same), "canters_an", "I"])
    # A row has a column a figure, JSON the same names.
    (row,) = found._table()
    assert {"isotropy", "isotropy_error", "canters_an_best_scale"} <= set(row)
    assert set(found.to_dict()["indices"]["isotropy"]) == {"value", "error", "best", "best_error", "best_scale"}
    field = sample("eck4", belt, measures=[figure.measure for figure in FIGURES.values()])
    assert len(same) >= 9
    for name in same:
        assert INDICES[name].figure is FIGURES[name]
        assert found[name].value == pytest.approx(field.figure(name).value, rel=1e-5), name
    assert found["canters_an"].value == pytest.approx(field.figure("mean_omega").value, rel=1e-5)
