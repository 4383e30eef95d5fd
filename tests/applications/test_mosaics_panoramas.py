"""Panoramas of a camera that only turns: rotations, focal lengths, and pictures on maps of the sphere."""

import dataclasses
import json

import numpy as np
import pytest
import shapely
from panorama_pictures import cameras, colours, common_directions, directions, off_by, picture, turned_by
from refusals import refuses
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import projdist
from projdist.applications.mosaics import Correspondences, match, mosaic, open_pictures, panorama, render
from projdist.applications.mosaics.canvases import Camera
from projdist.matrices import turns

WIDTH, HEIGHT, FOCAL = 480, 400, 420.0
RADIUS = 6371008.7714

SETS = {
    "150 degrees": (np.linspace(-50.0, 50.0, 5), 0.0),
    "a full turn": (36.0 * np.arange(10), 0.0),
    "all round": (np.r_[45.0 * np.arange(8), 45.0 * np.arange(8), 0, 0], np.r_[[-35.0] * 8, [35.0] * 8, 90, -90]),
}


def turned(name, seed=2, wobble=2.0):
    """The rotations of a set, and a focal length in pixels with which its images overlap."""
    return cameras(np.random.default_rng(seed), *SETS[name], wobble), 270.0 if name == "all round" else FOCAL


def seen_by(R, f):
    """Points without error that pictures of such cameras have in common."""
    return common_directions(R, f, WIDTH, HEIGHT, np.random.default_rng(4))


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("focal", ["common", "free"])
def test_exact_points_give_the_cameras(name, focal):
    """From points without error rotations and focal lengths come back to rounding."""
    R, f = turned(name)
    f = f * (1.0 if focal == "common" else 1.0 + 0.05 * np.random.default_rng(3).normal(size=len(R)))
    points = common_directions(R, f, WIDTH, HEIGHT, np.random.default_rng(4), count=1000)
    found = panorama(points, focal=focal).cameras
    assert found.images == list(range(len(R)))
    assert off_by(found.rotations, R) < 1e-9
    np.testing.assert_allclose(found.focals, f, rtol=1e-11)
    assert found.rms_pixels < 1e-9


def test_the_least_symmetric_transfer_error():
    """Scipy's general least squares over rotation vectors and the focal length find nothing less."""
    R, f = cameras(np.random.default_rng(1), [-20.0, 0.0, 25.0]), 400.0
    rng = np.random.default_rng(2)
    points = common_directions(R, f, WIDTH, HEIGHT, rng, noise=1.0, count=500)
    found = panorama(points, tolerance=100.0).cameras
    middle = [WIDTH / 2, HEIGHT / 2]

    def residuals(unknowns):
        into = Rotation.from_rotvec(np.vstack([np.zeros(3), unknowns[:6].reshape(2, 3)])).as_matrix()
        gaps = []
        for i, j, xi, xj in zip(points.i, points.j, points.xi, points.xj, strict=True):
            for a, b, x, y in ((i, j, xi, xj), (j, i, xj, xi)):
                ray = into[b].T @ into[a] @ np.append((x - middle) / unknowns[6], 1.0)
                gaps.append(unknowns[6] * ray[:2] / ray[2] + middle - y)
        return np.ravel(gaps)

    relative = Rotation.from_matrix(R[0].T @ R[1:]).as_rotvec()
    best = least_squares(residuals, np.append(relative.ravel(), f), x_scale="jac", xtol=1e-12, ftol=1e-12)
    assert found.rms_pixels == pytest.approx(np.sqrt(2.0 * best.cost / (2 * len(points.i))), rel=1e-8)
    assert found.focals[0] == pytest.approx(best.x[6], rel=1e-6)


