"""Projections as CRSs of cartopy, and distortion on its axes."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import shapely
from matplotlib import colors

from projdist import earth, projections, regions, support, surfaces
from projdist._typing import FloatArray
from projdist.plots import map_drawing
from projdist.plots.colours import ColourScale, Levels
from projdist.projections import Projection

_THRESHOLD = 5e-4  # of a map's shorter side, as cartopy has it for Robinson's map


def cartopy_projection(source: Projection, wkt: str, to_metres: FloatArray, polygon: shapely.Polygon) -> Any:
    """Cartopy's CRS of a map with an edge in metres, with coordinates in the CRS's own unit."""
    return _class()(source, wkt, to_metres, polygon)


@functools.cache
def _class() -> Any:
    """Class of these CRSs, made when cartopy is loaded."""
    import cartopy.crs  # an extra

    class MeasuredProjection(cartopy.crs.Projection):  # type: ignore[misc]  # cartopy has no types
        """A projection of projdist as cartopy has them: `source` is the projection, `to_metres` a matrix (2, 2)."""

        def __init__(self, source: Projection, wkt: str, to_metres: FloatArray, polygon: shapely.Polygon) -> None:
            super().__init__(wkt)
            self.source, self.to_metres = source, to_metres
            self._given = source, wkt, to_metres, polygon
            metres = shapely.get_coordinates(polygon.exterior)
            self._edge = shapely.LinearRing(np.linalg.solve(to_metres, metres.T).T)
            west, south, east, north = self._edge.bounds
            self.bounds = west, east, south, north
            self.threshold = _THRESHOLD * min(east - west, north - south)

        @property
        def boundary(self) -> shapely.LinearRing:
            """The edge of the map."""
            return self._edge

        def __repr__(self) -> str:
            return f"<cartopy CRS of {self.source.name}>"

        def __reduce__(self) -> tuple[Any, ...]:
            return cartopy_projection, self._given

    return MeasuredProjection


# ---- geoaxes -------------------------------------------------------------------------------------


def to_cartopy(projection: projections.ProjectionLike, *, region: regions.RegionLike | None = None) -> Any:
    """A projection as a CRS of cartopy's, for `plt.axes(projection=...)`, with its edge where the map has it.

    Parameters
    ----------
    projection : ProjectionLike
        Any projection that PROJ has as a CRS.
    region : RegionLike, optional
        The map's edge surrounds the box around it; by default the area of use of a CRS, else the globe, cut at seams.

    Returns
    -------
    cartopy.crs.Projection
        With coordinates in the unit of the CRS, the easting first; its `source` is the projection.

    Raises
    ------
    ProjectionError, ValueError
        For functions, pipelines, and other maps without a CRS; for maps in several pieces, which cartopy cannot have.
    ImportError
        Without cartopy.

    References
    ----------
    https://cartopy.readthedocs.io/stable/reference/projections.html

    Examples
    --------
    The outline of the map of the world reaches as far as its edge at the equator:

    >>> import cartopy.crs
    >>> crs = to_cartopy("equal-earth")
    >>> x, _ = crs.transform_point(180.0, 0.0, cartopy.crs.Geodetic())
    >>> round(float(crs.x_limits[1] / x), 3)
    1.0
    """
    _need_cartopy("projection for cartopy")
    projection = Projection.from_user_input(projection)
    plane = _plane_of(projection)
    bounds = regions.region_for(region, [projection]).bounds
    polygon = surfaces.boundary_polygon(surfaces.surface_of(projection, regions.Box.between(bounds)))
    return cartopy_projection(projection, plane.wkt, plane.to_metres, polygon)


def add_tissot(
    ax: Any, *, region: regions.RegionLike | None = None, step: float | None = None, radius: float | None = None
) -> float:
    """Add Tissot's indicatrices to axes of cartopy; returns the radius in metres of their circles on the ground.

    Parameters
    ----------
    ax : cartopy.mpl.geoaxes.GeoAxes
        With a projection of `to_cartopy` or one of cartopy's own.
    region : RegionLike, optional
        Where they are; without one in the area of use of a CRS, else everywhere.
    step : float, optional
        Degrees between them.
    radius : float, optional
        Metres; without one as large as they can be without overlap.

    Raises
    ------
    ValueError
        For other axes and invalid options.
    ImportError
        Without cartopy.

    Examples
    --------
    >>> import cartopy.crs
    >>> from matplotlib.figure import Figure
    >>> ax = Figure().add_subplot(projection=cartopy.crs.Mollweide())
    >>> add_tissot(ax, step=30.0, radius=5e5)
    500000.0
    """
    projection, from_metres = _of_axes(ax)
    surface = surfaces.surface_of(projection, region)
    fitted, (panel,) = surfaces.fit([surfaces.tissot_points(surface, step)], radius)
    with ax.hold_limits():
        map_drawing.draw_ellipses(ax, panel, fitted, from_metres)
    return fitted


def add_heatmap(
    ax: Any,
    *,
    measure: map_drawing.AnyMeasure = "fisher",
    region: regions.RegionLike | None = None,
    levels: Levels = None,
    cmap: str | colors.Colormap | None = None,
    limits: tuple[float, float] | None = None,
    colourbar: bool = True,
) -> ColourScale:
    """Add a measure to axes of cartopy, as colours below its lines, and isolines; returns the colour scale.

    Parameters
    ----------
    ax : cartopy.mpl.geoaxes.GeoAxes
        With a projection of `to_cartopy` or one of cartopy's own.
    measure : str, Measure or callable
        As in `projdist.plots.heatmap`.
    region : RegionLike, optional
        Where it is drawn; without one the area of use of a CRS, else the globe.
    levels : int or sequence of float, optional
        The isolines, or about how many.
    cmap : str or Colormap, optional
        Of matplotlib.
    limits : (float, float), optional
        Ends of the colours.
    colourbar : bool
        Whether there is one below.

    Raises
    ------
    ValueError
        For other axes and invalid options.
    ImportError
        Without cartopy.

    Examples
    --------
    >>> import cartopy.crs
    >>> from matplotlib.figure import Figure
    >>> ax = Figure().add_subplot(projection=cartopy.crs.Mollweide())
    >>> add_heatmap(ax, measure="omega", limits=(0.0, 90.0)).limits
    (0.0, 90.0)
    """
    projection, from_metres = _of_axes(ax)
    surface = surfaces.surface_of(projection, region)
    values, scale, values_at = map_drawing.measured(surface, measure, levels=levels, cmap=cmap, limits=limits)
    with ax.hold_limits():
        map_drawing.draw_field(ax, _in_unit(surface, from_metres), values, scale, values_at)
    if colourbar:
        map_drawing.draw_bar_below(ax, scale)
    return scale


def _need_cartopy(thing: str) -> None:
    """Raise ImportError in one line that says what to install where there is no cartopy."""
    try:
        import cartopy.crs
        import cartopy.mpl.geoaxes  # noqa: F401 whether both are there
    except ImportError as error:
        text = f"Invalid {thing}. It needs cartopy: pip install 'projdist[cartopy]'."
        raise ImportError(text, name="cartopy") from error


def _of_axes(ax: Any) -> tuple[Projection, FloatArray]:
    """Projection of axes, and the matrix from metres to their coordinates."""
    _need_cartopy("axes of cartopy")
    from cartopy.mpl.geoaxes import GeoAxes

    support.check_instance("axes", ax, GeoAxes, "GeoAxes of cartopy")
    crs = ax.projection
    source = getattr(crs, "source", None)
    if isinstance(source, Projection):
        return source, np.asarray(np.linalg.inv(crs.to_metres), dtype=float)
    if crs.is_geographic and not crs.is_derived:
        # Cartopy's plate carree, in degrees from a central meridian that it has for a prime meridian: the spherical
        # formula on the ellipsoid; PROJ's eqc has the ellipsoidal one since 9.8.
        a, b = crs.ellipsoid.semi_major_metre, crs.ellipsoid.semi_minor_metre
        sphere = Projection.from_user_input(f"+proj=eqc +lon_0={crs.prime_meridian.longitude!r} +R={a!r}")
        return dataclasses.replace(sphere, ellipsoid=earth.Ellipsoid(a, 1.0 - b / a)), np.eye(2) / np.radians(a)
    projection = Projection.from_user_input(crs)
    return projection, np.asarray(np.linalg.inv(_plane_of(projection).to_metres), dtype=float)


def _plane_of(projection: Projection) -> projections.ProjectedCrs:
    plane = projections.projected_crs_of(projection)
    if plane is None:
        text = f"Invalid projection '{projection.name}' for cartopy. It must be one that PROJ has a CRS for."
        raise projections.ProjectionError(text)
    return plane


def _in_unit(surface: surfaces.Surface, matrix: FloatArray) -> surfaces.Surface:
    """Surface with coordinates transformed by a matrix (2, 2)."""
    x, y = matrix @ np.stack([surface.x, surface.y])
    return dataclasses.replace(
        surface,
        x=x,
        y=y,
        outline=surface.outline @ matrix.T,
        pieces=tuple(piece @ matrix.T for piece in surface.pieces),
        border=tuple(line @ matrix.T for line in surface.border),
        ground=None if surface.ground is None else _in_unit(surface.ground, matrix),
    )
