"""Pictures of old maps and mosaics."""

import functools

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.text import Text
from mosaic_pictures import HEIGHT, WIDTH, cut, maps
from mosaic_sets import SIZES, affine_maps, common_points, moved
from PIL import Image
from refusals import refuses
from scipy.spatial.transform import Rotation
from tables import each

from projdist import plots
from projdist.applications.mosaics import mosaic, open_pictures
from projdist.applications.oldmaps import ControlPoints, old_map
from projdist.matrices.measures import principal_scales
from projdist.plots.images import read_scan

FIGURES, NONE = (plots.old_map_figure, plots.mosaic_figure), ([], ["mdt", "middle"])


@functools.cache
def sheet(flip=1.0, shift=0.0, **options):
    """An old map 400 by 300 units large of a known quadratic map."""
    x, y = np.stack(np.meshgrid(np.linspace(20.0, 380.0, 6), np.linspace(20.0, 280.0, 5)), axis=-1).reshape(-1, 2).T
    new = np.stack([50.0 * x + 0.02 * x * x, 52.0 * y + 0.01 * x * y], axis=-1)
    return old_map(ControlPoints(np.stack([x, flip * y + shift], axis=-1), new), model="polynomial2", **options)


@pytest.fixture
def scan(tmp_path):
    """A picture of 400 by 300 pixels, dark in its upper left quarter."""
    pixels = np.full((300, 400, 3), 240, dtype=np.uint8)
    pixels[:150, :200] = 20
    path = tmp_path / "scan.png"
    Image.fromarray(pixels).save(path)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("panels", [["grid"], ["tissot", "scale"], list(plots.OLD_MAP_PANELS)])
def test_panels(panels):
    """Each panel has its title and, if coloured, its bar; none lies upon another; one unit is the same in x and y."""
    figure = plots.old_map_figure(sheet(dots_per_inch=300.0), draw=panels)
    maps, bars = figure.axes[::2], figure.axes[1::2]
    assert len(maps) == len(panels)
    assert [bar.axison for bar in bars] == [panel in ("heatmap", "rotation", "scale") for panel in panels]
    titles = {"tissot": "Tissot", "heatmap": "Fisher", "rotation": "Rotation", "scale": "Scale", "grid": "True grid"}
    assert all(ax.get_title().startswith(titles[panel]) for ax, panel in zip(maps, panels, strict=True))
    boxes = [ax.get_position() for ax in figure.axes if ax.axison or ax in maps]
    for k, one in enumerate(boxes):
        assert 0.0 <= one.x0 < one.x1 <= 1.0 >= one.y1 > one.y0 >= 0.0
        assert not any(one.overlaps(other) for other in boxes[:k])


@pytest.mark.slow
def test_indicatrices():
    """The ellipses are the images of equal circles: their areas go with the areal scale, and none touches another."""
    found = sheet()
    (ax, _) = plots.old_map_figure(found, draw=["tissot"]).axes
    (drawn,) = (child for child in ax.get_children() if isinstance(child, PolyCollection))
    paths = np.array([path.vertices[:-1] for path in drawn.get_paths()])
    x, y = np.moveaxis(paths, -1, 0)
    areas = 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))
    centres = paths.mean(axis=1)
    scales = principal_scales(found.local_jacobian(centres)).prod(axis=1)
    np.testing.assert_allclose(areas / scales, areas[0] / scales[0], rtol=1e-6)
    distance = np.hypot(*(centres[:, None] - centres).T)
    reach = np.hypot(*(paths - centres[:, None]).T).max(axis=0)
    np.fill_diagonal(distance, np.inf)
    assert (distance > reach[:, None] + reach).all()
    assert len(paths) > 60