@pytest.mark.slow
def test_the_error_of_the_focal_length():
    """It is the standard deviation over many sets of noisy points."""
    R = cameras(np.random.default_rng(1), [-30.0, 0.0, 30.0])
    focals, told = [], []
    for seed in range(60):
        points = common_directions(R, FOCAL, WIDTH, HEIGHT, np.random.default_rng(seed), noise=0.7, count=1500)
        found = panorama(points).cameras
        focals.append(found.focals[0])
        told.append(found.focal_errors[0])
    # The deviation of sixty values is known to 9 %, and the directions differ, too.
    assert np.mean(told) == pytest.approx(np.std(focals), rel=0.3)
    assert np.mean(focals) == pytest.approx(FOCAL, abs=4.0 * np.mean(told) / np.sqrt(60))


def test_wrong_points_do_not_count():
    """With three points in ten at random places the cameras are the exact ones."""
    R, f = turned("a full turn")
    rng = np.random.default_rng(5)
    points = common_directions(R, f, WIDTH, HEIGHT, rng, count=3000)
    wrong = rng.random(len(points.i)) < 0.3
    xj = np.where(wrong[:, None], rng.uniform(size=points.xj.shape) * [WIDTH, HEIGHT], points.xj)
    found = panorama(dataclasses.replace(points, xj=xj), tolerance=1.0).cameras
    # A wrong point that is by chance right to a pixel counts.
    assert off_by(found.rotations, R) < 0.05
    assert found.focals[0] == pytest.approx(f, rel=1e-3)


def test_homographies_that_are_no_rotations():
    """A plane seen from several places is told from a camera that turns."""
    x = np.stack(np.meshgrid(np.linspace(20, 460, 9), np.linspace(20, 380, 9)), axis=-1).reshape(-1, 2)
    sheared = x @ np.array([[1.0, 0.35], [0.0, 0.9]]) * 0.7 + 20.0
    sizes = np.array([[480.0, 400.0]] * 2)
    found = panorama(Correspondences(i=np.zeros(len(x)), j=np.ones(len(x)), xi=x, xj=sheared, sizes=sizes))
    assert found.notes[0].startswith("Rotations fit the points to ")
    assert found.notes[0].endswith("the camera also moved, or its lens bends lines.")


