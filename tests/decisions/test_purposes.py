"""What a map is asked to keep, and which maps serve."""

import pytest

from projdist.decisions.ranking import PURPOSES, get_purpose, suits


def test_purposes():
    """Each purpose takes what keeps it; a compromise keeps nothing, and any takes all."""
    for name in PURPOSES[1:-1]:
        assert suits((name,), name)
        assert not suits((), name)
        assert not suits((name,), "compromise")
    assert suits((), "compromise")
    assert suits((), "any")


def test_unknown_names():
    """One line, with what it may have been meant for."""
    with pytest.raises(ValueError, match=r"^Invalid purpose 'conformel'. Did you mean conformal\? It must be any"):
        get_purpose("conformel")
