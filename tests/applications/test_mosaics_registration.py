"""Images registered by the points that they have in common: exact recovery, wrong points, components, mirrors."""

import dataclasses
import functools
import math
import tracemalloc

import numpy as np
import pytest
from mosaic_sets import MAKERS, SIZES, affine_maps, common_points, homographies, moved, turned, write_csv
from refusals import refuses
from scipy.optimize import least_squares
from tables import each

from projdist.applications.mosaics import Correspondences, parse_sizes, read_correspondences, register
from projdist.applications.mosaics.bundle_adjustment import _false_alarms

MODELS = pytest.mark.parametrize("model", MAKERS)


def relative(H):
    """From each image into the first, with a last entry of 1."""
    S = np.linalg.solve(H[0], H)
    return S / S[:, 2:, 2:]


def errors(H, points):
    """Both distances of each pair of points, by the definition."""
    found = []
    for i, j, xi, xj in zip(points.i, points.j, points.xi, points.xj, strict=True):
        S = np.linalg.inv(H[j]) @ H[i]
        found += [moved(S, xi[None])[0] - xj, moved(np.linalg.inv(S), xj[None])[0] - xi]
    return np.array(found)


@MODELS
def test_exact_points_give_the_maps(model):
    """From points without error the maps come back to rounding, whatever plane they were made in."""
    H = MAKERS[model](np.random.default_rng(1))
    found = register(common_points(H), model=model)
    np.testing.assert_allclose(relative(found.matrices), relative(H), rtol=1e-10, atol=1e-12)
    assert found.rms_pixels < 1e-9
    assert (found.images, found.left_out, found.components) == (list(range(6)), [], [list(range(6))])


@MODELS
def test_the_least_symmetric_transfer_error(model):
    """The RMS is that of the definition, and scipy's general least squares find none that is less."""
    rng = np.random.default_rng(2)
    points = common_points(MAKERS[model](rng, count=3), SIZES[:3], rng, noise=0.5, grid=5)
    found = register(points, model=model)
    H = relative(found.matrices)
    size = 6 if model == "affine" else 8
    least = np.sum(errors(H, points) ** 2)
    assert found.rms_pixels == pytest.approx(np.sqrt(least / (2 * len(points.i))), rel=1e-10)

    def residuals(entries):
        maps = np.tile(np.eye(3), (3, 1, 1))
        maps[1:].reshape(2, 9)[:, :size] = entries.reshape(2, size)
        return errors(maps, points).ravel()

    start = H[1:].reshape(2, 9)[:, :size].ravel()
    again = least_squares(residuals, start, x_scale="jac", max_nfev=5)
    assert 2.0 * again.cost == pytest.approx(least, rel=1e-9)
    np.testing.assert_allclose(again.x, start, rtol=1e-4, atol=1e-6)


@pytest.mark.slow
@MODELS
@pytest.mark.parametrize("share", [0.1, 0.5])
def test_wrong_points_do_not_count(model, share):
    """With half of the points at random places the maps are the exact ones, and the same each time."""
    rng = np.random.default_rng(5)
    H = MAKERS[model](rng)
    points = common_points(H, grid=15)
    wrong = rng.random(len(points.i)) < share
    points.xj[wrong] = rng.uniform(size=(wrong.sum(), 2)) * [300.0, 200.0]
    found = register(points, model=model, tolerance=0.5)
    np.testing.assert_allclose(relative(found.matrices), relative(H), rtol=2e-3, atol=2e-3)
    for match in found.matches:
        right = np.sum(~wrong[(points.i == match.i) & (points.j == match.j)])
        # A wrong point may by chance be right; and six right ones of more may be there by chance.
        assert match.agree in (right, right + 1) or (match.agree == 0 and right <= 6)
    np.testing.assert_array_equal(register(points, model=model, tolerance=0.5).matrices, found.matrices)


