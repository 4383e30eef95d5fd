"""Every public function with input of every kind: the right answer, or one clear line of projdist's own."""

import functools
import inspect
import warnings
from pathlib import Path

import matplotlib
import numpy as np
import pyproj
import pytest
import shapely
from batch_functions import name_of
from matplotlib.figure import Figure

import projdist
from projdist import plots

CAP = projdist.Cap(10, 50, 200)
SQUARE = shapely.box(8, 48, 12, 52)


@functools.cache
def low_distortion() -> projdist.LDP:
    """A low-distortion projection of a small box, for the pictures of one."""
    return projdist.ldp("box:8,48,8.2,48.2", height=500, families=["tmerc"])


@functools.cache
def old_map() -> projdist.OldMap:
    """An old map of six points that is a plate carrée."""
    new = np.array([[8.0, 48.0], [9.0, 48.0], [9.0, 49.0], [8.0, 49.0], [8.5, 48.2], [8.2, 48.7]])
    return projdist.old_map(projdist.ControlPoints(new * 100.0, new))


@functools.cache
def short_profile() -> projdist.Profile:
    """A line of one edge."""
    return projdist.profile("robin", [(10, 50), (11, 51)])


def axes() -> object:
    """Axes of a figure of their own."""
    return Figure().add_subplot()


def geoaxes() -> object:
    """Axes of cartopy."""
    crs = pytest.importorskip("cartopy.crs")
    return Figure().add_subplot(projection=crs.PlateCarree())


