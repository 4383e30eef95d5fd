"""The command `mosaic`: formats, the report, and what is refused."""

import json
import re
import shlex
from unittest import mock

import numpy as np
import pytest
from commands import command, parse_csv
from mosaic_pictures import cut, maps, save
from mosaic_sets import SIZES, affine_maps, common_points, homographies, write_csv
from panorama_pictures import cameras, common_directions, picture
from PIL import Image
from refusals import says, wrong_words
from tables import each

from projdist.applications.mosaics import (
    Georeference,
    mosaic,
    read_correspondences,
    read_world_file,
    world_file,
    write_world_file,
)
from projdist.gis import save_geotiff

run, run_ok, run_json, refusal = command("mosaic")


@pytest.fixture
def points(tmp_path):
    rng = np.random.default_rng(1)
    return write_csv(tmp_path / "points.csv", common_points(affine_maps(rng, count=3), SIZES[:3], rng, noise=0.3))


def test_json_and_report(points, tmp_path):
    """What the library answers, printed and written; a file is not replaced unasked."""
    report = tmp_path / "report.json"
    words = ["--correspondences", points, "--report", report, "--format", "json"]
    out = run_ok(*words)
    assert json.loads(out) == json.loads(report.read_text()) == mosaic(read_correspondences(points)).to_dict()
    assert "It exists; --overwrite replaces it." in refusal(*words)
    assert run(*words, "--overwrite", "--frame", "first", "--weights", "1,2,3")[0] == 0
    assert json.loads(report.read_text())["matrices"][0] == np.eye(3).tolist()


def test_table(points):
    """Dist_F of each image in each frame, the reference images, the sums."""
    words = ["--correspondences", points]
    out = run_ok(*words, "--rotation", "log", "--tolerance", "5")
    shown = ("3 images, affine", "first (0)", "last (2)", "central (", "best (", "mdt", "all", "pixels RMS")
    assert [text for text in shown if text not in out] == []
    assert "| image |" in run(*words, "--format", "markdown")[1]
    rows = parse_csv(run(*words, "-f", "csv")[1])
    assert list(rows[0]) == ["image", "first", "last", "central", "best", "mdt"]
    assert ([row["image"] for row in rows], float(rows[0]["first"])) == (["0", "1", "2"], 0)


def test_sizes(tmp_path, points):
    """Sizes that the file does not have; an image that nothing connects is named, and its row is empty."""
    maps_of_three = homographies(np.random.default_rng(2), count=3)
    table = write_csv(tmp_path / "h.csv", common_points(maps_of_three, SIZES[:3]), 1, False)
    words = ["--correspondences", table, "--model", "homography"]
    assert run_json(*words, "--sizes", "300x200")["sizes"] == [[300, 200]] * 3
    assert run(*words)[0] == 2
    points.write_text(points.read_text().replace(")]", "), (200, 300)]"))
    code, out, err = run("--correspondences", points)
    assert (code, err) == (1, "projdist: Left out: 3. Nothing connects them with the other images.\n")
    assert "3 images, affine" in out


def of_relief(folder, numbers):
    """The maps of pictures of the relief, their files, and the words that name these and their points in common."""
    H = maps(np.random.default_rng(3))[numbers]
    sheets = save(folder, cut(H))
    table = write_csv(folder / "points.csv", common_points(H, np.array([[300.0, 240.0]] * len(H))))
    return H, sheets, [*sheets, "--correspondences", table]


@pytest.mark.slow
def test_groups(tmp_path):
    """Of two groups the smaller is left out and named as one; with --all each is a mosaic with a file of its own."""
    H = np.tile(np.eye(3), (6, 1, 1))
    H[:, 0, 2] = [0.0, 150.0, 300.0, 5000.0, 5150.0, 9000.0]
    table, figure = write_csv(tmp_path / "groups.csv", common_points(H)), tmp_path / "frames.png"
    code, out, err = run("--correspondences", table, "-f", "json")
    left_out = "5; 3 and 4, which belong together"
    assert (code, err) == (1, f"projdist: Left out: {left_out}. Nothing connects them with the other images.\n")
    assert json.loads(out)["components"] == [["0", "1", "2"], ["3", "4"]]
    report, second = tmp_path / "report.json", tmp_path / "frames-2.png"
    words = ["--correspondences", table, "--all", "--compare", figure, "--dpi", "40"]
    code, out, err = run(*words, "--report", report)
    assert (code, err) == (1, "projdist: Left out: 5. Nothing connects them with the other images.\n")
    assert out.endswith(f"Wrote: {figure}\nWrote: {second}\nWrote: {report}\n")
    assert "3 and 2 images, affine" in out
    assert figure.is_file()
    first, other = json.loads(report.read_text())["mosaics"]
    assert [row is None for row in first["matrices"]] == [False] * 3 + [True] * 3
    assert [row is None for row in other["matrices"]] == [True] * 3 + [False] * 2 + [True]
    assert other["matrices"][4][0][2] - other["matrices"][3][0][2] == pytest.approx(150.0)
    figure.unlink()
    assert f"'{second}'. It exists; --overwrite replaces it." in run(*words)[2]
    assert not figure.exists()
    assert "Invalid frame '3'. With --all it must be mdt, first" in refusal(*words, "--frame", "3")
    rows = parse_csv(run("--correspondences", table, "--all", "-f", "csv")[1])
    assert [row["image"] for row in rows] == ["0", "1", "2", "3", "4"]


