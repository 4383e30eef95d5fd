"""The plan of the house: which room may import which, where each library lives, and what an import must not load."""

import ast
import functools
import graphlib
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from syntax import statements_of
from tables import each

import projdist

PACKAGE = Path(projdist.__file__).parent

# The table of docs/how_it_works.md. Each room imports another only through that room's face, its `__init__`.
WAIST = {"support", "numerics", "matrices", "earth", "projections", "regions"}
BELOW_PLOTS = {*WAIST, "field", "answers", "decisions", "designs", "applications", "surfaces"}
MAY_IMPORT = {
    "support": set(),
    "earth": set(),
    "numerics": {"support"},
    "matrices": {"support", "numerics"},
    "projections": {"support", "earth"},
    "regions": {"support", "numerics", "earth", "projections"},
    "field": WAIST,
    "answers": {*WAIST, "field"},
    "decisions": {*WAIST, "field", "answers"},
    "designs": {*WAIST, "field", "answers", "decisions"},
    "applications": {"support", "numerics", "matrices", "projections"},
    "surfaces": {"numerics", "matrices", "earth", "projections", "regions", "field", "support"},
    "plots": BELOW_PLOTS,
    "gis": BELOW_PLOTS,
    "web": {*BELOW_PLOTS, "plots", "gis"},
    "cli": {*BELOW_PLOTS, "plots", "gis", "web"},
}
# Packages for users to import from, besides the rooms.
FACES = {*MAY_IMPORT, "applications.mosaics", "applications.oldmaps", "applications.pointclouds"}
FOR_ALL = {"_typing"}
NEEDS_VERSION = {"cli.app", "cli.report", "answers.batches"}

HOMES = {
    "pyproj": {"projections"},
    "pandas": {"support.answers", "gis"},
    **{library: {"gis"} for library in ("geopandas", "pyogrio", "xarray", "pyarrow")},
    "rasterio": {"gis", "decisions.ground"},
    "distributed": {"support.executors"},
    "scipy": {
        *("numerics.minima", "matrices.measures", "regions.combinations"),
        *("applications.oldmaps.field", "applications.oldmaps.rectifying"),
        *("applications.pointclouds.correspondences", "applications.pointclouds.affine"),
        *("applications.mosaics.homographies", "applications.mosaics.correspondences"),
        *("surfaces.tissot_ellipses", "plots.images", "plots.map_drawing", "designs.newton", "designs.spline_sheets"),
    },
    "shapely": {
        *("earth.natural_earth", "regions", "decisions.data_edges", "designs.base_maps"),
        *("designs.conformal_bounds", "designs.fits"),
        *("surfaces.surface", "surfaces.domain", "surfaces.land", "surfaces.regional", "surfaces.tissot_ellipses"),
        *("plots.basemap", "plots.geoaxes", "plots.morphs"),
        *("gis.layers", "gis.reading", "gis.conversion", "web.frames", "web.live"),
    },
    "matplotlib": {"plots"},
    "cartopy": {"plots.geoaxes"},
    "PIL": {
        *("applications.oldmaps.rectifying", "applications.mosaics.images", "applications.mosaics.rendering"),
        *("plots.morphs", "web.live.widget"),
    },
    "cv2": {"applications.mosaics.images"},
    **{library: {"cli"} for library in ("typer", "rich")},
    **{library: {"web.live.server"} for library in ("starlette", "uvicorn", "websockets")},
    **{library: {"web.live.widget"} for library in ("anywidget", "traitlets")},
}

# What the package may import besides its homes' own: anything else is a new dependency.
EVERYWHERE = {"numpy", "lazy_loader", "projdist", *sys.stdlib_module_names}


def module_name(path: Path) -> str:
    """`plots.style` of projdist/plots/style.py, `plots` of its __init__.py."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}
INSIDE = [name for name in MODULES if name not in ("__init__", "__main__", *FOR_ALL)]


@functools.cache
def imports(name: str) -> set[str]:
    """Dotted names of all that a module imports, wherever in it; of our own the modules only."""
    found: set[str] = set()
    for node in statements_of(MODULES[name]):
        names = [alias.name for alias in getattr(node, "names", ())]
        if isinstance(node, ast.Import):
            found.update(names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name} has a relative import"
            found.update(_imported(name, node.module, names))
    return found


def _imported(importer: str, module: str, names: list[str]) -> set[str]:
    """What `from module import names` imports: another room's face where it is one, else modules."""
    place = module.removeprefix("projdist.")
    if place in FACES and room(place) != room(importer):
        return {module}
    modules = {f"{module}.{name}" for name in names if f"{place}.{name}".removeprefix("projdist.") in MODULES}
    return modules | ({module} if len(modules) < len(names) else set())


def own_imports(name: str) -> set[str]:
    """Names of the package's own modules that a module imports."""
    ours = {text for text in imports(name) if room(text) == "projdist"}
    return {text.removeprefix("projdist.") if text != "projdist" else "__init__" for text in ours}


