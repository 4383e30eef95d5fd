"""Pages have their turns, whatever each of them asks for."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from projdist.web.live.worker import MOST_OF_ALL, MOST_OF_PAGE, RequestQueue, TooManyRequests


def filled(sizes: dict[str, int]) -> RequestQueue[tuple[str, int]]:
    """RequestQueue in which pages have so many tasks, of which each knows its page and its number."""
    turns: RequestQueue[tuple[str, int]] = RequestQueue(100)
    for page, count in sizes.items():
        for number in range(count):
            turns.put(page, number, (page, number))
    return turns


def served(turns: RequestQueue[tuple[str, int]]) -> list[tuple[str, int]]:
    """All tasks in their order."""
    return [turns.next() for _ in range(len(turns))]


def test_pages_are_served_in_turn() -> None:
    """Each in its own order."""
    assert served(filled({"a": 3, "b": 1, "c": 2})) == [("a", 0), ("b", 0), ("c", 0), ("a", 1), ("c", 1), ("a", 2)]


@given(st.dictionaries(st.sampled_from("abcdefgh"), st.integers(1, MOST_OF_PAGE), min_size=2), st.data())
def test_nobody_waits_for_more_than_one_of_each(sizes: dict[str, int], data: st.DataObject) -> None:
    """Whenever a page comes, its first task is served after at most one of each of the others."""
    turns = filled(sizes)
    for _ in range(data.draw(st.integers(0, sum(sizes.values()) - 1))):
        turns.next()
    turns.put("new", 0, ("new", 0))
    before = [page for page, _ in served(turns)]
    before = before[: before.index("new")]
    assert len(before) == len(set(before)) <= len(sizes)


def test_the_newest_takes_the_place_of_the_first() -> None:
    """Of the same key, at any time, however full it is."""
    turns = filled({"a": MOST_OF_PAGE, "b": 1})
    turns.put("a", 0, ("a", -1))
    assert served(turns)[:3] == [("a", -1), ("b", 0), ("a", 1)]


def test_a_page_has_so_many_places() -> None:
    """And no more; others have theirs."""
    turns = filled({"a": MOST_OF_PAGE})
    with pytest.raises(TooManyRequests, match=f"^Invalid request. This page has {MOST_OF_PAGE} others that wait"):
        turns.put("a", "more", ("a", 99))
    turns.put("b", 0, ("b", 0))
    assert len(turns) == MOST_OF_PAGE + 1
    turns.next()
    turns.put("a", "more", ("a", 99))


def test_all_have_so_many_places() -> None:
    """But there is one for every page."""
    pages = MOST_OF_ALL // MOST_OF_PAGE
    turns = filled(dict.fromkeys(map(str, range(pages)), MOST_OF_PAGE))
    turns.put("new", 0, ("new", 0))
    with pytest.raises(TooManyRequests, match="may not have more"):
        turns.put("new", 1, ("new", 1))
    assert len(turns) == MOST_OF_ALL + 1


def test_a_page_has_so_many_bytes() -> None:
    """Of files; a newer one of the same key takes the place of the older."""
    turns = filled({"a": 0})
    turns.put("a", "check", ("a", 0), 90)
    with pytest.raises(TooManyRequests, match="A file of this page waits already"):
        turns.put("a", "other", ("a", 1), 11)
    turns.put("a", "other", ("a", 2))
    turns.put("a", "check", ("a", 3), 100)
    turns.put("b", "check", ("b", 0), 100)
    assert served(turns) == [("a", 3), ("b", 0), ("a", 2)]


def test_what_is_dropped_waits_no_more() -> None:
    """Nor do pages that have left."""
    turns = filled({"a": 2, "b": 2, "c": 1})
    turns.drop("a", 0)
    turns.drop("c", 0)
    turns.drop("c", 0)
    turns.leave("b")
    turns.leave("b")
    assert served(turns) == [("a", 1)]
    with pytest.raises(LookupError):
        turns.next()
