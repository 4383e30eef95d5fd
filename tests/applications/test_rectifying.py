"""Rectified scans: generated scans of known maps come back to the plane of the truth."""

import numpy as np
import pytest
from old_map_points import grid
from PIL import Image
from refusals import refuses

from projdist import Projection, mean_plane_map
from projdist.applications.oldmaps import RECTIFIED_BY, ControlPoints, common_ground, old_map, rectify
from projdist.applications.oldmaps.rectifying import old_places

pytestmark = pytest.mark.slow

WIDTH, HEIGHT = 500, 380  # pixels of the scan
HALF = 0.5  # a pixel, which a rectified place may be off


def truth(x, y, bent):
    """True places of pixels, of which one is 20 m large; rows go down."""
    x, y = x / 500.0, y / 500.0
    east = x + 0.1 * y + bent * (0.12 * x * x + 0.06 * np.sin(3 * y))
    north = -y + 0.07 * x - bent * (0.1 * x * y + 0.04 * np.sin(4 * x))
    return 6e5 + 1e4 * east, 2e5 + 1e4 * north


def relief(east, north):
    """Grey as waves of 600 to 2000 m."""
    waves = np.sin(east / 100.0) * np.cos(north / 130.0) + np.sin((east + 2.0 * north) / 320.0)
    return 128.0 + 55.0 * waves


def sheet(bent, place, tmp_path, model="tps"):
    """An old map of 80 control points, and its scan; `place` takes columns and rows to the points' coordinates."""
    columns, rows = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    path = tmp_path / "scan.png"
    Image.fromarray(np.rint(relief(*truth(columns, rows, bent))).astype(np.uint8)).save(path)
    u, v = np.reshape(np.meshgrid(np.linspace(0, WIDTH, 10), np.linspace(0, HEIGHT, 8)), (2, -1))
    points = ControlPoints(np.stack(place(u, v), axis=-1), np.stack(truth(u, v, bent), axis=-1))
    return old_map(points, model=model), path


def shifts(found):
    """By how many pixels blocks of a rectified scan lie off the truth: least squares along the slopes of the grey."""
    height, width = found.pixels.shape[:2]
    east = found.left + found.side * (np.arange(width) + 0.5)
    north = found.top - found.side * (np.arange(height) + 0.5)
    true = relief(*np.meshgrid(east, north))
    slopes = np.gradient(true)
    gaps = found.pixels[..., 0] - true
    away = []
    for row in range(0, height - 40, 40):
        for column in range(0, width - 40, 40):
            block = slice(row, row + 40), slice(column, column + 40)
            if (found.pixels[(*block, -1)] == 255).all():
                A = np.stack([slope[block].ravel() for slope in slopes], axis=-1)
                away.append(np.hypot(*np.linalg.lstsq(A, gaps[block].ravel(), rcond=None)[0]))
    assert len(away) > 40
    return np.array(away)


WAYS = {"down": lambda u, v: (u, v), "up": lambda u, v: (u, HEIGHT - v), "negative": lambda u, v: (u, -v)}


@pytest.mark.parametrize("way", WAYS)
def test_a_bent_map_comes_back(way, tmp_path):
    """By the spline blocks are within half a pixel, however rows are counted; by linear maps what is bent stays so."""
    sheet_of = sheet(1.0, WAYS[way], tmp_path)
    found = rectify(*sheet_of)
    assert found.side == 22.0
    assert shifts(found).max() < HALF
    assert set(np.unique(found.pixels[..., -1])) == {0, 255}
    assert way != "down" or np.median(shifts(rectify(*sheet_of, by="mdt"))) > HALF


def test_linear_maps_come_back(tmp_path):
    """An affine map does by every way but a similarity's, which a stretched sheet cannot come back by."""
    sheet_of = sheet(0.0, WAYS["down"], tmp_path, model="affine")
    for by in RECTIFIED_BY:
        assert (shifts(rectify(*sheet_of, by=by)).max() < HALF) == (by != "helmert"), by


def test_resolution(tmp_path):
    """Larger pixels lie on multiples of their side, and have the mean of what is in them: no shift on average."""
    found = rectify(*sheet(1.0, WAYS["down"], tmp_path), resolution=60.0)
    assert (found.left % 60.0, found.top % 60.0) == (0.0, 0.0)
    height, width = found.pixels.shape[:2]
    places = np.meshgrid(found.left + 60.0 * (np.arange(width) + 0.5), found.top - 60.0 * (np.arange(height) + 0.5))
    true, there = relief(*places), found.pixels[..., -1] == 255
    A = np.stack([slope[there] for slope in np.gradient(true)], axis=-1)
    assert np.hypot(*np.linalg.lstsq(A, (found.pixels[..., 0] - true)[there], rcond=None)[0]) < HALF


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "P", "I;16"])
def test_kinds_of_images(mode, tmp_path):
    """Colours, palettes and deep greys are read; what is grey stays so."""
    found, path = sheet(0.0, WAYS["down"], tmp_path, model="affine")
    with Image.open(path) as image:
        deep = Image.fromarray(np.asarray(image).astype(np.uint16) * 257)
        (deep if mode == "I;16" else image.convert(mode)).save(tmp_path / "other.png")
    plain, other = rectify(found, path), rectify(found, tmp_path / "other.png")
    assert other.pixels.shape[2] == (2 if mode == "I;16" else 4)
    np.testing.assert_allclose(other.pixels[..., 0].astype(int), plain.pixels[..., 0], atol=5 if mode == "P" else 0)