def test_turns_and_a_camera_there_and_back():
    """Rodrigues' formula is the exponential, at small angles and large ones."""
    rng = np.random.default_rng(7)
    w = rng.normal(size=(50, 3)) * np.geomspace(1e-12, 3.0, 50)[:, None]
    np.testing.assert_allclose(turns(w), Rotation.from_rotvec(w).as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(turns(np.zeros(3)), np.eye(3))
    # Pixels go out and come back; what is behind has none.
    view = Camera(turned_by([0.3, -0.2, 0.9]), 300.0, (640.0, 480.0))
    x = np.random.default_rng(8).uniform(size=(40, 2)) * [640.0, 480.0]
    np.testing.assert_allclose(view.pixels(view.directions(x)), x, atol=1e-9)
    assert view.sees(view.directions(x)).all()
    assert np.isnan(view.pixels(-view.directions(x))).all()
    middle = directions(view.rotation, 300.0, 640, 480)
    np.testing.assert_allclose(view.directions(np.array([[0.5, 0.5]]))[0], middle[0, 0], atol=1e-12)


@pytest.mark.parametrize("name", ["150 degrees", "a full turn"])
def test_the_horizon_is_level(name):
    """However the first camera was held, the panorama is level, and longitude 0 is in its middle."""
    R, f = turned(name, wobble=0.0)
    R = R @ turned_by([0.2, 0.0, 0.0])  # all look up by 11 degrees
    found = panorama(seen_by(turned_by([0.3, 0.5, -0.4]) @ R, f))
    answer = found.to_dict()
    np.testing.assert_allclose(answer["latitudes"], np.degrees(0.2), atol=1e-8)
    np.testing.assert_allclose(answer["rolls"], 0.0, atol=1e-8)
    turn = np.unwrap(answer["longitudes"], period=360.0)
    np.testing.assert_allclose(np.diff(turn), np.diff(SETS[name][0]), atol=1e-8)
    if name == "150 degrees":
        assert np.mean(turn) == pytest.approx(0.0, abs=1e-8)


# Decibels against what the sphere has, of panoramas whose cameras are known exactly: two interpolations of a texture
# with lines two pixels wide.
CLEAR = {1.0: 30.0, 0.5: 25.0}  # of pictures whose lines are a pixel wide


def angles(name, canvas):
    """Longitudes and latitudes of a canvas's pixels by the maps' formulas, in radians."""
    x, y = np.meshgrid(np.arange(canvas.width) + 0.5, np.arange(canvas.height) + 0.5)
    u = (canvas.origin[0] + x * canvas.pixel) / RADIUS
    v = (canvas.origin[1] - y * canvas.pixel) / RADIUS
    if name == "plate-carree":
        return u, v
    if name == "mercator":
        return u, np.arctan(np.sinh(v))
    c = 2.0 * np.arctan(0.5 * np.hypot(u, v))  # stereographic, Snyder 1987, eqs. 20-14 and 20-15
    return np.arctan2(u * np.sin(c), np.hypot(u, v) * np.cos(c)), np.arcsin(v * np.sin(c) / np.hypot(u, v))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "projection", "blend", "size"), [
    ("150 degrees", "stereographic", "feather", 0.5),
    ("150 degrees", "mercator", "multiband", 1.0),
    ("a full turn", "plate-carree", "multiband", 1.0),
    ("all round", "plate-carree", "none", 1.0),
])  # fmt: skip
def test_the_panorama_is_the_sphere(name, projection, blend, size):
    """What is drawn on a map is what the sphere has there, over the whole turn, across its cut and about poles."""
    pytest.importorskip("cv2")
    R, f = turned(name)
    f, width, height = size * f, int(size * WIDTH), int(size * HEIGHT)
    pictures = open_pictures([picture(one, f, width, height) for one in R])
    found = panorama(common_directions(R, f, width, height, np.random.default_rng(4)))
    drawn = render(found.mapped(projection), pictures, blend=blend, exposure="none")
    lam, phi = angles(projection, drawn.canvas)
    rays = np.stack([np.cos(phi) * np.sin(lam), -np.sin(phi), np.cos(phi) * np.cos(lam)], axis=-1)
    on_map = (np.abs(lam) <= np.pi) & (np.abs(phi) <= np.pi / 2)
    seen = drawn.pixels[..., 3] > 0
    # From the panorama's right, down and forward to those in which the pictures were made.
    truth = colours(rays[seen] @ (R[0] @ found.rotations[0].T).T).astype(float)
    assert 10.0 * np.log10(255.0**2 / np.mean((drawn.pixels[..., :3][seen] - truth) ** 2)) > CLEAR[size]
    there = np.any([view.sees(rays) for view in found.views], axis=0) & on_map
    assert (there != seen).mean() < 2e-3
    # And the canvas has little more than what was seen.
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    assert np.ptp(rows) > 0.97 * drawn.canvas.height
    assert np.ptp(columns) > 0.97 * drawn.canvas.width


@pytest.mark.slow
def test_directions_between_nodes_and_regions():
    """Directions that are interpolated are the map's own to a twentieth of a pixel, NaN where it has none."""
    found = panorama(seen_by(*turned("a full turn")))
    canvas = found.mapped("mollweide").canvas()
    box = (0, 0, canvas.width, canvas.height)
    x, y = np.meshgrid(np.arange(canvas.width) + 0.5, np.arange(canvas.height) + 0.5)
    exact, quick = canvas._exact(x, y), canvas._rays(box)
    assert (np.isnan(exact) == np.isnan(quick)).all()
    assert canvas._lattice[0] > 1
    gap = np.linalg.norm(quick - exact, axis=-1)
    assert np.nanmax(gap) * FOCAL < 0.05
    # A panorama stands for what it shows: all round the sphere, and of an image the solid angle of a pyramid.
    found = panorama(seen_by(*turned("all round")))
    assert projdist.get_region(found).geometry.area == pytest.approx(360.0 * 180.0, rel=1e-9)
    found = panorama(seen_by(*turned("150 degrees")))
    one = {"type": "Polygon", "coordinates": found.__geo_interface__["coordinates"][0]}
    a, b = WIDTH / 2 / FOCAL, HEIGHT / 2 / FOCAL
    angle = 4.0 * np.arcsin(a * b / np.sqrt((1 + a * a) * (1 + b * b)))
    outline = shapely.segmentize(projdist.get_region(one).geometry, 0.1)
    # In longitude and the sine of latitude areas are those of the sphere.
    plane = shapely.transform(outline, lambda xy: np.column_stack([np.radians(xy[:, 0]), np.sin(np.radians(xy[:, 1]))]))
    assert plane.area == pytest.approx(angle, rel=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "degrees", "share"), [("150 degrees", 0.4, 5e-3), ("a full turn", 0.1, 5e-4)])
