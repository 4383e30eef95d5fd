"""What of the site is made: the reference of Python and of the commands, the atlas, notebooks, the change log."""

from __future__ import annotations

import importlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import atlas_pages
from typer.testing import CliRunner

import projdist
from projdist.cli.app import COMMANDS, app
from projdist.support import Answer

ROOT = Path(__file__).parents[1]
LISTS = {
    "projections": "Projections with names",
    "measures": "Measures of a point",
    "figures": "Figures of a map over a region",
    "criteria": "Criteria of numbers with weights",
    "indices": "Published indices",
}
MODULES = {
    "plots": "Pictures",
    "gis": "Files of GIS programs",
    "spd": "Symmetric matrices",
    "mosaics": "Mosaics",
    "pointclouds": "Point clouds",
    "oldmaps": "Old maps",
    "worldmaps": "World maps that PROJ has not",
}
RESULTS = ("projections", "matrices", "answers", "decisions", "designs")
"""Rooms whose functions return types of their own."""


def write(folder: Path) -> None:
    """Make the folder `made` of the site's sources anew."""
    made = folder / "made"
    shutil.rmtree(made, ignore_errors=True)
    for name in ("notebooks", "commands", "python", "atlas"):
        (made / name).mkdir(parents=True)
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        text = notebook.read_text().replace("](../docs/", "](../../")
        (made / "notebooks" / notebook.name).write_text(text)
    changes = (ROOT / "CHANGELOG.md").read_text()
    (made / "changelog.md").write_text(changes.replace("](docs/", "](../"))
    for name in COMMANDS:
        (made / "commands" / f"{name}.md").write_text(_command_page(name))
    for name, text in _python_pages():
        (made / "python" / f"{name}.rst").write_text(text)
    (made / "lists.md").write_text("".join(_lists()))
    for name, text in _atlas_pages(folder / "images" / "atlas"):
        (made / "atlas" / f"{name}.md").write_text(text)


def relink(_: object, name: str, source: list[str]) -> None:
    """Links to what lies beside the documentation go to its copy in the site."""
    source[0] = source[0].replace("](../notebooks/", "](made/notebooks/")
    source[0] = source[0].replace("](atlas.md)", "](made/atlas/index.md)")


def groups() -> Iterator[tuple[str, list[str]]]:
    """The public names of Python by the titles of their groups in `projdist/__init__.pyi`."""
    text = (ROOT / "projdist" / "__init__.pyi").read_text().partition("\n__version__")[0]
    for block in text.split("\n\n"):
        title, _, imports = block.partition("\n")
        names = [name for name in re.findall(r"\w+", imports) if name in projdist.__all__]
        told = [name for name in names if name not in MODULES and _has_page(getattr(projdist, name))]
        if told:
            yield title.removeprefix("# "), told


def _atlas_pages(images: Path) -> Iterator[tuple[str, str]]:
    """The pages of the atlas, with the pictures that there are."""
    pages = {name: atlas_pages.slug(entry) for name, entry in atlas_pages.entries().items()}
    yield "index", atlas_pages.overview_page("../../images/atlas", lambda name: f"{pages[name]}.md")
    for name, page in pages.items():
        picture = f"../../images/atlas/{page}.png" if (images / f"{page}.png").exists() else None
        yield page, f"---\norphan: true\n---\n\n{atlas_pages.place_page(name, picture)}"


def _python_pages() -> Iterator[tuple[str, str]]:
    """The pages of groups and of modules, and the list of them, by their names."""
    pages = {_slug(title): _python_page(title, "projdist", names) for title, names in groups()}
    for module, title in MODULES.items():
        found = getattr(projdist, module)
        names = [name for name in found.__all__ if not hasattr(projdist, name) and _has_page(getattr(found, name))]
        pages[_slug(title)] = _python_page(title, found.__name__, names)
    for room in RESULTS:
        found = importlib.import_module(f"projdist.{room}")
        names = [name for name in found.__all__ if _is_result(getattr(found, name)) and not hasattr(projdist, name)]
        title = f"Results of projdist.{room}"
        pages[_slug(title)] = _python_page(title, found.__name__, names)
    listed = "\n".join(f"   {name}" for name in pages)
    pages["index"] = f"{_headed('Python')}.. toctree::\n   :maxdepth: 2\n\n{listed}\n"
    yield from pages.items()


def _python_page(title: str, module: str, names: list[str]) -> str:
    """A page that lists names, each with a page of its own."""
    listed = "\n".join(f"   {name}" for name in sorted(set(names), key=str.lower))
    return f"{_headed(title)}.. currentmodule:: {module}\n\n.. autosummary::\n   :toctree: names\n\n{listed}\n"


def _is_result(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, Answer)


def _has_page(value: object) -> bool:
    """Whether a public name has a page: registries and other constants are on that of lists."""
    return callable(value) or type(value).__module__.startswith("projdist.")


def _headed(title: str) -> str:
    return f"{title}\n{'=' * len(title)}\n\n"


def _command_page(name: str) -> str:
    return f"# projdist {name}\n\n```text\n{_printed(name, '--help')}```\n"


def _lists() -> Iterator[str]:
    yield "# Lists\n\nWhat `projdist list` prints.\n"
    for name, title in LISTS.items():
        yield f"\n## {title}\n\n{_printed('list', name, '--format', 'markdown')}"


def _printed(*words: str) -> str:
    """What a command prints."""
    result = CliRunner().invoke(app, [*words], terminal_width=100, catch_exceptions=False)
    if result.exit_code:
        raise RuntimeError(f"'projdist {' '.join(words)}' ended with {result.exit_code}.")
    return result.stdout


def _slug(title: str) -> str:
    return re.sub(r"\W+", "-", title.lower()).strip("-")