def test_what_does_not_count():
    """A point of twenty that is off by ten pixels does not count, and the maps are exact."""
    H = affine_maps(np.random.default_rng(9), count=2)
    points = common_points(H, SIZES[:2])
    points.xj[3] += 10.0
    found = register(points)
    np.testing.assert_allclose(relative(found.matrices), relative(H), rtol=1e-10, atol=1e-12)
    assert found.matches[0].agree == len(points.i) - 1
    # A pair whose points lie on a line is refused with that reason, and the images that it alone connects are left.
    H = np.tile(np.eye(3), (3, 1, 1))
    H[:, 0, 2] = [0.0, 150.0, 300.0]
    good = common_points(H, SIZES[:3], pairs=[(0, 1)])
    x = np.column_stack([np.linspace(160.0, 290.0, 20), np.full(20, 100.0)])
    i, j = np.r_[good.i, np.full(20, 1)], np.r_[good.j, np.full(20, 2)]
    xi, xj = np.vstack([good.xi, x]), np.vstack([good.xj, x - [150.0, 0.0]])
    found = register(Correspondences(i=i, j=j, xi=xi, xj=xj, sizes=SIZES[:3]))
    assert (found.images, found.left_out) == ([0, 1], [2])
    assert found.matches[1].reason == "the points lie on a line"
    # The largest group is registered; other groups and single images are reported, none silently.
    H = np.tile(np.eye(3), (7, 1, 1))
    H[:, 0, 2] = [0.0, 0.0, 150.0, 1000.0, 1150.0, 1300.0, 9000.0]
    found = register(common_points(H, np.array([[300.0, 200.0]] * 7)))
    assert (found.images, found.left_out) == ([0, 1, 2], [3, 4, 5, 6])
    assert found.components == [[0, 1, 2], [3, 4, 5]]
    np.testing.assert_allclose(relative(found.matrices)[:, :2, 2], [[0, 0], [0, 0], [150, 0]], atol=1e-9)


def two_images(xi, xj, tolerance=4.0, model="affine"):
    """The match of two images with these points."""
    points = Correspondences(i=np.zeros(len(xi)), j=np.ones(len(xi)), xi=xi, xj=xj, sizes=SIZES[:2])
    try:
        return register(points, tolerance=tolerance, model=model).matches[0]
    except ValueError:
        return None


@pytest.mark.slow
@MODELS
def test_few_right_points_are_no_chance(model):
    """Eleven right points of 13 are certain, four of 23 nothing."""
    rng = np.random.default_rng(10)
    for right, count, kept in ((11, 13, True), (4, 23, False)):
        x = rng.uniform(size=(count, 2)) * [300.0, 200.0]
        y = moved(MAKERS[model](rng, count=1)[0], x) + rng.normal(size=x.shape)
        y[right:] = rng.uniform(size=(count - right, 2)) * [300.0, 200.0]
        found = two_images(x, y, model=model)
        assert (found is not None) == kept
        assert not kept or found.agree >= right


def test_the_number_of_false_alarms():
    """Of exact points it is that of Moisan and Stival's formula, written out; one place counts once."""
    rng = np.random.default_rng(11)
    x = rng.uniform(size=(20, 2)) * [300.0, 200.0]
    y = x + [0.0, 2.0] + 0.5 * rng.choice([-1.0, 1.0], size=(20, 1)) * [0.0, 1.0]
    S = turned(0.0, 2.0, 0.0)
    # Every point is off by half a pixel: all twenty at that precision.
    expected = 17 * math.comb(20, 3) * (math.pi * 0.25 / 60000.0) ** 17
    for again in (1, 2):
        pairs = np.tile(x, (again, 1)), np.tile(y, (again, 1))
        found = _false_alarms(S, *pairs, 4.0, 60000.0, 3)
        assert found == pytest.approx(math.log10(expected), rel=1e-9)


@pytest.mark.slow
def test_chance_is_not_believed():
    """Of a hundred pairs of images with random points none is accepted: a tenth of one is to be expected."""
    rng = np.random.default_rng(12)
    for _ in range(100):
        x = rng.uniform(size=(2, int(rng.integers(8, 25)), 2)) * [300.0, 200.0]
        assert two_images(*x) is None