# Arguments with which a call takes a moment; each is then given everything else in turn.
CALLS = {
    "atlas": lambda: {"place": "NZ"},
    "axes_shift": lambda: {"points": np.eye(3)},
    "batch": lambda: {
        "function": name_of,
        "regions": "box:0,0,1,1",
        "projections": None,
        "options": None,
        "executor": None,
    },
    "check": lambda: {"data": SQUARE, "crs": "EPSG:3857", "column": None, "purpose": None},
    "compare": lambda: {
        "projections": ["robin"],
        "region": CAP,
        "measures": (),
        "indices": (),
        "modes": False,
        "tolerance": 1e-3,
    },
    "correct": lambda: {
        "projection": "robin",
        "region": CAP,
        "criterion": "mean",
        "constraint": "affine",
        "keep_north": True,
        "tolerance": 1e-3,
    },
    "derivatives": lambda: {"projection": "robin", "lon": 10, "lat": 50},
    "design": lambda: {
        "region": CAP,
        "kind": "any",
        "criterion": "airy_kavrayskiy",
        "degree": 2,
        "base": "EPSG:3035",
        "balance": 0.5,
        "norm": None,
        "background": 0.0,
        "symmetric": "none",
        "north": None,
        "datum": None,
        "against": (),
        "name": None,
    },
    "distance_distortion": lambda: {
        "projection": "robin",
        "region": CAP,
        "measure": "gott",
        "map_distance": None,
        "tolerance": 0.1,
        "seed": 0,
    },
    "distortion_ppm": lambda: {"projection": "robin", "lon": 10, "lat": 50, "height": 100},
    "elevation_factor": lambda: {"lat": 50, "height": 100, "ellipsoid": projdist.WGS84},
    "factors": lambda: {"projection": "robin", "lon": 10, "lat": 50, "measures": (), "prefix": ""},
    "find_crs": lambda: {"text": "utm 33", "authorities": ("EPSG",), "limit": 1},
    "get_criterion": lambda: {"criterion": "mean"},
    "get_figure": lambda: {"figure": "airy"},
    "get_measure": lambda: {"measure": "omega"},
    "get_region": lambda: {"region": "globe"},
    "goldberg_gott_score": lambda: {
        "values": dict.fromkeys("IAFSDB", 1.0),
        "normalisers": dict.fromkeys("IAFSDB", 1.0),
    },
    "field_of": lambda: {
        "jacobian": [np.eye(2)],
        "weight": [1.0],
        "lon": [10.0],
        "lat": [50.0],
        "hessian": np.zeros((1, 2, 2, 2)),
        "region": None,
    },
    "great_circle_bending": lambda: {"projection": "robin", "region": CAP, "tolerance": 0.1, "seed": 0},
    "hessian": lambda: {"projection": "robin", "lon": 10, "lat": 50},
    "indices": lambda: {"projection": "robin", "region": CAP, "names": "airy", "tolerance": 1e-3},
    "info": lambda: {"projection": "robin", "region": CAP, "tolerance": 1e-3},
    "interpolant": lambda: {"projection": "robin", "region": CAP},
    "jacobian": lambda: {"projection": "robin", "lon": 10, "lat": 50},
    "jacobian_grid": lambda: {"projection": "robin", "lon": [10, 11], "lat": [50, 51]},
    "ldp": lambda: {
        "region": "box:8,48,8.2,48.2",
        "heights": None,
        "height": 500,
        "families": ["tmerc"],
        "criterion": "share",
        "target_ppm": 20.0,
        "round_k": 1e-6,
        "round_axis": 0.1,
        "geodetic": "EPSG:4326",
        "against": (),
        "name": None,
    },
    "local_corrections": lambda: {"projection": "robin", "lon": 10, "lat": 50, "radius_km": 100},
    "modes": lambda: {"A": np.eye(2)[None], "weights": None, "T": np.eye(2)},
    "mdt": lambda: {"A": np.eye(2)[None], "weights": None, "method": "auto"},
    "mean_map": lambda: {
        "projections": ["robin"],
        "weights": None,
        "region": CAP,
        "degree": 1,
        "datum": None,
        "name": None,
    },
    "mean_plane_map": lambda: {
        "x": [0.0, 1.0, 0.0],
        "y": [0.0, 0.0, 1.0],
        "jacobians": np.tile(np.eye(2), (2, 3, 1, 1)),
        "weights": None,
        "area": None,
        "degree": 1,
    },
    "mean_rotation": lambda: {"A": np.eye(2)[None], "weights": None, "T": None, "method": "chordal"},
    "old_map": lambda: {
        "points": old_map().points,
        "model": "affine",
        "smoothing": None,
        "outliers": "drop",
        "dots_per_inch": None,
    },
    "optimize": lambda: {
        "family": "eqc",
        "region": CAP,
        "free": None,
        "criterion": "airy_kavrayskiy",
        "ellipsoid": None,
        "round_to": None,
        "against": (),
    },
    "principal_scales": lambda: {"J": np.eye(2)},
    "profile": lambda: {
        "projection": "robin",
        "line": [(10, 50), (11, 51)],
        "measures": (),
        "spacing_km": None,
        "height": None,
    },
    "read_control_points": lambda: {"path": "nowhere.csv", "crs": None},
    "read_heights": lambda: {"path": "nowhere.csv"},
    "recommend": lambda: {
        "region": "nowhere",
        "purpose": "any",
        "criterion": "airy_kavrayskiy",
        "authorities": ("EPSG",),
        "datum": None,
        "area": "preferred",
        "limit": 1,
    },
    "sample": lambda: {
        "projection": "robin",
        "region": CAP,
        "measures": (),
        "tolerance": 1e-3,
    },
    "summarize": lambda: {
        "projection": "robin",
        "region": CAP,
        "measures": (),
        "indices": (),
        "modes": False,
        "tolerance": 1e-3,
    },
    "tables": lambda: {"name": "nothing"},
    "world_map": lambda: {
        "region": None,
        "cut": 180.0,
        "elsewhere": 0.02,
        "until": 90.0,
        "symmetric": "auto",
        "exponent": 0.125,
        "cells": 8,
        "against": (),
    },
    "estimate_crs": lambda: {"frame": None, "purpose": "any"},
    "plots.add_heatmap": lambda: {
        "ax": geoaxes(),
        "measure": "omega",
        "region": CAP,
        "levels": None,
        "cmap": None,
        "limits": None,
    },
    "plots.add_tissot": lambda: {"ax": geoaxes(), "region": CAP, "step": None, "radius": None},
    "plots.distribution_figure": lambda: {
        "projections": ["robin"],
        "kind": "histogram",
        "measure": "fisher",
        "region": CAP,
        "size": (4, 4),
        "dpi": 50,
        "titles": None,
    },
    "plots.heatmap": lambda: {
        "ax": axes(),
        "projection": "robin",
        "measure": "fisher",
        "region": CAP,
        "step": None,
        "levels": None,
        "cmap": None,
        "limits": None,
        "title": None,
        "airy_kavrayskiy": None,
    },
    "plots.figure": lambda: {"projections": ["robin"], "kind": "tissot", "region": CAP},
    "plots.heatmap_figure": lambda: {
        "projections": ["robin"],
        "measure": "fisher",
        "against": None,
        "region": CAP,
        "step": None,
        "levels": None,
        "cmap": None,
        "limits": None,
        "size": (2, 2),
        "dpi": 50,
        "titles": None,
        "airy_kavrayskiy": None,
        "look": None,
    },
    "plots.ldp_figure": lambda: {"found": low_distortion(), "size": (2, 2), "dpi": 50, "title": None},
    "plots.ground_map": lambda: {"ax": axes(), "found": low_distortion(), "title": None},
    "plots.local_figure": lambda: {
        "projection": "robin",
        "radius_km": 100,
        "region": CAP,
        "step": None,
        "size": (2, 2),
        "dpi": 50,
        "title": None,
        "look": None,
    },
    "plots.local_field": lambda: {
        "ax": axes(),
        "projection": "robin",
        "radius_km": 100,
        "region": CAP,
        "step": None,
        "title": None,
    },
    "plots.modes_figure": lambda: {
        "projections": ["robin"],
        "region": CAP,
        "size": (4, 4),
        "dpi": 50,
        "titles": None,
    },
    "plots.space_figure": lambda: {
        "projections": ["robin"],
        "region": CAP,
        "size": (4, 4),
        "dpi": 50,
        "titles": None,
    },
    "plots.morph": lambda: {
        "first": "robin",
        "second": "moll",
        "path": "nowhere/x.gif",
        "measure": "fisher",
        "region": CAP,
        "frames": 2,
        "seconds": 1.0,
        "size": (2, 2),
        "dpi": 50,
        "progress": None,
    },
    "plots.mosaic_figure": lambda: {"found": None},
    "plots.old_map_figure": lambda: {
        "found": old_map(),
        "draw": ["scale"],
        "measure": "fisher",
        "image": None,
        "size": (2, 2),
        "dpi": 50,
    },
    "plots.profile_figure": lambda: {"found": short_profile(), "size": (4, 4), "dpi": 50, "title": None},
    "plots.encoded": lambda: {"figure": Figure(), "suffix": ".png", "dpi": 50.0},
    "plots.save": lambda: {"figure": Figure(), "path": "nowhere/x.png", "dpi": None},
    "plots.tissot": lambda: {
        "ax": axes(),
        "projection": "robin",
        "region": CAP,
        "step": None,
        "radius": None,
        "title": None,
        "airy_kavrayskiy": None,
    },
    "plots.tissot_figure": lambda: {
        "projections": ["robin"],
        "region": CAP,
        "step": None,
        "size": (2, 2),
        "dpi": 50,
        "titles": None,
        "airy_kavrayskiy": None,
        "look": None,
    },
    "plots.to_cartopy": lambda: {"projection": "robin", "region": CAP},
}

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
    for parameter in CALLS[name]():
        for kind in FEW if name.startswith("plots.") else STRANGE:
            value = STRANGE[kind]
            if callable(value) and parameter in TAKES_FUNCTIONS:
                continue  # what a function of the user's raises goes through
            text = complaint(function, CALLS[name]() | {parameter: value})
            if text:
                wrong.append(f"{parameter} = {kind}: {text}")
    assert not wrong, "\n".join(wrong)