def room(name: str) -> str:
    return name.split(".")[0]


def at_home(name: str, home: str) -> bool:
    return name == home or name.startswith(f"{home}.")


def loaded_by(*codes: str) -> list[set[str]]:
    """Top-level names in sys.modules after each of some pieces of code, run one after the other by one interpreter."""
    script = "import sys\n" + "".join(f"{code}\nprint(*sys.modules)\n" for code in codes)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return [set(map(room, line.split())) for line in done.stdout.splitlines()]


def is_allowed(name: str, other: str) -> bool:
    """Whether a module may import another: of another room only if the table allows it, and only through its face."""
    if other == "__init__":
        return name in NEEDS_VERSION
    return room(other) == room(name) or (other in FACES and room(other) in MAY_IMPORT[room(name)])


def test_rooms_import_as_the_plan_says() -> None:
    """Every module is in a room, and every room of the plan is built."""
    assert {room(name) for name in INSIDE} == set(MAY_IMPORT)
    pairs = [(name, other) for name in INSIDE for other in own_imports(name) - FOR_ALL]
    assert [pair for pair in pairs if not is_allowed(*pair)] == []


def test_rooms_above_take_figures_of_fields() -> None:
    """How a field is sampled and searched is the affair of its room: this is all that others may take of it."""
    known = (
        "DEFAULT_TOLERANCE FIGURES AnyFigure Links Map Field Figure field_of field_resolving get_figure named_measures "
    )
    known += "sample AiryKavrayskiy Extreme GeometricMedian Spread Derivatives Quality derivatives hessian "
    known += "jacobian Nodes cut_length drawn evaluate find_tears is_interrupted measure_at "
    known += "nodes_at nodes_of check_declared_property"
    assert set(importlib.import_module("projdist.field").__all__) == set(known.split())


def test_no_cycles() -> None:
    """The plan has no arrow upward: rooms can be put in an order, and so can the modules within rooms."""
    graph = {name: {other for other in own_imports(name) if room(other) == room(name)} - {name} for name in INSIDE}
    for plan in (MAY_IMPORT, graph):
        assert set(graphlib.TopologicalSorter(plan).static_order()) >= set(plan)


@each("face", ["", *sorted(name for name in MODULES if MODULES[name].name == "__init__.py")[1:]])
def test_no_module_bears_the_name_of_an_exported_function(face: str) -> None:
    """`import projdist.recommend` would give the function where the module was meant."""
    package = importlib.import_module(f"projdist.{face}".rstrip("."))
    modules = {name.removeprefix(f"{face}.") for name in MODULES if face == "" or name.startswith(f"{face}.")}
    exported = [name for name in getattr(package, "__all__", []) if inspect.isroutine(getattr(package, name))]
    assert modules & set(exported) == set()


def test_a_library_has_one_home() -> None:
    """A module imports numpy, the standard library, ours, and what is at home in it; and homes are lived in."""
    used = {name: set(map(room, imports(name))) - EVERYWHERE for name in MODULES}
    assert set().union(*used.values()) - set(HOMES) == set()
    for library, homes in HOMES.items():
        users = {name for name in MODULES if library in used[name]}
        assert {name for name in users if not any(at_home(name, home) for home in homes)} == set(), library
        assert {home for home in homes if not any(at_home(name, home) for name in users)} == set(), library


COMMAND_LINE = """
import contextlib, io
import projdist.cli

def run(*words):
    sys.argv = ["projdist", *words]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        projdist.cli.main()
    assert out.getvalue()
"""


def test_import_and_help_load_nothing_slow() -> None:
    """`import projdist` is quick: it loads what is asked for when it is asked for; help and lists answer at once."""
    short, long = "run('--version')\nrun('--help')", "run('heatmap', '--help')\nrun('list', 'measures')"
    imported, by_typer, listed, helped = loaded_by("import projdist", "import typer", COMMAND_LINE + short, long)
    slow = {"pyproj", "matplotlib", "scipy", "shapely", "typer", "rich", "pandas", "geopandas", "pyogrio", "rasterio"}
    assert imported & (slow | {"numpy", "pyarrow", "cv2", "PIL"}) == set()
    # The version and the list of commands take what Python and their parser take, nor rich, which old typers do.
    assert listed & ({"numpy", "pyproj", "matplotlib", "scipy", "shapely", "rich", "PIL"} - by_typer) == set()
    assert helped & {"matplotlib", "scipy", "shapely", "cv2", "PIL"} == set()


NUMBERS = """
import projdist, projdist.gis
projdist.compare(['robin', 'moll'], tolerance=1e-3), projdist.factors('merc', 0, 0)
projdist.gis.raster, projdist.gis.indicatrices
"""


@pytest.mark.slow
def test_numbers_load_no_matplotlib() -> None:
    """A comparison needs no drawing library, nor do the files of GIS programs."""
    assert "matplotlib" not in loaded_by(NUMBERS)[-1]
