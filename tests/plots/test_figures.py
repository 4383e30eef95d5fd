"""Whole figures: files, titles, regions and differences."""

import os
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.tri import Triangulation
from pyproj import CRS
from refusals import refuses

from projdist import get_measure, plots
from projdist.plots import map_drawing
from projdist.plots.basemap import closed_path
from projdist.plots.colours import level_labels
from projdist.plots.figures import field_against
from projdist.plots.styled_figure import shortened, title_of, with_minus
from projdist.projections import NAMES, WORLD_MAPS, Projection
from projdist.projections.catalogue import TITLES
from projdist.surfaces import surface_of

GOLDEN = Path(__file__).parents[1] / "golden"
EUROPE = "box:-10,35,40,70"


def labelled(figure: Figure, label: str) -> list:
    return [child for child in figure.axes[0].get_children() if child.get_label() == label]


@pytest.mark.slow
def test_panels_share_radius_and_scale() -> None:
    figure = plots.tissot_figure(["robin", "laea"], region=EUROPE)
    scales = []
    for ax in figure.axes:
        inches = np.array(ax.get_position().size) * figure.get_size_inches()
        scales += (np.ptp([ax.get_xlim(), ax.get_ylim()], axis=1) / inches).tolist()
    assert scales == pytest.approx([scales[0]] * 4, rel=1e-6)


@pytest.mark.slow
def test_draws_on_given_axes() -> None:
    """The functions draw on axes of the caller, and return the colours and the radius, which may be given."""
    left, right = (figure := Figure()).subplots(1, 2)
    options = {"projections": "robin", "region": "box:-40,25,-30,35", "step": 5.0, "title": "A"}
    assert plots.tissot(ax=left, radius=1e5, **options) == 1e5
    (circles,) = labelled(figure, "indicatrices")
    assert len(circles.get_paths()) == 4
    assert (
        1e5 < plots.tissot(ax=Figure().add_subplot(), **options) < 0.5 * np.radians(5.0) * 6371e3
    )  # as large as can be
    scale = plots.heatmap("robin", right, region=EUROPE, measure="h", levels=[0.9], limits=(0.5, 2.0), title="B")
    assert scale.limits == pytest.approx((0.5, 2.0))
    for draw in (plots.tissot, plots.heatmap):
        assert isinstance(draw("robin", region=EUROPE), Figure)
    assert (left.get_title(), right.get_title()) == ("A", "B")
    assert any(isinstance(child, PolyCollection) for child in left.get_children())
    assert any(isinstance(child, LineCollection) for child in right.get_children())


