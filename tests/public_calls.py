"""A call of every public function that takes a moment; for the tests of their input."""

import functools
import inspect
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from batch_functions import name_of
from matplotlib.figure import Figure

import projdist
from projdist.answers import Profile
from projdist.applications.oldmaps import ControlPoints, OldMap
from projdist.decisions import LDP

CAP = projdist.Cap(10, 50, 200)
SQUARE = shapely.box(8, 48, 12, 52)


@functools.cache
def low_distortion() -> LDP:
    """A low-distortion projection of a small box, for the pictures of one."""
    return projdist.ldp("box:8,48,8.2,48.2", height=500, families=["tmerc"])


@functools.cache
def old_map() -> OldMap:
    """An old map of six points that is a plate carrée."""
    new = np.array([[8.0, 48.0], [9.0, 48.0], [9.0, 49.0], [8.0, 49.0], [8.5, 48.2], [8.2, 48.7]])
    return projdist.old_map(ControlPoints(new * 100.0, new))


@functools.cache
def short_profile() -> Profile:
    return projdist.profile("robin", [(10, 50), (11, 51)])


def axes() -> object:
    return Figure().add_subplot()


def geoaxes() -> object:
    crs = pytest.importorskip("cartopy.crs")
    return Figure().add_subplot(projection=crs.PlateCarree())


ROBINSON = {"projection": "robin", "region": CAP}
HERE = {"projection": "robin", "lon": 10, "lat": 50}
QUICK = {**ROBINSON, "tolerance": 1e-3}
SMALL = {"size": (2, 2), "dpi": 50}
PICTURES = {"projections": ["robin"], "region": CAP, "size": (4, 4), "dpi": 50}

# Arguments with which a call takes a moment, but for defaults; each parameter is then given everything else in turn.
CALLS = {
    **dict.fromkeys(("correct", "info", "sample", "summarize"), lambda: QUICK),
    **dict.fromkeys(("derivatives", "factors", "hessian", "jacobian"), lambda: HERE),
    **dict.fromkeys(("distance_distortion", "great_circle_bending"), lambda: {**ROBINSON, "tolerance": 0.1}),
    "plots.to_cartopy": lambda: ROBINSON,
    **dict.fromkeys(("mdt", "mean_rotation"), lambda: {"A": np.eye(2)[None]}),
    **dict.fromkeys(("read_control_points", "read_heights"), lambda: {"path": "nowhere.csv"}),
    "atlas": lambda: {"place": "NZ"},
    "axes_shift": lambda: {"points": np.eye(3)},
    "batch": lambda: {"function": name_of, "regions": "box:0,0,1,1", "options": None, "executor": None},
    "check": lambda: {"data": SQUARE, "crs": "EPSG:3857"},
    "compare": lambda: {"projections": ["robin"], "region": CAP, "tolerance": 1e-3},
    "design": lambda: {"region": CAP, "degree": 2, "base": "EPSG:3035", "background": 0.0, "against": ()},
    "distortion_ppm": lambda: {**HERE, "height": 100},
    "elevation_factor": lambda: {"lat": 50, "height": 100, "ellipsoid": projdist.WGS84},
    "estimate_crs": lambda: {"frame": None},
    "field_of": lambda: {
        **{"jacobian": [np.eye(2)], "weight": [1.0], "lon": [10.0], "lat": [50.0]},
        "hessian": np.zeros((1, 2, 2, 2)),
    },
    "find_crs": lambda: {"text": "utm 33", "authorities": ("EPSG",), "limit": 1},
    "get_criterion": lambda: {"criterion": "mean"},
    "get_figure": lambda: {"figure": "airy"},
    "get_measure": lambda: {"measure": "omega"},
    "get_region": lambda: {"region": "globe"},
    "goldberg_gott_score": lambda: dict.fromkeys(("values", "normalisers"), dict.fromkeys("IAFSDB", 1.0)),
    "indices": lambda: {**QUICK, "names": "airy"},
    "ldp": lambda: {"region": "box:8,48,8.2,48.2", "height": 500, "families": ["tmerc"], "round_axis": 0.1},
    "local_corrections": lambda: {**HERE, "radius_km": 100},
    "mean_map": lambda: {"projections": ["robin"], "region": CAP, "degree": 1},
    "mean_plane_map": lambda: {
        **{"x": [0.0, 1.0, 0.0], "y": [0.0, 0.0, 1.0], "jacobians": np.tile(np.eye(2), (2, 3, 1, 1))},
        "degree": 1,
    },
    "modes": lambda: {"A": np.eye(2)[None], "T": np.eye(2)},
    "old_map": lambda: {"points": old_map().points, "model": "affine"},
    "optimize": lambda: {"family": "eqc", "region": CAP, "ellipsoid": None},
    "principal_scales": lambda: {"J": np.eye(2)},
    "profile": lambda: {"projection": "robin", "line": [(10, 50), (11, 51)], "measures": ()},
    "recommend": lambda: {"region": "nowhere", "authorities": ("EPSG",), "limit": 1},
    "tables": lambda: {"name": "nothing"},
    "world_map": lambda: {"cells": 8, "against": ()},
    **dict.fromkeys([f"plots.{kind}_figure" for kind in ("distribution", "modes", "space")], lambda: PICTURES),
    **dict.fromkeys(("plots.heatmap_figure", "plots.tissot_figure"), lambda: PICTURES | SMALL),
    **dict.fromkeys(("plots.heatmap", "plots.tissot"), lambda: {"ax": axes(), "projections": "robin"}),
    "plots.add_heatmap": lambda: {"ax": geoaxes(), "measure": "omega", "region": CAP},
    "plots.add_tissot": lambda: {"ax": geoaxes(), "region": CAP},
    "plots.figure": lambda: {"projections": ["robin"], "kind": "tissot", "region": CAP},
    "plots.ldp_figure": lambda: {"found": low_distortion(), **SMALL},
    "plots.ground_map": lambda: {"ax": axes(), "found": low_distortion()},
    "plots.local_figure": lambda: {**ROBINSON, "radius_km": 100, **SMALL},
    "plots.local_field": lambda: {"ax": axes(), **ROBINSON, "radius_km": 100},
    "plots.morph": lambda: {
        **{"first": "robin", "second": "moll", "path": "nowhere/x.gif", "region": CAP},
        **{"frames": 2, "seconds": 1.0, "progress": None, **SMALL},
    },
    "plots.mosaic_figure": lambda: {"found": None},
    "plots.old_map_figure": lambda: {"found": old_map(), "draw": ["scale"], **SMALL},
    "plots.profile_figure": lambda: {"found": short_profile(), "size": (4, 4), "dpi": 50},
    "plots.encoded": lambda: {"figure": Figure(), "suffix": ".png", "dpi": 50.0},
    "plots.save": lambda: {"figure": Figure(), "path": "nowhere/x.png"},
}
# Parameters that are tried only where a call above has them: functions, what fails later, and switches.
UNTRIED = {
    *("progress", "options", "partial", "executor", "pictures", "sort", "ellipsoid"),
    *("deprecated", "colourbar", "context", "overwrite", "exaggeration", "axes", "grid"),
}


def parameters_of(name: str, function: Callable[..., object]) -> list[str]:
    """The parameters of a public function that are given everything."""
    given = CALLS[name]()
    return [*dict.fromkeys([*given, *(one for one in inspect.signature(function).parameters if one not in UNTRIED)])]
