"""projdist against pyproj, in one process, as Markdown tables: `python benchmarks/run.py [table ...]`."""

import math
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np
from pyproj import Proj

from projdist.answers.points_and_lines import factors
from projdist.answers.summaries import summarize
from projdist.field import jacobian
from projdist.matrices.measures import principal_scales
from projdist.projections import Projection
from projdist.projections.operations import Pipeline
from projdist.regions import get_region

R = 6371008.7714
RUNS = 5
WINKEL = 50.4597762521898  # pyproj loses PROJ's default for +proj=wintri

# Raw Airy-Kavrayskiy errors over the globe by quadrature of closed forms (tests/field/closed_errors.py). None:
# Robinson's table has no closed form, so that projdist at 1e-10 stands in for both sides.
TRUTHS = {
    "merc": 0.7371453308191,
    "eqc": 0.5212404621422,
    "moll": 0.5454592115798,
    "sinu": 0.6668815294428,
    "hammer": 0.5820412168474,
    "aitoff": 0.5244866924923,
    "wintri": 0.3859311391408,
    "natearth": 0.4103361730378,
    "robin": None,
    "eck4": 0.5070191212210,
}


def alternating(*functions: Callable[[], object], runs: int = RUNS) -> list[float]:
    """Median seconds of processor time of each function, run in turn."""
    for function in functions:
        function()  # caches and lazy imports
    times: list[list[float]] = [[] for _ in functions]
    for _ in range(runs):
        for function, seconds in zip(functions, times, strict=True):
            start = time.process_time()
            function()
            seconds.append(time.process_time() - start)
    return [statistics.median(seconds) for seconds in times]


def table(title: str, *columns: str) -> None:
    print(f"\n### {title}\n\n| {' | '.join(columns)} |\n|{' --- |' * len(columns)}")


def row(*cells: object) -> None:
    print(f"| {' | '.join(str(cell) for cell in cells)} |", flush=True)


def definition(name: str) -> str:
    return f"+proj={name} +R={R}" + (f" +lat_1={WINKEL}" if name == "wintri" else "")


# ---- (a) the globe --------------------------------------------------------------------------


def grid_error(projection: Proj) -> float:
    """The usual way: factors at the centres of quarter-degree cells, weighted by cos(latitude)."""
    lon, lat = np.meshgrid(np.arange(-179.875, 180, 0.25), np.arange(-89.875, 90, 0.25))
    found = projection.get_factors(lon, lat, errcheck=False)
    square = np.log(found.tissot_semimajor) ** 2 + np.log(found.tissot_semiminor) ** 2
    weight = np.cos(np.radians(lat))
    defined = np.isfinite(square)
    return math.sqrt(np.sum(weight[defined] * square[defined]) / np.sum(weight[defined]))


def globe() -> None:
    table(
        "Airy-Kavrayskiy error of the globe",
        *(
            "map",
            "summarize(tolerance=1e-7) ms",
            "its error",
            "its estimate",
            "grid ms",
            "grid's error",
            "ratio of times",
        ),
    )
    for name, known in TRUTHS.items():
        text, proj = definition(name), Proj(definition(name))
        truth = known or summarize(text, tolerance=1e-10).airy_kavrayskiy
        found, usual = summarize(text, tolerance=1e-7), grid_error(proj)
        ours, theirs = alternating(lambda t=text: summarize(t, tolerance=1e-7), lambda p=proj: grid_error(p))
        row(
            name,
            f"{1e3 * ours:.1f}",
            f"{abs(found.airy_kavrayskiy - truth):.1e}",
            f"{found.error_estimate:.1e}",
            f"{1e3 * theirs:.0f}",
            f"{abs(usual - truth):.1e}",
            f"{theirs / ours:.0f}",
        )


# ---- (b) scattered points -------------------------------------------------------------------


