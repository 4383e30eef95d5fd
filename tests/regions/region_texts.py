"""What texts of regions stand for, and what is said of those that stand for none."""

import pytest

from projdist.regions import get_region


def refused(text):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 the texts are compared
        get_region(text)
    return str(caught.value)


def area(text):
    return get_region(text).area_km2
