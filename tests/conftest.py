"""What all tests share."""

import os

from hypothesis import settings

# Tests run in as many processes as there are cores: BLAS's threads would only wait for each other. Before numpy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The same examples every time, and no deadline: a busy machine is no failure.
settings.register_profile("projdist", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("projdist")
