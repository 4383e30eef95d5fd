"""The common frame of images: the mean distorting transformation's, and those of single images."""

import dataclasses
import json

import numpy as np
import pytest
from matrix_samples import around, fisher_squares, rotation
from mosaic_sets import MAKERS, SIZES, affine_maps, common_points, homographies, moved, turned
from refusals import refuses
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from projdist.applications.mosaics import mosaic, mosaics_of_groups
from projdist.applications.mosaics.registration import ImageRegistration, common_frames

EQUAL = np.full(6, 1.0 / 6.0)
CORNERS = np.array([[0.0, 0.0], [300.0, 0.0], [0.0, 200.0], [300.0, 200.0]])
MODELS = pytest.mark.parametrize("model", MAKERS)


def registered(H, model="affine", sizes=SIZES):
    """Images with these maps, as if they had been registered."""
    if model == "homography":
        H = H / np.cbrt(np.linalg.det(H))[:, None, None]
    images = list(range(len(H)))
    return ImageRegistration(images, [images], [], [], model, H, sizes[: len(H)], 0.0, {})


def found_frames(H, model="affine", weights=EQUAL, rotation="chordal"):
    return common_frames(registered(H, model), weights[: len(H)] / weights[: len(H)].sum(), rotation)


def test_known_means():
    """Of diagonal matrices the MDT is the geometric mean: closed forms of all figures."""
    scales = np.array([[1.0, 1.0], [2.0, 1.0], [4.0, 3.0]])
    H = np.tile(np.eye(3), (3, 1, 1))
    H[:, [0, 1], [0, 1]] = scales
    H[:, 0, 2] = [0.0, 1000.0, 3000.0]
    logs = np.log(scales)
    found = found_frames(H)
    first, middle, last = (np.sum((logs - log) ** 2) for log in logs)
    expected = {"first": first, "last": last, "central": middle, "best": min(first, middle, last)}
    expected["mdt"] = np.sum((logs - logs.mean(axis=0)) ** 2)
    assert {name: frame.figure for name, frame in found.frames.items()} == pytest.approx(expected, rel=1e-12)
    mean = found.frames["mdt"]
    np.testing.assert_allclose(mean.matrices[:, [0, 1], [0, 1]], scales / np.exp(logs.mean(axis=0)), rtol=1e-12)
    np.testing.assert_allclose(mean.distortions, np.linalg.norm(logs - logs.mean(axis=0), axis=1), rtol=1e-12)
    H = affine_maps(np.random.default_rng(1))
    H[:, :2, :2], weights, truth = around(np.array([[1.5, 0.7], [-0.2, 0.8]]), 6, 0.1)
    squares = found_frames(H, weights=weights).frames["mdt"].distortions ** 2
    assert np.average(squares, weights=weights) == pytest.approx(truth, rel=1e-10)


def test_references():
    """The best reference is the one of the least total by the definition, and the MDT is better."""
    H = affine_maps(np.random.default_rng(3), spread=0.3)
    A = H[:, :2, :2]
    totals = np.array([fisher_squares(reference, A).sum() for reference in A])
    found, best = found_frames(H).frames, int(totals.argmin())
    assert (found["best"].reference, found["best"].figure) == (best, pytest.approx(totals[best], rel=1e-12))
    assert found["mdt"].figure < totals[best]


@MODELS
def test_gauge(model):
    """Another plane of departure changes neither figures nor the mosaic, to 1e-10."""
    rng = np.random.default_rng(4)
    H = MAKERS[model](rng)
    G = np.eye(3) + np.diag([0.4, 0.4, 0.0]) @ rng.normal(size=(3, 3)) * [[1, 1, 100], [1, 1, 100], [0, 0, 0]]
    G[0] *= np.sign(np.linalg.det(G))
    if model == "homography":
        G[2, :2] = rng.uniform(-3e-4, 3e-4, size=2)
    before, after = found_frames(H, model).frames, found_frames(G @ H, model).frames
    for name, frame in before.items():
        assert after[name].figure == pytest.approx(frame.figure, rel=1e-10)
        np.testing.assert_allclose(after[name].distortions, frame.distortions, rtol=1e-8, atol=1e-10)
        for one, other in zip(frame.matrices, after[name].matrices, strict=True):
            np.testing.assert_allclose(moved(other, CORNERS), moved(one, CORNERS), atol=1e-6)


@pytest.mark.slow
@MODELS
def test_rotation_is_outside(model):
    """Whichever rotation is taken, the distortions stay, the frame touches the axes, and the mean turn is none."""
    rng = np.random.default_rng(5)
    H = MAKERS[model](rng, spread=0.2)
    H[1::2] = H[1::2] @ turned(300.0, 100.0, np.radians(150.0))
    chordal, log = (found_frames(H, model, rotation=rotation) for rotation in ("chordal", "log"))
    one, other = chordal.frames["mdt"], log.frames["mdt"]
    np.testing.assert_allclose(one.distortions, other.distortions, rtol=1e-9)
    assert np.abs(one.matrices - other.matrices).max() > 1e-4
    for frame in (one, other):
        places = np.vstack([moved(M, CORNERS) for M in frame.matrices])
        np.testing.assert_allclose(places.min(axis=0), 0.0, atol=1e-9)
    if model == "affine":
        U, _, V = np.linalg.svd(one.matrices[:, :2, :2])
        mean = (U @ V).mean(axis=0)
        assert mean[0, 1] == pytest.approx(mean[1, 0], abs=1e-12)
        assert chordal.rotation.mean_resultant_length == pytest.approx(0.5 * np.trace(mean), rel=1e-12)


