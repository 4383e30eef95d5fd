"""Tasks on executors: groups, losses, failures."""

import json
import os
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from unittest.mock import Mock

import pytest
from batch_functions import name_of, wrong
from refusals import refuses
from tables import each

import projdist
from projdist.answers import areas_of
from projdist.answers.batch_tasks import Job, Task
from projdist.answers.batches import open_partial, run_job
from projdist.earth import data_rows
from projdist.regions import PointSet, get_region

TASKS = [Task(number, f"r{number}", f"box:{number},0,{number + 1},1") for number in range(60)]


def results(executor, tasks=TASKS, function=name_of):
    """The results by their tasks, each of which is told once."""
    lines = []
    run_job(Job(function, {}), tasks, executor, lines.extend)
    found = [json.loads(line) for line in lines]
    assert sorted(one["task"] for one in found) == [task.number for task in tasks]
    return {one["task"]: one for one in found}


def is_whole(found, but=()):
    """Whether every task has its own result."""
    names = {number: one["answer"]["name"] for number, one in found.items() if number not in but}
    return names == {number: f"box:{number},0,{number + 1},1" for number in names}


@each("make", [lambda: None, lambda: ThreadPoolExecutor(3)])
def test_every_task_is_done_once(make):
    """Whatever does it; what is wrong with a task is one line, and what nobody expected has its kind before it."""
    assert is_whole(results(make()))
    found = results(make(), TASKS[:8], wrong)
    assert [found[number]["error"] for number in (0, 1)] == ["It is the first.", "KeyError: 'second'"]
    assert "not JSON compliant" in found[2]["error"]
    assert is_whole(found, but=[0, 1, 2])


class Lossy(Executor):
    """An executor that loses groups with their workers as it is told, and remembers what it was given."""

    def __init__(self, is_lost, error=CancelledError):
        self.is_lost, self.error, self.given = is_lost, error, []

    def submit(self, function, job, tasks):
        """Lose the group, or do it at once."""
        future = Future()
        numbers = [task.number for task in tasks]
        if self.is_lost(numbers, self.given):
            future.set_exception(self.error())
        else:
            future.set_result(function(job, tasks))
        self.given.append(numbers)
        return future


@each("error", [CancelledError, BrokenExecutor])
def test_what_is_lost_is_done_again_alone(error):
    """Each task of a lost group in a group of its own, and nothing else twice; one that is lost twice is given up."""
    executor = Lossy(lambda numbers, given: 30 in numbers and not any(30 in one for one in given), error)
    assert is_whole(results(executor))
    (lost,) = (numbers for numbers in executor.given if 30 in numbers and numbers != [30])
    assert len(lost) > 1
    again = [numbers for numbers in executor.given if set(numbers) & set(lost)]
    assert again == [lost, *([number] for number in lost)]
    # It is told to have failed, to be tried again another time; what was lost with it is not.
    found = results(Lossy(lambda numbers, _: 30 in numbers, error))
    assert found[30] == {"task": 30, "error": "The process that worked on it was killed, twice.", "again": True}
    assert is_whole(found, but=[30])


def test_groups():
    """At first one task, as nobody knows how long it takes; then more, and at the end few again."""
    executor = Lossy(lambda *_: False)
    results(executor)
    sizes = [len(numbers) for numbers in executor.given]
    assert (sizes[0], sizes[-1]) == (1, 1)
    assert 1 < max(sizes) <= len(TASKS) / 4


@each("error", [OSError("Timed out trying to connect."), RuntimeError("ConnectionPool is closed")])
def test_a_cluster_that_is_gone(error):
    """Its connection is closed, as Dask and pools have it; that is no file that cannot be written."""
    with pytest.raises(ConnectionError, match=r"^The executor does not answer any more.$"):
        results(Mock(spec=Executor, **{"submit.side_effect": error}))


