"""Functions of many regions: answers as those of one, on whatever they run, through crashes."""

import json
import math
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import pyproj
import pytest
from batch_functions import always_killed, name_of, once_killed, slow
from dask_clusters import dask_cluster
from refusals import refuses
from tables import each

import projdist
from projdist.answers import areas_of, batch
from projdist.answers.batch_tasks import Job, run_tasks
from projdist.answers.batches import _tasks
from projdist.regions import region_for

BANDS = [f"box:{k},0,{k + 1},1" for k in range(8)]
MAPS = ["mollweide", "EPSG:3035", "+proj=lcc +lat_1=40 +lat_2=60"]
BUSY = "threads", "processes:2"
PLACES = ["country:CH", "box:-10,30,20,60", "cap:10,50,500"]
COARSE = {"tolerance": 1e-3}
NAMED = projdist.Projection.from_function(lambda x, y: (x, y), name="robin")
TEXTS = "options of a batch. They must be text, numbers, and lists of them: "
NO_TEXT = "projection '{}' of a batch. It must have a text: a name, "


@pytest.fixture(scope="module")
def serial():
    """Summaries one by one, by region and map."""
    maps = [projdist.Projection.from_user_input(one) for one in MAPS]
    regions = {place: region_for(place, maps) for place in PLACES}  # a cap is the same for all maps, spheres and not
    pairs = [(place, one) for place in PLACES for one in MAPS]
    return {(place, one): projdist.summarize(one, regions[place], measures=["omega"], **COARSE) for place, one in pairs}


@pytest.mark.slow
@pytest.mark.parametrize("executor", [None, *BUSY], ids=["here", *BUSY])
def test_answers_are_those_of_one(serial, executor):
    """To the last digit and in order, with what is told on the way; a frame has the rows, their region before them."""
    workers = ThreadPoolExecutor(3) if executor == "threads" else executor
    found = batch(projdist.summarize, PLACES, MAPS, options={"measures": ["omega"], **COARSE}, executor=workers)
    assert found.failures == ()
    assert [(one.region, one.projection) for one in found.results] == list(serial)
    for one in found.results:
        expected = serial[one.region, one.projection]
        assert one.answer == expected.to_dict()
        assert one.area_km2 == expected.region.area_km2
    rows = found.plain_rows()
    assert [row["omega_mean"] for row in rows] == [one.measures["omega"].mean for one in serial.values()]
    assert rows[4]["region"] == "box:-10,30,20,60"


def test_notices_and_features(tmp_path):
    """Notices stand beside the answers that they are of, and are no warnings; polygons of a file are regions."""
    found = batch(projdist.summarize, ["country:CH", "box:20,-30,30,-20"], ["moll", "EPSG:3035"], options=COARSE)
    told = {(one.region, one.projection): one.notices for one in found.results if one.notices}
    assert list(told) == [("box:20,-30,30,-20", "EPSG:3035")]
    assert "where nothing of box:20,-30,30,-20 lies" in told.popitem()[1][0]
    shape = {"type": "Polygon", "coordinates": [[[0.1, 0.2], [3, 0.3], [2.2, 4], [0.1, 0.2]]]}
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "Feature", "properties": {"name": "triangle"}, "geometry": shape}))
    (one,) = batch(projdist.summarize, str(path), "moll", options=COARSE).results
    assert (one.region, one.answer) == ("triangle", projdist.summarize("moll", shape, **COARSE).to_dict())


def test_tasks_are_small_texts(tmp_path):
    """A task of a named place takes 100 bytes on its way, and one alone 400; maps are codes, or what is in files."""
    job = Job(projdist.summarize, {"measures": ["omega"], "tolerance": 1e-8})
    tasks = _tasks("countries", MAPS)
    assert len(tasks) == 3 * len(areas_of("countries"))
    assert len(pickle.dumps((run_tasks, job, tasks[:1]))) < 400
    assert len(pickle.dumps((run_tasks, job, tasks[:100]))) < 100 * 100
    # Workers may not have the files.
    path = tmp_path / "a.prj"
    path.write_text(pyproj.CRS(3035).to_wkt())
    for one in (pyproj.CRS(3035), 3035, ("EPSG", 3035), projdist.Projection.from_user_input("EPSG:3035")):
        assert [task.projection for task in _tasks(BANDS[0], one)] == ["EPSG:3035"]
    for given in (path, str(path)):
        assert [task.projection for task in _tasks(BANDS[0], [given])] == [path.read_text()]


def test_going_on(tmp_path):
    """What a partial file has is not done again, and the answers are the same; another job is refused."""
    path, log, heard = tmp_path / "part", tmp_path / "log", []
    options = {"log": str(log), "seconds": 0.0}
    told = {"progress": lambda done, total: heard.append((done, total))}
    whole = batch(slow, BANDS, options=options, partial=path, **told).to_dict()
    assert (heard, heard[-1]) == (sorted(heard), (8, 8))
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:4]) + lines[4][:20])
    log.write_text("")
    assert batch(slow, BANDS, options=options, partial=path).to_dict() == whole
    assert sorted(line.split()[1] for line in log.read_text().splitlines()) == BANDS[3:]
    others = (slow, BANDS, options | {"seconds": 1.0}), (slow, [*BANDS[1:], BANDS[0]], options), (name_of, BANDS, {})
    for (function, bands, given), what in zip(
        others, ("with other options", "of other regions", "of another"), strict=True
    ):
        refuses(f"It belongs to another job, {what}", batch, function, bands, options=given, partial=path)


