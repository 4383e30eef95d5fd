"""Frames of mosaics side by side: what the panels show and say."""

import numpy as np
import pytest
from mosaic_pictures import HEIGHT, WIDTH, cut, maps
from mosaic_sets import SIZES, affine_maps, common_points, moved

from projdist import plots
from projdist.applications.mosaics import mosaic, open_pictures

FRAMES = ["first", "last", "central", "best", "mdt"]


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
    for ax, name in zip(figure.axes, FRAMES, strict=True):
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
    """With pictures these are drawn, in the frames that are asked for."""
    pytest.importorskip("cv2")
    H = maps(np.random.default_rng(3))[:2]
    points = common_points(H, np.array([[float(WIDTH), float(HEIGHT)]] * 2))
    figure = plots.mosaic_figure(mosaic(points), open_pictures(cut(H)), frames=["mdt"], size=(6, 4))
    (image,) = figure.axes[0].images
    assert (np.asarray(image.get_array())[..., 3] > 0).mean() > 0.8


def test_impossible_frames():
    """A plane that sends an image through infinity has a title, and no picture."""
    turns = np.radians([-55.0, -20.0, 20.0, 55.0])
    H = []
    for t in turns:  # a camera that turns by 110 degrees, with a field of view of 50
        K = np.array([[320.0, 0.0, 150.0], [0.0, 320.0, 100.0], [0.0, 0.0, 1.0]])
        R = np.array([[np.cos(t), 0.0, np.sin(t)], [0.0, 1.0, 0.0], [-np.sin(t), 0.0, np.cos(t)]])
        H.append(K @ R @ np.linalg.inv(K))
    found = mosaic(common_points(np.stack(H), SIZES[:4]), model="homography")
    assert found.frames["first"] is None
    figure = plots.mosaic_figure(found, frames=["first", "mdt"])
    first, mdt = figure.axes
    assert texts(first) == ["First", "Impossible: the plane sends an image to infinity"]
    assert not first.collections
    assert f"Mean of Dist_F² = {found.frames['mdt'].figure:.4g}" in texts(mdt)


def test_refused(found):
    """Frames that are none, and sizes, are refused."""
    for frames in ([], ["mdt", "middle"]):
        with pytest.raises(ValueError, match=r"^Invalid frames '.*'. They must be of first, last, ce"):
            plots.mosaic_figure(found, frames=frames)
    with pytest.raises(ValueError, match=r"Invalid size '\(0, 3\)'"):
        plots.mosaic_figure(found, size=(0, 3))
