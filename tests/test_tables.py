"""Tests of what runs the tests of tables."""

import pytest
from tables import each


@pytest.fixture
def most() -> int:
    return 2


def test_all_cases_run_and_those_that_fail_are_named(most: int) -> None:
    """Also where others fail before, in any way; in a table of pairs, and one of pairs with another."""
    done = []

    @each("factor", [1, 10])
    @each(("one", "other"), [(1, 2), (3, 4), (5, 6)])
    def test(one: int, other: int, factor: int, most: int) -> None:
        done.append((one * factor, other))
        if one == 5:
            pytest.fail("Five.")
        assert one < most

    with pytest.raises(BaseExceptionGroup, match=r"2 of 2 cases fail: 1\. {'factor': 1} 2\. {'factor': 10}") as caught:
        test(most=most)
    assert done == [(1, 2), (3, 4), (5, 6), (10, 2), (30, 4), (50, 6)]
    inner = caught.value.exceptions[1]
    assert "2 of 3 cases fail: 1. {'one': 3, 'other': 4} 2. {'one': 5, 'other': 6}" in str(inner)
    assert [type(error) for error in inner.exceptions] == [AssertionError, pytest.fail.Exception]


@each("value", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_slow_cases_are_another_test(value: int, request: pytest.FixtureRequest) -> None:
    assert (value == 2) == (request.node.get_closest_marker("slow") is not None)
