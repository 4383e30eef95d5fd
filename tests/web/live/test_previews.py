"""Previews are about what the map is, and are cut at its edge; the handlers' pictures, outlines, designs and checks."""

import math

import numpy as np
import pytest
import shapely
from live_pages import right_nodes
from refusals import refuses
from tables import each

import projdist
from projdist.projections import Projection, tunable, tuned
from projdist.web.live.handlers import Pictures, outline
from projdist.web.live.previews import Previewer, _wider, cut_cells

CASES = [
    ("robinson", "globe"), ("mollweide@45,-100", "globe"), ("+proj=laea +lat_0=40 +lon_0=20 +R=6371000", "globe"),
    ("EPSG:3857", "box:-60,-60,60,60"), ("EPSG:3035", "country:DE"), ("EPSG:2193", "country:NZ"),
    ("+proj=ortho +lat_0=30 +R=6371000", "globe"), ("igh", "globe"), ("EPSG:3031", "cap:0,-90,2000"),
    ("+proj=lcc +lat_1=30 +lat_2=60", "continent:Europe"), ("EPSG:32633", "cap:15,50,20"),
]  # fmt: skip

# Across the antimeridian, about poles, all around; of other bodies, meridians, axes and orders of these.
FURTHER = [
    ("EPSG:3832", "box:170,-50,-170,-30"), ("EPSG:3338", "box:170,50,-130,72"), ("mollweide", "country:FJ"),
    ("EPSG:3031", "box:-180,-90,180,-60"), ("EPSG:3995", "cap:0,90,3000"), ("robinson", "box:-180,40,180,80"),
    ("+proj=stere +lat_0=90 +R=6371000", "cap:10,88,900"), ("mercator", "box:-180,-80,180,80"),
    ("IAU_2015:30120", "globe"), ("IAU_2015:49910", "globe"), ("+proj=robin +R=1737400", "globe"),
    ("+proj=merc +axis=wnu", "box:-60,-60,60,60"), ("+proj=laea +lat_0=90 +axis=wnu", "cap:0,90,3000"),
    ("EPSG:5514", "country:CZ"), ("EPSG:2053", "country:ZA"), ("+proj=eqearth +pm=paris", "globe"),
    ("+proj=lcc +lat_1=60 +lat_2=65 +lon_0=180 +pm=ferro", "box:150,50,-150,80"),
]  # fmt: skip

MIRRORED = {"+proj=merc +axis=wnu", "+proj=laea +lat_0=90 +axis=wnu"}
WITHIN = 0.03  # of ln of scales: second differences of cells of 2.5 degrees
OFTEN = 0.9  # of the nodes; beside tears and where a map ends, differences are of one side


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* outside its area of use")
@pytest.mark.parametrize(("given", "region"), CASES + FURTHER)
def test_derivatives_are_about_those_of_the_map(given: str, region: str) -> None:
    projection = Projection.from_user_input(given)
    header, arrays = Previewer().frame(projection, region, tunable(given).centre)
    whole, right = right_nodes(header, arrays, projection, WITHIN)
    assert header["mirrored"] == (given in MIRRORED)
    assert whole > 0.2
    assert right > OFTEN


@pytest.mark.slow
@each(("given", "region"), CASES[:5] + FURTHER)
def test_the_figure_is_about_right(given: str, region: str) -> None:
    header, _ = Previewer().frame(Projection.from_user_input(given), region, tunable(given).centre)
    true = projdist.sample(given, region, tolerance=1e-3).airy_kavrayskiy
    about = header["about"]["airy_kavrayskiy"], header["about"]["airy_kavrayskiy_scaled"]
    assert about == pytest.approx((true.raw, true.scaled), rel=0.1)


def test_maps_of_a_part_have_no_preview_of_the_figure() -> None:
    """Gnomonic maps have twice that of what is shown; horizons give no bound; New Zealand's is of all its islands."""
    gnomonic, near = "+proj=gnom +lat_0=45 +R=6371000", "+proj=nsper +h=1000000 +R=6371000"
    cases = [(gnomonic, "globe", tunable(gnomonic).centre), (near, "globe", tunable(near).centre)]
    for given, region, centre in [*cases, ("EPSG:2193", "country:NZ", None)]:
        header, _ = Previewer().frame(Projection.from_user_input(given), region, centre)
        assert header["about"] is None, given


@each(("bounds", "wider"), [
    ((10, -5, 20, 5), (6.97, -8.0, 23.03, 8.0)),  # three of ten degrees; to the sides over cos(8)
    ((0, 70, 40, 89), (-114.0, 64.3, 154.0, 90.0)),  # 5.7 of nineteen, over 0.05 at most
    ((-150, -40, 150, 60), (-180.0, -90.0, 180.0, 90.0)),
])  # fmt: skip
def test_what_is_around_a_region_is_on_the_globe(bounds: tuple[float, ...], wider: tuple[float, ...]) -> None:
    """Three tenths of its size to all sides, as far as there is anything."""
    assert _wider(bounds) == pytest.approx(wider, abs=0.01)


