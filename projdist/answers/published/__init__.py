"""Tables of the literature: figures as they were printed, beside ours."""

from projdist.answers.published_tables import TABLES, Printed, PublishedRow, PublishedTable, printed, tables

__all__ = ["TABLES", "Printed", "PublishedRow", "PublishedTable", "printed", "tables"]