def sheared(shear: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """a and b of an equal-area map of shear t: a - b = |t| and a b = 1."""
    a = 0.5 * (np.abs(shear) + np.hypot(2.0, shear))
    return a, 1.0 / a


def mollweide_scales(lam: np.ndarray, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of x = 2 sqrt(2) / pi lam cos(theta), y = sqrt(2) sin(theta), 2 theta + sin(2 theta) = pi sin(phi)."""
    theta = phi.copy()
    for _ in range(60):
        theta -= (2 * theta + np.sin(2 * theta) - np.pi * np.sin(phi)) / (4 * np.cos(theta) ** 2)
    k = 2 * math.sqrt(2) / np.pi * np.cos(theta) / np.cos(phi)
    # Equal-area, with the shear that of dx/dphi = -2 sqrt(2) / pi lam sin(theta) dtheta/dphi.
    shear = lam * np.sin(theta) * np.cos(phi) / (math.sqrt(2) * np.cos(theta) ** 2)
    both, gap = np.hypot(k + 1 / k, shear), np.hypot(k - 1 / k, shear)
    return 0.5 * (both + gap), 2 / (both + gap)


# a and b from the longitude and the latitude in radians.
SCALES: dict[str, Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]] = {
    "merc": lambda lam, phi: (1 / np.cos(phi), 1 / np.cos(phi)),
    "eqc": lambda lam, phi: (1 / np.cos(phi), np.ones_like(phi)),
    "cea": lambda lam, phi: (1 / np.cos(phi), np.cos(phi)),
    "sinu": lambda lam, phi: sheared(lam * np.sin(phi)),
    "laea": lambda lam, phi: (
        np.sqrt(2 / (1 + np.cos(phi) * np.cos(lam))),
        np.sqrt((1 + np.cos(phi) * np.cos(lam)) / 2),
    ),
    "stere": lambda lam, phi: (2 / (1 + np.cos(phi) * np.cos(lam)), 2 / (1 + np.cos(phi) * np.cos(lam))),
}


def points() -> None:
    n = 200_000
    rng = np.random.default_rng(1)
    lon, lat = rng.uniform(-179, 179, n), np.degrees(np.arcsin(rng.uniform(-1, 1, n) * math.sin(math.radians(89))))
    table(
        f"Factors at {n:,} scattered points below 89 degrees",
        *("map", "factors ms", "largest relative error of a, b", "get_factors ms", "its largest", "ratio of times"),
    )
    # Of Robinson's table and Winkel Tripel there is no closed form here.
    for name in (*SCALES, "moll", "robin", "wintri"):
        projection, proj = Projection.from_user_input(definition(name)), Proj(definition(name))
        found, usual = factors(projection, lon, lat), proj.get_factors(lon, lat, errcheck=False)
        ours, theirs = alternating(
            lambda p=projection: factors(p, lon, lat), lambda p=proj: p.get_factors(lon, lat, errcheck=False)
        )
        scales = SCALES.get(name, mollweide_scales if name == "moll" else None)
        truth = scales(np.radians(lon), np.radians(lat)) if scales else None
        row(
            name,
            f"{1e3 * ours:.0f}",
            worst((found.a, found.b), truth),
            f"{1e3 * theirs:.0f}",
            worst((usual.tissot_semimajor, usual.tissot_semiminor), truth),
            f"{ours / theirs:.2f}",
        )


def worst(found: tuple[np.ndarray, np.ndarray], truth: tuple[np.ndarray, np.ndarray] | None) -> str:
    """The largest relative error, if the truth is known."""
    return "" if truth is None else f"{np.nanmax(np.abs(np.stack(found) / np.stack(truth) - 1)):.0e}"


# ---- factors of CRSs --------------------------------------------------------------------------

CRSS = "EPSG:25832 EPSG:2154 EPSG:2056 EPSG:28992 EPSG:3375 EPSG:3035 EPSG:5070 EPSG:3413 EPSG:3857 EPSG:6933".split()


def crss() -> None:
    n, rng = 200_000, np.random.default_rng(1)
    titles = (
        "CRS",
        "factors ms",
        "PROJ's transform ms",
        "get_factors ms",
        "ratio to transform",
        "ratio to get_factors",
    )
    table(f"Factors at {n:,} points of areas of use, of methods that have closed forms", *titles)
    for code in CRSS:
        projection, proj = Projection.from_user_input(code), Proj(code)
        west, south, east, north = projection.area_of_use
        lon, lat = rng.uniform(west, east, n), rng.uniform(south, north, n)
        ours, plain = alternating(partial(factors, projection, lon, lat), partial(projection, lon, lat))
        _, theirs = alternating(partial(projection, lon, lat), partial(proj.get_factors, lon, lat, errcheck=False))
        times = [f"{1e3 * each:.0f}" for each in (ours, plain, theirs)]
        row(code, *times, f"{ours / plain:.2f}", f"{ours / theirs:.2f}")


# ---- (c) rasters ----------------------------------------------------------------------------


def rasters() -> None:
    lon, lat = np.linspace(-175, 175, 1414), np.linspace(-85, 85, 708)
    table(
        f"A raster of {lon.size} x {lat.size} points",
        *(
            "map",
            "jacobian ms",
            "largest relative error of a, b",
            "get_factors ms",
            "its largest",
            "ratio of times",
        ),
    )
    lons, lats = np.meshgrid(lon, lat)
    for name, scales in SCALES.items():
        projection, proj = Projection.from_user_input(definition(name)), Proj(definition(name))
        truth = np.stack(scales(np.radians(lons), np.radians(lats)), axis=-1)
        found = principal_scales(jacobian(projection, lons, lats))
        theirs_found = proj.get_factors(lons, lats, errcheck=False)
        usual = np.stack([theirs_found.tissot_semimajor, theirs_found.tissot_semiminor], axis=-1)
        ours, theirs = alternating(
            lambda p=projection: jacobian(p, lons, lats),
            lambda p=proj: p.get_factors(lons, lats, errcheck=False),
            runs=3,
        )
        row(
            name,
            f"{1e3 * ours:.0f}",
            f"{np.nanmax(np.abs(found / truth - 1)):.0e}",
            f"{1e3 * theirs:.0f}",
            f"{np.nanmax(np.abs(usual / truth - 1)):.0e}",
            f"{ours / theirs:.2f}",
        )


# ---- (d) the cost of the evaluations themselves ---------------------------------------------


class Timed(Pipeline):
    """PROJ's operation, whose own processor time is added up."""

    seconds: ClassVar[list[float]] = []

    def __call__(self, lon: np.ndarray, lat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the operation gives."""
        start = time.process_time()
        found = super().__call__(lon, lat)
        self.seconds.append(time.process_time() - start)
        return found


CASES = [
    *((f"+proj={name}", "globe") for name in ("moll", "robin", "kav7", "hammer", "merc", "eqearth", "wintri", "igh")),
    *((f"+proj={name}", "globe") for name in ("laea", "laea +lat_0=45 +lon_0=13", "ortho +lat_0=30", "tmerc")),
    *((f"+proj={name}", region) for region in ("country:CA", "continent:Africa", "land") for name in ("robin", "moll")),
]


def units() -> None:
    table(
        "Second map on: processor time of summarize(tolerance=1e-7), in units of its evaluations' own",
        *("map", "region", "evaluations", "calls", "own ms", "all ms", "ratio", "estimate"),
    )
    for text, name in CASES:
        region, projection = get_region(name), Projection.from_user_input(f"{text} +R={R}")
        timed = replace(projection, function=Timed(projection.function.definition, projection.function.to_metre))
        found = summarize(timed, region, tolerance=1e-7)
        own, whole = [], []
        for _ in range(4 * RUNS + 1):
            Timed.seconds.clear()
            summarize(timed, region, tolerance=1e-7)
            own.append(sum(Timed.seconds))
            start = time.process_time()
            summarize(projection, region, tolerance=1e-7)
            whole.append(time.process_time() - start)
        unit, total = 1e3 * statistics.median(own), 1e3 * statistics.median(whole)
        row(
            text[6:],
            name,
            found.evaluations,
            len(Timed.seconds),
            f"{unit:.2f}",
            f"{total:.2f}",
            f"{total / unit:.1f}",
            f"{found.error_estimate:.0e} {found.limit}",
        )


TABLES = {"globe": globe, "points": points, "crss": crss, "rasters": rasters, "units": units}

if __name__ == "__main__":
    for chosen in sys.argv[1:] or TABLES:
        TABLES[chosen]()
