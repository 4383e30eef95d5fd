"""The package as a whole: its index, its version, its docstrings, its silence."""

import ast
import importlib.metadata
import inspect
import pickle
import re
import runpy
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from tables import each

import projdist
from projdist import answers

ROOT = Path(__file__).parent.parent
PACKAGE = Path(projdist.__file__).parent
LIBRARY = sorted(path for path in PACKAGE.rglob("*.py") if "cli" not in path.relative_to(PACKAGE).parts)

LONGEST_DOCSTRING = 70  # with the sections of numpydoc
EXTRAS = ["gis", "dask", "mosaic", "cartopy", "explore"]  # what users install; the others are the developers'

FUNCTIONS = {name: getattr(projdist, name) for name in projdist.__all__ if inspect.isfunction(getattr(projdist, name))}
CLASSES = {name: getattr(projdist, name) for name in projdist.__all__ if inspect.isclass(getattr(projdist, name))}


def test_index_is_what_it_imports() -> None:
    """`__all__` names each import of the face once, and nothing else, all of which is there; and `dir` shows that."""
    face, code = (ast.parse((PACKAGE / f"__init__.{end}").read_text(encoding="utf-8")).body for end in ("pyi", "py"))
    froms = [alias for node in face if isinstance(node, ast.ImportFrom) for alias in node.names]
    assert dir(projdist) == sorted(projdist.__all__) == sorted(alias.asname or alias.name for alias in froms)
    assert len(set(projdist.__all__)) == len(projdist.__all__)
    assert [name for name in projdist.__all__ if getattr(projdist, name) is None] == []
    # `__init__.py` has no logic: a docstring, imports, and two assignments, the version and the lazy face.
    kinds = [type(node) for node in code if not isinstance(node, ast.Import | ast.ImportFrom)]
    assert kinds == [ast.Expr, ast.Assign, ast.Assign]


def test_what_the_issue_promises_in_python() -> None:
    """The calls that the issue names have the arguments that it names."""
    promised = {"factors": ["projection", "lon", "lat"], "summarize": ["projection", "region"]}
    for name, arguments in (promised | {"compare": ["projections", "region"]}).items():
        assert [*inspect.signature(FUNCTIONS[name]).parameters][: len(arguments)] == arguments
    assert inspect.signature(projdist.summarize).parameters["tolerance"].kind is inspect.Parameter.KEYWORD_ONLY
    for result in (answers.Factors, answers.Summary, answers.Comparison, answers.Failure, answers.MeasureSummary):
        assert callable(getattr(result, "to_dict", None)), result


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_version_and_extras(project: dict[str, Any]) -> None:
    """The versions of the package, of pyproject.toml and of what is installed are one; one extra has all of users'."""
    assert projdist.__version__ == project["version"] == importlib.metadata.version("projdist")
    (everything,) = map(Requirement, project["optional-dependencies"]["all"])
    assert (everything.name, everything.extras) == ("projdist", set(EXTRAS))
    assert (PACKAGE / "py.typed").is_file()  # type checkers are told that the package has types


@pytest.fixture
def recipe_path() -> Path:
    path = ROOT / "recipe" / "recipe.yaml"
    if not path.exists():
        pytest.skip("needs the checkout")
    return path


def test_the_recipe_needs_what_the_package_needs(recipe_path: Path, project: dict[str, Any]) -> None:
    """The recipe for conda has the version and the lower bounds of pyproject.toml, under conda's names."""
    recipe = recipe_path.read_text(encoding="utf-8")
    run = recipe.partition("\n  run:\n")[2].partition("\ntests:")[0]
    needed = re.findall(r"^    - (\S+) (>=.+)$", run, re.MULTILINE)
    wanted = {one.name: str(one.specifier) for one in map(Requirement, project["dependencies"])}
    wanted["matplotlib-base"] = wanted.pop("matplotlib")
    assert dict(needed) == wanted | {"python": ">=${{ python_min }}"}
    assert f'version: "{project["version"]}"' in recipe
    assert f'python_min: "{project["requires-python"].removeprefix(">=")}"' in recipe


def test_the_recipe_renders(recipe_path: Path) -> None:
    """As conda-forge's builder reads it: one package of pure Python, with the command. For releases."""
    rattler_build = pytest.importorskip("rattler_build")  # py-rattler-build, 80 MB: in no extra
    recipe = rattler_build.Stage0Recipe.from_file(str(recipe_path))
    (variant,) = recipe.render(rattler_build.VariantConfig())
    build = variant.recipe.to_dict()["build"]
    assert (build["noarch"], build["python"]["entry_points"]) == ("python", ["projdist = projdist.cli:main"])


