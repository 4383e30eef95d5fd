"""Operations of PROJ with a figure of the Earth of their own, which they have whatever +ellps or +R says.

They were found by doubling +R and +a, and are read from PROJ's sources (krovak.cpp, mod_krovak.cpp, nzmg.cpp,
mod_ster.cpp of PROJ 9.5); a test does the former with all operations of the PROJ that is installed.
"""

from __future__ import annotations

import math

from projdist.earth import Ellipsoid
from projdist.support import tell

# Each with the digits of e^2 that PROJ has.
_BESSEL = Ellipsoid(6377397.155, 1.0 - math.sqrt(1.0 - 0.006674372230614))
_INTERNATIONAL = Ellipsoid(6378388.0, 1.0 / 297.0)
_CLARKE_1866 = Ellipsoid(6378206.4, 1.0 - math.sqrt(1.0 - 0.00676866))
_CLARKE_SPHERE = Ellipsoid(6370997.0)  # of the area of Clarke 1866

_ALWAYS = {"krovak": _BESSEL, "mod_krovak": _BESSEL, "nzmg": _INTERNATIONAL}
_OF_TWO = ("alsk", "gs50")  # one for a sphere, and one for an ellipsoid
_OF_ONE_SIZE = "gs48"
# Maps of a sphere. PROJ puts conformal latitudes for theirs, but leaves the centre's: another map, conformal, too.
_SPHERICAL = ("gs48", "lee_os", "mil_os")

_PARAMETERS = {_BESSEL: "+ellps=bessel", _INTERNATIONAL: "+ellps=intl", _CLARKE_1866: "+ellps=clrk66"}
_SAME = 1e-6  # of size and flattening: ellipsoids that people take for one another differ by less


def own_figure(operation: str, stated: Ellipsoid) -> Ellipsoid:
    """The figure on which PROJ has an operation where a figure is stated."""
    if operation in _OF_TWO:
        return _CLARKE_SPHERE if stated.is_sphere else _CLARKE_1866
    if operation == _OF_ONE_SIZE:
        return Ellipsoid(_CLARKE_SPHERE.a, stated.f)
    return _ALWAYS.get(operation, stated)


def has_own_figure(operation: str) -> bool:
    """Whether PROJ passes over the figure that is stated, or its size."""
    return operation in (*_ALWAYS, *_OF_TWO, _OF_ONE_SIZE)


def figure_parameters(figure: Ellipsoid) -> str:
    """PROJ's parameters of a figure."""
    if figure.is_sphere:
        return f"+R={figure.a:.12g}"
    return _PARAMETERS.get(figure, f"+a={figure.a:.12g} +rf={1.0 / figure.f:.12g}")


def tell_of_figure(operation: str, stated: Ellipsoid) -> None:
    """Tell that a map is measured on a figure of its own, where that is not the stated one."""
    figure = own_figure(operation, stated)
    if abs(figure.a / stated.a - 1.0) > _SAME or abs(figure.f - stated.f) > _SAME:
        tell(f"PROJ draws {operation} on a figure of its own, {figure_parameters(figure)}; it is measured on that.")


def tell_of_sphere(operation: str, stated: Ellipsoid) -> None:
    """Tell that a map of the sphere was asked for on an ellipsoid, where PROJ has another map."""
    if operation in _SPHERICAL and not stated.is_sphere:
        tell(f"PROJ's {operation} is a map of the sphere; what it draws on an ellipsoid is another map.")