@pytest.mark.slow
def test_the_model_that_the_points_ask_for(tmp_path):
    """Affine maps of pictures taken aslant are warned of with both errors; auto takes the homographies."""
    rng = np.random.default_rng(4)
    points = common_points(homographies(rng, spread=0.02, tilt=4e-4), rng=rng, noise=0.3)
    words = ["--correspondences", write_csv(tmp_path / "aslant.csv", points), "--tolerance", "30"]
    code, out, err = run(*words)
    told = r"Homographies fit the pairs to ([\d.]+) pixels RMS, affine maps to ([\d.]+): the model should be homography"
    homography, affine = map(float, re.fullmatch(rf"projdist: {told}\.\n", err).groups())
    assert (code, 2.0 * homography < affine) == (0, True)
    assert homography == pytest.approx(0.6, rel=0.1)  # noise in both images, along both axes
    code, out, err = run(*words, "--model", "auto", "-f", "json")
    assert (code, err, json.loads(out)["model"]) == (0, "", "homography")


@pytest.mark.slow
def test_refused(points, turned):
    """Values that cannot be, and options that do not go together."""
    for table, name in ((points, "_mosaic"), (turned[1], "_panoramas")):
        for words, code, message in wrong_words(name):
            assert says(message, refusal("--correspondences", table, *shlex.split(words), code=code))
    words = ["--correspondences", turned[1], "--model", "rotation", "--projection", "mollwide"]
    assert "Did you mean mollweide?" in refusal(*words, code=1)
    message = "Invalid correspondences. No two images match: 0 and 1, "
    assert message in refusal("--correspondences", points, "--tolerance", "0.001", code=1)


@pytest.fixture
def turned(tmp_path):
    """Points of three pictures of a camera that turned by 25 degrees and again."""
    R = cameras(np.random.default_rng(1), [-25.0, 0.0, 25.0])
    points = common_directions(R, 210.0, 240, 200, np.random.default_rng(2), noise=0.2, count=3000)
    return R, write_csv(tmp_path / "turned.csv", points)


@pytest.mark.slow
def test_a_camera_that_turns(turned, tmp_path):
    """Where the pictures look, and the map that distorts least what they see; with one of one's own, too."""
    report = tmp_path / "report.json"
    words = ["--correspondences", turned[1], "--model", "rotation", "--overwrite", "--report", report]
    assert "3 images, rotation" in run_ok(*words)
    found = json.loads(report.read_text())
    assert found["focals"][0] == pytest.approx(210.0, abs=5 * found["focal_errors"][0])
    assert np.diff(found["longitudes"]).tolist() == pytest.approx([25.0, 25.0], abs=5.0)
    errors = {row["projection"]: row["airy_kavrayskiy_scaled"] for row in found["projections"]}
    assert min(errors, key=errors.get) == "this one"
    assert set(errors) == {"this one", "plate carrée", "Mercator", "cylindrical", "stereographic", "plane (gnomonic)"}
    rows = parse_csv(run(*words, "--projection", "mercator", "--focal", "free", "-f", "csv")[1])
    assert (list(rows[0]), len(rows)) == (["image", "longitude", "latitude", "roll", "focal"], 3)
    own = json.loads(report.read_text())
    assert (own["projection"][:10], len(set(own["focals"]))) == ("+proj=merc", 3)
    assert {row["projection"] for row in own["projections"]} == set(errors) - {"Mercator"}


