"""The command `list`."""

from __future__ import annotations

from typing import Annotated

import typer

from projdist.answers import INDICES
from projdist.cli.options import FormatOption, choice, format_of
from projdist.cli.output import present
from projdist.cli.report import listing
from projdist.field import FIGURES
from projdist.matrices import MEASURES
from projdist.numerics import CRITERIA
from projdist.projections import NAMES, WORLD_MAPS, needed_parameters, projection_names


def list_command(
    what: Annotated[str, typer.Argument(metavar="projections|measures|figures|criteria|indices", help="What to list.")],
    format: FormatOption = "table",
) -> None:
    """List the projections, measures, figures, criteria or published indices that there are."""
    rows = _LISTS[choice("list", what, list(_LISTS))]()
    present(listing(rows), format_of(format))


def _projection_rows() -> list[dict[str, str]]:
    return [
        {
            "name": name,
            "kind": "name" if name in NAMES or name in WORLD_MAPS else "PROJ id",
            "needs": ", ".join(needed_parameters(name)),
            "definition": definition,
        }
        for name, definition in projection_names().items()
    ]


def _measure_rows() -> list[dict[str, str]]:
    rows = [
        {"name": measure.name, "symbol": measure.symbol, "unit": measure.unit, "description": measure.description}
        for measure in MEASURES.values()
    ]
    return [*rows, {"name": "scale@AZIMUTH", "symbol": "", "unit": "", "description": "Scale in an azimuth, degrees."}]


def _figure_rows() -> list[dict[str, str]]:
    """What maps are ranked by and made better by."""
    return [
        {
            "name": figure.name,
            "unit": figure.unit,
            "definition": figure.description,
            "source": figure.source,
        }
        for figure in FIGURES.values()
    ]


def _criterion_rows() -> list[dict[str, str]]:
    """Statistics of a measure, and the published indices."""
    statistics = {name: (criterion.__doc__ or "").partition("\n")[0] for name, criterion in CRITERIA.items()}
    statistics["pNN"] = "Weighted percentile."
    rows = [{"name": name, "group": "statistics", "definition": text} for name, text in statistics.items()]
    indices = _index_rows()
    return [dict.fromkeys(indices[0], "") | row for row in rows] + indices


def _index_rows() -> list[dict[str, str]]:
    return [
        {
            "name": index.name,
            "symbol": index.symbol,
            "group": index.group,
            "definition": index.definition,
            "normalisation": index.normalisation,
            "scale": index.scale_dependence,
            "source": index.source,
        }
        for index in INDICES.values()
    ]


_LISTS = {
    "projections": _projection_rows,
    "measures": _measure_rows,
    "figures": _figure_rows,
    "criteria": _criterion_rows,
    "indices": _index_rows,
}