def test_wrong_words(tmp_path):
    """What makes no sheet is refused."""
    found, path = sheet(0.0, WAYS["down"], tmp_path, model="affine")
    refuses(r"Invalid rectification 'tps'. It must be one of fit, mdt, affine, helmert", rectify, found, path, by="tps")
    refuses(r"Invalid resolution '0'. It must be positive", rectify, found, path, resolution=0)
    refuses(r"Invalid resolution '0.001'. It makes 8.93e\+13 pixels; 1e\+08 do", rectify, found, path, resolution=0.001)
    away = old_map(ControlPoints(found.points.old + 900.0, found.points.new), model="affine")
    refuses(r"It has 500 by 380 pixels, and 80 of 80 control points lie outside, as '1'", rectify, away, path)


SPLINE = 5e-3  # of Jacobians, by interpolation between 17 x 17 points; 1e-3 in the middle, most at the rim

SLOPES = (0.4, 0.3j, -0.1 + 0.3j)


def conformal(slope, ground=(0.0, 1.0), change=((1.0, 0.0), (0.0, 1.0)), side=17, **options):
    """A sheet of which exp(slope w) is the scale and turn at w = x + i y in truth; then a change of its plane."""
    new = grid(side) * [ground[1] - ground[0], 1.0] + [ground[0], 0.0]
    z = (np.exp(slope * (new @ [1.0, 1.0j])) - 1.0) / slope
    old = np.stack([z.real, z.imag], axis=-1) @ np.array(change).T
    return old_map(ControlPoints(old, 1000.0 * new), **(options or {"smoothing": 0.0}))


def test_the_way_back_and_the_mean():
    """What the fit brings to a place is where that is on the old map; beyond folds there is nothing."""
    found = conformal(0.4)
    old = np.random.default_rng(1).uniform(0.1, 0.9, (50, 2))
    np.testing.assert_allclose(old_places(found, found.fit(old)), old, atol=1e-8)
    folded = old_map(ControlPoints(grid(11), grid(11) - [0.0, 0.625] * grid(11) ** 2), model="polynomial2")
    assert np.isnan(old_places(folded, np.array([[0.5, 0.5]]))).all()
    # The mean of conformal maps has the geometric mean of the scales, and the mean turn: exp of the mean slope.
    ground = common_ground([conformal(slope) for slope in SLOPES])
    mean = mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area, degree=5)
    J = mean.jacobian(ground.x, ground.y)
    w = (ground.x + 1j * ground.y) / 1000.0
    slopes = 0.5 * (J[:, 0, 0] + J[:, 1, 1] + 1j * (J[:, 1, 0] - J[:, 0, 1]))
    ratio = slopes / np.exp(np.mean(SLOPES) * w)
    inside = (np.abs(w.real - 0.5) < 0.4) & (np.abs(w.imag - 0.5) < 0.4)
    np.testing.assert_allclose(ratio[inside] / ratio[inside].mean(), 1.0, atol=SPLINE)
    np.testing.assert_allclose(J[inside], np.conj(J[inside, ::-1, ::-1]) * [[1, -1], [-1, 1]], atol=2.0 * SPLINE)


def test_common_ground():
    """A mirrored, stretched and turned copy of a sheet has the same field: the mean is the sheet's own."""
    plain, other = conformal(0.4), conformal(0.4, change=((30.0, -80.0), (-50.0, -20.0)))
    ground = common_ground([plain, other])
    np.testing.assert_allclose(*np.linalg.svd(ground.jacobians, compute_uv=False), rtol=1e-6)
    assert mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area, degree=5).total < 1e-4
    # It is where the hulls overlap, in truth.
    ground = common_ground([conformal(0.4), conformal(0.3j, ground=(0.6, 1.8))])
    assert 600.0 < ground.x.min() < ground.x.max() < 1000.0
    assert ground.jacobians.shape == (2, ground.x.size, 2, 2)
    assert ground.area.sum() == pytest.approx(1.0)
    one, far = conformal(0.4), conformal(0.4, ground=(2.0, 3.0))
    refuses(r"There is no ground that all of them show", common_ground, [one, far])
    refuses(r"At least two are needed, not 1", common_ground, [one])
    refuses(r"Invalid rectification 'fit'", common_ground, [one, one], by="fit")


def test_planes_that_are_not_the_same():
    """Sheets whose control points state different planes have no ground to compare on; other units do not matter."""
    sheet = conformal(0.4, side=5, model="affine")

    def stating(crs):
        points = sheet.points.old, sheet.points.new + np.array([2e6, 6e5])
        return old_map(ControlPoints(*points, crs=Projection.from_user_input(crs)), model="affine")

    told = r"^Invalid old maps\. Their truth is in EPSG:2230 and EPSG:32611; it must be in"
    refuses(told, common_ground, [stating("EPSG:2230"), stating("EPSG:32611")])
    np.testing.assert_array_equal(*common_ground([stating("EPSG:2230"), stating("EPSG:26946")]).jacobians)
