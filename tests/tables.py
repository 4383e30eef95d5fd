"""Tables of cases, all of which one test runs: hundreds of tests of a millisecond cost as much for themselves."""

import functools
import inspect
import os
from collections.abc import Callable, Iterable
from typing import Any

import pytest

_LONGEST = 200  # characters of a case in a message


def some(cases: Iterable[Any], step: int, first: int = 0) -> list[Any]:
    """One in `step` of many cases that are alike, as CI has no hours; all if PROJDIST_ALL_CASES is set."""
    return [*cases][first :: 1 if os.environ.get("PROJDIST_ALL_CASES") else step]


def each(names: str | tuple[str, ...], cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """As pytest's `parametrize`, but within one test: all cases run, and those that fail are named with their errors.

    Cases that are marked as slow make another test. Fixtures are made once for all of them.
    """
    keys, rows = [name.strip() for name in names.split(",")] if isinstance(names, str) else [*names], [*cases]
    legs: dict[str, list[tuple[Any, ...]]] = {"fast": [], "slow": []}
    for row in rows:
        marks = {mark.name for mark in getattr(row, "marks", ())}
        assert marks <= {"slow"}, row
        values = row.values if hasattr(row, "marks") else row if len(keys) > 1 else (row,)
        legs["slow" if marks else "fast"].append(values)
    leg = f"leg_of_{keys[0]}"

    def folded(test: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(test)
        def run(**fixtures: Any) -> None:
            cases = legs[fixtures.pop(leg, "fast")]
            failed: dict[str, BaseException] = {}
            for case in cases:
                given = dict(zip(keys, case, strict=True))
                try:
                    test(**fixtures, **given)
                except (Exception, pytest.fail.Exception, BaseExceptionGroup) as error:  # noqa: BLE001 - told below, with the others
                    named = f"{len(failed) + 1}. {repr(given)[:_LONGEST]}"
                    error.add_note(f"Case {named}")
                    failed[named] = error
            if failed:
                said = f"{len(failed)} of {len(cases)} cases fail: {' '.join(failed)}"
                raise BaseExceptionGroup(said, [*failed.values()])

        parameters = inspect.signature(test).parameters
        assert set(keys) <= set(parameters), keys
        others = [one for name, one in parameters.items() if name not in keys]
        if not legs["slow"]:
            run.__signature__ = inspect.Signature(others)
            return run
        run.__signature__ = inspect.Signature([*others, inspect.Parameter(leg, inspect.Parameter.KEYWORD_ONLY)])
        return pytest.mark.parametrize(leg, ["fast", pytest.param("slow", marks=pytest.mark.slow)])(run)

    return folded