SQUARE = {"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]]}
FAR = {"type": "Polygon", "coordinates": [[[10, 50], [12, 50], [12, 51], [10, 51], [10, 50]]]}


@pytest.mark.slow
def test_countries_and_continents():
    """All of the table of countries, of their continents, and of states; in the detail that is asked for."""
    rows = data_rows("countries.csv")
    assert {area.text for area in areas_of("countries")} == {f"country:{row['name']}" for row in rows}
    assert {area.text for area in areas_of("continents")} == {f"continent:{row['continent']}" for row in rows}
    assert len(areas_of("areas")) == 55
    assert len(areas_of("states")) == len(areas_of("states@10m")) == 56
    assert areas_of("states")[5] == ("state:California", "state:California")
    (switzerland,) = (one for one in areas_of("countries@10m") if "Switzerland" in one.text)
    assert switzerland.text == "country:Switzerland@10m"
    assert switzerland.place().area_km2 == get_region("country:CH@10m").area_km2


def test_features_of_a_file(tmp_path):
    """Each is a region, by its name if it has one; two of a name are told apart; one without a geometry fails later."""
    both = {"type": "GeometryCollection", "geometries": [SQUARE, FAR]}
    given = [({"NAME": "a"}, SQUARE), ({"name": "a"}, FAR), ({}, both), ({"name": "none"}, None)]
    members = [{"type": "Feature", "properties": fields, "geometry": shape} for fields, shape in given]
    (tmp_path / "parts.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": members}))
    areas = areas_of(str(tmp_path / "parts.geojson"))
    assert [area.name for area in areas] == ["a", "a (2)", "parts 3", "none"]
    places = [area.place() for area in areas[:3]]
    octants = [get_region("box:0,0,2,2").area_km2, get_region("box:10,50,12,51").area_km2]
    assert [place.area_km2 for place in places] == pytest.approx([*octants, sum(octants)], rel=1e-9)
    assert [place.name for place in places] == ["a", "a (2)", "parts 3"]
    refuses(r"^Invalid region 'none'. It holds no polygons.$", areas[3].place)


@pytest.mark.slow
def test_features_in_a_crs(tmp_path):
    """A file's own coordinates go along with its CRS, and edges are straight there."""
    gis = pytest.importorskip("geopandas")
    shape = gis.points_from_xy([4321000], [3210000]).buffer(1e5, cap_style=3)
    frame, path = gis.GeoDataFrame({"name": ["square"]}, geometry=shape, crs=3035), tmp_path / "square.gpkg"
    frame.to_file(path)
    expected = get_region(f"file:{path}").area_km2
    assert expected == pytest.approx(4e4, rel=1e-3)  # 200 km squared; the projection is equal-area
    for given in (str(path), frame):
        (area,) = areas_of(given)
        assert (area.name, area.place().area_km2) == ("square", pytest.approx(expected, rel=1e-12))


@pytest.mark.slow
def test_one_and_several():
    """Whatever `get_region` takes, to the last digit, alone or in a list."""
    third = projdist.Box(1 / 3, 0, 20, 10)
    given = [third, projdist.Cap(10, 1 / 3, 500), (0, 1, 2, 3), "land & box:0,0,10,10", FAR]
    areas = areas_of(given)
    assert [area.place() for area in areas[:3]] == [third, given[1], projdist.Box(0, 1, 2, 3)]
    assert areas[3].text == "land & box:0,0,10,10"
    assert areas[4].place().area_km2 == pytest.approx(get_region("box:10,50,12,51").area_km2, rel=1e-12)
    assert areas_of((0, 1, 2, 3)) == [areas[2]]
    assert areas_of(areas) == areas


def test_files_within_words(tmp_path):
    """Workers need no file: what is named so goes along as it is."""
    path = tmp_path / "square.geojson"
    path.write_text(json.dumps(SQUARE))
    (area,) = areas_of(f"file:{path} & box:1,1,5,5")
    path.unlink()
    assert area.place().area_km2 == pytest.approx(get_region("box:1,1,2,2").area_km2, rel=1e-9)


