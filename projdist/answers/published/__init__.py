"""Tables of the literature: figures as they were printed, beside ours."""

from projdist.answers.published.comparisons import PublishedRow, PublishedTable, tables
from projdist.answers.published.rows import TABLES, Printed, printed

__all__ = ["TABLES", "Printed", "PublishedRow", "PublishedTable", "printed", "tables"]