def test_from_pictures(name, degrees, share):
    """Points found in pictures give the rotations to tenths of a degree, where a turn closes better yet."""
    pytest.importorskip("cv2")
    R, f = turned(name)
    found = panorama(match(open_pictures([picture(one, f, WIDTH, HEIGHT) for one in R])))
    assert found.images == list(range(len(R)))
    assert off_by(found.cameras.rotations, R) < degrees
    assert found.cameras.focals[0] == pytest.approx(f, rel=share)
    assert found.notes == []


@pytest.mark.slow
def test_the_map_that_distorts_least():
    """Over a full turn it is a cylinder with the closed form's parallel, where plate carrée and Mercator are worse."""
    found = panorama(seen_by(*turned("a full turn", wobble=0.0)))
    best = projdist.optimize("auto", found, criterion="airy_kavrayskiy_scaled", ellipsoid="sphere")
    assert best.family in ("eqc", "cea", "merc")
    for other in ("plate-carree", "mercator"):
        assert projdist.summarize(other, found).airy_kavrayskiy_scaled > 1.2 * best.value


def test_reports():
    """The report has a place for every image; JSON and frames have its figures; images left out are named."""
    pytest.importorskip("pandas")
    points = seen_by(*turned("150 degrees"))
    points = dataclasses.replace(points, sizes=np.vstack([points.sizes, [[WIDTH, HEIGHT]]]), names=tuple("abcdef"))
    found = panorama(points)
    answer = json.loads(found.to_json())
    assert answer["left_out"] == found.alone == ["f"]
    assert found.notes == ["Left out: f. Nothing connects them with the other images."]
    assert answer["rotations"][5] is answer["focals"][5] is None
    assert found.to_frame()["image"].tolist() == list("abcde")
    assert repr(found) == "Panorama(5 images of a camera that turns)"


@pytest.mark.slow
def test_arguments_are_checked():
    """Maps of ellipsoids and without an inverse, focal lengths and tolerances that cannot be."""
    points = seen_by(*turned("150 degrees"))
    found = panorama(points)
    match = r"^Invalid projection 'EPSG:3035'\. It must be of a sphere: a name, or with \+R="
    refuses(match, found.mapped, "EPSG:3035")
    refuses(r"It must be one that PROJ has the inverse of\.$", found.mapped, lambda lon, lat: (lon, lat))
    refuses(r"^Invalid projection 'mollwide'\. Did you mean mollweide\?", found.mapped, "mollwide")
    refuses(r"^Invalid focal 'one'\. It must be one of common, free\.$", panorama, points, focal="one")
    refuses(r"^Invalid tolerance -1\. It must be a number of pixels above 0\.$", panorama, points, tolerance=-1)
    with pytest.raises(ValueError, match=r"^Invalid correspondences\. No two images match: 0 and 1, "):
        panorama(dataclasses.replace(points, xj=np.random.default_rng(1).uniform(0, 400, points.xj.shape)))
    small = found.mapped("plate-carree", most_pixels=1e4).canvas()
    assert small.width * small.height < 1.05e4
    assert small.note.startswith("The canvas would have ")
    refuses(r"^Invalid model 'rotation'", mosaic, points, model="rotation")