@pytest.mark.slow
@MODELS
def test_the_model_that_made_the_points(model):
    """It is chosen over many sets of noisy points; exact points, too, which both models fit, are of the simpler one."""
    chosen = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        H = MAKERS[model](rng, spread=0.02)
        for noise in (0.0, 0.3):
            points = common_points(H, SIZES, rng, noise=noise, grid=6)
            chosen.append(register(points, model="auto", tolerance=6.0).model)
    assert chosen == [model] * 16


def test_torrs_criterion():
    """It is the formula, written out for two images by the least errors of either model."""
    rng = np.random.default_rng(13)
    points = common_points(homographies(rng, 0.02, 2), SIZES[:2], rng, noise=0.5)
    found, count, sizes, squares = register(points, tolerance=20.0), len(points.i), {"affine": 6, "homography": 8}, {}
    for model in sizes:
        gaps = errors(register(points, model=model, tolerance=20.0).matrices, points)
        squares[model] = (gaps.reshape(count, 4) ** 2).sum(axis=1)
        rms = np.sqrt(squares[model].sum() / (2 * count))
        assert found.models[model].rms_pixels == pytest.approx(rms, rel=1e-6)
    noise = squares["homography"].sum() / 4.0 / (2 * count - 8)
    for model, size in sizes.items():
        gric = np.minimum(squares[model] / 4.0 / noise, 4.0).sum() + 2 * count * np.log(4) + size * np.log(4 * count)
        assert found.models[model].gric == pytest.approx(gric, rel=1e-6)