@pytest.mark.slow
@MODELS
def test_weights(model):
    """An image that counts twice counts as two; one that counts nothing changes no frame."""
    H = MAKERS[model](np.random.default_rng(6))
    twice = np.concatenate([H, H[2:3]])
    weights = np.array([1.0, 1.0, 2.0, 1.0, 1.0, 1.0])
    doubled = common_frames(registered(twice, model, np.tile(SIZES[:1], (7, 1))), np.full(7, 1 / 7), "chordal")
    figure = (7.0 / 6.0 if model == "affine" else 1.0) * found_frames(H, model, weights).frames["mdt"].figure
    assert figure == pytest.approx(doubled.frames["mdt"].figure, rel=1e-10)
    alone = found_frames(H, model, np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])).frames["mdt"]
    few = found_frames(H[:3], model).frames["mdt"]
    np.testing.assert_allclose(alone.distortions[:3], few.distortions, rtol=1e-8)


def test_a_plane_without_distortion():
    """Images that a homography brought from one plane, where they are rigid, come back there: figure 0."""
    rng = np.random.default_rng(7)
    rigid = affine_maps(rng, spread=0.0)
    t = 0.2 * rng.normal(size=6)
    rigid[:, :2, :2] = rotation(t)
    G = np.array([[1.2, 0.3, 20.0], [-0.1, 0.9, 5.0], [4e-4, -3e-4, 1.0]])
    found = found_frames(G @ rigid, "homography").frames["mdt"]
    assert found.figure < 1e-20
    angles = np.arctan2(found.matrices[:, 1, 0], found.matrices[:, 0, 0])
    np.testing.assert_allclose(angles - angles[0], t - t[0], atol=1e-9)


@pytest.mark.slow
def test_least_of_all_homographies():
    """A general search over all eight entries of G ends at the same figure, integrated by another rule."""
    H = homographies(np.random.default_rng(8), spread=0.2, count=3, tilt=8e-4)
    steps = (np.arange(30) + 0.5) / 30
    x = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * SIZES[0]

    def cost(entries):
        maps = np.append(entries, 1.0).reshape(3, 3) @ np.diag([1e-2, 1e-2, 1.0]) @ H
        y = np.einsum("kij,nj->kni", maps, np.column_stack([x, np.ones(len(x))]))
        if (y[..., 2] <= 0).any():
            return 1e3
        image = y[..., :2] / y[..., 2:]
        J = (maps[:, None, :2, :2] - image[..., None] * maps[:, None, 2:, :2]) / y[..., 2:, None]
        total = np.hypot(J[..., 0, 0] + J[..., 1, 1], J[..., 1, 0] - J[..., 0, 1])
        difference = np.hypot(J[..., 0, 0] - J[..., 1, 1], J[..., 1, 0] + J[..., 0, 1])
        return np.mean(np.log(0.5 * (total + difference)) ** 2 + np.log(0.5 * np.abs(total - difference)) ** 2)

    start = np.array([100.0, 0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 0.0])
    options = {"maxfev": 20000, "maxiter": 20000, "xatol": 1e-7, "fatol": 1e-12, "adaptive": True}
    searched = minimize(cost, start, method="Nelder-Mead", options=options)
    # The midpoint rule with 30 x 30 points is good to 1e-3 of the figure.
    assert found_frames(H, "homography").frames["mdt"].figure == pytest.approx(searched.fun, rel=2e-3)


NEXT = [(0, 1), (1, 2), (2, 3), (3, 4)]


def turning_camera(degrees):
    """Homographies into the middle image of a camera that turns by these angles, focal length 250 pixels."""
    K = np.array([[250.0, 0.0, 150.0], [0.0, 250.0, 100.0], [0.0, 0.0, 1.0]])
    turns = Rotation.from_rotvec(np.multiply.outer(np.radians(degrees), [0.0, 1.0, 0.0]))
    return K @ turns.as_matrix() @ np.linalg.inv(K)