def test_colours_are_for_the_last_pictures() -> None:
    """Two dozen; one that is seen again counts as new."""
    pictures, values = Pictures(), (np.tile(np.eye(2), (3, 1, 1)), np.ones(3))
    for number in (*range(24), 0, 24, 25):
        pictures._keep((str(number), "globe"), values)
    assert list(pictures.kept) == [(str(number), "globe") for number in (*range(3, 24), 0, 24, 25)]


def test_outlines_that_are_moved_are_whole() -> None:
    header, arrays = outline(projdist.get_region("box:10,-5,20,15"))
    assert (arrays["sizes"].tolist(), header["middle"]) == ([len(arrays["points"])], [15.0, 5.0])
    assert shapely.Polygon(arrays["points"]).equals(shapely.box(10, -5, 20, 15))


def test_lines_add_up() -> None:
    """Points of lines are as many as their sizes say, within the steps of the frame."""
    header, arrays = Previewer().frame(Projection.from_user_input("EPSG:3035"), "country:DE", None)
    for name in ("graticule", "coast", "borders", "border", "region", "land", "outline"):
        assert arrays[f"{name}Sizes"].sum() == len(arrays[name])
    assert header["regional"]
    assert header["view"][0] < 4_321_000 < header["view"][1]


def test_nothing_of_a_region_is_said() -> None:
    north = Projection.from_user_input("+proj=ortho +lat_0=90 +R=6371000")
    refuses("No part of it can be projected", Previewer().frame, north, "cap:0,-80,500", None)


@pytest.mark.slow
# Of Mars, of the Moon and of Phobos, as they are and dragged, and strings with the figure of a body.
@pytest.mark.parametrize("given", ["IAU_2015:49911", "ESRI:103881", "IAU_2015:40110", "+proj=moll +R=1737400"])
@pytest.mark.parametrize("centre", [None, (20.0, 10.0)])
def test_other_bodies_have_no_coasts_of_the_earth(given: str, centre: tuple[float, float] | None) -> None:
    projection = Projection.from_user_input(given) if centre is None else tuned(given, {}, centre)
    told = Projection.from_user_input(projection.definition)  # by whose words the page asks for the picture
    _, arrays = Previewer().frame(told, "globe", centre)
    assert arrays["coastSizes"].size == arrays["coast"].size == 0 < arrays["graticuleSizes"].size


def test_maps_without_an_end_are_cut_evenly() -> None:
    """An oblique Mercator map of a sphere runs off up and down, where equal scales are straight lines."""
    header, arrays = Previewer().frame(tuned("+proj=merc +R=6371000", {}, (20.0, 30.0)), "globe", (20.0, 30.0))
    y = header["grid"][1] + header["grid"][2] * arrays["y"][-arrays["imageU"].size :].astype(float)
    assert y.size >= 40
    for side in (y[y > 0.0], y[y < 0.0]):
        assert np.ptp(side) < 0.03 * (header["view"][3] - header["view"][2])
    triangles = arrays["cutSizes"].sum() - 2 * arrays["cutSizes"].size
    assert arrays["cutError"].size == triangles >= 40


def disc(count: int) -> tuple[float, float]:
    """The area and the circumference of a disc of radius 1, on a grid of so many nodes across 3."""
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, count), np.linspace(-1.5, 1.5, count))
    level, z = np.hypot(x, y) - 1.0, (x + 1j * y).ravel()
    found = cut_cells(level, np.ones((count - 1, count - 1), dtype=bool))
    near, far = found.ends.T
    assert (level.ravel()[near] <= 0.0).all()
    z = np.append(z, z[near] + found.share * (z[far] - z[near]))
    shown = level <= 0.0
    whole = (shown[:-1, :-1] & shown[1:, :-1] & shown[:-1, 1:] & shown[1:, 1:]).sum() * (3.0 / (count - 1)) ** 2
    parts = [z[polygons] for polygons in found.polygons]
    area = whole + sum(0.5 * (part.conj() * np.roll(part, -1, axis=1)).imag.sum() for part in parts)
    return area, np.abs(np.diff(z[count * count + found.sides], axis=1)).sum()


def test_a_disc_has_its_area_and_its_edge() -> None:
    """Polygons with the same sense of turning as cells; what they are off by falls as the square of the step."""
    off = np.array([[abs(area - math.pi), abs(edge - 2.0 * math.pi)] for area, edge in map(disc, (41, 161))])
    assert (off[1] < 1e-3).all()
    assert (off[1] < off[0] / 8.0).all()


@each("sign", [-1.0, 1.0])
def test_saddles_are_parted(sign: float) -> None:
    """Between two corners across that are shown there is a hexagon; where nothing is parted, there is nothing."""
    level = sign * np.array([[-1.0, 1.0], [1.0, -1.0]])
    found = cut_cells(level, np.ones((1, 1), dtype=bool))
    assert [polygon.shape for polygon in found.polygons] == [(1, 6)]
    assert found.share.tolist() == [0.5] * 4
    assert not cut_cells(np.full((3, 3), sign), np.ones((2, 2), dtype=bool)).polygons
