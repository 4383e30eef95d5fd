"""The command `clouds`: formats, options, files, and what is refused."""

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from commands import command, parse_csv
from tables import each

from projdist.applications.pointclouds import column_weights, read_cloud, register

run, run_ok, run_json, refusal = command("clouds")

RNG = np.random.default_rng(1)
POINTS = RNG.normal(size=(12, 3))
CLOUDS = POINTS @ (np.eye(3) + 0.2 * RNG.normal(size=(3, 3, 3))) + 0.05 * RNG.normal(size=(3, 12, 3))


def saved(path: Path, points: np.ndarray, head: str = "x,y,z") -> str:
    np.savetxt(path, points, delimiter=",", header=head, comments="")
    return str(path)


def with_ids(path: Path, points: np.ndarray, ids: Iterable[str], weights: Iterable[float] | None = None) -> str:
    """A file of points with ids and, where given, weights."""
    rows = [[one, *map(repr, point)] for one, point in zip(ids, points.tolist(), strict=True)]
    if weights is not None:
        rows = [[*row, str(weight)] for row, weight in zip(rows, weights, strict=True)]
    head = ["id", *"xyz"[: points.shape[1]], *(["Quality"] if weights is not None else [])]
    path.write_text("\n".join(",".join(row) for row in [head, *rows]))
    return str(path)


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    return [saved(tmp_path / name, cloud) for name, cloud in zip(("a.csv", "b.csv", "c.csv"), CLOUDS, strict=True)]


@pytest.mark.slow
def test_formats(files: list[str]) -> None:
    """Each cloud, each choice of a frame, and what the figures mean; JSON is what the library answers."""
    assert run_json(*files) == register([read_cloud(file).points for file in files], names=files).to_dict()
    head = "3 clouds in 3 dimensions, by rows (symmetric), in the frame mdt: rms 0.0"
    shown = (head, "Dist_F", "12 of 12", "best", "mdt", "the mean of all", *files)
    for form in ("table", "markdown"):
        out = run_ok(*files, "-f", form)
        assert [text for text in shown if text not in out] == []
    assert [row["name"] for row in parse_csv(run_ok(*files, "-f", "csv"))] == files


@pytest.mark.slow
@each(("frame", "number"), [("2", 1), ("b.csv", 1), ("last", 2), ("first", 0), ("central", 1)])
def test_frame(files: list[str], frame: str, number: int) -> None:
    """A frame is a word, a file's name, or a number from 1."""
    data = run_json(*files, "--frame", frame)
    assert data["reference"] == files[number]
    np.testing.assert_allclose(data["clouds"][number]["matrix"], np.eye(3), atol=1e-12)


@pytest.mark.slow
def test_moved_files(files: list[str], tmp_path: Path) -> None:
    """The moved clouds are files of the same names in a directory; they are not replaced unless asked."""
    folder = tmp_path / "out"
    assert run_ok(*files, "-o", folder).endswith(f"Wrote: {folder}\n")
    found = register([read_cloud(file).points for file in files])
    for file, points in zip(files, found.aligned, strict=True):
        np.testing.assert_array_equal(read_cloud(folder / Path(file).name).points, points)
    message = f"projdist: Invalid output '{folder}/a.csv'. It exists; --overwrite replaces it.\n"
    assert run(*files, "-o", folder, "--frame", "first") == (2, "", message)
    assert run(*files, "-o", folder, "--frame", "first", "--overwrite")[0] == 0
    np.testing.assert_allclose(read_cloud(folder / "a.csv").points, CLOUDS[0], atol=1e-12)


@pytest.mark.slow
def test_ids_are_used_where_all_have_them(tmp_path: Path) -> None:
    """With a column id in all files rows may stand in any order; --correspond rows looks at rows, icp at neither."""
    rows = [np.hstack([np.arange(12)[:, None], cloud])[RNG.permutation(12)] for cloud in CLOUDS]
    files = [saved(tmp_path / f"{k}.csv", row, "id,x,y,z") for k, row in enumerate(rows)]
    data = run_json(*files)
    assert data["correspond"] == "id"
    assert data["rms"] == pytest.approx(register(CLOUDS).rms_total, rel=1e-9)
    assert json.loads(run(*files, "--correspond", "rows", "-f", "json")[1])["rms"] > 2 * data["rms"]
    files = [saved(tmp_path / f"{k}.csv", RNG.permutation(POINTS * (1 + 0.05 * k))) for k in range(3)]
    assert run_json(*files, "--correspond", "icp")["rms"] < 1e-12


