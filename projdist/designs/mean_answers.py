"""What `mean_map` answers: the mean of several maps, the bound, and the maps beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from projdist.designs.made_functions import BoxPolynomials
from projdist.projections import DerivedCrs, Projection
from projdist.regions import Place
from projdist.support import Answer, plain

__all__ = ["MeanMap", "Nearness"]


@dataclass(frozen=True, kw_only=True)
class Nearness:
    """How near a map is to those given, and how far from the ground.

    `kind` is "bound", "mean", "average" or "given". `total` is the sum over the given maps of weight times the mean of
    the squared Fisher distance, `airy_kavrayskiy` the Airy-Kavrayskiy error in the best scale, with its `error`. The
    bound is that of the mean metrics, which are no map's: its `projection` is None.
    """

    kind: str
    name: str
    projection: Projection | None
    total: float
    airy_kavrayskiy: float
    error: float | None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MeanMap(Answer):
    """The mean of several maps.

    `projection` is the map, `crs` its texts for other programs, None where it has none: that of the world is a sum of
    products of Chebyshev polynomials of longitude and latitude. `base` is the map that is corrected, None of the world.
    `average` is the plain average of coordinates. `standings` are those of the bound, the mean, the average and the
    given maps; `error` is what fewer nodes would change of their totals.
    """

    region: Place
    maps: tuple[Projection, ...]
    weights: tuple[float, ...]
    degree: int
    projection: Projection
    base: Projection | None
    crs: DerivedCrs | None
    average: Projection
    standings: tuple[Nearness, ...]
    error: float
    notes: tuple[str, ...] = ()

    @property
    def bound(self) -> float:
        """The total of the mean metrics, below which no map gets."""
        return self.standing("bound").total

    @property
    def total(self) -> float:
        """The total of the mean."""
        return self.standing("mean").total

    @property
    def airy_kavrayskiy(self) -> float:
        """The Airy-Kavrayskiy error of the mean in the best scale."""
        return self.standing("mean").airy_kavrayskiy

    def standing(self, kind: str) -> Nearness:
        """The first of a kind."""
        return next(one for one in self.standings if one.kind == kind)

    def _line(self) -> str:
        return (
            f"mean of {len(self.maps)} maps over {self.region.name}: total {self.total:.6g}, bound {self.bound:.6g}, "
            f"Airy-Kavrayskiy {self.airy_kavrayskiy:.4g}"
        )

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is not finite is None."""
        function = self.projection.function
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "maps": [one.definition for one in self.maps],
            "weights": list(self.weights),
            "degree": self.degree,
            "base": None if self.base is None else self.base.definition,
            "standings": [
                {
                    "kind": one.kind,
                    "name": one.name,
                    "total": plain(one.total),
                    "airy_kavrayskiy_scaled": plain(one.airy_kavrayskiy),
                    "airy_kavrayskiy_error": plain(one.error),
                }
                for one in self.standings
            ],
            "error_estimate": plain(self.error),
            "notes": list(self.notes),
            "chebyshev": _series(function) if isinstance(function, BoxPolynomials) else None,
            "proj": None if self.crs is None else self.crs.pipeline,
            "wkt": None if self.crs is None else self.crs.wkt,
            "wkt_derived": None if self.crs is None else self.crs.wkt_derived,
        }

    def _table(self) -> list[dict[str, Any]]:
        """A row a map, and the bound."""
        return [
            {
                "map": one.kind,
                "name": one.name,
                "total": one.total,
                "airy_kavrayskiy_scaled": one.airy_kavrayskiy,
            }
            for one in self.standings
        ]


def _series(function: BoxPolynomials) -> dict[str, Any]:
    """The map of the world in numbers: x, y of T_i T_j, by the box of the polynomials."""
    x, y = function.coefficients
    return {"box": list(function.box), "x": x.tolist(), "y": y.tolist()}
