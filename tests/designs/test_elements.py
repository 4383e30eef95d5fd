"""Newton's method on elements: figures that another program found on the same triangles, and exact derivatives."""

import numpy as np
import pytest
from triangles import elements_and_start

from projdist.designs.newton import minimise_elements
from projdist.matrices import EXPONENT, Energy

# Root mean energy and Airy-Kavrayskiy error of the world cut along a meridian, on 2 n^2 triangles of a quarter of the
# sphere, by an independent prototype, to five decimals.
PUBLISHED = {6: (0.37610, 0.36393), 12: (0.35506, 0.34193), 24: (0.34679, 0.33285), 48: (0.34340, 0.32903)}
PRINTED = 6e-6
TRUNCATED = 1e-8  # of central differences with a step of 1e-5, the third derivatives being some ten times the values
EXPONENTIATED = Energy(exponent=EXPONENT)


@pytest.mark.slow
@pytest.mark.parametrize("n", PUBLISHED)
def test_known_energies(n: int) -> None:
    """To the last decimal."""
    elements, start = elements_and_start(n)
    found = minimise_elements(EXPONENTIATED, elements, start)
    airy_kavrayskiy = np.sqrt(elements.mean(Energy(), found.place))
    assert (np.sqrt(found.energy), airy_kavrayskiy) == pytest.approx(PUBLISHED[n], abs=PRINTED)


def test_derivatives() -> None:
    """The slope and the Hessian are those of differences."""
    elements, start = elements_and_start(3)
    expansion = EXPONENTIATED.expansion(elements.jacobians(start))
    slope, band = elements.slope(expansion), elements.hessian(expansion, projected=False)
    width = len(band) - 1
    full = np.zeros((elements.count, elements.count))
    for k in range(width + 1):
        above = np.diag(band[width - k, k:], k)
        full += above + (above.T if k else 0.0)
    for unit, row, by in zip(np.eye(elements.count), full, slope, strict=True):
        ahead, behind = start + 1e-5 * unit, start - 1e-5 * unit
        rise = elements.mean(EXPONENTIATED, ahead) - elements.mean(EXPONENTIATED, behind)
        assert rise / 2e-5 == pytest.approx(by, abs=TRUNCATED)
        slopes = [elements.slope(EXPONENTIATED.expansion(elements.jacobians(at))) for at in (ahead, behind)]
        assert (slopes[0] - slopes[1]) / 2e-5 == pytest.approx(row, rel=TRUNCATED, abs=TRUNCATED)


def test_a_start_that_folds_is_refused() -> None:
    elements, start = elements_and_start(3)
    with pytest.raises(ValueError, match="Invalid start of a map"):
        minimise_elements(EXPONENTIATED, elements, start[::-1].copy())
