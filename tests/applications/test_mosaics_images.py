"""Images of mosaics: what is read of files, and the points found in them against known maps."""

import sys

import numpy as np
import pytest
from mosaic_pictures import HEIGHT, WIDTH, aerial, blobs, cut, maps, page, places, sampled, save, spectrum
from mosaic_sets import moved, turned, write_csv
from PIL import Image
from refusals import refuses

from projdist.applications.mosaics import correspondences, correspondences_of, match, mosaic, open_pictures
from projdist.applications.mosaics.images import Picture

# Pixels. Features of SIFT lie within a tenth to a few tenths of a pixel (median 0.1); maps by two hundred of them
# a pair are as good at the rims.
SUB_PIXEL = 0.3


def pairs_apart(found, H):
    """The largest distance in pixels, over images that overlap by a third, of their maps from the known ones."""
    M = found.matrices
    worst = 0.0
    for i in range(len(H)):
        for j in range(len(H)):
            known = moved(np.linalg.solve(H[j], H[i]), places())
            inside = ((known >= 0) & (known <= [WIDTH, HEIGHT])).all(axis=1)
            if i != j and inside.mean() > 0.25:
                got = moved(np.linalg.solve(M[j], M[i]), places())
                worst = max(worst, float(np.abs(got - known)[inside].max()))
    return worst


@pytest.mark.slow
@pytest.mark.parametrize(("model", "tilt"), [("affine", 0.0), ("homography", 3e-4)])
def test_registration_recovers_the_maps(model, tilt):
    """Pictures warped by known maps are registered to a fraction of a pixel."""
    H = maps(np.random.default_rng(3), tilt=tilt)
    points = match(open_pictures(cut(H)))
    rows = zip(points.i, points.j, points.xi, strict=True)
    known = np.array([moved(np.linalg.solve(H[j], H[i]), x[None])[0] for i, j, x in rows])
    assert np.median(np.hypot(*(known - points.xj).T)) < 0.15
    assert pairs_apart(mosaic(points, model=model), H) < SUB_PIXEL


@pytest.mark.slow
@pytest.mark.parametrize("fine", [0.5, 1.0])
def test_large_images_are_reduced(monkeypatch, fine):
    """Features of reduced images are in pixels of the whole ones, without a shift; larger ones are nearer."""
    pytest.importorskip("cv2")
    H = maps(np.random.default_rng(3))[:2]
    pictures = open_pictures(cut(H))
    monkeypatch.setattr(correspondences, "_COARSE", 0.25 * WIDTH * HEIGHT)
    monkeypatch.setattr(correspondences, "_FINE", fine * WIDTH * HEIGHT)
    heard = []
    points = match(pictures, progress=lambda *steps: heard.append(steps))
    # Two images, a pair, and the two images again.
    assert heard[0] == (1, 2)
    assert heard[-1] == (5, 5)
    np.testing.assert_allclose(points.reductions, 1.0 / np.sqrt(fine))
    assert pairs_apart(mosaic(points), H) < (2 if fine < 1 else 1) * SUB_PIXEL


# What is looked at has the same size in leaves; the files differ.
AERIAL = {"small": (577, 433, 1.33, 1.7e4, 6.7e4), "4 megapixels": (2309, 1732, 5.33, 2.7e5, 1.07e6)}


@pytest.mark.slow
@pytest.mark.parametrize("size", AERIAL)
def test_leaves_move(monkeypatch, size):
    """Photos whose clearest features are leaves, which no two of them share, are all found, to a pixel of the file."""
    pytest.importorskip("cv2")
    width, height, leaves, coarse, fine = AERIAL[size]
    pictures, H = aerial(np.random.default_rng(1), width, height, leaves)
    monkeypatch.setattr(correspondences, "_COARSE", coarse)
    monkeypatch.setattr(correspondences, "_FINE", fine)
    found = mosaic(match(open_pictures(pictures)))
    assert found.images == list(range(6))
    rim = places() * [width / WIDTH, height / HEIGHT]
    for (i, j), S in {(m.i, m.j): np.linalg.solve(H[m.j], H[m.i]) for m in found.registration.matches}.items():
        known = moved(S, rim)
        inside = ((known >= 0) & (known <= [width, height])).all(axis=1)
        got = moved(np.linalg.solve(found.matrices[j], found.matrices[i]), rim)
        assert np.hypot(*(got - known)[inside].T).max(initial=0.0) < 1.0


def overlap_apart(found, H):
    """Distances in pixels of the first two images' maps from the known ones, where the images overlap."""
    x = np.stack(np.meshgrid(np.linspace(0, 420, 13), np.linspace(0, 320, 13)), axis=-1).reshape(-1, 2)
    known, got = (moved(np.linalg.solve(M[1], M[0]), x) for M in (H, found.matrices))
    inside = ((known >= 0) & (known <= [420, 320])).all(axis=1)
    return np.hypot(*(got - known)[inside].T)