@each(("flip", "shift", "extent"), [
    (-1.0, 300.0, (0, 400, 300, 0)), (1.0, 0.0, (0, 400, 0, 300)), (1.0, -300.0, (0, 400, -300, 0)),
])  # fmt: skip
def test_scans(flip, shift, extent, scan):
    """Points may count rows downwards, upwards, or downwards by negative numbers: the dark quarter is upper left."""
    found = sheet(flip, shift)
    read = read_scan(scan, found)
    assert read.extent == extent
    south_east = found.points.new @ [1.0, -1.0]
    for k, brightness in ((np.argmin(south_east), 20 / 240), (np.argmax(south_east), 1.0)):
        x, y = found.points.old[k]
        shown = read.brightness(np.array([x, 390.0, 395.0, 399.0]), np.array([y]))[0, 0]
        assert shown == pytest.approx(brightness, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_picture_on_a_scan(flip, scan):
    """North is up, whichever way the rows are counted, and the scan fills the view that it has."""
    found = sheet(flip, 0.0 if flip > 0 else 300.0)
    ax = plots.old_map_figure(found, draw=["heatmap"], image=scan).axes[0]
    up = found.points.new[:, 1].argmax(), found.points.new[:, 1].argmin()
    high, low = (ax.transData.transform(found.points.old[k])[1] for k in up)
    assert high > low
    assert np.ptp(ax.get_xlim()) <= 400.0
    assert len(ax.get_images()) == 2


@pytest.mark.slow
def test_rotation_has_one_sign():
    """A map turned clockwise by ten degrees is told so in the figures and in the picture."""
    truth = np.stack(np.meshgrid(*[np.linspace(0.0, 9000.0, 4)] * 2), axis=-1).reshape(-1, 2)
    angle = np.radians(10.0)
    # A step to the north goes to the right on a sheet that is turned clockwise.
    old = truth @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) / 50.0
    found = old_map(ControlPoints(old, truth), model="affine")
    assert {round(one["rotation"], 9) for one in found.to_dict()["rectifications"].values()} == {10.0}
    texts = [text.get_text() for text in plots.old_map_figure(found, draw=["rotation"]).findobj(Text)]
    assert any("clockwise from the mean, which is 10.00" in text for text in texts), texts


def test_no_image(tmp_path, scan):
    """A file that is no picture, one that is not there, and one in whose pixels the points are not: one is named."""
    path = tmp_path / "x.jpg"
    path.write_text("no picture", encoding="utf-8")
    for found, image, said in (
        (sheet(), path, r"Invalid image '.*x\.jpg'\. It cannot be read: cannot identify image file"),
        (sheet(), tmp_path / "none.jpg", r"It cannot be read: No such file or directory\."),
        (sheet(-1.0, 900.0), scan, r"It has 400 by 300 pixels, and 30 of 30 control points lie outside, as '1'\."),
    ):
        refuses(said, read_scan, image, found)


@pytest.mark.slow
def test_a_bomb(tmp_path, monkeypatch):
    """A file of 12 kB may have 100 million pixels; a JPEG is read at a part of its size, and may have more."""
    Image.new("1", (10_001, 10_000)).save(tmp_path / "bomb.png")
    said = r"Invalid image '.*bomb\.png'\. It cannot be read: 10001 x 10000 pixels are more"
    refuses(said, read_scan, tmp_path / "bomb.png", sheet())
    monkeypatch.setattr("projdist.applications.mosaics.images._MOST_PIXELS", 20_000_000)
    Image.new("L", (8000, 8000)).save(tmp_path / "scan.jpg")
    assert read_scan(tmp_path / "scan.jpg", sheet()).pixels.shape == (4000, 4000, 3)


@pytest.mark.slow
def test_folds_are_marked():
    """Where the fit turns over the picture has another colour, and says so."""
    x, y = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 8)] * 2), axis=-1).reshape(-1, 2).T
    points = ControlPoints(np.stack([x, y], axis=-1), 1000.0 * np.stack([x, y - 0.625 * y * y], axis=-1))
    ax = plots.old_map_figure(old_map(points, model="polynomial2"), draw=["heatmap"]).axes[0]
    (folds,) = (child for child in ax.get_children() if child.get_label() == "folds")
    corners = np.concatenate([path.vertices for path in folds.get_paths()])
    assert corners[:, 1].min() == pytest.approx(0.8, abs=0.03)
    assert any("pink: the fit folds" in text.get_text() for text in ax.texts)