@pytest.mark.slow
def test_save(tmp_path: Path) -> None:
    """A figure is written by its suffix, the same again, and nothing else is left; other suffixes are refused."""
    said = r"Invalid picture file '.*x\.foo'\. Its suffix must be \.png, \.svg or \.pdf\."
    refuses(said, plots.save, Figure(), tmp_path / "x.foo")
    assert not list(tmp_path.iterdir())
    heads = {".png": b"PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    assert set(heads) == set(plots.SUFFIXES)
    figure = Figure(figsize=(1, 1))
    figure.add_axes((0, 0, 1, 1)).scatter([0, 1], [0, 1])  # markers and clips have ids in SVG, which are not random
    for number, (suffix, head) in enumerate(heads.items(), start=1):
        path = tmp_path / f"map{suffix}"
        first, second = (plots.save(figure, path, dpi=30).read_bytes() for _ in range(2))
        assert first == second == path.read_bytes()
        assert head in first[:200]
        assert not re.search(rb"Date>|CreationDate|ModDate|date:", first)
        assert len(list(tmp_path.iterdir())) == number


@pytest.mark.slow
@pytest.mark.parametrize("region", ["box:10,54,10.01,54.01", "cap:179.9999,50,0.1", "cap:0,90,0.5"])
def test_tiny_regions_need_little(region: str) -> None:
    """A picture of a square kilometre takes no more memory than one of the world, and has ellipses and graticule."""
    tracemalloc.start()
    tissot, heatmap = (make(["laea"], region=region) for make in (plots.tissot_figure, plots.heatmap_figure))
    assert tracemalloc.get_traced_memory()[1] < 150e6
    tracemalloc.stop()
    assert len(labelled(tissot, "indicatrices")[0].get_paths()) > 20
    assert 4 < len(labelled(tissot, "graticule")[0].get_segments()) < 60
    assert heatmap.axes[0].has_data()


@pytest.mark.slow
def test_the_outline_and_the_caption() -> None:
    """The outline is few lines, which would be seen where they meet; the caption tells the radius, the title a cap."""
    for projection, most in (("EPSG:2154", 1), ("igh", 40)):
        assert 1 <= len(labelled(plots.tissot_figure([projection]), "outline")[0].get_segments()) <= most
    # In metres or kilometres, whichever is read more easily.
    for km, unit in (("1", "m"), ("500", "km")):
        figure = plots.tissot_figure(["laea"], region=f"cap:10,54,{km}")
        found = figure.texts[0].get_text()
        assert re.search(rf"a radius of [1-9][0-9.]* {unit}$", found)
        assert f"{km} km around 54°N, 10°E" in {text.get_text() for text in figure.axes[0].texts}


@pytest.mark.slow
def test_ticks_of_bars() -> None:
    """Mercator's areal scale is nowhere below 1, and its bar begins there; a convergence both ways has minus signs."""
    figure = plots.heatmap_figure(["merc"], measure="s", region="box:-20,0,20,60")
    assert figure.axes[1].get_xlim() == (pytest.approx(1.0), pytest.approx(4.0, rel=0.01))
    assert figure.axes[1].get_xticklabels()[0].get_text() == "1"
    tmerc = "+proj=tmerc +lon_0=20 +R=6371000"
    figure = plots.heatmap_figure(tmerc, measure="convergence", region=EUROPE, levels=[-20, 0])
    figure.canvas.draw()
    assert [text.get_text() for text in figure.axes[-1].get_xticklabels()] == ["−20", "0"]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "projection", "words"), [
    ("tissot-robin", "robin", {"kind": "tissot"}), ("heatmap-igh", "igh", {"measure": "omega"}),
    ("heatmap-laea-europe", "EPSG:3035", {"measure": "s"}), ("heatmap-merc", "merc", {"measure": "s"}),
])  # fmt: skip
def test_golden_pictures(name: str, projection: str, words: dict[str, str], tmp_path: Path) -> None:
    path = plots.save(plots.figure(projection, **words), tmp_path / f"{name}.png", dpi=32)
    new, old = (imread(file)[..., :3].astype(float) for file in (path, GOLDEN / f"{name}.png"))
    assert new.shape == old.shape
    rows, columns = (n // 8 for n in new.shape[:2])
    difference = (new - old)[: 8 * rows, : 8 * columns].reshape(rows, 8, columns, 8, 3).mean(axis=(1, 3))
    assert np.sqrt(np.mean(difference**2)) < 0.02
    assert np.abs(difference).max() < 0.25


@pytest.mark.slow
@pytest.mark.parametrize("suffix", plots.SUFFIXES)
def test_pictures_are_the_same_bits_twice(suffix: str, tmp_path: Path) -> None:
    """From processes of their own, one after the other, with other seeds of hashes."""
    made = 'plots.tissot_figure(["robin"], region="box:0,0,40,40", step=20)'
    command = f"import sys; from projdist import plots; plots.save({made}, sys.argv[1], dpi=30)"
    paths = [tmp_path / f"{seed}{suffix}" for seed in "01"]
    for path in paths:
        words, environment = [sys.executable, "-c", command, str(path)], os.environ | {"PYTHONHASHSEED": path.stem}
        subprocess.run(words, check=True, env=environment)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_angles_have_no_jump_where_they_turn() -> None:
    """Between 170 and -170 degrees an isoline is at 180, and none at 0: triangles there have vertices of their own."""
    values = np.array([170.0, -170.0, -160.0, 100.0])
    mapped = Triangulation([0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0], [[0, 1, 2], [0, 1, 3]])
    parted, found = map_drawing._without_turn(mapped, values)
    for triangle, whole in zip(parted.triangles, mapped.triangles, strict=True):
        assert np.ptp(found[triangle]) <= 180.0
        np.testing.assert_allclose(np.mod(found[triangle] - values[whole], 360.0), 0.0)
        np.testing.assert_array_equal(parted.x[triangle], mapped.x[whole])
        np.testing.assert_array_equal(parted.y[triangle], mapped.y[whole])
    assert sorted(found[parted.triangles[0]]) == [170.0, 190.0, 200.0]


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_small_distortions_are_exaggerated_and_the_picture_says_so() -> None:
    """France on Lambert-93 has the same circles everywhere, but for a factor; axes are lines of their own."""
    figure = plots.tissot_figure("EPSG:2154", region="country:FR", exaggeration="auto", axes=True)
    assert "distortion exaggerated 200 times" in figure.texts[0].get_text()
    (ellipses,) = labelled(figure, "indicatrices")
    widths = [np.ptp(path.vertices[:, 0]) for path in ellipses.get_paths()]
    assert 1.2 < max(widths) / min(widths) < 2.6
    # A grid keeps all its ellipses, also where they stand close: eleven meridians on five parallels.
    (ellipses,) = labelled(plots.tissot_figure("robin", grid=(30.0, 30.0)), "indicatrices")
    assert len(ellipses.get_paths()) == 55


def test_polygons_are_one_path() -> None:
    rings = [np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 2.0]]), np.array([[5.0, 5.0], [7.0, 5.0], [7.0, 6.0], [5.0, 6.0]])]
    for ring, closed in zip(rings, closed_path(rings).to_polygons(closed_only=True), strict=True):
        np.testing.assert_array_equal(closed, [*ring, ring[0]])


