"""The published indices in `compare`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from projdist.cli.errors import refuse
from projdist.indices import GROUPS, Index, get_indices, indices
from projdist.regions import Place

IndicesOption = Annotated[
    list[str] | None,
    typer.Option(
        "--indices",
        "--measures",
        metavar="NAME",
        help=f"Published indices of the map: {', '.join(GROUPS)}, all, or names (see 'projdist list indices'); may be "
        "repeated, or with commas.",
    ),
]

_FINEST = 1e-6  # of the means; the Airy-Kavrayskiy figures are finer by default


def chosen_indices(given: list[str] | None) -> list[Index]:
    """Indices of names and groups, which may stand with commas between them."""
    names = [name.strip() for text in given or [] for name in text.split(",")]
    try:
        return get_indices(names)
    except ValueError as error:
        refuse(str(error), error)


def add_indices(rows: list[dict[str, Any]], region: Place, chosen: list[Index], tolerance: float) -> None:
    """Give each row of a comparison its indices, by name."""
    names = [index.name for index in chosen]
    for row in rows if names else []:
        found = indices(row["projection"], region, names, tolerance=max(tolerance, _FINEST))
        row["indices"] = found.to_dict()["indices"]