@pytest.mark.slow
@MODELS
def test_mirrored_images_are_named(model):
    """Images that mirror the others are refused by name, whichever is the first."""
    H = MAKERS[model](np.random.default_rng(7), count=5)
    for odd, told in (([2], "c"), ([0, 3], "a and d"), ([1, 2, 3, 4], "a")):
        mirrored = H.copy()
        mirrored[odd] = mirrored[odd] @ [[-1.0, 0.0, 300.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        points = dataclasses.replace(common_points(mirrored, SIZES[:5]), names=tuple("abcde"))
        match = rf"^Invalid orientation of {told}\. They mirror the others; all must agree\.$"
        refuses(match, register, points, model=model)


def test_the_table(tmp_path):
    """The rows of a model, sizes from the comment line in either order, numbers of images from 0."""
    points = common_points(affine_maps(np.random.default_rng(8)))
    path = write_csv(tmp_path / "points.csv", points)
    found = read_correspondences(path)
    for name in ("i", "j", "xi", "xj", "sizes"):
        np.testing.assert_array_equal(getattr(found, name), getattr(points, name))
    path.write_text("model,i,j,xi,yi,xj,yj\naffine,0,1,1,2,3,4\n1,1,0,5,6,7,8\n\n# sizes w x h: 30x20, 40x30\n")
    found = read_correspondences(path, model="homography", names=["a", "b"])
    np.testing.assert_array_equal([found.i[0], found.j[0], *found.xi[0], *found.xj[0]], [1, 0, 5, 6, 7, 8])
    np.testing.assert_array_equal(found.sizes, [[30, 20], [40, 30]])
    assert found.name(1) == "b"
    np.testing.assert_array_equal(read_correspondences(path, sizes=parse_sizes("9x8")).sizes, [[9, 8], [9, 8]])


TWO, ONES = "# sizes h x w: (9, 9), (9, 9)\n", "0,0,1,1,1,1,1\n"


@each(("text", "message"), [
    ("", r"It is empty\.$"),
    ("model,i,j,xi,yi,xj,yj\n", r"It has no rows; it must have some of the model affine\.$"),
    ("0,0,1,1,5,2,3,4,5\n", r"Line 1 must be model,i,j,xi,yi,xj,yj"),
    ("model,i,j,xi,yi,xj,yj\n0,0,1,1,5,2,3,4,5\n", r"Line 2 has 9 cells; it must have 7\. Decimal commas are read"),
    ("1,0,1,1,1,1,1\n", r"It has rows of the model homography; it must have some of the model affine\.$"),
    ("0,0,1,1,1,1\n", r"Line 1 must be model,i,j,xi,yi,xj,yj"),
    (TWO + "0,0,one,1,1,1,1\n", r"Line 2 must be model"),
    ("0,0,1.5,1,1,1,1\n", r"Line 1 must be model"),
    ("0,0,nan,1,1,1,1\n", r"Line 1 must be model"),
    ("2,0,1,1,1,1,1\n", r"Line 1 must be model"),
    (ONES, r"The sizes of the images must be given, or stand in a comment line"),
    (TWO + ONES + "0,0,2,1,1,1,1\n", r"correspondence 2\. Its images must be numbers"),
    (TWO + "0,0,-1,1,1,1,1\n", r"correspondence 1\. Its images must be numbers from 0 to 1"),
    (TWO + "0,1,1,1,1,1,1\n", r"correspondence 1\. It pairs an image with itself\.$"),
    (TWO + "0,0,1,1,nan,1,1\n", r"correspondence 1\. Its coordinates must be finite\.$"),
    (TWO.replace("(9", "(0", 1) + ONES, r"^Invalid sizes of images\. They must be given, in pixels"),
])  # fmt: skip
def test_the_table_is_checked(tmp_path, text, message):
    """What is wrong with a table is told in one line, with its place."""
    path = tmp_path / "points.csv"
    path.write_text(text)
    refuses(message, read_correspondences, path)


@each(("number", "ends"), [(9_999_999, "0 to 9999999"), (-1, "-1 to 1"), (3, "0 to 3")])
def test_numbers_of_images_without_a_gap(number, ends, tmp_path):
    """One size for all images tells not how many there are: a wrong number must not make millions of them."""
    path = tmp_path / "points.csv"
    path.write_text(f"0,0,1,1,1,1,1\n0,0,{number},1,1,1,1\n")
    told = rf"'\. Its 3 images are numbered {ends}; they must be 0 to 2, or the size of every image must be given\.$"
    tracemalloc.start()
    try:
        refuses(told, read_correspondences, path, sizes=[(9, 9)])
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()
    path.write_text("0,0,1,1,1,1,1\n0,1,3,1,1,1,1\n1,0,2,1,1,1,1\n")
    assert len(read_correspondences(path, sizes=[(9, 9)]).sizes) == 4  # of rows of any model


def test_arguments_are_checked(tmp_path):
    """Files, models, sizes, names and tolerances that cannot be."""
    points = common_points(affine_maps(np.random.default_rng(8)))
    told = r"^Invalid correspondences '.*none.csv'\. It cannot be read as text: No su"
    refuses(told, read_correspondences, tmp_path / "none.csv")
    told = r"^Invalid model 'similar'\. It must be one of affine, homography, auto\.$"
    refuses(told, read_correspondences, "x", model="similar")
    refuses(told, register, points, model="similar")
    refuses(r"^Invalid sizes '800,600'\. They must be WIDTHxHEIGHT", parse_sizes, "800,600")
    other = functools.partial(dataclasses.replace, points)
    refuses(r"^Invalid names of images\. There are 1; there must be 6, as sizes\.$", other, names=("a",))
    refuses(r"^Invalid correspondences\. There must be as many i and j as points", other, i=points.i[1:])
    refuses(r"^Invalid reductions of correspondences\. There must be one per", other, reductions=0.0 * points.i)
    refuses(r"^Invalid tolerance 0\. It must be a number of pixels above 0\.$", register, points, tolerance=0)
    # Random points connect nothing, and the message says how many agree.
    x = np.random.default_rng(6).uniform(size=(2, 60, 2)) * [300.0, 200.0]
    points = Correspondences(i=np.zeros(60), j=np.ones(60), xi=x[0], xj=x[1], sizes=SIZES[:2])
    told = r"^Invalid correspondences\. No two images match: 0 and 1, \d+ of 60 points agr"
    refuses(told, register, points, tolerance=1.0)
    few = Correspondences(i=[0, 0], j=[1, 1], xi=x[0, :2], xj=x[0, :2], sizes=SIZES[:2])
    refuses(r"0 and 1, 2 points; it takes 3\.$", register, few)