# ---- the right answers ----------------------------------------------------------------------

BOUNDS = (-10, 35, 30, 70)


@pytest.mark.parametrize("bounds", [BOUNDS, list(BOUNDS), np.array(BOUNDS)], ids=["tuple", "list", "array"])
def test_bounds_are_a_box(bounds: object) -> None:
    """West, south, east, north, as other programs give them."""
    assert projdist.get_region(bounds) == projdist.Box(-10.0, 35.0, 30.0, 70.0)


def test_a_geometry_is_a_region() -> None:
    """Of shapely, by what it says of itself: a square has the area of its box."""
    area = projdist.get_region(SQUARE).area_km2
    assert area == pytest.approx(projdist.Box(8, 48, 12, 52).area_km2, rel=1e-8)  # as areas of polygons are


@pytest.mark.parametrize(
    "one",
    [
        "robin",
        pyproj.CRS("EPSG:3857"),
        3857,
        ("EPSG", 3857),
        {"proj": "moll"},
        projdist.Projection.from_user_input("moll"),
    ],
    ids=["name", "CRS", "code", "pair", "dictionary", "function"],
)
def test_a_single_projection_is_one(one: object) -> None:
    """And not its letters: the result is that of a list with it alone."""
    results, listed = (projdist.compare(value, CAP, tolerance=1e-3).results for value in (one, [one]))
    assert [result.airy_kavrayskiy for result in results] == [result.airy_kavrayskiy for result in listed]
    assert len(results) == 1


