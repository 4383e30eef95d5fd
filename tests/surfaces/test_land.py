"""The land on a map as rings: as much of it as there is on the ground."""

import functools

import pytest
import shapely

import projdist
from projdist.surfaces import land_rings, surface_of

SIZE = 5e6  # metres, of maps of a continent: what their curves are smooth to


@pytest.mark.parametrize(
    ("projection", "region"),
    [
        # The picture shows the pole, and closes round it.
        pytest.param("EPSG:3035", "box:-10,35,40,70", marks=pytest.mark.slow),
        ("EPSG:3035", "country:DE"),
        pytest.param("EPSG:6931", "cap:0,90,2000", marks=pytest.mark.slow),  # cut at the antimeridian
        ("EPSG:3577", "country:AU"),  # islands only
        ("ESRI:102025", "box:40,30,60,50"),  # about the Caspian Sea, a hole
    ],
)
def test_equal_area_maps_keep_the_area_of_the_land(projection: str, region: str) -> None:
    """By even and odd, the rings have the area of the land within the surroundings, on the ground."""
    ground = surface_of(projection, region, 2.0).ground
    assert ground is not None
    rings = land_rings(ground, "50m", SIZE)
    assert rings is not None
    shapes = [shapely.make_valid(shapely.polygons(ring)) for ring in rings]
    inside = functools.reduce(shapely.symmetric_difference, shapes)
    west, south, east, north = ground.domain.box.bounds
    box = f"box:{west!r},{south!r},{projdist.get_region('globe').bounds[2] if east == 180.0 else east!r},{north!r}"
    truth = projdist.get_region(f"land@50m & {box}").area_km2
    assert shapely.area(inside) / 1e6 == pytest.approx(truth, rel=2e-4)  # chords, smooth to 2.5 km


def test_torn_maps_have_no_rings() -> None:
    """A seam, or an edge, may part what a ring is around."""
    for projection, region in (("igh", "box:-60,-60,60,-10"), ("+proj=ortho +lat_0=50 +lon_0=10", "box:-60,-60,80,70")):
        surface = surface_of(projection, region, 2.0)
        assert land_rings(surface if surface.ground is None else surface.ground, "50m", SIZE) is None
