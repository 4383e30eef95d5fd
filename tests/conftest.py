"""What all tests share."""

from hypothesis import settings

# The same examples every time, and no deadline: a busy machine is no failure.
settings.register_profile("projdist", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("projdist")
