"""Every public function with input of every kind: an answer, or one clear line of projdist's own."""

import inspect
import warnings
from pathlib import Path

import numpy as np
import pyproj
import pytest
from public_calls import CALLS, CAP, SQUARE, parameters_of

import projdist
from projdist import plots

STRANGE = {
    "None": None,
    "True": True,
    "0": 0,
    "-1.5": -1.5,
    "nan": float("nan"),
    "inf": float("inf"),
    "complex": 1j,
    "empty text": "",
    "text": "nonsense",
    "long text": "n" * 300,
    "bytes": b"robin",
    "path": Path("nonsense.xyz"),
    "list": [],
    "bounds": (8.0, 48.0, 12.0, 52.0),
    "nested": [[1, [2, "x"]], [3]],
    "texts": ["robin", "x"],
    "dict": {},
    "other dict": {"a": 1},
    "set": {1, 2},
    "array": np.array([1.0, 2.0, 3.0]),
    "array of objects": np.array([None, "x"], dtype=object),
    "CRS": pyproj.CRS("EPSG:3857"),
    "Proj": pyproj.Proj("+proj=merc"),
    "geometry": SQUARE,
    "region": CAP,
    "ellipsoid": projdist.SPHERE,
    "object": object(),
    "class": int,
    "function of none": lambda: 0,
    "function": lambda value: value,
}

# A picture takes a moment each time that it is drawn.
FEW = ("-1.5", "nan", "text", "bytes", "list", "bounds", "nested", "dict", "array of objects", "CRS", "object")
TAKES_FUNCTIONS = {
    "projection",
    "projections",
    "measure",
    "measures",
    "criterion",
    "figure",
    "jacobian",
    "map_distance",
    "against",
    "crs",
}


def public_functions() -> dict[str, object]:
    """The functions of `projdist` and `projdist.plots` by name."""
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
        except (ValueError, TypeError) as error:
            text = str(error)
            clear = text.startswith("Invalid ") and text.endswith(".") and "\n" not in text and len(text) < 600
            return "" if clear else f"{type(error).__name__}: {text}"
        except Exception as error:  # noqa: BLE001 whatever else it raises is what the test is about
            return f"{type(error).__name__}: {error}"
    return ""


def test_every_public_function_is_tried() -> None:
    """But for those that take nothing."""
    assert set(public_functions()) - {"atlas_names", "projection_names"} == set(CALLS)


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_arguments_of_any_kind(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each argument in turn is given numbers, text, sequences, objects, functions."""
    monkeypatch.setattr("projdist.surfaces.surface._REGION_NODES", 30)  # a fiftieth of the cells
    function, wrong = public_functions()[name], []
    for parameter in parameters_of(name, function):
        for kind in FEW if name.startswith("plots.") else STRANGE:
            value = STRANGE[kind]
            if callable(value) and parameter in TAKES_FUNCTIONS:
                continue  # what a function of the user's raises goes through
            text = complaint(function, CALLS[name]() | {parameter: value})
            if text:
                wrong.append(f"{parameter} = {kind}: {text}")
    assert not wrong, "\n".join(wrong)