@pytest.mark.slow
def test_text():
    """Of printed letters, which look alike, those at their places are told from others; of two pages none are."""
    pytest.importorskip("cv2")
    H = [turned(20.0, 20.0, 0.02), turned(330.0, 60.0, -0.03), turned(60.0, 270.0, 0.05)]
    found = mosaic(match(open_pictures([sampled(page(3), one) for one in H])))
    assert found.images == [0, 1, 2]
    assert min(match.agree / match.points for match in found.registration.matches) < 0.12
    assert overlap_apart(found, H).max() < SUB_PIXEL
    with pytest.raises(ValueError, match=r"0 and 1, [0-9]+ of 2[0-9]+ points agree, no more than by chance"):
        mosaic(match(open_pictures([sampled(page(seed), H[0]) for seed in (11, 21)])))


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "kept"), [(2, 6), (5, 10)])
def test_few_blobs(seed, kept):
    """Of seven or thirteen points, as cells under a microscope have, those that are right are enough."""
    pytest.importorskip("cv2")
    H = [turned(20.0, 20.0, 0.02), turned(230.0, 60.0, -0.03)]
    points = match(open_pictures([sampled(blobs(seed), one) for one in H]))
    (pair,) = mosaic(points).registration.matches
    right = np.hypot(*(moved(np.linalg.solve(H[1], H[0]), points.xi) - points.xj).T) < 4.0
    assert pair.agree == right.sum() == kept
    assert pair.false_alarms < -10


@pytest.mark.slow
def test_mirrored_pictures():
    """A picture and its mirror image, as of a slide turned over, make no mosaic."""
    pytest.importorskip("cv2")
    one = cut(maps(np.random.default_rng(3)))[0]
    with pytest.raises(ValueError, match=r"^Invalid orientation of 1\. They mirror the others"):
        mosaic(match(open_pictures([one, np.ascontiguousarray(one[:, ::-1])])))


