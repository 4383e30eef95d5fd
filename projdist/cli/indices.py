"""The published indices in `compare`."""

from __future__ import annotations

from typing import Annotated

import typer

from projdist.answers import GROUPS, Index, get_indices
from projdist.cli.errors import refuse

IndicesOption = Annotated[
    list[str] | None,
    typer.Option(
        "--indices",
        metavar="NAME",
        help=f"Published indices of the map: {', '.join(GROUPS)}, all, or names (see 'projdist list indices'); may be "
        "repeated, or with commas.",
    ),
]


def chosen_indices(given: list[str] | None) -> list[Index]:
    """Indices of names and groups, which may stand with commas between them."""
    names = [name.strip() for text in given or [] for name in text.split(",")]
    try:
        return get_indices(names) if names else []
    except ValueError as error:
        refuse(str(error), error)
