"""Points that PROJ has no coordinates of because it cannot read a grid, told from points beyond a map."""

from __future__ import annotations

import re

import numpy as np
import pyproj.exceptions
from pyproj import Transformer
from pyproj.enums import TransformDirection

from projdist._typing import FloatArray
from projdist.projections.errors import GridError, proj_reason

# PROJ's words for PROJ_ERR_OTHER_NETWORK_ERROR and PROJ_ERR_INVALID_OP_FILE_NOT_FOUND_OR_INVALID.
_UNREAD = re.compile(r"network error|file not found", re.IGNORECASE)
_ASKED = 300  # of the points that are lost: 20 ms


def check_grids(
    transformer: Transformer,
    given: tuple[FloatArray, FloatArray],
    found: FloatArray,
    direction: TransformDirection = TransformDirection.FORWARD,
) -> None:
    """Raise GridError where a point has no coordinates, and PROJ says that it could not read a grid for it.

    PROJ fetches grids at the first point that needs them, and gives infinity where it cannot. Others may be lost for
    other reasons: up to 300 of them, one as far from the next as from the one before, are asked for theirs.
    """
    lost = np.flatnonzero(np.isfinite(given[0]) & np.isfinite(given[1]) & ~np.isfinite(found))
    asked = lost[np.unique(np.linspace(0, lost.size - 1, min(lost.size, _ASKED)).astype(int))]
    for u, v in zip(*(values.ravel()[asked].tolist() for values in given), strict=True):
        try:
            transformer.transform(u, v, errcheck=True, direction=direction)
        except pyproj.exceptions.ProjError as error:
            if _UNREAD.search(str(error)):
                reason = proj_reason(error).removeprefix("transform error: ")
                raise GridError(
                    f"Invalid coordinates. PROJ cannot read a grid that they need: {reason}. Fetch it with 'projsync', "
                    "or set PROJ_NETWORK=OFF to do without."
                ) from error
