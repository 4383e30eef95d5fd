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
NEEDS_VERSION = {"cli.app", "answers.batches"}

HOMES = {
    "pyproj": {"projections"},
    "pandas": {"support.answers", "gis"},
    "geopandas": {"gis"},
    "pyogrio": {"gis"},
    "xarray": {"gis"},
    "pyarrow": {"gis"},
    "rasterio": {"gis", "decisions.ground"},
    "distributed": {"support.executors"},
    "scipy": {
        *("numerics.minima", "matrices.measures", "regions.combinations"),
        *("applications.oldmaps.field", "applications.oldmaps.rectifying"),
        *("applications.pointclouds.correspondences", "applications.pointclouds.affine"),
        *("applications.mosaics.homographies", "applications.mosaics.correspondences"),
        *(
            "surfaces.tissot_ellipses",
            "plots.images",
            "plots.map_drawing",
            "designs.newton",
            "designs.spline_sheets",
        ),
    },
    "shapely": {
        *("earth.natural_earth", "regions"),
        *("decisions.data_edges", "designs.base_maps"),
        *("surfaces.surface", "surfaces.domain", "surfaces.land", "surfaces.regional", "surfaces.tissot_ellipses"),
        *("plots.basemap", "plots.geoaxes", "plots.morphs"),
        *("gis.layers", "gis.reading", "gis.conversion", "web.frames", "web.live"),
    },
    "matplotlib": {"plots"},
    "cartopy": {"plots.geoaxes"},
    "PIL": {
        "applications.oldmaps.rectifying",
        "applications.mosaics.images",
        "applications.mosaics.rendering",
        "plots.morphs",
        "web.live.widget",
    },
    "cv2": {"applications.mosaics.images"},
    "typer": {"cli"},
    "rich": {"cli"},
    "starlette": {"web.live.server"},
    "uvicorn": {"web.live.server"},
    "websockets": {"web.live.server"},
    "anywidget": {"web.live.widget"},
    "traitlets": {"web.live.widget"},
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
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name} has a relative import"
            assert node.module is not None
            found.update(_imported(name, node.module, [alias.name for alias in node.names]))
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
    ours = {text for text in imports(name) if text.split(".")[0] == "projdist"}
    return {text.removeprefix("projdist.") if text != "projdist" else "__init__" for text in ours}


def room(name: str) -> str:
    return name.split(".")[0]


def at_home(name: str, home: str) -> bool:
    return name == home or name.startswith(f"{home}.")


def loaded_by(code: str) -> set[str]:
    """Top-level names in sys.modules after a fresh interpreter ran the code."""
    script = f"import sys\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return {name.split(".")[0] for name in done.stdout.split()}


def test_every_module_is_in_a_room() -> None:
    """And every room of the plan is built."""
    assert {room(name) for name in INSIDE} == set(MAY_IMPORT)


def test_rooms_import_as_the_plan_says() -> None:
    """Another room only if the table allows it, and only through its face."""
    wrong = [
        f"{name} -> {other}"
        for name in INSIDE
        for other in own_imports(name) - FOR_ALL
        if room(other) != room(name)
        and not (other in FACES and room(other) in MAY_IMPORT[room(name)])
        and not (other == "__init__" and name in NEEDS_VERSION)
    ]
    assert wrong == []


def test_rooms_above_take_figures_of_fields() -> None:
    """How a field is sampled and searched is the affair of its room: this is all that others may take of it."""
    values = {"DEFAULT_TOLERANCE", "FIGURES", "AnyFigure", "Links", "Map"}
    figures = {"Field", "Figure", "field_of", "field_resolving", "get_figure", "named_measures", "sample"}
    answers = {"AiryKavrayskiy", "Extreme", "GeometricMedian", "Spread"}
    points = {"Derivatives", "Interpolant", "Quality", "derivatives", "hessian", "interpolant", "jacobian"}
    others = {"Nodes", "cut_length", "drawn", "evaluate", "find_tears", "is_interrupted", "jacobian_grid"}
    nodes = {"measure_at", "nodes_at", "nodes_of", "check_declared_property"}
    assert (
        set(importlib.import_module("projdist.field").__all__) == values | figures | answers | points | others | nodes
    )