def test_a_single_measure_is_one() -> None:
    """By its name, as a Measure and as a function."""
    for measure in ("omega", projdist.get_measure("omega"), projdist.MEASURES["angular_distortion"].function):
        found = projdist.summarize("merc", CAP, measures=measure, tolerance=1e-3).measures
        assert [value.max < 1e-6 for value in found.values()] == [True]  # conformal
    assert list(projdist.factors("robin", 10, 50, measures="airy").extra) == ["airy"]
    assert not projdist.factors("robin", 10, 50, measures=None).extra


def test_fields_take_names_and_text() -> None:
    """The areal scale of the plate carree is 1 / cos(lat), whose mean over the globe is pi / 2."""
    found = projdist.sample("plate-carree", "globe", measures="s")
    for measure in ("s", projdist.get_measure("s"), projdist.MEASURES["areal_scale"].function):
        assert found.mean(measure).value == pytest.approx(np.pi / 2, rel=1e-6)


@pytest.mark.slow
def test_a_colour_map_of_matplotlib_goes_wherever_a_name_does() -> None:
    """The same colours as by its name."""
    by_name, by_map = (
        plots.heatmap(axes(), "robin", region=CAP, cmap=given).colours
        for given in ("magma", matplotlib.colormaps["magma"])
    )
    np.testing.assert_array_equal(by_name(np.linspace(0, 1, 9)), by_map(np.linspace(0, 1, 9)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: projdist.summarize("robin", True), r"^Invalid region 'True'\. It must be globe, "),
        (lambda: projdist.summarize("robin", [1, 2, 3]), r"^Invalid region '\[1, 2, 3\]'\. It must be globe, "),
        (
            lambda: projdist.summarize("robin", CAP, tolerance="small"),
            r"^Invalid tolerance 'small'\. It must be a number",
        ),
        (lambda: projdist.summarize("robin", CAP, measures=5), r"^Invalid measure '5'\. It must be one of fisher, "),
        (lambda: projdist.factors("robin", "here", 50), r"^Invalid longitudes 'here'\. They must be numbers\.$"),
        (lambda: projdist.factors("robin", [1, 2], [1, 2, 3]), r"^Invalid points\. .* shapes \(2,\) and \(3,\)"),
        (lambda: projdist.correct("robin", CAP, constraint=["affine"]), r"^Invalid constraint \"?'\['affine'\]'"),
        (lambda: plots.tissot(5, "robin"), r"^Invalid axes '5'\. It must be Axes of matplotlib\.$"),
        (lambda: plots.heatmap(axes(), "robin", region=CAP, cmap=5), r"^Invalid colour map '5'\. It must be a name "),
        (
            lambda: plots.tissot_figure("robin", region=CAP, size="big"),
            r"^Invalid size 'big'\. They must be numbers\.$",
        ),
    ],
)
def test_wrong_kinds_are_refused_in_one_line(call: object, message: str) -> None:
    """What no function takes is said with its value."""
    with pytest.raises(ValueError, match=message):
        call()
