"""The package as a whole: its index, its version, its docstrings, its silence."""

import ast
import importlib.metadata
import inspect
import pickle
import re
import runpy
import tomllib
from pathlib import Path

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


def index_imports() -> list[str]:
    tree = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    return [
        alias.asname or alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names
    ]


def public_definitions() -> list[str]:
    return [name for name in projdist.__all__ if inspect.isfunction(getattr(projdist, name)) or is_class(name)]


def is_class(name: str) -> bool:
    return inspect.isclass(getattr(projdist, name))


def test_index_is_what_it_imports() -> None:
    """`__all__` names each import of the face once, and nothing else; and `dir` shows that."""
    assert sorted(projdist.__all__) == sorted(index_imports())
    assert len(set(projdist.__all__)) == len(projdist.__all__)
    assert dir(projdist) == sorted(projdist.__all__)


def test_index_has_no_logic() -> None:
    """`__init__.py` is a docstring, imports, and two assignments: the version and the lazy face."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    kinds = [type(node) for node in tree.body if not isinstance(node, ast.Import | ast.ImportFrom)]
    assert kinds == [ast.Expr, ast.Assign, ast.Assign]


def test_index_names_exist() -> None:
    """Each name of `__all__` can be had from the package."""
    assert [name for name in projdist.__all__ if getattr(projdist, name) is None] == []


def test_what_the_issue_promises_in_python() -> None:
    """The calls that the issue names have the arguments that it names."""
    assert list(inspect.signature(projdist.factors).parameters)[:3] == ["projection", "lon", "lat"]
    assert list(inspect.signature(projdist.summarize).parameters)[:2] == ["projection", "region"]
    assert inspect.signature(projdist.summarize).parameters["tolerance"].kind is inspect.Parameter.KEYWORD_ONLY
    assert list(inspect.signature(projdist.compare).parameters)[:2] == ["projections", "region"]
    for result in (answers.Factors, answers.Summary, answers.Comparison, answers.Failure, answers.MeasureSummary):
        assert callable(getattr(result, "to_dict", None)), result


def test_version() -> None:
    """The version of the package, of pyproject.toml and of what is installed is one."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert projdist.__version__ == stated == importlib.metadata.version("projdist")


def test_one_extra_has_all() -> None:
    """Of what users install."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    (everything,) = map(Requirement, extras["all"])
    assert (everything.name, everything.extras) == ("projdist", set(EXTRAS))


@pytest.fixture
def recipe_path() -> Path:
    path = ROOT / "recipe" / "recipe.yaml"
    if not path.exists():
        pytest.skip("needs the checkout")
    return path


def test_the_recipe_needs_what_the_package_needs(recipe_path: Path) -> None:
    """The recipe for conda has the version and the lower bounds of pyproject.toml, under conda's names."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    recipe = recipe_path.read_text(encoding="utf-8")
    needed = re.findall(
        r"^    - (\S+) (>=.+)$", recipe.partition("\n  run:\n")[2].partition("\ntests:")[0], re.MULTILINE
    )
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


def test_the_oldest_versions_are_those_stated() -> None:
    """Each dependency, of extras too, has a lower bound and nothing else, and `make test-oldest` takes that version."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    stated = [*project["dependencies"], *(text for name in EXTRAS for text in project["optional-dependencies"][name])]
    wanted = {one.name: str(one.specifier) for one in map(Requirement, stated)}
    taken = [Requirement(line) for line in runpy.run_path(str(ROOT / ".ci" / "oldest.py"))["oldest"]()]
    assert {one.name: str(one.specifier).replace("==", ">=") for one in taken} == wanted


def test_typed() -> None:
    """Type checkers are told that the package has types."""
    assert (PACKAGE / "py.typed").is_file()


def prints(path: Path) -> bool:
    """Whether a module calls print, or has to do with the standard streams."""
    text = path.read_text(encoding="utf-8")
    if not re.search("print|stdout|stderr", text):
        return False
    nodes = [*ast.walk(ast.parse(text))]
    calls = {node.func.id for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    return bool({"print"} & calls or {"stdout", "stderr"} & {n.attr for n in nodes if isinstance(n, ast.Attribute)})


def test_the_library_does_not_print(tmp_path: Path) -> None:
    """Nothing is written to the standard streams outside the command line."""
    assert [path for path in LIBRARY if prints(path)] == []
    for text, found in {
        "print('a')": True,
        "sys.stderr.write('a')": True,
        "# print": False,
        "a.print()": False,
    }.items():
        (tmp_path / "a.py").write_text(text)
        assert prints(tmp_path / "a.py") == found


def test_docstrings() -> None:
    """Each public function and class says what it is, in at most seventy lines."""
    lines = {
        name: len(inspect.cleandoc(getattr(projdist, name).__doc__ or "").splitlines()) for name in public_definitions()
    }
    assert {name: count for name, count in lines.items() if not 1 <= count <= LONGEST_DOCSTRING} == {}


@each("name", [name for name in public_definitions() if not is_class(name)])
def test_sections_of_numpydoc(name: str) -> None:
    """Each names its parameters, what it returns and raises, and where it is from, and has an example."""
    function = getattr(projdist, name)
    sections = dict.fromkeys(("Parameters", "Returns", "Raises", "References", "Examples"), "")
    parts = re.split(r"^(\w+)\n-+\n", inspect.cleandoc(function.__doc__ or ""), flags=re.MULTILINE)
    sections |= dict(zip(parts[1::2], parts[2::2], strict=True))
    parameters = inspect.signature(function).parameters
    named = re.findall(r"^\*{0,2}(\w+(?:, \*{0,2}\w+)*)(?: : .*)?$", sections["Parameters"], flags=re.MULTILINE)
    assert {one.strip("* ") for line in named for one in line.split(",")} == set(parameters)
    assert {section for section in sections if not sections[section]} - (
        {"Parameters"} if not parameters else set()
    ) == set()
    assert ">>>" in sections["Examples"]


@each("name", [name for name in public_definitions() if is_class(name)])
def test_public_methods_have_docstrings(name: str) -> None:
    """So does each public method and property."""
    cls = getattr(projdist, name)
    own = {key: value for key, value in vars(cls).items() if not key.startswith("_")}
    checked = {
        key: value
        for key, value in own.items()
        if inspect.isfunction(value) or isinstance(value, property | classmethod | staticmethod)
    }
    missing = [key for key, value in checked.items() if not inspect.getdoc(value)]
    long = [key for key, value in checked.items() if len((inspect.getdoc(value) or "").splitlines()) > 40]
    assert missing == []
    assert long == []


def test_results_pickle() -> None:
    """A summary goes to another process and comes back."""
    summary = projdist.summarize("moll", tolerance=1e-3)
    assert pickle.loads(pickle.dumps(summary)).to_dict() == summary.to_dict()
