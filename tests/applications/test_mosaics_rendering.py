"""Drawn mosaics, against the picture that their images were cut from."""

import dataclasses
import itertools

import numpy as np
import pytest
from gis_files import some_slow
from mosaic_pictures import HEIGHT, WIDTH, cut, maps, relief, sampled, save
from mosaic_sets import common_points, moved
from PIL import Image
from refusals import refuses
from tables import each

from projdist.applications.mosaics import match, mosaic, open_pictures, render, rendering
from projdist.applications.mosaics.images import Piece, Pixels
from projdist.applications.mosaics.rendering import (
    BLENDERS,
    BLENDS,
    PICTURE_SUFFIXES,
    Rendered,
    covered_box,
    save_mosaic,
)

pytest.importorskip("cv2")

SIZES = np.array([[float(WIDTH), float(HEIGHT)]] * 6)

# Decibels against the original of mosaics whose maps are known exactly. What is left is rounding to 8 bits, twice (two
# twelfths of a grey level squared are 56 dB), and two interpolations of a relief with slopes a pixel wide.
CLEAR = 42.0


def beneath(drawn, H):
    """What the pixels of a mosaic show of the original."""
    return sampled(relief(), H[0] @ np.linalg.inv(drawn.canvas.matrices[0]), drawn.canvas.width, drawn.canvas.height)


def decibels(drawn, truth, white=255.0):
    """The peak signal-to-noise ratio of what is drawn to what is there."""
    gap = (drawn.pixels[..., :3].astype(float) - truth)[drawn.pixels[..., 3] > 0]
    return 10.0 * np.log10(white**2 / np.mean(gap**2))


@pytest.fixture(scope="module")
def H():
    """Six pictures, a little sheared."""
    return maps(np.random.default_rng(3))


@pytest.fixture(scope="module")
def cuts(H):
    return cut(H)


@pytest.fixture(scope="module")
def pictures(cuts):
    return open_pictures(cuts)


@pytest.fixture(scope="module")
def found(H):
    """Their mosaic by points without noise."""
    return mosaic(common_points(H, SIZES))


some_blends = pytest.mark.parametrize("blend", some_slow(BLENDS, {*BLENDS} - {"feather"}))


@pytest.mark.slow
@some_blends
def test_the_mosaic_is_the_original(H, pictures, found, blend):
    """Each way to blend gives the picture back, and covers just what the images do."""
    drawn = render(found, pictures, blend=blend)
    assert decibels(drawn, beneath(drawn, H)) > CLEAR
    assert drawn.pixels.shape == (drawn.canvas.height, drawn.canvas.width, 4)
    assert not drawn.is_grey
    y, x = np.mgrid[: drawn.canvas.height, : drawn.canvas.width] + 0.5
    middles = np.column_stack([x.ravel(), y.ravel()])
    inside = [moved(np.linalg.inv(one), middles) / [WIDTH, HEIGHT] for one in drawn.canvas.matrices]
    covered = np.any([((one > 0) & (one < 1)).all(axis=1) for one in inside], axis=0).reshape(x.shape)
    # Rims go through pixels: of the few thousand along them some are counted otherwise.
    assert (covered != (drawn.pixels[..., 3] > 0)).mean() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("model", "tilt"), [("affine", 0.0), ("homography", 3e-4)])
def test_from_pixels_to_pixels(model, tilt):
    """The whole way, points found in the images, loses a few decibels at most."""
    H = maps(np.random.default_rng(3), tilt=tilt)
    pictures = open_pictures(cut(H))
    drawn = render(mosaic(match(pictures), model=model), pictures)
    assert decibels(drawn, beneath(drawn, H)) > CLEAR - 2.0


@pytest.mark.slow
@pytest.mark.parametrize("blend", BLENDS)
def test_tiles_do_not_show(monkeypatch, pictures, found, blend):
    """A mosaic in tiles is the same as in one piece, to a grey level of rounding."""
    whole = render(found, pictures, blend=blend).pixels.astype(int)
    monkeypatch.setattr(rendering, "_TILE", 192)
    tiled = render(found, pictures, blend=blend).pixels.astype(int)
    assert np.abs(tiled - whole).max() <= 1


def shown(found, pictures, exposure, H):
    """The logarithm of what is drawn over what is there, and where that is not too dark."""
    drawn = render(found, pictures, exposure=exposure, blend="none")
    whole = beneath(drawn, H)
    clear = (drawn.pixels[..., 3] > 0) & (whole.min(axis=-1) > 50)
    return np.log(np.maximum(drawn.pixels[..., :3], 1.0) / np.maximum(whole, 1.0)), clear


@pytest.mark.slow
def test_gains(H, cuts, found):
    """Pictures of different brightness are made equally bright; without that they are not."""
    gains = [0.8, 1.0, 0.9, 0.7, 0.95, 0.75]
    pictures = open_pictures([(gain * one).astype(np.uint8) for gain, one in zip(gains, cuts, strict=True)])
    spread = {}
    for exposure in ("gain", "none"):
        steps, clear = shown(found, pictures, exposure, H)
        spread[exposure] = steps[clear].std()
    assert spread["none"] > 0.1
    assert spread["gain"] < 0.3 * spread["none"]