@pytest.mark.slow
def test_two_panoramas(tmp_path):
    """Two groups of pictures of turning cameras are two panoramas with --all, and one that is alone is named."""
    rng = np.random.default_rng(3)
    R = cameras(rng, [-100, -80, -60, 60, 80, 180], wobble=1.0)
    table = write_csv(tmp_path / "groups.csv", common_directions(R, 210.0, 240, 200, rng, count=4000))
    words = ["--correspondences", table, "--model", "rotation", "--projection", "stereographic", "-f", "json"]
    code, out, err = run(*words)
    assert code == 1
    assert err.startswith("projdist: Left out: 5; 3 and 4, which belong together. Nothing connects them")
    code, out, err = run(*words, "--all")
    assert (code, err) == (1, "projdist: Left out: 5. Nothing connects them with the other images.\n")
    first, other = json.loads(out)["mosaics"]
    assert [row is None for row in first["focals"]] == [False] * 3 + [True] * 3
    assert [row is None for row in other["focals"]] == [True] * 3 + [False] * 2 + [True]


@pytest.mark.slow
def test_a_panorama(turned, tmp_path):
    """It is drawn in the projection that was asked for."""
    pytest.importorskip("cv2")
    R, table = turned
    sheets = save(tmp_path, [picture(one, 210.0, 240, 200) for one in R])
    words = [*sheets, "--correspondences", table, "--model", "rotation", "--projection", "stereographic"]
    out = run(*words, "-o", tmp_path / "p.png", "--crop")[1]
    assert "Projection: +proj=stere +R=6371008.7714." in out
    with Image.open(tmp_path / "p.png") as image:
        assert f"The mosaic has {image.size[0]} x {image.size[1]} pixels." in out
        assert np.asarray(image)[..., 3].min() == 255
        assert image.size[0] > 350


@pytest.mark.slow
def test_images(tmp_path):
    """Points are found in images, which are called by their files; what matches nothing is named."""
    pytest.importorskip("cv2")
    _, sheets, words = of_relief(tmp_path, [0, 1, 3])
    noise = tmp_path / "noise.png"
    Image.fromarray(np.random.default_rng(1).integers(0, 255, (200, 200, 3), np.uint8)).save(noise)
    code, out, err = run(*sheets, noise, "-f", "json")
    assert (code, err) == (1, "projdist: Left out: noise.png. Nothing connects them with the other images.\n")
    found = json.loads(out)
    assert found["images"] == ["sheet0.png", "sheet1.png", "sheet2.png", "noise.png"]
    assert found["left_out"] == ["noise.png"]
    assert "first (sheet0.png)" in run_ok(*words)


@pytest.mark.slow
def test_picture(tmp_path):
    """A mosaic of sheets with world files is drawn with one of its own, or as a GeoTIFF, and is told in the report."""
    rasterio = pytest.importorskip("rasterio")
    H, sheets, words = of_relief(tmp_path, [0, 1])
    for sheet, one in zip(sheets, H, strict=True):
        write_world_file(world_file(sheet), np.diag([5.0, -5.0, 1.0]) @ one)
    picture, report = tmp_path / "m.png", tmp_path / "report.json"
    out = run_ok(*words, "-o", picture, "--report", report, "--crop", "--blend", "feather")
    assert out.endswith(f"Wrote: {picture}\nWrote: {report}\n")
    assert "Georeference: the mean of 2 sheets by least squares of their corners" in out
    written = json.loads(report.read_text())["picture"]
    assert (written["file"], written["georeference"]["sheets"]) == (str(picture), 2)
    with Image.open(picture) as image:
        assert image.size == (written["width"], written["height"])
    known = np.diag([5.0, -5.0, 1.0]) @ H[0] @ np.linalg.inv(written["matrices"][0])
    assert np.abs(read_world_file(picture).matrix - known).max() < 1e-6
    assert run(*words, "-o", tmp_path / "m.tif", "--depth", "16", "--exposure", "blocks")[0] == 0
    with rasterio.open(tmp_path / "m.tif") as image:
        assert np.abs(np.array(image.transform)[[0, 4]] - [5.0, -5.0]).max() < 0.5
        assert image.dtypes == ("uint16",) * 4
    picture.unlink()
    for more, message in {
        f"-o {picture}": "m.pgw'. It exists; --overwrite replaces it.",
        f"-o {sheets[0]} --overwrite": "It is one of the images.",
        "-o m.gif": "Its suffix must be .png, .jpg, .jpeg, .tif or .tiff.",
        "-o n.jpg --blend soft": "Invalid blend 'soft'. It must be",
        "-o n.jpg --exposure auto": "Invalid exposure 'auto'. It must be",
        "-o n.jpg --depth 16": "For 16 bits a colour its suffix must be .png, .tif or",
        "-o n.png --depth 12": "Invalid depth '12'. It must be 8 or 16.",
        "--crop": "Invalid option '--crop'. It needs a mosaic to draw: -o FILE.",
        "--pixels 10": "Invalid pixels '10'.",
    }.items():
        assert message in refusal(*words, *more.split())
    assert "A mosaic is drawn from images, and there are none." in refusal(*words[2:], "-o", picture)
    assert not picture.exists()
    code, out, err = run(*words, "-o", tmp_path / "small.jpg", "--pixels", "1e4")
    assert (code, "The canvas would have" in err) == (0, True)


