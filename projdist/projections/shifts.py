"""Changes of datum: how far they move places, as far as PROJ knows."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Transformer

from projdist.projections.datums import greenwich_offset, units_per_degree

__all__ = ["DatumShift", "datum_shift", "keeps_datum", "kept_datum"]


@dataclass(frozen=True)
class DatumShift:
    """A change of datum at a place: by how many metres coordinates differ, and how well PROJ knows that.

    Both are NaN where they are not known; a grid that is not installed is a reason for that.
    """

    source: str
    target: str
    metres: float
    accuracy: float

    def __str__(self) -> str:
        """One sentence."""
        change = f"The datum changes from {self.source} to {self.target}"
        if not np.isfinite(self.metres):
            return f"{change}; by how much is not known to PROJ here."
        sure = f", to {self.accuracy:g} m" if np.isfinite(self.accuracy) else ""
        return f"{change}: coordinates of the same place differ by {self.metres:.3g} m{sure}."


def datum_shift(source: Any, target: Any, lon: float, lat: float) -> DatumShift | None:
    """The change of datum between two CRSs at a place in Greenwich degrees; None where the datum is the same."""
    one, other = (CRS.from_user_input(crs).geodetic_crs for crs in (source, target))
    if one is None or other is None or _datum_name(one) == _datum_name(other):
        return None
    one, other = one.to_2d(), other.to_2d()
    try:
        # Ballpark transformations take one datum for the other: their shift of nothing would be a lie.
        transformer = Transformer.from_crs(one, other, always_xy=True, allow_ballpark=False)
        u = (lon - greenwich_offset(one)) * units_per_degree(one)
        x, y = transformer.transform(u, lat * units_per_degree(one), errcheck=True)
    except pyproj.exceptions.ProjError:
        return DatumShift(one.name, other.name, np.nan, np.nan)
    east, north = x / units_per_degree(other) + greenwich_offset(other), y / units_per_degree(other)
    geod = other.get_geod()
    assert geod is not None  # of a geodetic CRS
    metres = geod.inv(lon, lat, east, north)[2]
    return DatumShift(one.name, other.name, float(metres), _accuracy(transformer))


def _accuracy(transformer: Transformer) -> float:
    """What a transformer that was used is good to, in metres, as its registry has it."""
    accuracy = transformer.accuracy
    if accuracy < 0.0:  # one of several operations, which tell
        with contextlib.suppress(pyproj.exceptions.ProjError):
            accuracy = transformer.get_last_used_operation().accuracy
    return accuracy if accuracy >= 0.0 else np.nan


def kept_datum(crs: Any) -> str:
    """The geodetic CRS by name whose datum data in a CRS shall keep.

    None ("") for longitudes and latitudes of WGS 84: that is how data are exchanged, whatever datum they were made on.
    """
    given = CRS.from_user_input(crs)
    geodetic = given.geodetic_crs
    if geodetic is None or (given.is_geographic and _datum_name(geodetic) == _datum_name(CRS.from_epsg(4326))):
        return ""
    return geodetic.name


def keeps_datum(source: Any, target: Any) -> bool:
    """Whether two CRSs have the same datum."""
    one, other = (CRS.from_user_input(crs).geodetic_crs for crs in (source, target))
    return one is not None and other is not None and _datum_name(one) == _datum_name(other)


def _datum_name(crs: CRS) -> str:
    """The name of a datum or of an ensemble of them, without what only databases add."""
    name = crs.datum.name if crs.datum is not None else crs.name
    return name.removesuffix(" ensemble")