@pytest.mark.slow
def test_vignettes(H, cuts, found):
    """Of pictures a third darker at their corners gains of blocks leave less than half of what shows at seams."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    far = np.hypot((x - WIDTH / 2) / (WIDTH / 2), (y - HEIGHT / 2) / (HEIGHT / 2)) / np.sqrt(2.0)
    shade = (1.0 - 0.35 * far**2)[..., None]
    pictures = open_pictures([np.round(shade * one).astype(np.uint8) for one in cuts])
    spread = {}
    for exposure in ("gain", "blocks"):
        steps, clear = shown(found, pictures, exposure, H)
        steps = steps.mean(axis=-1)
        # What shows are steps from one picture to the next, within a few pixels.
        both = clear[:, 4:] & clear[:, :-4]
        spread[exposure] = np.quantile(np.abs(steps[:, 4:] - steps[:, :-4])[both], 0.99)
    assert spread["blocks"] < 0.5 * spread["gain"]


@pytest.mark.slow
def test_small_canvas_and_crop(H, pictures, found):
    """A canvas that would be too large is reduced without aliasing, and that is said."""
    capped = mosaic(found.points, most_pixels=2e4)
    drawn = render(capped, pictures)
    assert 1.9e4 < drawn.canvas.width * drawn.canvas.height < 2.1e4
    assert any("The canvas would have" in note for note in capped.notes)
    # Against means over sixteen places a pixel.
    to_whole = H[0] @ np.linalg.inv(drawn.canvas.matrices[0])
    fine = sampled(relief(), to_whole @ np.diag([0.25, 0.25, 1.0]), 4 * drawn.canvas.width, 4 * drawn.canvas.height)
    means = fine.reshape(drawn.canvas.height, 4, drawn.canvas.width, 4, 3).mean(axis=(1, 3))
    assert decibels(drawn, means) > 30.0
    assert render(found, pictures, most_pixels=2e4).canvas.width == drawn.canvas.width
    # A cropped mosaic has no gaps and is in its place.
    drawn = render(found, pictures, crop=True)
    assert (drawn.pixels[..., 3] == 255).all()
    assert drawn.pixels.shape[:2] == (drawn.canvas.height, drawn.canvas.width)
    assert drawn.canvas.height * drawn.canvas.width > 0.85 * found.canvas().height * found.canvas().width
    assert decibels(drawn, beneath(drawn, H)) > CLEAR


def test_largest_box():
    """The largest covered box, against all boxes there are."""
    rng = np.random.default_rng(5)
    rows, columns = itertools.combinations(range(8), 2), itertools.combinations(range(10), 2)
    boxes = list(itertools.product(rows, columns))
    for _ in range(30):
        covered = rng.random((7, 9)) < 0.75
        areas = [(b - t) * (r - x) for (t, b), (x, r) in boxes if covered[t:b, x:r].all()]
        left, top, right, bottom = covered_box(covered)
        assert covered[top:bottom, left:right].all()
        assert (right - left) * (bottom - top) == max(areas)
    large = np.zeros((1000, 1500), bool)
    large[13:977, 21:1403] = True
    assert covered_box(large) == (21, 13, 1403, 977)
    refuses(r"Invalid crop. No box is covered by images.", covered_box, np.zeros((5, 5), bool))


@each("shape", [(5, 7), (399, 403), (1001, 1203)])
@each("holes", [[], [(0, 0)], [(-1, -1)], [(0, -1), (-1, 0)]])
def test_the_box_reaches_the_last_pixels(shape, holes):
    """A box is grown to what is not covered or to the picture's sides, also where cells do not divide them."""
    covered = np.ones(shape, bool)
    for hole in holes:
        covered[hole] = False
    left, top, right, bottom = covered_box(covered)
    assert covered[top:bottom, left:right].all()
    assert left == 0 or not covered[top:bottom, left - 1].all()
    assert top == 0 or not covered[top - 1, left:right].all()
    assert right == shape[1] or not covered[top:bottom, right].all()
    assert bottom == shape[0] or not covered[bottom, left:right].all()
    assert holes or (left, top, right, bottom) == (0, 0, shape[1], shape[0])


def test_feathers_fall_to_the_rims_of_pieces():
    """Two pieces side by side with ten columns in common: there each counts as its distance to its own end."""
    blender = BLENDERS["feather"]((0, 0, 70, 101))
    for left, width, grey in ((0, 50, 0), (40, 30, 200)):
        piece, whole = np.full((101, width, 3), grey, np.int16), np.full((101, width), 255, np.uint8)
        blender.feed(Piece((left, 0), Pixels(piece, whole)))
    colours, mask = blender.blend()
    column = np.arange(40, 50)
    one, other = 50.0 - column, column - 39.0
    np.testing.assert_allclose(colours[50, 40:50, 0], 200.0 * other / (one + other), atol=0.51)
    assert mask.all()


