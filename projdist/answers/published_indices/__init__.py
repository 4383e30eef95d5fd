"""Published indices of whole maps: one registry, each with its definition, normalisation, scale and source."""

from projdist.answers.published_indices.answers import IndexSummary, IndexValue, indices
from projdist.answers.published_indices.registry import (
    GROUPS,
    INDICES,
    NORMALISERS,
    Index,
    get_index,
    get_indices,
    goldberg_gott_score,
)

__all__ = [
    "GROUPS",
    "INDICES",
    "NORMALISERS",
    "Index",
    "IndexSummary",
    "IndexValue",
    "get_index",
    "get_indices",
    "goldberg_gott_score",
    "indices",
]
