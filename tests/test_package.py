"""The package as a whole: its index, its version, its docstrings, its silence."""

import ast
import importlib.metadata
import inspect
import pickle
import tomllib
from pathlib import Path

import pytest

import projdist

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "projdist"
LIBRARY = sorted(path for path in PACKAGE.rglob("*.py") if "cli" not in path.relative_to(PACKAGE).parts)

LONGEST_DOCSTRING = 40


def index_imports() -> list[str]:
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    return [
        alias.asname or alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names
    ]


def public_definitions() -> list[str]:
    return [name for name in projdist.__all__ if inspect.isfunction(getattr(projdist, name)) or is_class(name)]


def is_class(name: str) -> bool:
    return inspect.isclass(getattr(projdist, name))


def test_index_is_what_it_imports() -> None:
    """`__all__` names each import of `__init__` once, and nothing else."""
    assert sorted(projdist.__all__) == sorted(index_imports())
    assert len(set(projdist.__all__)) == len(projdist.__all__)


def test_index_has_no_logic() -> None:
    """`__init__.py` is a docstring, imports, and two assignments."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    kinds = [type(node) for node in tree.body if not isinstance(node, ast.ImportFrom)]
    assert kinds == [ast.Expr, ast.Assign, ast.Assign]


@pytest.mark.parametrize("name", projdist.__all__)
def test_index_names_exist(name: str) -> None:
    """Each name of `__all__` can be had from the package."""
    assert getattr(projdist, name) is not None


def test_what_the_issue_promises_in_python() -> None:
    """The calls that the issue names have the arguments that it names."""
    assert list(inspect.signature(projdist.factors).parameters)[:3] == ["projection", "lon", "lat"]
    assert list(inspect.signature(projdist.summarize).parameters)[:2] == ["projection", "region"]
    assert inspect.signature(projdist.summarize).parameters["tolerance"].kind is inspect.Parameter.KEYWORD_ONLY
    assert list(inspect.signature(projdist.compare).parameters)[:2] == ["projections", "region"]
    for result in (projdist.Factors, projdist.Summary, projdist.Comparison, projdist.Failure, projdist.MeasureSummary):
        assert callable(getattr(result, "to_dict", None)), result


def test_version() -> None:
    """The version of the package, of pyproject.toml and of what is installed is one."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert projdist.__version__ == stated == importlib.metadata.version("projdist")


def test_typed() -> None:
    """Type checkers are told that the package has types."""
    assert (PACKAGE / "py.typed").is_file()


@pytest.mark.parametrize("path", LIBRARY, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_the_library_does_not_print(path: Path) -> None:
    """No call of print, and nothing written to the standard streams, outside the command line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    calls = [node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
    assert "print" not in calls
    streams = [node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    assert not {"stdout", "stderr"} & set(streams)


@pytest.mark.parametrize("name", public_definitions())
def test_docstring(name: str) -> None:
    """Each public function and class says what it is, in at most forty lines."""
    text = getattr(projdist, name).__doc__
    assert text
    assert len(inspect.cleandoc(text).splitlines()) <= LONGEST_DOCSTRING


@pytest.mark.parametrize("name", [name for name in public_definitions() if is_class(name)])
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