@pytest.mark.slow
def test_impossible_planes():
    """A panorama of 170 degrees: in the planes of the outer images others reach infinity; the MDT is finite."""
    H = turning_camera([-50.0, -25.0, 0.0, 25.0, 50.0])
    points = common_points(H, SIZES[:5], pairs=NEXT)
    found = mosaic(points, model="homography")
    report = found.to_dict()
    assert report["impossible"] == ["0", "1", "3", "4"]
    assert report["frames"]["first"] is report["frames"]["last"] is report["distortions"]["first"] is None
    assert report["references"] == {"central": "2", "best": "2"}
    assert 0 < report["frames"]["mdt"] <= report["frames"]["best"] * (1 + 1e-12)
    # By symmetry the best plane is that of the middle image, stretched.
    middle = found.matrices[2] / found.matrices[2, 2, 2]
    np.testing.assert_allclose(middle[2, :2], 0.0, atol=1e-9)
    told = r"^Invalid frame 'first'\. Its plane sends other images through infinity; mdt"
    refuses(told, mosaic, points, model="homography", frame="first")
    # All round no plane holds the images, and that is said.
    points = common_points(turning_camera([-80.0, -40.0, 0.0, 40.0, 80.0]), SIZES[:5], pairs=NEXT)
    told = r"^Invalid images for one plane\. Every plane sends some of them through infin"
    refuses(told, mosaic, points, model="homography")


@pytest.mark.slow
def test_report():
    """The report has a place for every image, and JSON and frames have its figures."""
    pytest.importorskip("pandas")
    rng = np.random.default_rng(9)
    points = common_points(affine_maps(rng), SIZES, rng, noise=0.2)
    points = dataclasses.replace(points, sizes=np.tile(SIZES[:1], (7, 1)), names=tuple("abcdefg"))
    found = mosaic(points, frame="central")
    report = json.loads(found.to_json())
    assert list(report["frames"]) == ["first", "last", "central", "best", "mdt"]
    assert report["left_out"] == ["g"]
    assert report["matrices"][6] is None
    assert report["notes"] == ["Left out: g. Nothing connects them with the other images."]
    own = "abcdefg".index(report["references"]["central"])
    np.testing.assert_array_equal(report["matrices"][own], np.eye(3))
    assert report["distortions"]["central"][own] == 0
    assert report["rms_pixels"] == pytest.approx(0.2 * 2, rel=0.2)
    assert found.to_frame()["mdt"].tolist() == report["distortions"]["mdt"][:6]
    assert mosaic(points, frame=own).matrices.tolist() == found.matrices.tolist()


def test_groups_have_mosaics_of_their_own():
    """The largest comes first, by the weights of its own images; a number names a frame of one group only."""
    H = np.tile(np.eye(3), (5, 1, 1))
    H[:, 0, 2], H[3, 0, 0] = [0.0, 150.0, 2000.0, 2000.0, 2150.0], 2.0
    points = common_points(H, SIZES[:5])
    large, small = mosaics_of_groups(points, weights=[5.0, 1.0, 1.0, 3.0, 1.0])
    assert (large.images, small.images) == ([2, 3, 4], [0, 1])
    logs = np.log([1.0, 2.0, 1.0])
    np.testing.assert_allclose(large.frame.distortions, np.abs(logs - 0.6 * np.log(2.0)), rtol=1e-9)
    assert large.messages(others=False) == small.messages(others=False) == []
    refuses(r"^Invalid frame '0'\. An image is in one group only; it must be mdt", mosaics_of_groups, points, frame="0")


def test_no_orientation_is_said():
    """Images at right angles to each other have no mean orientation: a length near 0, and a note."""
    H = np.tile(np.eye(3), (4, 1, 1))
    H[:, :2, :2] = np.round(rotation(np.arange(4) * np.pi / 2))
    H[:, :2, 2] = 100.0 - H[:, :2, :2] @ [100.0, 100.0]
    found = mosaic(common_points(H, np.full((4, 2), 200.0)))
    assert found.to_dict()["resultant_length"] == pytest.approx(0.0, abs=1e-9)
    assert found.notes[0].startswith("There is no meaningful mean orientation")


def test_canvas_and_arguments():
    """The canvas holds all corners; a huge one is reduced to so many pixels, and that is said."""
    points = common_points(affine_maps(np.random.default_rng(10)))
    found = mosaic(points, frame="first")
    for most, scale in ((1e8, 1.0), (1e4, None)):
        canvas = found.canvas(most_pixels=most)
        corners = np.vstack([moved(M, CORNERS) for M in canvas.matrices])
        np.testing.assert_allclose(corners.min(axis=0), 0.0, atol=1e-9)
        np.testing.assert_array_equal(np.ceil(corners.max(axis=0)), [canvas.width, canvas.height])
        assert canvas.scale == scale or canvas.width * canvas.height < 1.05 * most
    assert canvas.note.startswith("The canvas would have ")
    assert found.notes == []
    # Frames, rotations and weights that cannot be.
    points = common_points(affine_maps(np.random.default_rng(11), count=3), SIZES)
    for frame in ("middle", 6, "6", -1):
        told = rf"^Invalid frame '{frame}'\. It must be mdt, .*, or the number of an image, 0"
        refuses(told, mosaic, points, frame=frame)
    refuses(r"^Invalid frame '5'\. Nothing connects image 5 with the others\.$", mosaic, points, frame="5")
    refuses(r"^Invalid rotation 'none'\. It must be one of chordal, log\.$", mosaic, points, rotation="none")
    refuses(r"^Invalid shape \(2,\) of weights", mosaic, points, weights=[1, 2])