@pytest.mark.slow
@some_blends
def test_transparent_parts(H, cuts, found, blend):
    """What is transparent in an image is not drawn, and its colour does not shine through."""
    masked = [np.dstack([one, np.full(one.shape[:2], 255, np.uint8)]) for one in cuts]
    for one in masked:
        one[:40, :, :3], one[:40, :, 3] = 255, 0
    drawn = render(found, open_pictures(masked), blend=blend)
    assert (drawn.pixels[:20, :, 3] == 0).all()
    assert decibels(drawn, beneath(drawn, H)) > CLEAR - 4.0


@pytest.mark.slow
def test_left_out_is_not_drawn(pictures, found):
    """An image that nothing connects is named and is not in the picture."""
    seven = [*pictures, *open_pictures([np.zeros((40, 50), np.uint8)])]
    partly = mosaic(dataclasses.replace(found.points, sizes=np.vstack([SIZES, [[50.0, 40.0]]])))
    assert partly.left_out == ["6"]
    assert (render(partly, seven).pixels == render(found, pictures).pixels).all()


def test_refused(pictures, found):
    """Wrong words and wrong images are refused in one line."""
    given = render, found, pictures
    refuses(r"^Invalid blend 'soft'. It must be one of multiband, feather, none.$", *given, blend="soft")
    refuses(r"^Invalid exposure 'auto'. It must be one of gain, blocks, none.$", *given, exposure="auto")
    refuses(r"^Invalid images. They must be those of the correspondences", render, found, pictures[:5])


@pytest.mark.slow
@pytest.mark.parametrize("suffix", PICTURE_SUFFIXES)
def test_files(tmp_path, found, pictures, suffix):
    """Files hold the pixels, in colour or grey; JPEGs are white where nothing is."""
    drawn = render(found, pictures, blend="none")
    grey = Rendered(drawn.pixels[..., [0, 0, 0, 3]], drawn.canvas, True)
    for one, mode in ((drawn, "RGB"), (grey, "L")):
        path = save_mosaic(one, tmp_path / f"{mode}{suffix}")
        with Image.open(path) as image:
            assert image.mode == (mode if suffix in (".jpg", ".jpeg") else mode + "A")
            pixels = np.asarray(image.convert("RGBA"))
        seen = one.pixels[..., 3] > 0
        if suffix in (".jpg", ".jpeg"):
            assert pixels[~seen].mean() > 253
            assert np.abs(pixels[seen].astype(float) - one.pixels[seen]).mean() < 5
        else:
            assert (pixels == one.pixels).all()
        with pytest.raises(FileExistsError):
            save_mosaic(one, path, overwrite=False)


@pytest.mark.slow
def test_grey_images(tmp_path, cuts, found):
    """Grey images make a grey mosaic."""
    grey = save(tmp_path, [one.mean(axis=-1).astype(np.uint8) for one in cuts], ".jpg")
    drawn = render(found, open_pictures(grey))
    assert drawn.is_grey
    assert drawn.bands.shape[2] == 2
    assert (np.ptp(drawn.pixels[..., :3].astype(int), axis=-1) <= 1).all()


@pytest.mark.slow
@pytest.mark.parametrize("blend", BLENDS)
def test_twelve_bits(H, cuts, found, blend):
    """Pictures of 12 bits keep their values in a mosaic of 16; one of 8 has the whole range of greys."""
    pictures = open_pictures([one.astype(np.uint16) * 16 + 7 for one in cuts])
    assert pictures[0].levels == pictures[5].levels == (0.0, 4095.0)
    drawn = render(found, pictures, blend=blend, exposure="none", depth=16)
    assert drawn.pixels.dtype == np.uint16
    assert set(np.unique(drawn.pixels[..., 3])) == {0, 65535}
    assert decibels(drawn, 16.0 * beneath(drawn, H) + 7.0, 4095.0) > CLEAR
    shallow = render(found, pictures, blend=blend, exposure="none")
    # A mean square of 1: roundings; and seams may run elsewhere.
    assert decibels(shallow, drawn.pixels[..., :3] * (255.0 / 4095.0), 1.0) > 0.0


def test_files_of_sixteen_bits(tmp_path, cuts, found):
    """PNG and TIFF hold them, JPEG does not."""
    cv2 = pytest.importorskip("cv2")
    deep = open_pictures([one.astype(np.uint16) * 16 for one in cuts])
    drawn = render(found, deep, blend="none", depth=16, most_pixels=4e4)
    refuses(r"Invalid picture file '.*m.gif'. Its suffix must be .png", save_mosaic, drawn, tmp_path / "m.gif")
    for suffix in (".png", ".tif"):
        path = save_mosaic(drawn, tmp_path / f"deep{suffix}")
        again = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert (again[..., [2, 1, 0, 3]] == drawn.pixels).all()
    refuses(r"For 16 bits a colour its suffix must be .png, .tif or .tiff.$", save_mosaic, drawn, tmp_path / "deep.jpg")
    refuses(r"^Invalid depth 12. It must be 8 or 16 bits.$", render, found, open_pictures(cuts), depth=12)
