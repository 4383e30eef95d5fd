"""A call of every public function that takes a moment; for the tests of their input."""

import functools

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