# As Snyder & Voxland 1989, Snyder 1993, or who made the map print them.
PRINTED = {
    "van-der-grinten": "Van der Grinten I", "gall-peters": "Gall-Peters", "plate-carree": "Plate carrée",
    "winkel-tripel": "Winkel Tripel", "equal-earth": "Equal Earth", "eckert-4": "Eckert IV",
    "kavrayskiy-7": "Kavrayskiy VII", "mcbryde-thomas-flat-polar-quartic": "McBryde-Thomas flat-polar quartic",
    "+proj=vandg +R=6371000": "Van der Grinten I", "sinu": "Sinusoidal", "esri:54030": "ESRI:54030 · World_Robinson",
    "van-der-grinten@10,20": "Van der Grinten I, 10° N, 20° E",
    "EPSG:3035": "EPSG:3035 · ETRS89-extended / LAEA Europe",
}  # fmt: skip


def test_titles_and_minus() -> None:
    """A picture has the title that people write; a long name ends with a whole word and an ellipsis."""
    # A hyphen before a number that stands alone is a minus sign, in labels, too; others stay.
    printed = {"-0.5": "−0.5", "from -5 to -.5 m": "from −5 to −.5 m", "2e-05": "2e−05"}
    printed |= {text: text for text in ("10-20", "Eckert-4", "ETRS89-extended")}
    assert {text: with_minus(text) for text in printed} == printed
    assert level_labels(np.array([-1.0, -0.5, 0.0])) == ["−1", "−0.5", "0"]
    # Every entry of the catalogue has one, and none is a name's letters made large.
    assert set(TITLES) == {*NAMES, *WORLD_MAPS}
    assert all("-2" not in title and title[0].isupper() for title in TITLES.values())
    assert {given: title_of(Projection.from_user_input(given)) for given in PRINTED} == PRINTED
    assert shortened("North Pole / Very Long Name of a Zone", 30) == "North Pole / Very Long Name…"
    assert len(title_of(Projection.from_user_input("EPSG:8692"))) <= 64