def of_numbers(lon, lat):
    """A map that takes no arrays."""
    return math.radians(lon), math.radians(lat)


@pytest.mark.slow
@each(("function", "others", "message"), [
    (name_of, {"options": {"suffix": object()}}, TEXTS),
    (name_of, {"options": {"suffix": float("nan")}}, "options of a batch."),
    (lambda _: {}, {}, "function '.*<lambda>' of a batch. Other processes must be able to import it."),
    (Job(name_of, {}), {}, "function '.*' of a batch. It must be one of a module; see options."),
    *((name_of, {"executor": wrong}, f"executor '{wrong}'. It must be ") for wrong in ("two", 2)),
    # Functions have no text, whatever they would say of arrays.
    (projdist.summarize, {"projections": [of_numbers]}, NO_TEXT.format("of_numbers")),
    (projdist.summarize, {"projections": NAMED}, NO_TEXT.format("robin")),
])  # fmt: skip
def test_refused(function, others, message):
    refuses(f"^Invalid {message}", batch, function, BANDS, **{"executor": "processes:2"} | others)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ours", "a pool"])
def test_a_killed_worker_loses_nothing(tmp_path, kind):
    """Its task is done by another process; also where the pool is broken by it."""
    executor = ProcessPoolExecutor(2) if kind == "a pool" else "processes:2"
    options = {"trap": str(tmp_path / "trap"), "at": BANDS[3]}
    found = batch(once_killed, BANDS, options=options, executor=executor)
    assert (tmp_path / "trap").exists()
    assert found.failures == ()
    assert [one.answer for one in found.results] == [one.answer for one in batch(name_of, BANDS).results]


@pytest.mark.slow
def test_a_killer_is_named(tmp_path):
    """A task that ends two processes has failed; the others are done, and going on tries it again."""
    log, part = tmp_path / "log", tmp_path / "part"
    options = {"log": str(log), "at": BANDS[3]}
    for times in (2, 4):
        found = batch(always_killed, BANDS, options=options, executor="processes:2", partial=part)
        (failure,) = found.failures
        assert failure.line == f"{BANDS[3]}: The process that worked on it was killed, twice."
        assert [one.region for one in found.results] == [*BANDS[:3], *BANDS[4:]]
        assert log.read_text().splitlines().count(BANDS[3]) == times


SCRIPT = """
    import json, sys
    import projdist
    from batch_functions import slow
    if __name__ == "__main__":
        bands, options = [f"box:{k},0,{k + 1},1" for k in range(40)], {"log": sys.argv[1], "seconds": 0.1}
        print(projdist.batch(slow, bands, options=options, executor="processes:2", partial=sys.argv[2]).to_json())
"""


def is_there(pid):
    """Whether a process is, and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up as Linux has them")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
@pytest.mark.usefixtures("default_signals")
def test_the_main_process_may_be_killed(tmp_path, number):
    """Its workers end with it, and the same script goes on: what was done is not done again, the answers are all."""
    script, log, part = tmp_path / "job.py", tmp_path / "log", tmp_path / "part"
    script.write_text(textwrap.dedent(SCRIPT))
    log.touch()
    words = [sys.executable, str(script), str(log), str(part)]
    paths = [str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        while not (part.exists() and part.read_bytes().count(b"\n") > 10) and process.poll() is None:
            time.sleep(0.05)
        process.send_signal(number)
        process.communicate()
    workers = {int(line.split()[0]) for line in log.read_text().splitlines()}
    assert len(workers) == 2
    until = time.monotonic() + 30.0
    while any(map(is_there, workers)) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(map(is_there, workers))
    done = {json.loads(line)["task"] for line in part.read_bytes().splitlines()[1:]}
    assert 10 <= len(done) < 40
    log.write_text("")
    again = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    bands = [f"box:{k},0,{k + 1},1" for k in range(40)]
    assert {line.split()[1] for line in log.read_text().splitlines()} == {bands[k] for k in range(40) if k not in done}
    found = json.loads(again.stdout)
    assert ([one["region"]["name"] for one in found["results"]], found["failures"]) == (bands, [])


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_dask(tmp_path):
    """A cluster of two workers, of which one is killed half-way, answers what this process does."""
    pytest.importorskip("distributed")
    killed, log = [], tmp_path / "log"
    bands = [f"box:{k},0,{k + 1},1" for k in range(30)]
    options = {"log": str(log), "seconds": 0.2}
    with dask_cluster(tmp_path) as (address, workers):

        def kill(done, _):
            if done > 8 and not killed:
                workers[0].kill()
                killed.append(done)

        found = batch(slow, bands, options=options, executor=address, partial=tmp_path / "part", progress=kill)
        maps = batch(projdist.summarize, PLACES, MAPS[:1], options=COARSE, executor=address)
    assert killed
    assert found.failures == ()
    assert len({line.split()[0] for line in log.read_text().splitlines()}) == 2
    assert [one.answer for one in found.results] == [one.answer for one in batch(name_of, bands).results]
    assert maps.to_dict() == batch(projdist.summarize, PLACES, MAPS[:1], options=COARSE).to_dict()
