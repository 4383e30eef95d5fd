"""The table of the states of the USA, and their outlines."""

from tables import each

from projdist.earth import state_keys, state_outline
from projdist.earth.natural_earth import topology


def test_table_and_outlines_are_one_to_one() -> None:
    """Each outline of the file has its row, and no code stands for two."""
    rows = state_keys()
    assert sorted(row["fips"] for row in rows) == sorted(
        one["id"] for one in topology("states-10m.npz").objects["states"]
    )
    assert len({row["postal"] for row in rows}) == len({row["name"] for row in rows}) == len(rows) == 56


@each("fips", [row["fips"] for row in state_keys()])
def test_outlines_are_valid(fips: str) -> None:
    """Also those of which rounding has made rings cross themselves; none has a part without an area."""
    outline = state_outline(fips)
    assert outline.is_valid
    assert min(part.area for part in outline.geoms) > 0.0
