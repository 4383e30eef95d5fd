"""A CRS as `recommend` has it, with figures that are made up; for the tests of what it prefers."""

from projdist.decisions.candidate_crs import Candidate

NATIONAL = Candidate(
    code="EPSG:1",
    name="",
    method="",
    datum="New",
    keeps=(),
    area_of_use=(-180.0, -90.0, 180.0, 90.0),
    area_name="",
    trial=None,
    share=1.0,
    national=True,
    datum_since=2010,
)
"""Of its country alone, on a new datum."""
