"""Files of results as they come."""

import json
import os

import pytest

from projdist.answers.batches import open_partial

HEADER = {"projdist": "1", "PROJ": "9", "function": "f", "options": {"a": 1}, "tasks": 3, "digest": "abc"}
LINES = [json.dumps({"task": n, "answer": 1 / (n + 3)}) for n in range(3)]


def write(path, lines=LINES, header=HEADER):
    with open_partial(path, header) as file:
        file.append(lines)


def read(path, header=HEADER):
    with open_partial(path, header) as file:
        return file.done


def test_results_come_back(tmp_path):
    """All that was appended, in however many goes, to the last digit; lines of JSON below the header."""
    path = tmp_path / "part"
    write(path, LINES[:1])
    write(path, LINES[1:])
    assert read(path) == {n: {"task": n, "answer": 1 / (n + 3)} for n in range(3)}
    header, *lines = path.read_text().splitlines()
    assert (json.loads(header), lines) == (HEADER, LINES)


@pytest.mark.parametrize("cut", range(1, len(LINES[2]) + 2))
def test_a_line_that_was_cut_off_goes(tmp_path, cut):
    """Wherever; what follows it is whole."""
    path = tmp_path / "part"
    write(path)
    whole = path.stat().st_size
    os.truncate(path, whole - cut)
    assert set(read(path)) == {0, 1}
    write(path, LINES[2:])
    assert path.stat().st_size == whole
    assert set(read(path)) == {0, 1, 2}


@pytest.mark.parametrize("length", [0, 1, 5, 14, 40])
def test_a_header_that_was_cut_off(tmp_path, length):
    """Is written anew."""
    path = tmp_path / "part"
    path.write_bytes(json.dumps(HEADER).encode()[:length])
    assert read(path) == {}
    assert json.loads(path.read_text()) == HEADER


def test_what_was_lost_is_tried_again(tmp_path):
    """A task that was given up is none that is done, until it is."""
    path = tmp_path / "part"
    write(path, [json.dumps({"task": 1, "error": "killed", "again": True}), json.dumps({"task": 2, "error": "wrong"})])
    assert set(read(path)) == {2}
    write(path, LINES[1:2])
    assert set(read(path)) == {1, 2}


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"projdist": "2"}, "of another version of projdist"),
        ({"PROJ": "10"}, "with another version of PROJ"),
        ({"function": "g"}, "of another function"),
        ({"options": {"a": 2}}, "with other options"),
        ({"tasks": 4}, "of other regions or maps"),
        ({}, "of other regions or maps"),
    ],
)
def test_another_job_is_refused(tmp_path, changed, what):
    """In one line that says what is different; the file stays as it is."""
    path = tmp_path / "part"
    write(path)
    before = path.read_bytes()
    message = rf"^Invalid partial file '.*part'. It belongs to another job, {what}. Take another name, or remove it.$"
    with pytest.raises(ValueError, match=message):
        read(path, HEADER | {"digest": "other"} | changed)
    assert path.read_bytes() == before


@pytest.mark.skipif(os.name == "nt", reason="devices of Unix")
def test_a_device():
    """It keeps nothing, and one that never ends would fill the memory; it is not even opened."""
    told = r"^Invalid partial file '/dev/null'\. It is a device or a pipe, which keeps nothing\.$"
    with pytest.raises(ValueError, match=told):
        read("/dev/null")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (b"region,area_km2\n", "It is none; take another name."),
        (b"PNG", "It is none; take another name."),
        (b'{"a": 1}\n', "It is none; take another name."),
        (json.dumps(HEADER).encode() + b'\n{"task": 1\n{"task": 2}\n', "Its line 2 is damaged."),
        (json.dumps(HEADER).encode() + b"\n[1]\n", "Its line 2 is no result."),
    ],
)
def test_other_files_are_refused(tmp_path, text, what):
    """And stay as they are."""
    path = tmp_path / "part"
    path.write_bytes(text)
    with pytest.raises(ValueError, match=rf"^Invalid partial file '.*part'. {what}$"):
        read(path)
    assert path.read_bytes() == text


def test_one_process_at_a_time(tmp_path):
    """Two would do the same work."""
    pytest.importorskip("fcntl")
    path = tmp_path / "part"
    with (
        open_partial(path, HEADER),
        pytest.raises(ValueError, match=r"Another process is writing it.$"),
        open_partial(path, HEADER),
    ):
        pass
