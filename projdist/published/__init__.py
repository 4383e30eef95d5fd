"""Tables of the literature: figures as they were printed, beside ours."""

from projdist.published.rows import TABLES, Printed, printed
from projdist.published.tables import PublishedRow, PublishedTable, tables

__all__ = ["TABLES", "Printed", "PublishedRow", "PublishedTable", "printed", "tables"]
