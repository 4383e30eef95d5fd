"""The direction of imports, read from the modules themselves; and what an import must not load."""

import ast
import functools
import graphlib
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "projdist"

# From the bottom to the top: a module imports only what stands before it.
LAYERS = [
    "_typing",
    "files",
    "hints",
    "texttables",
    "answer",
    "ellipsoid",
    "sphere",
    "catalogue",
    "worldmaps",
    "bending",
    "measures",
    "linear",
    "spd",
    "whitened",
    "means",
    "hyperbolic",
    "mdt",
    "rigid",
    "pointclouds",
    "mosaics",
    "criteria",
    "spectral",
    "rings",
    "geodata",
    "projections",
    "regions",
    "seams",
    "stencils",
    "derivatives",
    "hessians",
    "rasters",
    "panels",
    "strips",
    "cuts",
    "mesh",
    "cubature",
    "extremes",
    "nodes",
    "scatter",
    "distances",
    "quantiles",
    "frames",
    "results",
    "indices",
    "published",
    "correction",
    "local_corrections",
    "objectives",
    "search",
    "families",
    "members",
    "optimize",
    "surveying",
    "interruptions",
    "oldmaps",
    "probe",
    "suitability",
    "candidates",
    "twins",
    "custom",
    "executors",
    "recommend",
    "geoframes",
    "edges",
    "features",
    "check",
    "__init__",
    "plots",
    "gis",
    "cli",
    "__main__",
]

HOMES = {
    "pyproj": {"projections"},
    "pandas": {"answer", "gis"},
    "geopandas": {"gis"},
    "pyogrio": {"gis"},
    "pyarrow": {"gis"},
    "rasterio": {"gis", "surveying.heights"},
    "distributed": {"executors"},
    "scipy": {
        *("measures", "indices", "search", "oldmaps.field", "pointclouds.icp", "mosaics.homographies"),
        *("plots.indicatrices", "plots.oldmaps"),
    },
    "shapely": {"rings", "geodata", "regions", "features", "plots.basemap", "plots.domain", "plots.land", "gis.layers"},
    "matplotlib": {"plots"},
    "PIL": {"plots.scans", "mosaics.images", "mosaics.saving"},
    "cv2": {"mosaics.libraries"},
    "typer": {"cli"},
    "rich": {"cli"},
}

# What the package may import besides its homes' own: anything else is a new dependency.
EVERYWHERE = {"numpy", "projdist", *sys.stdlib_module_names}


def module_name(path: Path) -> str:
    """`plots.fields` of projdist/plots/fields.py, `plots` of its __init__.py."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}
PACKAGES = {name.split(".")[0] for name in MODULES if "." in name}
EDGES = {"__init__", "plots", "cli", "cli.app", "__main__"}


@functools.cache
def imports(name: str) -> set[str]:
    """Dotted names of all that a module imports, wherever in it; of our own the modules only."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name} has a relative import"
            assert node.module is not None
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            modules = [text for text in inner if text.removeprefix("projdist.") in MODULES]
            found.update(modules or [node.module])
    return found


def own_imports(name: str) -> set[str]:
    """Names of the package's own modules that a module imports."""
    ours = {text for text in imports(name) if text.split(".")[0] == "projdist"}
    return {text.removeprefix("projdist.") if text != "projdist" else "__init__" for text in ours}


def layer(name: str) -> str:
    return name.split(".")[0]


def loaded_by(code: str) -> set[str]:
    """Top-level names in sys.modules after a fresh interpreter ran the code."""
    script = f"import sys\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return {name.split(".")[0] for name in done.stdout.split()}


def test_the_list_of_layers_is_complete() -> None:
    """Every module has its place in the list, and every place its module."""
    assert {layer(name) for name in MODULES} == set(LAYERS)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODULES)
def test_imports_point_down(name: str) -> None:
    """A module imports only layers below its own, or its own package."""
    allowed = set(LAYERS[: LAYERS.index(layer(name))])
    inside = {other for other in own_imports(name) if "." in name and layer(other) == layer(name)}
    inside |= {other for other in own_imports(name) if name in PACKAGES and layer(other) == name}
    assert {layer(other) for other in own_imports(name) - inside} <= allowed


@pytest.mark.parametrize("name", [name for name in MODULES if name not in EDGES])
def test_nothing_below_the_edges_imports_the_index(name: str) -> None:
    """`projdist/__init__.py` is an index for users; the library takes things from where they are."""
    assert "__init__" not in own_imports(name)


def test_no_cycles() -> None:
    """The modules within packages, too, can be put in an order."""
    order = graphlib.TopologicalSorter({name: own_imports(name) - {name} for name in MODULES}).static_order()
    assert set(order) >= set(MODULES)


@pytest.mark.parametrize("library", HOMES)
def test_a_library_has_one_home(library: str) -> None:
    """pyproj, matplotlib, shapely, scipy and the command line's toolkit are imported where they live, and are."""
    users = {name for name in MODULES if library in {text.split(".")[0] for text in imports(name)}}
    homes = HOMES[library]
    assert {name for name in users if name not in homes and layer(name) not in homes} == set()
    assert {home for home in homes if not any(home in (name, layer(name)) for name in users)} == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", MODULES)
def test_no_other_libraries(name: str) -> None:
    """A module imports numpy, the standard library, ours, and what is at home in it."""
    used = {text.split(".")[0] for text in imports(name)}
    assert used - EVERYWHERE - set(HOMES) == set()


def test_import_loads_nothing_slow() -> None:
    """`import projdist` is quick: no matplotlib, scipy, shapely, typer, and nothing of the extra gis."""
    slow = {"matplotlib", "scipy", "shapely", "typer", "rich", "pandas", "geopandas", "pyogrio", "pyarrow", "rasterio"}
    slow |= {"cv2", "PIL"}
    assert loaded_by("import projdist") & slow == set()


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["heatmap", "--help"], ["list", "measures"]])
def test_help_loads_nothing_slow(arguments: list[str]) -> None:
    """Help, the version and lists answer at once: no matplotlib, scipy or shapely."""
    code = f"""
import contextlib, io
import projdist.cli
sys.argv = ['projdist', *{arguments!r}]
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    projdist.cli.main()
"""
    assert loaded_by(code) & {"matplotlib", "scipy", "shapely", "cv2", "PIL"} == set()


def test_a_comparison_loads_no_matplotlib() -> None:
    """Numbers need no drawing library."""
    code = "import projdist\nprojdist.compare(['robin', 'moll'], tolerance=1e-3)\nprojdist.factors('merc', 0, 0)"
    assert "matplotlib" not in loaded_by(code)
