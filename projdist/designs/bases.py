"""The map that a made one starts from: the best member of the families of its kind, or a given one."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray
from projdist.decisions import Extent, best_member, ellipsoid_text, extent_of, sensible_families
from projdist.designs.kinds import Kind, Wish
from projdist.designs.sites import TORN, Site, smooth_at
from projdist.earth import Ellipsoid
from projdist.field import FIGURES, Nodes, cut_length
from projdist.matrices import log_anisotropy, log_areal_scale
from projdist.projections import Projection, ProjectionError, ProjectionLike, crs_wkt, parameters_of
from projdist.regions import Place

__all__ = ["best_base", "check_keeps", "check_whole", "given_base"]

_KEPT = 1e-7  # of scales: what is conformal or equal-area to 0.1 ppm
_ROUGH = 1e-3  # of the region's area: where it may not be, by rounding


def best_base(kind: Kind, region: Place, wish: Wish, nodes: Nodes, symmetry: str) -> Projection:
    """The best member of those families of a kind that suit the region; raises ProjectionError."""
    extent = extent_of(region)
    if symmetry in ("equator", "both"):
        return _equatorial(kind, extent, nodes.ellipsoid)
    scale_matters = wish.figure.is_maximum or not kind.free_scale
    figure = wish.figure if scale_matters else FIGURES["airy_kavrayskiy_scaled"]
    sensible = [name for name in sensible_families(extent, nodes.ellipsoid) if name in kind.families]
    found: list[tuple[float, Projection]] = []
    for name in sensible or kind.families:
        if name == "omerc" and symmetry == "meridian":
            continue
        try:
            projection, _ = best_member(name, region, figure, nodes.ellipsoid)
        except ProjectionError:
            continue
        J, _ = nodes.jacobian(projection)
        smooth = smooth_at(J)
        J, weight = J[smooth], nodes.weight[smooth]
        if 1.0 - weight.sum() > TORN or not _keeps(kind, J, weight):
            continue
        if cut_length(projection, region) == 0.0 and crs_wkt(projection, name)[0] is not None:
            found.append((figure(J, weight), projection))
    if not found:
        raise ProjectionError(f"Invalid region '{region.name}'. No {kind.name} map of PROJ's shows it whole.")
    return min(found, key=lambda one: one[0])[1]


def _equatorial(kind: Kind, extent: Extent, ellipsoid: Ellipsoid) -> Projection:
    """An azimuthal map about the equator: what is symmetric about it has its middle there."""
    name = "stere" if kind.name == "conformal" else "laea"
    return Projection.from_user_input(f"+proj={name} +lat_0=0 +lon_0={extent.lon:.7g} {ellipsoid_text(ellipsoid)}")


def check_whole(base: Projection, region: Place) -> None:
    """Raise ProjectionError for a base that is cut within the region: no correction mends that."""
    if cut_length(base, region) > 0.0:
        raise ProjectionError(f"Invalid base '{base.label}'. It is cut within {region.name}.")


def given_base(given: ProjectionLike) -> Projection:
    """A projection as the PROJ string of the same map; raises ProjectionError where there is none."""
    projection = Projection.from_user_input(given)
    text = parameters_of(projection, np.eye(2))
    if text is None:
        raise ProjectionError(
            f"Invalid base '{projection.label}'. It must be a projection with a PROJ string, in metres to the east "
            "and north."
        )
    return Projection.from_user_input(text)


def check_keeps(kind: Kind, site: Site) -> None:
    """Raise ProjectionError for a base that is not of the kind: made maps have what all their steps have."""
    base = site.base
    if not _keeps(kind, site.J, site.weight):
        own = "at scale 1" if kind.name == "equal-area" else "itself"
        raise ProjectionError(f"Invalid base '{base.label}' for {kind.name} maps. It must be {kind.name} {own}.")


def _keeps(kind: Kind, J: FloatArray, weight: FloatArray) -> bool:
    """Whether Jacobians with weights that sum to 1 are of the kind, all but a few where PROJ rounds, as about a pole.

    Those of conics that are all but cylindrical are not, by rounding everywhere.
    """
    lost = {"conformal": log_anisotropy, "equal-area": log_areal_scale}.get(kind.name)
    return lost is None or float(weight[np.abs(lost(J)) > _KEPT].sum()) <= _ROUGH