def test_the_plan_has_no_arrow_upward() -> None:
    """The rooms can be put in an order."""
    assert set(graphlib.TopologicalSorter(MAY_IMPORT).static_order()) == set(MAY_IMPORT)


def test_no_cycles() -> None:
    """The modules within rooms, too, can be put in an order."""
    graph = {name: {other for other in own_imports(name) if room(other) == room(name)} - {name} for name in INSIDE}
    assert set(graphlib.TopologicalSorter(graph).static_order()) >= set(INSIDE)


@each("face", ["", *sorted(name for name in MODULES if MODULES[name].name == "__init__.py")[1:]])
def test_no_module_bears_the_name_of_an_exported_function(face: str) -> None:
    """`import projdist.recommend` would give the function where the module was meant."""
    package = importlib.import_module(f"projdist.{face}".rstrip("."))
    modules = {name.removeprefix(f"{face}.") for name in MODULES if face == "" or name.startswith(f"{face}.")}
    exported = [name for name in getattr(package, "__all__", []) if inspect.isroutine(getattr(package, name))]
    assert modules & set(exported) == set()


@each("library", HOMES)
def test_a_library_has_one_home(library: str) -> None:
    """pyproj, matplotlib, shapely, scipy and the command line's toolkit are imported where they live, and are."""
    users = {name for name in MODULES if library in {text.split(".")[0] for text in imports(name)}}
    homes = HOMES[library]
    assert {name for name in users if not any(at_home(name, home) for home in homes)} == set()
    assert {home for home in homes if not any(at_home(name, home) for name in users)} == set()


def test_no_other_libraries() -> None:
    """A module imports numpy, the standard library, ours, and what is at home in it."""
    used = {name: {text.split(".")[0] for text in imports(name)} - EVERYWHERE - set(HOMES) for name in MODULES}
    assert {name: libraries for name, libraries in used.items() if libraries} == {}


def test_import_loads_nothing_slow() -> None:
    """`import projdist` is quick: it loads what is asked for when it is asked for."""
    slow = {"pyproj", "matplotlib", "scipy", "shapely", "typer", "rich", "pandas", "geopandas", "pyogrio", "rasterio"}
    assert loaded_by("import projdist") & (slow | {"numpy", "pyarrow", "cv2", "PIL"}) == set()


COMMAND_LINES = """
import contextlib, io
import projdist.cli
for words in {lines}:
    sys.argv = ['projdist', *words.split()]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        projdist.cli.main()
    assert out.getvalue()
"""


def test_help_loads_nothing_slow() -> None:
    """Help of commands and lists answer at once: no matplotlib, scipy or shapely."""
    code = COMMAND_LINES.format(lines=("heatmap --help", "list measures"))
    assert loaded_by(code) & {"matplotlib", "scipy", "shapely", "cv2", "PIL"} == set()


def test_the_version_and_the_list_of_commands_load_no_library() -> None:
    """They take what Python and the parser of the command line take: no numpy, no pyproj, nor rich (old typers do)."""
    slow = {"numpy", "pyproj", "matplotlib", "scipy", "shapely", "rich", "PIL"} - loaded_by("import typer")
    assert loaded_by(COMMAND_LINES.format(lines=("--version", "--help"))) & slow == set()


@pytest.mark.slow
def test_a_comparison_loads_no_matplotlib() -> None:
    """Numbers need no drawing library."""
    code = "import projdist\nprojdist.compare(['robin', 'moll'], tolerance=1e-3)\nprojdist.factors('merc', 0, 0)"
    assert "matplotlib" not in loaded_by(code)


@pytest.mark.slow
def test_a_raster_loads_no_matplotlib() -> None:
    """Nor do the files of GIS programs."""
    assert "matplotlib" not in loaded_by("import projdist.gis\nprojdist.gis.raster, projdist.gis.indicatrices")
