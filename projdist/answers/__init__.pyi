from .batch_tasks import Area, areas_of
from .batches import Batch, BatchFailure, BatchResult, batch
from .corrections import CONSTRAINTS, CORRECTION_CRITERIA, Correction, LocalCorrections, correct, local_corrections
from .distances import DISTANCE_MEASURES, FiniteDistortion, distance_distortion, great_circle_bending
from .point_factors import Factors, factors
from .profiles import Profile, elevation_factor, profile
from .published_indices import INDICES, Index, IndexSummary, IndexValue, get_indices, goldberg_gott_score, indices
from .published_tables import TABLES, PublishedRow, PublishedTable, tables
from .summaries import (
    GROUPS,
    SORTS,
    STATISTICS,
    Comparison,
    Failure,
    MeasureSummary,
    Summary,
    compare,
    sort_column,
    sort_order,
    summarize,
)

__all__ = [
    "CONSTRAINTS",
    "CORRECTION_CRITERIA",
    "DISTANCE_MEASURES",
    "GROUPS",
    "INDICES",
    "SORTS",
    "STATISTICS",
    "TABLES",
    "Area",
    "Batch",
    "BatchFailure",
    "BatchResult",
    "Comparison",
    "Correction",
    "Factors",
    "Failure",
    "FiniteDistortion",
    "Index",
    "IndexSummary",
    "IndexValue",
    "LocalCorrections",
    "MeasureSummary",
    "Profile",
    "PublishedRow",
    "PublishedTable",
    "Summary",
    "areas_of",
    "batch",
    "compare",
    "correct",
    "distance_distortion",
    "elevation_factor",
    "factors",
    "get_indices",
    "goldberg_gott_score",
    "great_circle_bending",
    "indices",
    "local_corrections",
    "profile",
    "sort_column",
    "sort_order",
    "summarize",
    "tables",
]