@each(("call", "options", "message"), [
    (plots.old_map_figure, {"draw": []}, r"Invalid panels ''\. They must be of tissot, heatmap, rotation, scale, gr"),
    (plots.old_map_figure, {"draw": ["map"]}, r"Invalid panels 'map'\."),
    (plots.old_map_figure, {"measure": "h"}, r"Invalid measure 'h' of an old map\. It must be fisher or areal_scale\."),
    (plots.old_map_figure, {"size": (1, 1)}, r"Invalid size '1,1'\. It has no room for 4 panels\."),
    *((call, {"size": (0, 3)}, r"Invalid size '\(0, 3\)'\. It must be a width and a height in") for call in FIGURES),
    *((plots.mosaic_figure, {"frames": frames}, "^Invalid frames '.*'. They must be of first, la") for frames in NONE),
])  # fmt: skip
def test_wrong_options(found, call, options, message):
    refuses(message, call, found if call is plots.mosaic_figure else sheet(), **options)


def texts(ax):
    """The title and the lines in the panel."""
    return [ax.get_title(), *(text.get_text() for text in ax.texts)]


@pytest.fixture(scope="module")
def found():
    return mosaic(common_points(affine_maps(np.random.default_rng(1))))


@pytest.mark.slow
def test_rims(found):
    """Without pictures each panel has the rims of the images in its frame, and says what the frame is worth."""
    figure = plots.mosaic_figure(found)
    assert len(figure.axes) == 5
    for ax, name in zip(figure.axes, ("first", "last", "central", "best", "mdt"), strict=True):
        frame = found.frames[name]
        assert ax.get_title().lower().startswith(name)
        assert f"Sum of Dist_F² = {frame.figure:.4g}" in texts(ax)
        drawn = np.array([path.vertices[:4] for path in ax.collections[0].get_paths()])
        there = moved(frame.matrices[2], np.array([[0.0, 0.0], [SIZES[2, 0], 0.0]]))
        # One scale and one shift in each panel.
        scale = np.hypot(*(drawn[2, 1] - drawn[2, 0])) / np.hypot(*(there[1] - there[0]))
        others = moved(frame.matrices[4], SIZES[4:5] * [[0.0, 0.0]]) - there[0]
        assert drawn[4, 0] - drawn[2, 0] == pytest.approx(scale * others[0], rel=1e-6)
        box = ax.get_position().width * figure.get_figwidth(), ax.get_position().height * figure.get_figheight()
        assert box[0] / box[1] == pytest.approx(np.ptp(ax.get_xlim()) / np.ptp(ax.get_ylim()), rel=1e-6)


@pytest.mark.slow
def test_pictures():
    pytest.importorskip("cv2")
    H = maps(np.random.default_rng(3))[:2]
    points = common_points(H, np.array([[float(WIDTH), float(HEIGHT)]] * 2))
    figure = plots.mosaic_figure(mosaic(points), open_pictures(cut(H)), frames=["mdt"], size=(6, 4))
    (image,) = figure.axes[0].images
    assert (np.asarray(image.get_array())[..., 3] > 0).mean() > 0.8


def test_impossible_frames():
    """A plane that sends an image through infinity has a title, and no picture."""
    K = np.array([[320.0, 0.0, 150.0], [0.0, 320.0, 100.0], [0.0, 0.0, 1.0]])
    # A camera that turns, with a field of view of 50 degrees.
    turns = Rotation.from_rotvec(np.outer([-55.0, -20.0, 20.0, 55.0], [0, 1, 0]), degrees=True).as_matrix()
    found = mosaic(common_points(K @ turns @ np.linalg.inv(K), SIZES[:4]), model="homography")
    assert found.frames["first"] is None
    first, mdt = plots.mosaic_figure(found, frames=["first", "mdt"]).axes
    assert texts(first) == ["First", "Impossible: the plane sends an image to infinity"]
    assert not first.collections
    assert f"Mean of Dist_F² = {found.frames['mdt'].figure:.4g}" in texts(mdt)
