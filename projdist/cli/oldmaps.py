"""Several old maps of one region in the command `oldmap`: what they have in common, and what each has for itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.oldmaps import OldMap, common_ground
from projdist.cli.errors import refuse
from projdist.cli.report import Column, Report, Table
from projdist.designs import mean_plane_map
from projdist.matrices import get_measure

_MEAN = "their mean"
_ROUNDING = 1e-12  # of a mean square


def refuse_for_several(given: Mapping[str, Any]) -> None:
    """Refuse options of one map only."""
    for name, value in given.items():
        if value:
            refuse(f"Invalid option '{name}' for several maps. It is for one.")


def refuse_twice(given: Sequence[str]) -> None:
    """Refuse a file that is given twice: with itself a map has everything in common."""
    for name in given:
        if given.count(name) > 1:
            refuse(f"Invalid points file '{name}'. It must be given once.")


def several_report(given: Sequence[str], maps: Sequence[OldMap], by: str) -> Report:
    """A row for each map after its rectification, and one for the mean of all."""
    data = _measured(given, maps, by)
    rows = [*data["maps"], {"map": _MEAN, "distortion": data["mean"]["distortion"]}]
    own = np.mean([row["distortion"] for row in data["maps"]])
    return Report(
        title=f"{len(maps)} old maps, each after its {by}",
        tables=[Table(rows, _COLUMNS)],
        notes=[
            "Mean Dist_F^2: over the ground that all maps show, from the ground to a map, and from the mean to it. The "
            "mean is the map nearest to all: what they have in common.",
            f"In common is {100 * data['mean']['distortion'] / own:.3g} % of the maps' distortion."
            if own > _ROUNDING
            else "The maps have no distortion but what is rounding.",
        ],
        data=lambda: data,
        rows=lambda: rows,
    )


def _rounded(square: float) -> str:
    return f"{square if square > _ROUNDING else 0.0:.4g}"


_COLUMNS = [
    Column("map"),
    Column("points", show="{:,}".format),
    Column("left_out", "left out", "{:,}".format),
    Column("distortion", "mean Dist_F^2", _rounded),
    Column("from_mean", "from the mean", _rounded),
]


def _measured(given: Sequence[str], maps: Sequence[OldMap], by: str) -> dict[str, Any]:
    """The figures of all maps, and the polynomials of their mean."""
    ground = common_ground(maps, by=by)
    mean = mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area)
    nearest = mean.jacobian(ground.x, ground.y)

    def mean_square(jacobian: FloatArray) -> float:
        return float(ground.area @ get_measure("fisher")(jacobian) ** 2)

    rows = [
        {
            "map": name,
            "points": len(one.points.old),
            "left_out": len(one.points.old) - len(one.fitted.old),
            "distortion": mean_square(field),
            "from_mean": mean_square(nearest @ np.linalg.inv(field)),
        }
        for name, one, field in zip(given, maps, ground.jacobians, strict=True)
    ]
    return {"by": by, "maps": rows, "mean": {"distortion": mean_square(nearest)} | mean.to_dict()}