@pytest.mark.slow
def test_compare(points, tmp_path):
    """The frames side by side, of images or of their rims."""
    figure = tmp_path / "frames.png"
    words = ["--correspondences", points, "--compare"]
    assert run_ok(*words, figure).endswith(f"Wrote: {figure}\n")
    with Image.open(figure) as image:
        assert min(image.size) > 500
    assert "It exists; --overwrite replaces it." in run(*words, figure)[2]
    assert "Its suffix must be .png, .svg or .pdf." in run(*words, tmp_path / "frames.gif")[2]


@pytest.mark.slow
def test_sheets_in_two_crss(tmp_path):
    """Sheets that are in different CRSs make a mosaic that is in none, which is said."""
    rasterio = pytest.importorskip("rasterio")
    _, images, words = of_relief(tmp_path, [0, 1])
    sheets = [tmp_path / "a.tif", tmp_path / "b.tif"]
    for sheet, image, code in zip(sheets, images, (2056, 21781), strict=True):
        place = Georeference(np.diag([5.0, -5.0, 1.0]), rasterio.CRS.from_epsg(code).to_wkt(), 0.0, 1)
        save_geotiff(np.asarray(Image.open(image).convert("RGBA")), sheet, place)
    code, _, err = run(*sheets, *words[2:], "-o", tmp_path / "m.png")
    assert code == 0
    assert err == "projdist: Invalid georeferences. The sheets are in different CRSs. The mosaic has none.\n"
    assert not (tmp_path / "m.pgw").exists()


def test_images_refused(tmp_path, points):
    """Wrong images end with 2, those without anything in common with 1; either in one line."""
    pytest.importorskip("cv2")
    sheets = save(tmp_path, np.random.default_rng(1).integers(0, 255, (2, 200, 200, 3), np.uint8))
    for words, code, message in (
        ([sheets[0]], 2, "Invalid images. At least two are needed, not 1."),
        ([*sheets, points], 2, f"Invalid image '{points}'. It cannot be read"),
        ([*sheets, "--sizes", "20x20"], 2, "Invalid sizes '20x20'. The images have their own."),
        ([*sheets, "--frame", "2"], 2, "Invalid frame '2'."),
        ([*sheets, "--correspondences", points], 2, "Invalid images. There are 2; the correspondences are for 3."),
        (sheets, 1, "Invalid images. No two of them have anything in common."),
    ):
        assert message in refusal(*words, code=code)


@each(("where", "error", "code", "message"), [
    ("render", ImportError("It needs OpenCV."), 2, "It needs OpenCV."),
    ("render", ValueError("Invalid crop."), 1, "Invalid crop."),
    ("render", MemoryError(), 2, "It needs more memory than there is: take fewer --pixels."),
    ("save_mosaic", FileExistsError("Invalid output 'm.png'. It exists."), 2, "Invalid output 'm.png'. It exists."),
    ("save_mosaic", OSError(28, "No space left on device"), 2, "It cannot be written: No space left on device."),
    ("read_world_file", ValueError("Invalid world file 'a.pgw'."), 2, "Invalid world file 'a.pgw'."),
    ("mosaic_figure", ImportError("It needs OpenCV."), 2, "It needs OpenCV."),
])  # fmt: skip
def test_pictures_that_cannot_be(where, error, code, message, tmp_path):
    pytest.importorskip("cv2")
    sheets = save(tmp_path, np.random.default_rng(1).integers(0, 255, (2, 60, 80, 3), np.uint8))
    shifts = np.stack([np.eye(3), np.eye(3)])
    shifts[1, :2, 2] = 20.0, 10.0
    table = write_csv(tmp_path / "points.csv", common_points(shifts, np.array([[80.0, 60.0]] * 2)))
    home, option = ("plots", "--compare") if where == "mosaic_figure" else ("applications.mosaics", "-o")
    with mock.patch(f"projdist.{home}.{where}", side_effect=error):
        found, _, err = run(*sheets, "--correspondences", table, option, tmp_path / "m.png")
    assert (found, err.count("\n"), (tmp_path / "m.png").exists()) == (code, 1, False)
    assert message in err