@pytest.mark.slow
def test_tiles():
    """Fifteen tiles, more than are all matched with one another, are found in their places by fewer pairs."""
    pytest.importorskip("cv2")
    rng = np.random.default_rng(1)
    scene = 110.0 + 30.0 * spectrum(rng, 1500, 950, 3.0, 100.0)
    H = [turned(40.0 + 260.0 * (k % 5), 40.0 + 260.0 * (k // 5), 0.03 * rng.normal()) for k in range(15)]
    points = match(open_pictures([sampled(scene, one, WIDTH, HEIGHT + 60) for one in H]))
    pairs = set(zip(points.i.tolist(), points.j.tolist(), strict=True))
    assert len(pairs) < 15 * 14 / 2
    found = mosaic(points)
    assert found.images == list(range(15))
    assert pairs_apart(found, np.stack(H)) < SUB_PIXEL


def test_nothing_in_common():
    """Pictures without a feature, or of other things, have no points."""
    pytest.importorskip("cv2")
    rng = np.random.default_rng(1)
    noise = [rng.integers(0, 255, size=(80, 90), dtype=np.uint8) for _ in range(2)]
    for sources in ([np.zeros((50, 60), np.uint8)] * 2, noise):
        refuses(r"Invalid images. No two of them have anything in common.", match, open_pictures(sources))
    refuses(r"At least two are needed, not 1.", match, open_pictures(noise[:1]))


def test_without_opencv(monkeypatch):
    """What is missing is said in one line."""
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(ImportError, match=r"^Invalid images.* takes OpenCV: pip install 'projdist\[mosaic\]'.$"):
        match(open_pictures([np.zeros((50, 60), np.uint8)] * 2))


def test_kinds_of_images(tmp_path):
    """Grey and coloured images of 8 and 16 bits, with palettes and alpha, are read alike."""
    pytest.importorskip("cv2")
    values = np.arange(48, dtype=np.uint8).reshape(6, 8) * 5
    grey, colours = Image.fromarray(values), Image.fromarray(np.repeat(values[..., None], 3, axis=2))
    alpha = colours.copy()
    alpha.putalpha(Image.fromarray(np.where(values < 100, 0, 255).astype(np.uint8)))
    deep = Image.fromarray(values.astype(np.uint16) * 257)
    files = {"grey.png": grey, "rgb.tif": colours, "rgba.png": alpha, "deep.png": deep, "deep.tif": deep}
    for name, image in {**files, "palette.png": grey.convert("P"), "cmyk.tif": colours.convert("CMYK")}.items():
        image.save(tmp_path / name)
        picture = Picture(tmp_path / name)
        pixels = picture.read()
        assert picture.size == (8, 6)
        assert np.abs(pixels.colours.astype(int) - values[..., None]).max() <= (1 if "cmyk" in name else 0)
        assert picture.is_grey == (name[:4] in ("grey", "deep"))
        assert (pixels.mask == 255).all() if "rgba" not in name else ((pixels.mask == 0) == (values < 100)).all()


@pytest.mark.parametrize("orientation", range(1, 9))
def test_upright(tmp_path, orientation):
    """Images that lie on their side are turned as their EXIF data say: the first row is at the top."""
    upright = np.arange(48, dtype=np.uint8).reshape(6, 8)
    # What a camera stores, from EXIF 2.3, 4.6.4 A: where the 0th row and the 0th column are.
    T = upright.T
    ways = [upright, upright[:, ::-1], upright[::-1, ::-1], upright[::-1], T, T[::-1], T[::-1, ::-1], T[:, ::-1]]
    stored, exif = np.ascontiguousarray(ways[orientation - 1]), Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(stored).save(tmp_path / "turned.png", exif=exif)
    Image.fromarray(stored.astype(np.uint16) * 80).save(tmp_path / "deep.png", exif=exif)
    picture, deep = Picture(tmp_path / "turned.png"), Picture(tmp_path / "deep.png")
    assert picture.size == deep.size == (8, 6)
    assert (picture.read().colours[..., 0] == upright).all()
    # OpenCV reads deep images as they are stored.
    pytest.importorskip("cv2")
    assert (deep.read(deep=True).colours[..., 0] == np.round(upright * (80.0 * 65535.0 / 4095.0))).all()


def test_one_range_for_all(tmp_path):
    """Of 12 bits in files of 16, and of numbers that are no whole ones, black and white are one for all images."""
    cv2 = pytest.importorskip("cv2")
    values = np.arange(48).reshape(6, 8)
    for name, one in (("dark.png", values), ("bright.tif", values * 85 + 100)):
        Image.fromarray(one.astype(np.uint16)).save(tmp_path / name)
    dark, bright = open_pictures([tmp_path / "dark.png", tmp_path / "bright.tif"])
    assert dark.levels == bright.levels == (0.0, 4095.0)
    assert (dark.read().colours[..., 0] == np.round(values * 255 / 4095)).all()
    assert (bright.read(deep=True).colours[..., 0] == np.round((values * 85 + 100) * 65535 / 4095)).all()
    colours = np.stack([values, 2 * values, 85 * values], axis=-1).astype(np.uint16)
    cv2.imwrite(str(tmp_path / "colours.png"), colours[..., ::-1])
    picture = Picture(tmp_path / "colours.png")
    assert (picture.is_deep, picture.is_grey) == (True, False)
    assert (picture.read().colours == np.round(colours * 255.0 / 4095)).all()
    assert (Picture(colours).read().colours == picture.read().colours).all()


def test_floats(tmp_path):
    """Floating-point TIFFs are read, of one band and of three, from what all have least to what all have most."""
    cv2 = pytest.importorskip("cv2")
    values = np.linspace(-3.0, 7.0, 48, dtype=np.float32).reshape(6, 8)
    Image.fromarray(values).save(tmp_path / "one.tif")
    plain = [cv2.IMWRITE_TIFF_COMPRESSION, 1]  # what old versions compress loses digits
    cv2.imwrite(str(tmp_path / "three.tif"), np.stack([values, 0 * values, values + 10.0], axis=-1), plain)
    one, three = open_pictures([tmp_path / "one.tif", tmp_path / "three.tif"])
    assert (one.is_grey, three.is_grey, three.size) == (True, False, (8, 6))
    assert one.levels == three.levels == (-3.0, 17.0)
    assert (one.read().colours[..., 1] == np.round((values + 3.0) * (255.0 / 20.0))).all()
    assert (three.read().colours[..., 0] == np.round((values + 13.0) * (255.0 / 20.0))).all()
    hole = values.copy()
    hole[2:4, 3] = np.nan
    assert (Picture(hole).read().mask == np.where(np.isnan(hole), 0, 255)).all()
    told = r"^Invalid image '0'. It cannot be read: its shape is \(6, 8, 5\), of float32\.$"
    refuses(told, open_pictures, [np.zeros((6, 8, 5), np.float32)])


def test_no_data(tmp_path):
    """What a GeoTIFF calls no data is transparent."""
    rasterio = pytest.importorskip("rasterio")
    values = np.linspace(0.0, 1.0, 48, dtype=np.float32).reshape(6, 8)
    values[1, 2] = -9999.0
    options = {"driver": "GTiff", "width": 8, "height": 6, "count": 1, "dtype": "float32", "nodata": -9999.0}
    with rasterio.open(tmp_path / "dem.tif", "w", transform=rasterio.Affine(5, 0, 9, 0, -5, 9), **options) as file:
        file.write(values, 1)
    picture = Picture(tmp_path / "dem.tif")
    assert picture.levels == (0.0, 1.0)
    assert np.argwhere(picture.read().mask == 0).tolist() == [[1, 2]]


def test_unreadable(tmp_path):
    """What is no image, is broken or has other pixels is told with its file, in one line."""
    text, tif, broken, ppm, bomb = (tmp_path / name for name in ("a.png", "a.tif", "b.png", "b.ppm", "bomb.png"))
    text.write_text("no image")
    tif.write_text("no image")
    Image.fromarray(np.random.default_rng(1).integers(0, 255, (90, 90), np.uint8)).save(broken)
    broken.write_bytes(broken.read_bytes()[:4000])
    for path, reason in ((text, "identify"), (tif, "identify"), (tmp_path / "none.png", "No such")):
        refuses(f"Invalid image '{path}'. .*{reason}", open_pictures, [path])
    refuses(f"Invalid image '{broken}'. It cannot be read", open_pictures, [broken])
    ppm.write_text("P6 4O 50 255 ")
    refuses(r"Invalid image '.*b\.ppm'\. It cannot be read: invalid literal for int", open_pictures, [ppm])
    refuses(r"It has 40000 x 1 pixels; 32766 a side do.", Picture, np.zeros((1, 40000), np.uint8))
    refuses(r"Invalid image '.*a.png'. It must be given once.", open_pictures, [text, text])
    # A file of 12 kB may claim more pixels than memory should hold.
    Image.new("1", (10_001, 10_000)).save(bomb)
    refuses(r"Invalid image '.*bomb\.png'\. It cannot be read: 10001 x 10000 pixels are more", open_pictures, [bomb])


def test_names_and_points_of_files(tmp_path):
    """Images are called by their files, and by their paths where that is not enough."""
    pictures = [np.zeros((5, 5), np.uint8)] * 2
    first = save(tmp_path, pictures)
    (tmp_path / "b").mkdir()
    second = save(tmp_path / "b", pictures)
    assert [one.name for one in open_pictures(first)] == ["sheet0.png", "sheet1.png"]
    assert [one.name for one in open_pictures([first[0], second[0]])] == [str(first[0]), str(second[0])]
    # Points that were measured in reduced images are those of the images at hand.
    pictures = open_pictures([np.zeros((60, 90), np.uint8)] * 2)
    half = correspondences.Correspondences(i=[0], j=[1], xi=[[10.0, 20.0]], xj=[[30.0, 15.0]], sizes=[[45.0, 30.0]] * 2)
    found = correspondences_of(pictures, write_csv(tmp_path / "half.csv", half))
    assert (found.xi.tolist(), found.xj.tolist()) == ([[20.0, 40.0]], [[60.0, 30.0]])
    assert (found.sizes == [90, 60]).all()
    assert found.names == ("0", "1")
    plain = correspondences_of(pictures, write_csv(tmp_path / "plain.csv", half, sizes=False))
    assert plain.xi.tolist() == [[10.0, 20.0]]
    wide = open_pictures([np.zeros((60, 100), np.uint8)] * 2)
    path, more = tmp_path / "half.csv", [*pictures, pictures[0]]
    refuses(r"Invalid image '0'. Its shape is not that of the correspondences.", correspondences_of, wide, path)
    refuses(r"Invalid images. There are 3; the correspondences are for 2.", correspondences_of, more, path)


def test_many_images_are_matched_with_what_resembles_them(monkeypatch):
    """Each of twelve with its neighbours, and with the two that most of its clearest features resemble."""
    pytest.importorskip("cv2")
    monkeypatch.setattr(correspondences, "_ALL_PAIRS", 3)
    monkeypatch.setattr(correspondences, "_RESEMBLING", 2)
    rng = np.random.default_rng(2)
    kinds = rng.uniform(0, 255, (4, 30, 128))
    # Images 0, 4, 8 show one thing, 1, 5, 9 another; the last one nothing.
    shown = [(kinds[k % 4] + rng.normal(0, 1, (30, 128))).astype(np.float32) for k in range(11)]
    shown.append(np.zeros((0, 128), np.float32))
    found = [correspondences._Features(np.zeros((len(one), 2)), one, 1.0) for one in shown]
    pairs = set(correspondences._candidates(found))
    assert {(k, k + 1) for k in range(11)} <= pairs
    assert {(0, 4), (0, 8), (4, 8), (1, 5), (5, 9), (3, 7)} <= pairs
    assert (0, 6) not in pairs
    assert len(pairs) < 12 * 11 / 2
    assert set(correspondences._candidates(found[:3])) == {(0, 1), (0, 2), (1, 2)}