def test_warnings_and_what_is_left_out(files: list[str], tmp_path: Path) -> None:
    """Warnings are lines on the standard error; a cloud that is left out ends the command with 1."""
    code, _, err = run(*files, "--method", "least_squares")
    assert code == 0
    assert err.startswith("projdist: Least squares shrinks the clouds, on average to ")
    flat = saved(tmp_path / "flat.csv", CLOUDS[0] * [1, 1, 0])
    code, out, err = run(*files, flat, "-o", tmp_path / "out")
    assert (code, "3 clouds" in out) == (1, True)
    assert err == f"projdist: Left out '{flat}': the 12 points that it has span 2 of 3 dimensions.\n"
    assert not (tmp_path / "out" / "flat.csv").exists()


def test_refused(files: list[str], tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    twin, short = saved(other / "a.csv", CLOUDS[1]), saved(tmp_path / "short.csv", CLOUDS[0][:9])
    for words, said in {
        (files[0],): "Invalid clouds. There must be at least two; there is one.",
        (*files, "--frame", "4"): "Invalid frame '4'. There are 3 clouds, from 1 on.",
        (*files, "--frame", "d.csv"): "Invalid frame 'd.csv'. It must be first, last, central, best, mdt or a cloud",
        (*files, "--method", "ols"): "Invalid method 'ols'. It must be symmetric or least_squares.",
        (*files, "--correspond", "row"): "Invalid correspondence 'row'. It must be rows, id or icp.",
        (*files, "--correspond", "id"): f"Invalid cloud '{files[0]}'. For the correspondence id it must be a .csv with",
        (*files, short): f"Invalid cloud '{short}'. It has 9 points, '{files[0]}' 12; rows that correspond must be as",
        (*files, files[0]): f"Invalid cloud '{files[0]}'. It must be given once.",
        (*files, twin, "-o", str(tmp_path / "out")): f"Invalid cloud '{files[0]}'. Another has its name, and",
        (*files, "-o", str(tmp_path)): f"Invalid output '{tmp_path}'. It holds the clouds themselves.",
        (*files, "-o", files[0]): f"Invalid output '{files[0]}'. It must be a directory.",
        (*files, "-o", "no/where"): "Invalid output 'no/where'. There is no directory 'no'.",
        (*files, "nothing.csv"): "Invalid cloud 'nothing.csv'. The file cannot be read: No such file or directory.",
    }.items():
        assert refusal(*words).startswith(said)
    assert not (tmp_path / "out").exists()


def test_wrong_partners(tmp_path):
    """Exchanged rows are told on standard error, and left out on request; the worst points are in the notes."""
    rng = np.random.default_rng(2)
    clouds = rng.normal(size=(30, 2)) + 0.01 * rng.normal(size=(2, 30, 2))
    clouds[1, [3, 8]] = clouds[1, [8, 3]]
    files = [saved(tmp_path / f"{k}.csv", cloud, "x,y") for k, cloud in enumerate(clouds)]
    code, out, err = run(*files)
    assert code == 0
    assert "Wrong partners, which a robust fit leaves out" in err
    assert "Farthest from where the others have them" in out
    data = json.loads(run(*files, "--robust", "--format", "json")[1])
    assert ({one["point"] for one in data["wrong"]}, data["rms"] < 0.02) == ({"4", "9"}, True)
    assert "Invalid robust with the correspondence icp." in refusal(*files, "--robust", "--correspond", "icp")


@pytest.mark.slow
def test_weights(tmp_path: Path) -> None:
    """A column, or a file by rows or ids, is what the library makes of the same weights."""
    counts, names = np.arange(12) % 4, [f"p{k}" for k in range(12)]
    files = [with_ids(tmp_path / f"{k}.csv", cloud, names, counts) for k, cloud in enumerate(CLOUDS)]
    (tmp_path / "rows.txt").write_text("\n".join(map(str, counts)))
    lines = [f"{name};{w}" for name, w in zip(names, counts, strict=True)]
    (tmp_path / "ids.csv").write_text("\n".join(["id;weight", *lines[::-1]]))
    plain = [saved(tmp_path / f"plain{k}.csv", cloud) for k, cloud in enumerate(CLOUDS)]
    expected = register(CLOUDS, weights=counts).rms_total
    for clouds, word in ((files, "quality"), (files, tmp_path / "ids.csv"), (plain, tmp_path / "rows.txt")):
        data = run_json(*clouds, "--weights", word)
        assert (data["weighted"], data["dimension"], data["rms"]) == (True, 3, pytest.approx(expected, rel=1e-9))
    assert ", by weights: rms " in run(*files, "--weights", "quality")[1]
    (tmp_path / "short.txt").write_text("1\n2\n")
    (tmp_path / "words.txt").write_text("weight\n1\nmany\n")
    (tmp_path / "few.csv").write_text("p0,1\n")
    (tmp_path / "wide.csv").write_text("1,2,3\n")
    for clouds, word, said in [
        (files, "w", f"'w'. No cloud has such a column; '{files[0]}' has id, x, y, z and quality."),
        (files, "w.csv", "'w.csv'. There is no such file."),
        (plain, tmp_path / "short.txt", f"of cloud '{plain[0]}'. There must be 12, one per point; "),
        (plain, tmp_path / "words.txt", f"'{tmp_path / 'words.txt'}'. Line 3 must end with a num"),
        (plain, tmp_path / "wide.csv", f"'{tmp_path / 'wide.csv'}'. It must have one column, of"),
        (files, tmp_path / "few.csv", f"'{tmp_path / 'few.csv'}'. It has none for the id 'p1' of"),
        (files, tmp_path / "rows.txt", f"'{tmp_path / 'rows.txt'}'. By ids it must have two"),
    ]:
        assert refusal(*clouds, "--weights", word).startswith(f"Invalid weights {said}")
    said = refusal(*plain, "--weights", tmp_path / "rows.txt", "--correspond", "icp")
    assert "With the correspondence icp they must be a column of clouds." in said


@pytest.mark.slow
@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_weights_that_some_clouds_lack(tmp_path: Path, unit: float) -> None:
    """Points there weigh as their partners do, whatever the unit; wrong points of weight 0 leave the truth exact."""
    rng = np.random.default_rng(4)
    points = rng.normal(size=(10, 2))
    A = np.array([[1.2, 0.3], [-0.1, 0.9]])
    moved = points @ A.T + [3.0, -2.0]
    moved[:2] += 5.0  # what the first cloud gives the weight 0
    marks = [f"p{k}" for k in range(10)]
    first = with_ids(tmp_path / "a.csv", points, marks, [0, 0, *(unit * rng.uniform(1, 5, size=8))])
    order = rng.permutation(10)
    second = with_ids(tmp_path / "b.csv", moved[order], [marks[k] for k in order])
    code, out, err = run(first, second, "--weights", "quality", "--frame", "last", "-f", "json")
    told = f"projdist: No column 'quality' in '{second}': the points there weigh as their partners do.\n"
    assert (code, err) == (0, told)
    data = json.loads(out)
    np.testing.assert_allclose(data["clouds"][0]["matrix"], A, atol=1e-12)
    assert ([row["used"] for row in data["clouds"]], data["rms"] < 1e-12) == ([8, 8], True)
    same = with_ids(tmp_path / "c.csv", moved, marks)
    out = run(first, same, "--weights", "quality", "--frame", "last", "-f", "json", "--correspond", "rows")[1]
    np.testing.assert_allclose(json.loads(out)["clouds"][0]["matrix"], A, atol=1e-12)


def test_weights_of_points_without_weighted_partners(tmp_path: Path) -> None:
    """They are the mean of all that are given; of closest points, too, as nobody knows the partners."""
    points = np.random.default_rng(4).normal(size=(6, 2))
    files = [
        with_ids(tmp_path / "a.csv", points[:4], "abcd", [1, 2, 3, 6]),
        with_ids(tmp_path / "b.csv", points[:5], "abcde", [3, 2, 3, 6, 4]),
        with_ids(tmp_path / "c.csv", points, "fedcba"),
    ]
    clouds = [read_cloud(file, weights="quality") for file in files]
    with pytest.warns(UserWarning, match="the points there weigh as their partners do"):
        assert column_weights(clouds, "quality", "id")[2].tolist() == pytest.approx([10 / 3, 4, 6, 3, 2, 2])
    with pytest.warns(UserWarning, match="the points there weigh as the others do on average"):
        assert column_weights(clouds, "quality", "icp")[2].tolist() == pytest.approx([10 / 3] * 6)
    wrong = with_ids(tmp_path / "d.csv", points[:4], "abcd", [1, -1, 2, 3])
    said = f"projdist: Invalid weights of cloud '{wrong}'. That of point 2 is -1; it must be finite and not negative.\n"
    assert run(files[2], wrong, "--weights", "quality") == (2, "", said)
    with pytest.warns(UserWarning, match="No column 'quality' in 4 of 6 clouds: "):
        column_weights([*clouds, *clouds[2:] * 3], "quality", "id")
