"""Every public function with input of every kind: an answer, or one clear line of projdist's own."""

import functools
import inspect
import warnings
from collections.abc import Callable, Hashable
from pathlib import Path

import numpy as np
import pyproj
import pytest
from matplotlib import colormaps
from public_calls import CALLS, CAP, SQUARE, axes, parameters_of
from refusals import refuses
from tables import each, some

import projdist
from projdist import plots, surfaces

NUMBERS = {"None": None, "True": True, "0": 0, "-1.5": -1.5, "nan": np.nan, "inf": np.inf, "complex": 1j}
TEXTS = {"empty text": "", "text": "nonsense", "long text": "n" * 300, "bytes": b"robin", "path": Path("nonsense.xyz")}
LISTS = {"list": [], "bounds": (8.0, 48.0, 12.0, 52.0), "nested": [[1, [2, "x"]], [3]], "texts": ["robin", "x"]}
DICTS = {"dict": {}, "other dict": {"a": 1}, "set": {1, 2}}
ARRAYS = {"array": np.array([1.0, 2.0, 3.0]), "array of objects": np.array([None, "x"], dtype=object)}
PLACES = {"geometry": SQUARE, "region": CAP, "ellipsoid": projdist.SPHERE}
CRSS = {"CRS": pyproj.CRS("EPSG:3857"), "Proj": pyproj.Proj("+proj=merc")}
OBJECTS = {"object": object(), "class": int, "function of none": lambda: 0, "function": lambda value: value}
STRANGE = NUMBERS | TEXTS | LISTS | DICTS | ARRAYS | PLACES | CRSS | OBJECTS
# A picture takes a moment each time that it is drawn.
FEW = ("-1.5", "nan", "text", "bytes", "list", "bounds", "nested", "dict", "array of objects", "CRS", "object")
MAPS = {"projection", "projections", "against", "crs"}
TAKES_FUNCTIONS = {*MAPS, "measure", "measures", "criterion", "figure", "jacobian", "map_distance"}


def public_functions() -> dict[str, object]:
    found = {name: getattr(projdist, name) for name in projdist.__all__}
    found |= {f"plots.{name}": getattr(plots, name) for name in plots.__all__}
    return {name: value for name, value in found.items() if inspect.isfunction(value)}


def complaint(function: object, arguments: dict[str, object]) -> str:
    """What is wrong with how a function takes its arguments; nothing where it answers, or refuses them clearly."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", projdist.Notice)
        try:
            function(**arguments)
        except OSError:
            return ""  # of the system's own words
        except Exception as error:  # noqa: BLE001 whatever else it raises is what the test is about
            text, ours = str(error), isinstance(error, ValueError | TypeError)
            clear = text.startswith("Invalid ") and text.endswith(".") and "\n" not in text and len(text) < 600
            return "" if ours and clear else f"{type(error).__name__}: {text}"
    return ""


def test_every_public_function_is_tried() -> None:
    """But for those that take nothing."""
    assert set(public_functions()) - {"atlas_names", "projection_names"} == set(CALLS)


@pytest.fixture(scope="module")
def surface_of() -> Callable[..., object]:
    """That of one map and region, which takes longest of a picture, is made once."""
    made, known = surfaces.surface_of, functools.lru_cache(maxsize=None, typed=True)(surfaces.surface_of)
    return lambda *given: (known if all(isinstance(one, Hashable) for one in given) else made)(*given)


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
@pytest.mark.usefixtures("few_cells")
def test_arguments_of_any_kind(name: str, surface_of: Callable[..., object], monkeypatch: pytest.MonkeyPatch) -> None:
    """Each argument in turn is given numbers, text, sequences, objects, functions."""
    monkeypatch.setattr("projdist.surfaces.surface_of", surface_of)
    function, wrong = public_functions()[name], []
    for parameter in parameters_of(name, function):
        for kind in FEW if name.startswith("plots.") else some(STRANGE, 2):
            value = STRANGE[kind]
            # What a function of the user's raises goes through.
            if not (callable(value) and parameter in TAKES_FUNCTIONS):
                wrong += [(parameter, kind, complaint(function, CALLS[name]() | {parameter: value}))]
    assert [one for one in wrong if one[-1]] == []


# ---- answers and refusals --------------------------------------------------------------------------


MOLLWEIDE = projdist.Projection.from_user_input("moll")


@each("one", ["robin", pyproj.CRS("EPSG:3857"), 3857, ("EPSG", 3857), {"proj": "moll"}, MOLLWEIDE])
def test_a_single_projection_is_one(one: object) -> None:
    """And not its letters: the result is that of a list with it alone."""
    (result,), (listed,) = (projdist.compare(value, CAP, tolerance=1e-3).results for value in (one, [one]))
    assert result.airy_kavrayskiy == listed.airy_kavrayskiy


@pytest.mark.slow
def test_a_single_measure_is_one() -> None:
    """By its name, as a Measure and as a function."""
    for measure in ("omega", projdist.get_measure("omega"), projdist.MEASURES["angular_distortion"].function):
        found = projdist.summarize("merc", CAP, measures=measure, tolerance=1e-3).measures
        assert [value.max < 1e-6 for value in found.values()] == [True]  # conformal
    assert list(projdist.factors("robin", 10, 50, measures="airy").extra) == ["airy"]
    assert not projdist.factors("robin", 10, 50, measures=None).extra
    # Of fields: the areal scale of the plate carree is 1 / cos(lat), whose mean over the globe is pi / 2.
    found = projdist.sample("plate-carree", "globe", measures="s")
    for measure in ("s", projdist.get_measure("s"), projdist.MEASURES["areal_scale"].function):
        assert found.mean(measure).value == pytest.approx(np.pi / 2, rel=1e-6)


@pytest.mark.usefixtures("few_cells")
def test_wrong_kinds_are_refused_in_one_line() -> None:
    """What no function takes is said with its value."""
    summarize, factors, here = projdist.summarize, projdist.factors, {"region": CAP}
    refuses(r"^Invalid region 'True'\. It must be globe, ", summarize, "robin", True)
    refuses(r"^Invalid region '\[1, 2, 3\]'\. It must be globe, ", summarize, "robin", [1, 2, 3])
    refuses(r"^Invalid tolerance 'small'\. It must be a number", summarize, "robin", CAP, tolerance="small")
    refuses(r"^Invalid measure '5'\. It must be one of fisher, ", summarize, "robin", CAP, measures=5)
    refuses(r"^Invalid longitudes 'here'\. They must be numbers\.$", factors, "robin", "here", 50)
    refuses(r"^Invalid points\. .* shapes \(2,\) and \(3,\)", factors, "robin", [1, 2], [1, 2, 3])
    refuses(r"^Invalid constraint \"?'\['affine'\]'", projdist.correct, "robin", CAP, constraint=["affine"])
    refuses(r"^Invalid axes '5'\. It must be Axes of matplotlib\.$", plots.tissot, "robin", 5)
    refuses(r"^Invalid colour map '5'\. It must be a name ", plots.heatmap, "robin", axes(), **here, cmap=5)
    refuses(r"^Invalid size 'big'\. They must be numbers\.$", plots.tissot_figure, "robin", **here, size="big")


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_a_colour_map_of_matplotlib_goes_wherever_a_name_does() -> None:
    maps = [plots.heatmap("robin", axes(), region=CAP, cmap=one) for one in ("magma", colormaps["magma"])]
    np.testing.assert_array_equal(*(one.colours(np.linspace(0, 1, 9)) for one in maps))
