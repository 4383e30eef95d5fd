"""The explorer in notebooks: what is set, what the page asks, and who answers."""

import base64
import io
import json
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from live_pages import decoded, right_nodes
from PIL import Image
from refusals import refuses

import projdist

pytest.importorskip("anywidget")

from projdist.web.live.widget import Explorer
from projdist.web.live.worker import WORKERS

SQUARE = shapely.box(8, 48, 12, 52)


def cosine(lon: Any, lat: Any) -> tuple[Any, Any]:
    """A map of the user's own: the sinusoidal one."""
    lam, phi = np.radians(lon), np.radians(lat)
    return 6371008.7714 * lam * np.cos(phi), 6371008.7714 * phi


Maker = Callable[..., Explorer]


@pytest.fixture
def make() -> Iterator[Maker]:
    """Explorers that are closed at the end."""
    made: list[Explorer] = []

    def maker(*projections: Any, **options: Any) -> Explorer:
        made.append(Explorer(*projections, **options))
        return made[-1]

    yield maker
    for one in made:
        one.close()
    assert WORKERS.pids == []


class _Page:
    """What a page would hear of a widget."""

    def __init__(self, widget: Explorer, monkeypatch: pytest.MonkeyPatch) -> None:
        self.widget, self.came = widget, threading.Condition()
        self.heard: list[tuple[dict[str, Any], dict[str, Any]]] = []
        monkeypatch.setattr(widget, "send", self._hear)

    def _hear(self, content: dict[str, Any], buffers: list[bytes]) -> None:
        with self.came:
            header, arrays = decoded(buffers[0])
            self.heard.append((content, header | arrays))
            self.came.notify_all()

    def ask(self, kind: str, *, view: int = 1, id: int = 1, **content: Any) -> None:
        text = json.dumps({"id": id, "kind": kind, "slot": "map1", **content})
        self.widget._handle_custom_msg({"view": view, "text": text}, [])

    def answer(self, id: int = 1) -> dict[str, Any]:
        """The reply to a request, waited for."""

        def found() -> list[dict[str, Any]]:
            return [one for _, one in self.heard if one["id"] == id and "progress" not in one]

        with self.came:
            assert self.came.wait_for(found, 60.0), "no answer"
            return found()[0]

    def answered(self, kind: str, id: int = 1, **content: Any) -> dict[str, Any]:
        """The reply to a request."""
        self.ask(kind, id=id, **content)
        return self.answer(id)


@pytest.fixture
def page(make: Maker, monkeypatch: pytest.MonkeyPatch) -> Callable[..., _Page]:
    return lambda *projections, **options: _Page(make(*projections, **options), monkeypatch)


def test_one_map_of_the_globe(make: Maker) -> None:
    """Without anything else; else the area of use that all maps have."""
    assert repr(make()) == "Explorer('winkel-tripel', region='globe', measure='fisher')"
    assert make("EPSG:3035").region == "box:-35.58,24.6,44.83,84.73"


@pytest.mark.parametrize(("given", "text"), [
    ("robinson", "robinson"), (3035, "EPSG:3035"), (("ESRI", 54030), "ESRI:54030"), (cosine, "cosine"),
    (projdist.Projection.from_user_input("mollweide@45,-100"), None),
])  # fmt: skip
def test_projections_of_any_kind_have_a_text(make: Maker, given: Any, text: str | None) -> None:
    widget = make("robinson", given)
    expected = text or given.definition
    assert widget.projections == ("robinson", expected)
    widget.projections = [given]
    widget.projection = widget.projection
    assert (widget.projection, widget.projections) == (expected, (expected,))
    np.testing.assert_allclose(widget.maps[0](20, 30), projdist.Projection.from_user_input(given)(20, 30), rtol=1e-12)


@pytest.mark.parametrize(("given", "text"), [
    ("country:DE", "country:DE"), ((8, 48, 12, 52), "box:8,48,12,52"), (SQUARE, "polygons"),
    (projdist.Cap(10, 50, 200), "cap:10,50,200"),
])  # fmt: skip
def test_regions_of_any_kind_have_a_text(make: Maker, given: Any, text: str) -> None:
    widget = make("robinson")
    for one in (given, text):
        widget.region = one
        assert widget.region == text
    assert widget.place.area_km2 == pytest.approx(projdist.get_region(given).area_km2, rel=1e-12)


