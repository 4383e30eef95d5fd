"""The live page as a notebook widget; the kernel answers its messages."""

from __future__ import annotations

import asyncio
import io
import json
from base64 import b64encode
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import anywidget
import numpy as np
import traitlets

from projdist import earth, matrices, plots, support
from projdist.projections import Projection, ProjectionError, ProjectionLike, listed_projections, projection_names
from projdist.regions import Place, RegionLike, get_region, region_for, region_names
from projdist.web import page
from projdist.web.live import dispatcher
from projdist.web.live.worker import WORKERS, Thread, answered

_FIRST = "winkel-tripel"
_MOST = 6
_SIZE, _DPI, _COLOURS = (6.0, 4.5), 100.0, 256  # inches, dots an inch; the palette makes it a fourth of the bytes
_TRIED = np.array([-120.0, -30.0, 10.0, 40.0, 170.0]), np.array([-50.0, -5.0, 50.0, 20.0, 75.0])


class Explorer(anywidget.AnyWidget):
    """Interactive maps in a notebook: the live page of `projdist explore` as a widget.

    Attributes follow what is dragged and chosen in the page, and the page follows them. Previews are computed in the
    kernel; pictures and figures in processes that all widgets share, which end when the last widget is closed, or with
    the kernel; those of functions in a thread. Without JavaScript, as on GitHub, a picture is shown.

    Needs anywidget: `pip install 'projdist[explore]'`.

    Parameters
    ----------
    *projections : ProjectionLike
        One to six; the Winkel tripel if there is none.
    region : RegionLike, optional
        By default the area of use of all projections, or else the globe.
    measure : str
        The measure whose colours are shown.

    Attributes
    ----------
    projections : tuple of str
        The definitions of the maps, as `Projection.from_user_input` takes them; a function has its name here. They can
        be set to anything that can be given as projections.
    projection : str
        The definition of the first map.
    region : str
        The region as text; one without a text, such as a geometry, has a name of its own here.
    measure : str
        The name of the measure.
    maps : tuple of Projection
        The projections themselves, also those without a text, for functions of projdist.
    place : Region or PointSet
        The region itself.

    Raises
    ------
    ValueError, ProjectionError
        For an invalid projection, region or measure, when it is given or set.

    Examples
    --------
    >>> import anywidget
    >>> explorer = Explorer("robinson", "EPSG:3035", region="country:DE", measure="omega")
    >>> explorer
    Explorer('robinson', 'EPSG:3035', region='country:DE', measure='angular_distortion')
    >>> explorer.observe(lambda change: print("now", change["new"]), "projection")
    >>> explorer.projection = "robinson+lon_0=150"
    now robinson+lon_0=150
    >>> explorer.close()
    """

    projections = traitlets.Any().tag(sync=True)
    region = traitlets.Any().tag(sync=True)
    measure = traitlets.Any().tag(sync=True)
    projection = traitlets.Any()
    _words = traitlets.Dict().tag(sync=True)
    _thread: Thread | None = None
    _still: tuple[object, str] | None = None

    def __init__(self, *projections: ProjectionLike, region: RegionLike | None = None, measure: str = "fisher") -> None:
        self._given = _Given()
        self._dispatcher = dispatcher.Dispatcher(self._given)
        texts = self._projection_texts(list(projections) or _FIRST)
        if region is None:
            region = region_for(None, [self._given.projection(text) for text in texts])
        super().__init__(
            projections=texts,
            projection=texts[0],
            region=self._given.region_text(region),
            measure=_measure_name(measure),
            _words={"names": sorted(projection_names()), "countries": list(region_names())},
        )
        self.on_msg(self._heard)

    def __repr__(self) -> str:
        """The call that makes it."""
        return f"Explorer({', '.join(map(repr, self.projections))}, region={self.region!r}, measure={self.measure!r})"

    @property
    def maps(self) -> tuple[Projection, ...]:
        """The projections, also those without a text."""
        return tuple(map(self._given.projection, self.projections))

    @property
    def place(self) -> Place:
        """The region, also one without a text."""
        return self._given.region(self.region)

    def close(self) -> None:
        """Close the widget; the last one ends the shared processes."""
        super().close()
        if self._thread is not None:
            self._thread.close()
        WORKERS.leave(id(self))

    def set_state(self, sync_data: Mapping[str, Any]) -> None:
        """Take the page's state; invalid values are ignored."""
        super().set_state({name: value for name, value in sync_data.items() if self._is_right(name, value)})

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The widget, and a picture as fallback."""
        bundle = super()._repr_mimebundle_(**options)
        # marimo requests the picture and does not show it.
        if bundle is None or type(self.comm).__module__.partition(".")[0] == "marimo":
            return bundle
        data, metadata = bundle
        return {**data, "image/png": self._picture()}, metadata

    # ---- traits -----------------------------------------------------------------------------

    @traitlets.validate("projections", "projection", "region", "measure")
    def _checked(self, proposal: Any) -> Any:
        return self._texts_of(proposal.trait.name, proposal.value)

    def _texts_of(self, name: str, value: Any) -> Any:
        """Normalised value of a trait; raises ValueError."""
        one, region = self._given.projection_text, self._given.region_text
        texts = {"projections": self._projection_texts, "projection": one, "region": region, "measure": _measure_name}
        return texts[name](value)

    def _projection_texts(self, given: ProjectionLike | Iterable[ProjectionLike]) -> tuple[str, ...]:
        texts = tuple(map(self._given.projection_text, listed_projections(given)))
        if not 1 <= len(texts) <= _MOST:
            raise ValueError(f"Invalid projections. They must be one to {_MOST}, and {len(texts)} were given.")
        return texts

    def _is_right(self, name: str, value: Any) -> bool:
        try:
            return name not in ("projections", "region", "measure") or self._texts_of(name, value) is not None
        except ValueError:
            return False

    @traitlets.observe("projections")
    def _first_changed(self, change: Any) -> None:
        self.projection = change["new"][0]

    @traitlets.observe("projection")
    def _put_first(self, change: Any) -> None:
        if self.projections[0] != change["new"]:
            self.projections = (change["new"], *self.projections[1:])

    # ---- requests of the page ---------------------------------------------------------------

    def _heard(self, _: Any, content: Mapping[str, Any], buffers: list[Any]) -> None:
        """Answer a message: previews at once, other requests in turn."""
        view = content.get("view")
        if content.get("closed"):
            return
        try:
            request = dispatcher.read_request(str(content.get("text", "")), bytes(buffers[0]) if buffers else b"")
        except dispatcher.RequestError as error:
            self._tell(view, dispatcher.failed(dispatcher.Request(id=0, kind="error"), str(error)))
            return
        if request.kind == "preview":
            self._tell(view, answered(self._dispatcher, request))
        elif request.kind == dispatcher.STOP:
            self._stop((view, request.slot), str(request.options.get("what")))
        else:
            self._ask(view, request)

    def _ask(self, view: Any, request: dispatcher.Request) -> None:
        """Hand a request to a process, or to a thread where maps or the region have no text."""
        tell = _in_this_loop(lambda block: self._tell(view, block))
        key = (view, request.slot, request.kind)
        if not self._given.any:
            WORKERS.ask(id(self), dispatcher.WORKER_OF_KIND[request.kind], key, request, tell)
            return
        self._thread = self._thread or Thread(self._dispatcher)
        self._thread.ask(id(self), key, request, tell)

    def _stop(self, place: tuple[Any, str], what: str) -> None:
        if what not in dispatcher.WORKER_OF_KIND:
            return
        WORKERS.drop(id(self), dispatcher.WORKER_OF_KIND[what], (*place, what))
        if self._thread is not None:
            self._thread.drop(id(self), (*place, what))

    def _tell(self, view: Any, block: bytes) -> None:
        if self.comm is not None:
            self.send({"view": view}, [block])

    # ---- fallback without a page ------------------------------------------------------------

    def _picture(self) -> str:
        """PNG of the current maps in base64."""
        state = (self.projections, self.region, self.measure)
        if self._still is None or self._still[0] != state:
            from PIL import Image

            options: dict[str, Any] = {"region": self.place, "measure": self.measure, "size": _SIZE, "dpi": _DPI}
            figure = plots.heatmap_figure(self.maps, **options)
            drawn, file = io.BytesIO(), io.BytesIO()
            figure.savefig(drawn, format="png", dpi=_DPI)
            Image.open(drawn).convert("RGB").quantize(_COLOURS).save(file, format="png", optimize=True)
            self._still = state, b64encode(file.getvalue()).decode("ascii")
        return self._still[1]


@dataclass(frozen=True)
class _Given(dispatcher.InputPolicy):
    """Inputs of the page: texts, and objects of the kernel without a text, under generated names."""

    is_open: bool = True
    projections: dict[str, Projection] = field(default_factory=dict)
    regions: dict[str, Place] = field(default_factory=dict)

    @property
    def any(self) -> bool:
        """True if there are objects without a text."""
        return bool(self.projections or self.regions)

    def projection(self, text: str) -> Projection:
        """The projection of a text or name; raises ProjectionError."""
        return self.projections[text] if text in self.projections else super().projection(text)

    def source(self, text: str) -> ProjectionLike:
        """Input that a text stands for."""
        return self.projections.get(text, text)

    def region(self, text: str, ellipsoid: earth.Ellipsoid | None = None) -> Place:
        """The region of a text or name, on the body of an ellipsoid; raises ValueError."""
        known = self.regions.get(text)
        return super().region(text, ellipsoid) if known is None else get_region(known, ellipsoid)

    def projection_text(self, given: ProjectionLike) -> str:
        """A text for a projection; raises ProjectionError."""
        if isinstance(given, str):
            self.projection(given.strip())
            return given.strip()
        projection = Projection.from_user_input(given)
        if _reads_back(projection):
            return projection.definition
        for name, known in self.projections.items():
            if known.function is projection.function:
                return name
        name = _new_name(projection.name, self.projections)
        self.projections[name] = replace(projection, name=name, definition=name)
        return name

    def region_text(self, given: RegionLike) -> str:
        """A text for a region; raises ValueError."""
        if isinstance(given, str):
            self.region(given.strip())
            return given.strip()
        place = get_region(given)
        try:
            if get_region(place.name) == place:
                return place.name
        except ValueError:
            pass  # the name is no text
        name = _new_name(place.name, self.regions)
        self.regions[name] = replace(place, name=name)  # type: ignore[type-var]
        return name


def _reads_back(projection: Projection) -> bool:
    """True if the definition reads back as the same map."""
    try:
        again = Projection.from_user_input(projection.definition)
    except ProjectionError:
        return False
    same = again.ellipsoid == projection.ellipsoid
    return same and bool(np.allclose(again(*_TRIED), projection(*_TRIED), rtol=1e-9, atol=1e-3, equal_nan=True))


def _new_name(name: str, known: Collection[str]) -> str:
    """An unused name."""
    names = [name, *(f"{name} ({k})" for k in range(2, len(known) + 2))]
    return next(one for one in names if one not in known)


def _measure_name(measure: Any) -> str:
    return support.check_choice("measure", matrices.get_measure(measure).name, page.SHOWN_MEASURES)


def _in_this_loop(tell: Any) -> Any:
    """`tell` for other threads: it runs in the current event loop, as some notebooks require."""
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:
        return tell

    def telling(block: bytes) -> None:
        if not loop.is_closed():
            loop.call_soon_threadsafe(tell, block)

    return telling


_FILES = page.live_files()
_STYLE = {"style.js": f"export const STYLE = {json.dumps(_FILES['explore.css'])};"}
Explorer._esm = page.bundled(_FILES | _STYLE, "widget.js")