def test_the_oldest_versions_are_those_stated(project: dict[str, Any]) -> None:
    """Each dependency, of extras too, has a lower bound and nothing else, and `make test-oldest` takes that version."""
    stated = [*project["dependencies"], *(text for name in EXTRAS for text in project["optional-dependencies"][name])]
    wanted = {one.name: str(one.specifier) for one in map(Requirement, stated)}
    taken = [Requirement(line) for line in runpy.run_path(str(ROOT / ".ci" / "oldest.py"))["oldest"]()]
    assert {one.name: str(one.specifier).replace("==", ">=") for one in taken} == wanted


def prints(text: str) -> bool:
    """Whether a module calls print, or has to do with the standard streams."""
    if not re.search("print|stdout|stderr", text):
        return False
    nodes = [*ast.walk(ast.parse(text))]
    calls = {node.func.id for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    return bool({"print"} & calls or {"stdout", "stderr"} & {n.attr for n in nodes if isinstance(n, ast.Attribute)})


def test_the_library_does_not_print() -> None:
    """Nothing is written to the standard streams outside the command line."""
    assert [path for path in LIBRARY if prints(path.read_text(encoding="utf-8"))] == []
    assert [*map(prints, ("print('a')", "sys.stderr.write('a')", "# print", "a.print()"))] == [True, True, False, False]


def test_docstrings() -> None:
    """Each public function and class says what it is, in at most seventy lines, methods and properties in forty."""
    texts = {name: inspect.cleandoc(value.__doc__ or "") for name, value in (FUNCTIONS | CLASSES).items()}
    assert [name for name, text in texts.items() if not 1 <= len(text.splitlines()) <= LONGEST_DOCSTRING] == []
    for key, value in (own for cls in CLASSES.values() for own in vars(cls).items()):
        is_method = inspect.isfunction(value) or isinstance(value, property | classmethod | staticmethod)
        if is_method and not key.startswith("_"):
            assert 1 <= len((inspect.getdoc(value) or "").splitlines()) <= 40, key


@each("function", FUNCTIONS.values())
def test_sections_of_numpydoc(function: Callable[..., object]) -> None:
    """Each names its parameters, what it returns and raises, and where it is from, and has an example."""
    sections = dict.fromkeys(("Parameters", "Returns", "Raises", "References", "Examples"), "")
    parts = re.split(r"^(\w+)\n-+\n", inspect.cleandoc(function.__doc__ or ""), flags=re.MULTILINE)
    sections |= dict(zip(parts[1::2], parts[2::2], strict=True))
    parameters = inspect.signature(function).parameters
    named = re.findall(r"^\*{0,2}(\w+(?:, \*{0,2}\w+)*)(?: : .*)?$", sections["Parameters"], flags=re.MULTILINE)
    assert {one.strip("* ") for line in named for one in line.split(",")} == set(parameters)
    assert [section for section in sections if not sections[section]] == ([] if parameters else ["Parameters"])
    assert ">>>" in sections["Examples"]


def test_results_pickle() -> None:
    summary = projdist.summarize("moll", tolerance=1e-3)
    assert pickle.loads(pickle.dumps(summary)).to_dict() == summary.to_dict()


# ---- progress: what takes long tells how much of it is done -----------------------------------------
AREA = "box:8,48,12,52"
CALLS: dict[str, Callable[[Callable[[int, int], object]], object]] = {
    "batch": lambda progress: projdist.batch(projdist.summarize, AREA, ["robin", "moll"], progress=progress),
    "compare": lambda progress: projdist.compare(["robin", "moll"], AREA, tolerance=1e-3, progress=progress),
    "mean_map": lambda progress: projdist.mean_map(["robin"], region=AREA, degree=1, progress=progress),
    "optimize": lambda progress: projdist.optimize("eqc", AREA, free=["lat_ts"], progress=progress),
    "world_map": lambda progress: projdist.world_map(cells=8, against=["robin"], progress=progress),
}


@pytest.mark.slow
@each("name", CALLS)
def test_progress(name: str) -> None:
    """It rises from news to news, of one total, and never beyond it."""
    told: list[tuple[int, int]] = []
    CALLS[name](lambda done, total: told.append((done, total)))
    done, (total,) = [one for one, _ in told], {total for _, total in told}
    assert done == sorted(set(done))
    assert 0 <= done[0] <= done[-1] <= total