def test_things_without_a_text_have_names_of_their_own(make: Maker) -> None:
    widget = make(cosine, projdist.Projection.from_function(lambda lon, lat: (lon, lat), name="cosine"), cosine)
    assert widget.projections == ("cosine", "cosine (2)", "cosine")
    widget.region = SQUARE
    widget.region = shapely.box(0, 0, 1, 1)
    assert widget.region == "polygons (2)"


def test_what_is_set_is_observed(make: Maker) -> None:
    """The first map is the first of all."""
    widget, heard = make("robinson", "mollweide"), []
    widget.observe(lambda change: heard.append((change["name"], change["new"])))
    widget.projection = "eckert-4"
    widget.projections = ("gall", "mollweide")
    widget.measure = "omega"
    assert set(heard) == {
        *(("projection", "eckert-4"), ("projections", ("eckert-4", "mollweide"))),
        *(("projection", "gall"), ("projections", ("gall", "mollweide")), ("measure", "angular_distortion")),
    }


@pytest.mark.parametrize(("name", "value", "text"), [
    ("projection", "robinsn", "Did you mean robinson"), ("projections", [], "one to 6, and 0"),
    ("projections", ["robinson"] * 7, "one to 6, and 7"), ("region", "country:Xx", "Invalid"),
    ("measure", "omga", "Invalid measure 'omga'"), ("measure", "flexion", "It must be one of fisher"),
])  # fmt: skip
def test_nonsense_is_refused(make: Maker, name: str, value: Any, text: str) -> None:
    """In words, and all stays as it was; at the start, too."""
    widget = make("robinson", "mollweide", region="country:DE")
    before = repr(widget)
    refuses(text, setattr, widget, name, value)
    assert repr(widget) == before
    widget.set_state({name: value})
    assert repr(widget) == before
    if name == "projection":
        with pytest.raises(projdist.ProjectionError, match=text):
            Explorer(value)


def test_what_the_page_sets(make: Maker) -> None:
    """Is heard of as if it had been set here, and not told to the page again."""
    widget, heard = make("robinson"), []
    widget.observe(lambda change: heard.append(change["new"]), "projection")
    widget.set_state({"projections": ["robinson+lon_0=150", "mollweide"], "region": "cap:1,2,300", "measure": "fisher"})
    assert heard == ["robinson+lon_0=150"]
    assert repr(widget) == "Explorer('robinson+lon_0=150', 'mollweide', region='cap:1,2,300', measure='fisher')"


def test_previews_are_answered_at_once(page: Callable[..., _Page]) -> None:
    """To the view that asked, without a process."""
    opened = page("robinson")
    opened.ask("preview", view=7, projection="robinson", centre=[30, 0])
    content, block = opened.heard[0]
    assert (content, block["preview"]) == ({"view": 7}, True)
    assert right_nodes(block, block, "robinson+lon_0=30", 0.03)[1] >= 0.9
    assert WORKERS.pids == []


@pytest.mark.slow
def test_functions_and_geometries_are_answered_by_a_thread(page: Callable[..., _Page]) -> None:
    """As no other process has them; the figures are those of `sample`."""
    opened = page(cosine, region=SQUARE)
    block = opened.answered("picture", projection="cosine", region="polygons")
    assert (block["definition"], block["drags"], block["region_title"]) == ("cosine", "none", "polygons")
    assert right_nodes(block, block, cosine, 1e-4)[1] == 1.0
    found = opened.answered("figures", 2, projection="cosine", region="polygons")["figures"]
    true = projdist.sample(cosine, SQUARE, tolerance=1e-7).airy_kavrayskiy
    assert found["airy_kavrayskiy"] == pytest.approx(true.raw, abs=found["error"] + 1e-7)
    assert opened.answered("preview", 3, projection="cosine", region="polygons")["preview"] is True
    assert WORKERS.pids == []


def test_what_a_function_raises_is_told(page: Callable[..., _Page]) -> None:
    """To the page, whichever way it is asked, and those who ask next are answered."""

    def broken(lon: Any, lat: Any) -> Any:
        return {}["here"]

    opened = page(broken, "robinson")
    for id, kind in enumerate(("preview", "picture", "figures"), start=1):
        assert opened.answered(kind, id, projection="broken")["problem"] == "KeyError: 'here'"
    assert opened.answered("outline", 4, region="country:DE")["title"] == "Germany (DE)"