# Of Switzerland's maps; other versions of the registry have other hundredths of a degree.
WEST, SOUTH, EAST, NORTH = CRS("EPSG:2056").area_of_use.bounds
PLACE = f"{WEST:g}°E to {EAST:g}°E, {SOUTH:g}°N to {NORTH:g}°N"


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_the_region_is_named_once():
    """For several maps in the line below, for one in its title, a country with its code; the globe is not named."""
    figure = plots.heatmap_figure(["robin", "moll"], measure="omega", region=EUROPE, airy_kavrayskiy=[0.4123, None])
    assert [ax.get_title() for ax in figure.axes[:2]] == ["Robinson", "Mollweide"]
    assert any("Airy–Kavrayskiy 0.4123" in text.get_text() for text in figure.axes[0].texts)
    assert figure.axes[2].get_xlabel() == "Angular distortion omega (degrees), over 10°W to 40°E, 35°N to 70°N"
    maps = ["EPSG:2056", "EPSG:2056"]
    assert plots.tissot_figure(maps, size=(3, 2)).texts[-1].get_text().endswith(f", over {PLACE}")
    assert plots.heatmap_figure(maps, size=(3, 2)).axes[-1].get_xlabel() == f"Fisher distortion, over {PLACE}"
    figure = plots.heatmap_figure("EPSG:2056", region="country:CH", airy_kavrayskiy=[0.0123])
    assert "Switzerland (CH) · Airy–Kavrayskiy 0.0123" in {text.get_text() for text in figure.axes[0].texts}
    assert figure.axes[-1].get_xlabel() == "Fisher distortion"
    figure = plots.tissot_figure(["EPSG:3857", "robin"], size=(3, 2))  # one CRS among others has an area of its own
    assert "over" not in figure.texts[-1].get_text()
    # What it is compared with; one map by its name, which has the place above it.
    labels = [("omega", "Angular distortion omega (degrees): Robinson less Mollweide")]
    labels += [("s", "Areal scale s: each map over Mollweide, over 0° to 40°E, 0° to 40°N")]
    for (measure, label), names in zip(labels, (["robin"], ["robin", "eqearth"]), strict=True):
        figure = plots.heatmap_figure(names, measure=measure, against="moll", region="box:0,0,40,40")
        assert figure.axes[-1].get_xlabel() == label


def against(one: str, other: str, measure: str, region: str) -> tuple[np.ndarray, np.ndarray]:
    """A measure of a map less or over another's, and the cosines of the latitudes."""
    surface = surface_of(one, region)
    values = field_against(surface, get_measure(measure), Projection.from_user_input(other))
    inside = np.isfinite(values)
    return values[inside], np.cos(np.radians(surface.lonlat()[1][inside]))


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_maps_against_others() -> None:
    """Scales are divided, others subtracted; directions differ by half a turn at most."""
    box, polar = "box:-60,-50,60,70", "+proj=stere +lat_0=90"
    # Areal scales: 1 / cos(lat) of the plate carree over 1 / cos(lat)^2 of Mercator.
    np.testing.assert_allclose(*against("plate-carree", "mercator", "s", box), rtol=1e-8)
    # Of Mercator omega is 0: the plate carree's own is left, and its negative the other way round.
    for one, other, sign in (("plate-carree", "mercator", 1.0), ("mercator", "plate-carree", -1.0)):
        values, cos = against(one, other, "omega", box)
        omega = np.degrees(2.0 * np.arcsin((1.0 - cos) / (1.0 + cos)))
        np.testing.assert_allclose(values, sign * omega, atol=1e-5)  # conformality is good to 1e-7 rad
    # Convergences of polar maps are lon - lon_0, and theirs differ by lon_0.
    for meridian in (90.0, -90.0):
        values, _ = against(polar, f"{polar} +lon_0={meridian}", "convergence", "box:-180,50,180,85")
        np.testing.assert_allclose(values, meridian, atol=1e-6)
