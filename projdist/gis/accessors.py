"""The accessor `frame.projdist` of geopandas, for answers about the data of a frame.

It is registered when this module is imported, which `import projdist.gis` does if pandas is loaded already.
"""

from importlib.util import find_spec
from typing import Any

from projdist.answers import factors
from projdist.decisions import Check, check, estimate_crs
from projdist.projections import CRS, ProjectionLike


class FrameAccessor:
    """projdist's answers about a GeoDataFrame or GeoSeries.

    Examples
    --------
    >>> import geopandas, projdist.gis.accessors
    >>> bern = geopandas.GeoSeries.from_xy([2600000, 2601000], [1200000, 1201000], crs="EPSG:2056")
    >>> bern.projdist.estimate_crs(authorities=["EPSG"]).to_epsg()
    2056
    """

    def __init__(self, frame: Any) -> None:
        self._frame = frame

    def check(self, crs: ProjectionLike | None = None, **options: Any) -> Check:
        """Errors of area, length and bearing of the features in a CRS, with the options of `projdist.check`."""
        return check(self._frame, crs, **options)

    def estimate_crs(self, **options: Any) -> CRS:
        """The best existing CRS for the data, with the options of `projdist.estimate_crs`."""
        return estimate_crs(self._frame, **options)

    def factors(self, projection: ProjectionLike, **options: Any) -> Any:
        """The frame with factors at its points as columns, with the options of `projdist.factors`."""
        return factors(projection, self._frame, **options)


if find_spec("pandas") is not None:  # without it there are no frames
    from pandas.api.extensions import register_dataframe_accessor, register_series_accessor

    register_dataframe_accessor("projdist")(FrameAccessor)
    register_series_accessor("projdist")(FrameAccessor)