def test_no_command_names_what_has_no_text(page: Callable[..., _Page]) -> None:
    opened = page(cosine, "robinson", region=SQUARE)
    asked = [("cosine", "globe", False), ("robinson", "polygons", False), ("robinson", "globe", True)]
    for id, (projection, region, is_text) in enumerate(asked, start=1):
        texts = opened.answered("texts", id, projection=projection, region=region)["texts"]
        assert ("Command" in texts) is is_text


@pytest.mark.parametrize("text", ["", "{}", '{"id": 1, "kind": "other"}'])
def test_what_is_no_request_is_told(page: Callable[..., _Page], text: str) -> None:
    opened = page("robinson")
    opened.widget._handle_custom_msg({"view": 1, "text": text}, [])
    assert opened.heard[0][1]["problem"].startswith("Invalid ")


def test_files_may_be_named_in_a_notebook(page: Callable[..., _Page], tmp_path: Path) -> None:
    """It is the user's own kernel, who can read them anyway."""
    path = tmp_path / "map.prj"
    path.write_text("EPSG:3035")
    opened = page(str(path), region="box:0,40,20,60")
    assert "problem" not in opened.answered("preview", projection=str(path), region="box:0,40,20,60")


@pytest.mark.slow
def test_pictures_are_answered_by_processes_that_end(page: Callable[..., _Page]) -> None:
    first, second = page("robinson"), page("mollweide")
    for opened, name in ((first, "robinson"), (second, "mollweide")):
        block = opened.answered("picture", projection=name)
        assert (block["definition"], block["drags"]) == (name, "both")
        assert right_nodes(block, block, name, 1e-4)[1] >= 0.97  # but at poles
    [pid] = WORKERS.pids
    for opened, left in ((first, [pid]), (second, [])):
        opened.widget.close()
        assert WORKERS.pids == left


@pytest.mark.slow
def test_no_process_outlives_the_kernel(tmp_path: Path) -> None:
    """That ends without closing anything."""
    script = """
import json, threading
import projdist
from projdist.web.live.worker import WORKERS
widget, came = projdist.Explorer("robinson"), threading.Event()
widget.send = lambda content, buffers: came.set()
widget._handle_custom_msg({"view": 1, "text": json.dumps({"id": 1, "kind": "picture", "projection": "robinson"})}, [])
assert came.wait(60)
print(*WORKERS.pids)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=True)
    [pid] = map(int, done.stdout.split())
    assert not Path(f"/proc/{pid}").exists()


def test_the_script_is_one_module(make: Maker, tmp_path: Path) -> None:
    """Of all that the page has, without an import, with the one export that a widget must have."""
    text = make("robinson")._esm
    assert [line for line in text.splitlines() if line.startswith(("import ", "export "))] == [
        "export default { render };"
    ]
    assert "class Explorer" in text
    if shutil.which("node"):
        (tmp_path / "page.mjs").write_text(text)
        subprocess.run(["node", "--check", str(tmp_path / "page.mjs")], check=True, timeout=60)


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_a_picture_stands_where_no_page_runs(make: Maker) -> None:
    """In few bytes, and is made anew when something else is shown."""
    widget = make("robinson", region="country:DE")
    first, _ = widget._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in first
    with Image.open(io.BytesIO(base64.b64decode(first["image/png"]))) as image:
        assert (image.format, image.size) == ("PNG", (600, 450))
    assert len(first["image/png"]) < 150_000
    assert widget._repr_mimebundle_()[0]["image/png"] is first["image/png"]
    widget.measure = "omega"
    assert widget._repr_mimebundle_()[0]["image/png"] != first["image/png"]


@pytest.mark.slow
def test_without_anywidget_one_line_says_so() -> None:
    """And the package itself does not ask for it."""
    script = """
import sys
sys.modules["anywidget"] = None
import projdist
from projdist import *
try:
    Explorer("robinson")
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "The explorer in notebooks needs anywidget: pip install 'projdist[explore]'.\n"
