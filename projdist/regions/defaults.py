"""The region of maps: where none was named, and on the body that they are of."""

from __future__ import annotations

from collections.abc import Iterable

from projdist.earth import WGS84, Ellipsoid
from projdist.projections import Body, Projection, ProjectionError, is_same_body
from projdist.regions.boxes import GLOBE, Box
from projdist.regions.language import Place, RegionLike, placed, region_on

__all__ = ["check_on_body", "ground_of_maps", "region_for"]


def region_for(region: RegionLike | None, projections: Iterable[Projection]) -> Place:
    """A region on the body that maps are of; raises ValueError, as for maps of different bodies.

    Without one it is the area of use that is that of all maps, else the globe.
    """
    maps = list(projections)
    body = Body(ground_of_maps(maps), next((one.body.name for one in maps if one.body.name), ""))
    if region is not None:
        return region_on(region, body)
    areas = {projection.area_of_use for projection in maps}
    area = areas.pop() if len(areas) == 1 else None
    return placed(GLOBE if area is None else Box(*area), body)


def check_on_body(projections: Iterable[Projection], body: Body) -> None:
    """Refuse maps of another body than a region is on; raises ProjectionError."""
    for projection in projections:
        if not is_same_body(projection.body, body):
            raise ProjectionError(
                f"Invalid map '{projection.label}'. It is of {projection.body}, and must be of {body}."
            )


def ground_of_maps(projections: Iterable[Projection]) -> Ellipsoid:
    """The ellipsoid on which the regions of maps are measured; ProjectionError for maps of different bodies.

    Of the Earth's two, WGS 84 and the sphere of the mean radius, it is the latter where all maps are of spheres;
    likewise another body's ellipsoid is that of the first map that is not of a sphere.
    """
    maps = list(projections)
    for other in maps[1:]:
        if not is_same_body(maps[0].body, other.body):
            raise ProjectionError(
                f"Invalid maps '{maps[0].label}' and '{other.label}'. They are of {maps[0].body} and of {other.body}; "
                "maps that are compared must be of one body."
            )
    figures = [projection.ellipsoid.ground for projection in maps]
    return next((figure for figure in figures if not figure.is_sphere), figures[0] if figures else WGS84)