@each(("given", "message"), [
    ([], "regions of a batch. There must be one at least."), ([3.5], "region '3.5'"),
    ("countries@5m", "suffix '@5m'. It must be one of @110m, "),
    ("states@50m", "suffix '@50m' of a state. It must be one of @10m, @main and @all."),
    ("nowhere.gpkg", "region file 'nowhere.gpkg'. It cannot be read: No such file"),
    (PointSet([1.0], [2.0], [1.0], "mine"), "region 'mine' of a batch. It must be an area, not points."),
])  # fmt: skip
def test_refused(given, message):
    pytest.importorskip("geopandas")
    refuses(f"^Invalid {message}", areas_of, given)


HEADER = {"projdist": "1", "PROJ": "9", "function": "f", "options": {"a": 1}, "tasks": 3, "digest": "abc"}
HEAD = json.dumps(HEADER).encode()
LINES = [json.dumps({"task": n, "answer": 1 / (n + 3)}) for n in range(3)]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "part"


def write(path, lines=LINES, header=HEADER):
    with open_partial(path, header) as file:
        file.append(lines)


def read(path, header=HEADER):
    with open_partial(path, header) as file:
        return file.done


def test_results_come_back(path):
    """All that was appended, in however many goes, to the last digit; lines of JSON below the header."""
    write(path, LINES[:1])
    write(path, LINES[1:])
    assert read(path) == {n: {"task": n, "answer": 1 / (n + 3)} for n in range(3)}
    header, *lines = path.read_text().splitlines()
    assert (json.loads(header), lines) == (HEADER, LINES)


def test_a_line_that_was_cut_off_goes(path):
    """Wherever; what follows it is whole, and a header that was cut off is written anew."""
    write(path)
    whole = path.stat().st_size
    for cut in range(1, len(LINES[2]) + 2):
        os.truncate(path, whole - cut)
        assert set(read(path)) == {0, 1}
        write(path, LINES[2:])
        assert path.stat().st_size == whole
        assert set(read(path)) == {0, 1, 2}
    for length in (0, 1, 5, 14, 40):
        path.write_bytes(HEAD[:length])
        assert read(path) == {}
        assert json.loads(path.read_text()) == HEADER


def test_what_was_lost_is_tried_again(path):
    """A task that was given up is none that is done, until it is."""
    write(path, [json.dumps({"task": 1, "error": "killed", "again": True}), json.dumps({"task": 2, "error": "wrong"})])
    assert set(read(path)) == {2}
    write(path, LINES[1:2])
    assert set(read(path)) == {1, 2}


CHANGES = [({"projdist": "2"}, "of another version of projdist"), ({"PROJ": "10"}, "with another version of PROJ")]
CHANGES += [({"function": "g"}, "of another function"), ({"options": {"a": 2}}, "with other options")]


@each("changed, what", [*CHANGES, *((one, "of other regions or maps") for one in ({"tasks": 4}, {}))])
def test_another_job_is_refused(path, changed, what):
    write(path)
    before = path.read_bytes()
    message = rf"^Invalid partial file '.*part'. It belongs to another job, {what}. Take another name, or remove it.$"
    refuses(message, read, path, HEADER | {"digest": "other"} | changed)
    assert path.read_bytes() == before


@pytest.mark.skipif(os.name == "nt", reason="devices of Unix")
def test_a_device():
    """It keeps nothing, and one that never ends would fill the memory; it is not even opened."""
    refuses(r"^Invalid partial file '/dev/null'\. It is a device or a pipe, which keeps nothing\.$", read, "/dev/null")


NO_PARTS = dict.fromkeys([b"region,area_km2\n", b"PNG", b'{"a": 1}\n'], "It is none; take another name.")
NO_PARTS |= {
    HEAD + b'\n{"task": 1\n{"task": 2}\n': "Its line 2 is damaged.",
    HEAD + b"\n[1]\n": "Its line 2 is not a result.",
}


@each("text, what", NO_PARTS.items())
def test_other_files_are_refused(path, text, what):
    path.write_bytes(text)
    refuses(rf"^Invalid partial file '.*part'. {what}$", read, path)
    assert path.read_bytes() == text


def test_one_process_at_a_time(path):
    pytest.importorskip("fcntl")
    with open_partial(path, HEADER):
        refuses(r"Another process is writing it.$", read, path)
