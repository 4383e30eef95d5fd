"""Print the oldest versions that pyproject.toml allows of what projdist needs and can use, as constraints for pip."""

import re
import tomllib
from pathlib import Path

# Extras of what develops projdist, of which the newest will do, and the one that is the others together.
TOOLS = {"test", "wheel-test", "browser-test", "benchmark", "notebook", "docs", "all"}
FLOOR = re.compile(r"([A-Za-z0-9._-]+)>=([0-9.]+)")


def oldest() -> list[str]:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    stated = [*project["dependencies"], *(text for name in extras if name not in TOOLS for text in extras[name])]
    floors = [FLOOR.fullmatch(text) for text in stated]
    if not all(floors):
        raise SystemExit(f"A dependency of {stated} is not of the form name>=version.")
    return [f"{floor[1]}=={floor[2]}" for floor in floors if floor]


if __name__ == "__main__":
    print("\n".join(oldest()))
