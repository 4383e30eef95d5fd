"""Pointwise measures of distortion: functions of the Jacobian of a map, and all of them by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Literal, NamedTuple

import numpy as np

from projdist._typing import ArrayLike, FloatArray, NDArray
from projdist.matrices.flexion import flexion, skewness
from projdist.support import Registry, check_numbers, quoted

_SMALL, _LARGE = 1e-290, 1e300  # squares between these have all their digits
_DEGREES = 180.0 / np.pi
_CHUNK = 8192  # Jacobians at a time, so that results stay in the cache

FACTORS = ("h", "k", "a", "b", "s", "omega", "theta", "convergence", "fisher")


def principal_scales(J: ArrayLike) -> FloatArray:
    """The singular values of Jacobians, the largest first: a and b, the semi-axes of Tissot's indicatrix.

    For n = 2 they come from a + b and a - b, each one a hypotenuse: exact to rounding near conformality.

    Parameters
    ----------
    J : array_like (..., n, n)
        Jacobians, or other matrices of any dimension.

    Returns
    -------
    ndarray (..., n)
        Ratios, in descending order; NaN where J is not finite.

    Raises
    ------
    ValueError
        For values that are no numbers, and matrices that are not square.

    References
    ----------
    Snyder 1987, Map Projections: A Working Manual, USGS Professional Paper 1395, equations 4-12 and 4-13.

    Examples
    --------
    The eigenvalues of J^T J, here of rows 25, 20 and 20, 25, are their squares:

    >>> (principal_scales([[3, 0], [4, 5]]) ** 2).round(9)
    array([45.,  5.])
    """
    J = check_numbers("Jacobian", J)
    if J.ndim < 2 or J.shape[-1] != J.shape[-2]:
        raise ValueError(f"Invalid Jacobian shape {J.shape}. The last two axes must be equal, as in (..., 2, 2).")
    if J.shape[-1] == 2:
        return np.stack(_principal(J), axis=-1)
    finite = np.isfinite(J).all(axis=(-1, -2))
    scales = np.full(J.shape[:-1], np.nan)
    scales[finite] = np.linalg.svd(J[finite], compute_uv=False)
    return scales


def _sum_and_difference(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The principal scales' sum a + b and difference a - b >= 0."""
    similar = _length(J[..., 0, 0] + J[..., 1, 1], J[..., 1, 0] - J[..., 0, 1])
    mirrored = _length(J[..., 0, 0] - J[..., 1, 1], J[..., 1, 0] + J[..., 0, 1])
    return np.maximum(similar, mirrored), np.minimum(similar, mirrored)


def _principal(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The principal scales a >= b."""
    total, difference = _sum_and_difference(J)
    return 0.5 * (total + difference), 0.5 * (total - difference)


def _length(x: FloatArray, y: FloatArray) -> FloatArray:
    """sqrt(x^2 + y^2), ten times faster than by `np.hypot`, which is used where squares are out of range."""
    with np.errstate(over="ignore", under="ignore"):
        square = x * x + y * y
    length: FloatArray = np.asarray(np.sqrt(square))
    odd = (square < _SMALL) | (square > _LARGE)
    if np.any(odd):
        np.hypot(x, y, out=length, where=odd)
    return length


def _log(value: FloatArray) -> FloatArray:
    """The natural logarithm; NaN, not -inf, of zero."""
    return np.log(_where(value > 0, value))


def _where(defined: NDArray[np.bool_], value: FloatArray) -> FloatArray:
    """The values where they are defined, else NaN."""
    return value if np.all(defined) else np.where(defined, value, np.nan)


def _angle(y: FloatArray, x: FloatArray) -> FloatArray:
    """Angle in degrees from the x axis to (x, y), NaN at (0, 0); half the time of `arctan2` if no x is negative."""
    if np.any(np.signbit(x)):
        return _where((x != 0.0) | (y != 0.0), _DEGREES * np.arctan2(y, x))
    with np.errstate(all="ignore"):
        return _DEGREES * np.arctan(y / x)


def _omega(total: FloatArray, difference: FloatArray) -> FloatArray:
    """Maximum angular deformation in degrees by a + b and a - b."""
    # tan(omega / 2) = (a - b) / (2 sqrt(a b)) is safe near 0 and near 180 degrees alike.
    return 2.0 * _angle(difference, np.sqrt((total - difference) * (total + difference)))


def factors_of(J: FloatArray) -> dict[str, FloatArray]:
    """h, k, a, b, s, omega, theta, convergence and fisher of Jacobians (..., 2, 2), sharing intermediate results."""
    flat = J.reshape(-1, 2, 2)
    found: FloatArray = np.empty((len(FACTORS), len(flat)))  # one array: allocating many is slow
    for start in range(0, len(flat), _CHUNK):
        part = slice(start, start + _CHUNK)
        some: FloatArray = flat[part]
        h, s = meridional_scale(some), areal_scale(some)
        if _are_similar(some):
            k = a = b = h
            omega, theta, both = np.zeros_like(h), np.full_like(h, 90.0), np.sqrt(2.0) * np.abs(np.log(h))
        else:
            k = parallel_scale(some)
            total, difference = _sum_and_difference(some)
            a, b = 0.5 * (total + difference), 0.5 * (total - difference)
            omega, theta = _omega(total, difference), meridian_parallel_angle(some)
            both = np.sqrt(np.square(_log(a)) + np.square(_log(b)))
        factors = h, k, a, b, s, omega, theta, meridian_convergence(some), both
        for row, values in zip(found, factors, strict=True):
            row[part] = values
    return dict(zip(FACTORS, found.reshape(len(FACTORS), *J.shape[:-2]), strict=True))


def _are_similar(J: FloatArray) -> bool:
    """True if all are similarities to the last digit that keep orientation, as by formulas of conformal maps."""
    (xx, xy), (yx, yy) = J.transpose(1, 2, 0)
    return np.array_equal(xx, yy) and np.array_equal(xy, -yx) and bool(np.all((xx != 0.0) | (xy != 0.0)))


def meridional_scale(J: FloatArray) -> FloatArray:
    """Scale h along the meridian, the length of J's north column."""
    return _length(J[..., 0, 1], J[..., 1, 1])


def parallel_scale(J: FloatArray) -> FloatArray:
    """Scale k along the parallel, the length of J's east column."""
    return _length(J[..., 0, 0], J[..., 1, 0])


def areal_scale(J: FloatArray) -> FloatArray:
    """Areal scale s = a b = |det J|; whether the map mirrors is the measure `orientation`."""
    return np.abs(J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0])


def tissot_semimajor(J: FloatArray) -> FloatArray:
    """Largest scale a, the indicatrix' semi-major axis."""
    return _principal(J)[0]


def tissot_semiminor(J: FloatArray) -> FloatArray:
    """Smallest scale b, the indicatrix' semi-minor axis."""
    return _principal(J)[1]


def angular_distortion(J: FloatArray) -> FloatArray:
    """Maximum angular deformation omega = 2 asin((a - b) / (a + b)) in degrees (Snyder 1987, 4-9)."""
    return _omega(*_sum_and_difference(J))


def meridian_parallel_angle(J: FloatArray) -> FloatArray:
    """Angle theta' between the meridian and the parallel on the map, 0 to 90 degrees (Snyder 1987, 4-14)."""
    return _angle(areal_scale(J), np.abs(J[..., 0, 0] * J[..., 0, 1] + J[..., 1, 0] * J[..., 1, 1]))


def meridian_convergence(J: FloatArray) -> FloatArray:
    """Angle from true north clockwise to grid north in degrees.

    The surveyors' sign, and PROJ's: positive east of the central meridian of UTM in the northern hemisphere.
    """
    return _angle(-J[..., 0, 1], J[..., 1, 1])


def fisher(J: FloatArray) -> FloatArray:
    """Fisher distortion sqrt(sum of ln^2 of the principal scales), any dimension.

    D. Ozeri, "Riemannian Geometry Approach for Minimizing Distortion and its Applications".
    """
    if J.shape[-1] == 2:
        return np.sqrt(log_scales(J)[0])
    return np.sqrt(np.sum(_log(principal_scales(J)) ** 2, axis=-1))


def log_anisotropy(J: FloatArray) -> FloatArray:
    """ln(a / b), the logarithmic distortion of angles."""
    a, b = _principal(J)
    return _log(a / np.where(b > 0, b, np.nan))


def log_areal_scale(J: FloatArray) -> FloatArray:
    """ln(a b), the logarithmic distortion of areas."""
    return _log(areal_scale(J))


def log_scales(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """ln^2 a + ln^2 b and ln(a b) together, NaN where the map is singular."""
    log_a, log_b = map(_log, _principal(J))
    return log_a * log_a + log_b * log_b, log_a + log_b


def airy(J: FloatArray) -> FloatArray:
    """Airy's term sqrt(((a - 1)^2 + (b - 1)^2) / 2); its RMS is Airy's error (Airy 1861)."""
    a, b = _principal(J)
    return np.sqrt(0.5 * ((a - 1.0) ** 2 + (b - 1.0) ** 2))


def kavrayskiy(J: FloatArray) -> FloatArray:
    """Kavrayskiy's term sqrt((ln^2 a + ln^2 b) / 2), with the half that `fisher` has not."""
    return fisher(J) / np.sqrt(2.0)


def jordan(J: FloatArray) -> FloatArray:
    """Jordan's term: the RMS over all directions of scale - 1 (Jordan 1896)."""
    total, difference = _sum_and_difference(J)
    c = 0.5 * total
    n = (difference / np.where(total > 0, total, 1.0)) ** 2
    # The mean scale over the directions is c (1 + n/4 + n^2/64 + ...), by an ellipse's perimeter (Ivory 1798). With its
    # excess over c nothing cancels near scale 1.
    return np.sqrt((c - 1.0) ** 2 + c * (c * n - 2.0 * _perimeter_excess(n)))


def jordan_kavrayskiy(J: FloatArray) -> FloatArray:
    """The RMS over all directions of ln of the scale (Kavrayskiy 1934)."""
    total, difference = _sum_and_difference(J)
    from scipy.special import spence  # imported here: scipy is slow to load, and few need it

    # In the direction z the scale is (a + b) / 2 times |1 + n exp(2 i z)|, n = (a - b) / (a + b), whose logarithm has
    # the Fourier coefficients n^k / k: the mean of its square is half a dilogarithm.
    n = difference / np.where(total > 0, total, np.nan)
    return np.asarray(np.sqrt(_log(0.5 * total) ** 2 + 0.5 * spence(1.0 - n * n)))


def _perimeter_excess(n: FloatArray) -> FloatArray:
    """Perimeter of an ellipse over pi (a + b), less 1, for n = ((a - b) / (a + b))^2."""
    # Coefficients are squares of the binomial ones of sqrt(1 + x). Below n = 0.05 six terms are exact to 1e-16 n.
    series = n * (1 / 4 + n * (1 / 64 + n * (1 / 256 + n * (25 / 16384 + n * (49 / 65536 + n * 441 / 1048576)))))
    large = n > 0.05
    if np.any(large):
        from scipy.special import ellipe  # imported here: scipy is slow to load, and few need it

        root = np.sqrt(n)
        exact = 2.0 / np.pi * (1.0 + root) * ellipe(np.minimum(4.0 * root / (1.0 + root) ** 2, 1.0)) - 1.0
        return np.asarray(np.where(large, exact, series))
    return np.asarray(series)


def scale_error_ppm(J: FloatArray) -> FloatArray:
    """Largest |scale - 1| over all directions, in parts per million."""
    a, b = _principal(J)
    return 1e6 * np.maximum(np.abs(a - 1.0), np.abs(b - 1.0))


def areal_error_ppm(J: FloatArray) -> FloatArray:
    """|s - 1| in parts per million."""
    return 1e6 * np.abs(areal_scale(J) - 1.0)


def orientation(J: FloatArray) -> FloatArray:
    """+1 where the map keeps orientation, -1 where it mirrors, 0 where it is singular."""
    return np.sign(J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0])


_ROUND = 1e-9  # relative difference below which the axes of the indicatrix are equal


class Decomposition(NamedTuple):
    """The parts of linear maps, each of shape (...)."""

    scale: FloatArray  # sqrt |det M|
    stretch: FloatArray  # the largest scale over the smallest, 1 for a similarity
    stretch_azimuth: FloatArray  # of the largest scale, degrees clockwise from the y axis in [0, 180); NaN for none
    shear: FloatArray  # 90 degrees minus the angle between the images of the axes
    rotation: FloatArray  # of the y axis, degrees clockwise


def decompose(M: ArrayLike) -> Decomposition:
    """The parts of matrices of shape (..., 2, 2).

    >>> decompose([[3.0, 0.0], [0.0, 1.5]]).stretch_azimuth
    array(90.)
    """
    M = np.asarray(M, dtype=float)
    a, b = np.moveaxis(principal_scales(M), -1, 0)
    xx, xy, yx, yy = M[..., 0, 0], M[..., 0, 1], M[..., 1, 0], M[..., 1, 1]
    dot = xx * xy + yx * yy
    # The major axis of M^T M, from the x axis counter-clockwise.
    major = 0.5 * np.arctan2(2.0 * dot, xx**2 + yx**2 - xy**2 - yy**2)
    area = areal_scale(M)
    return Decomposition(
        np.sqrt(area),
        a / b,
        np.where(a - b > _ROUND * a, np.mod(90.0 - np.degrees(major), 180.0), np.nan),
        np.degrees(np.arctan2(dot, area)),
        -meridian_convergence(M),
    )


# ---- measures by name ----------------------------------------------------------------------------

_LIMITS = {
    "angular_distortion": (0.0, 180.0),
    "meridian_parallel_angle": (0.0, 90.0),
    "meridian_convergence": (-180.0, 180.0),
    "orientation": (-1.0, 1.0),
}


@dataclass(frozen=True)
class Measure:
    """A named pointwise measure.

    `function` takes J, or J and H if it `needs_hessian`. The `kind` tells how values are compared and drawn: a "ratio"
    by its logarithm about 1, a "signed" value about 0, a "magnitude" from 0 up.
    """

    name: str
    function: Callable[..., FloatArray]
    symbol: str = ""
    unit: str = ""
    _: KW_ONLY
    kind: Literal["ratio", "signed", "magnitude"] = "magnitude"
    needs_hessian: bool = False

    def __call__(self, J: ArrayLike, H: ArrayLike | None = None) -> FloatArray:
        """Values of shape (...) for J of shape (..., 2, 2); raises ValueError where H is needed and missing."""
        J = np.asarray(J, dtype=float)
        if not self.needs_hessian:
            return self.function(J)
        if H is None:
            raise ValueError(f"Invalid call of measure '{self.name}'. It needs the second derivatives H as well.")
        return self.function(J, np.asarray(H, dtype=float))

    @property
    def title(self) -> str:
        """The label of colour bars and axes: Areal scale, Fisher distortion."""
        name = self.name.replace("_", " ").removesuffix(" ppm")
        name += " distortion" if self.name in ("fisher", "airy", "kavrayskiy", "jordan") else ""
        return name[:1].upper() + name[1:]

    @property
    def bounded(self) -> bool:
        """True for angles and signs, which are bounded on all maps."""
        return self.unit == "deg" or self.name == "orientation"

    @property
    def limits(self) -> tuple[float, float]:
        """Bounds of the values on any map, infinite if there are none; those of user functions are unknown."""
        if self.name in _LIMITS:
            return _LIMITS[self.name]
        positive = self.kind == "ratio" or (self.kind == "magnitude" and MEASURES.get(self.name) is self)
        return (0.0 if positive else -np.inf), np.inf

    @property
    def description(self) -> str:
        """The first line of the function's documentation."""
        return (self.function.__doc__ or "").strip().partition("\n")[0]


_MEASURES = {
    measure.name: measure
    for measure in (
        Measure("fisher", fisher),
        Measure("meridional_scale", meridional_scale, "h", kind="ratio"),
        Measure("parallel_scale", parallel_scale, "k", kind="ratio"),
        Measure("areal_scale", areal_scale, "s", kind="ratio"),
        Measure("tissot_semimajor", tissot_semimajor, "a", kind="ratio"),
        Measure("tissot_semiminor", tissot_semiminor, "b", kind="ratio"),
        Measure("angular_distortion", angular_distortion, "omega", "deg"),
        Measure("meridian_parallel_angle", meridian_parallel_angle, "theta", "deg"),
        Measure("meridian_convergence", meridian_convergence, "convergence", "deg", kind="signed"),
        Measure("log_anisotropy", log_anisotropy, "ln(a/b)"),
        Measure("log_areal_scale", log_areal_scale, "ln(ab)", kind="signed"),
        Measure("airy", airy),
        Measure("kavrayskiy", kavrayskiy),
        Measure("jordan", jordan),
        Measure("jordan_kavrayskiy", jordan_kavrayskiy),
        Measure("scale_error_ppm", scale_error_ppm, "ppm", "ppm"),
        Measure("areal_error_ppm", areal_error_ppm, "", "ppm"),
        Measure("orientation", orientation, kind="signed"),
        Measure("flexion", flexion, needs_hessian=True),
        Measure("skewness", skewness, needs_hessian=True),
    )
}

ALIASES: dict[str, str] = {measure.symbol: measure.name for measure in _MEASURES.values() if measure.symbol} | {
    "max_scale": "tissot_semimajor",
    "min_scale": "tissot_semiminor",
}

MEASURES: Registry[Measure] = Registry(
    "measure",
    _MEASURES,
    aliases=ALIASES,
    suggested=[*_MEASURES, *ALIASES, "scale@AZIMUTH"],
    rule="It must be one of fisher, h, k, s, a, b, omega, ... (see 'projdist list measures', or projdist.MEASURES), "
    "scale@AZIMUTH, or a function of J.",
)


def get_measure(measure: str | Measure | Callable[[FloatArray], FloatArray]) -> Measure:
    """The measure of a name, a symbol, `scale@AZIMUTH`, or a function of J.

    Parameters
    ----------
    measure : str, Measure or callable
        A name in `MEASURES`; a short symbol, as h, k, s, a, b, omega, theta; the scale in an azimuth of so many degrees
        clockwise from north; or a function of J (..., 2, 2) that gives values (...). A measure stands for itself.

    Returns
    -------
    Measure
        A function of J (..., 2, 2), or of J and second derivatives (..., 2, 2, 2) where it needs them.

    Raises
    ------
    ValueError
        For an unknown name, with close matches, and an azimuth that is no number.

    References
    ----------
    Snyder 1987, Map Projections: A Working Manual, equations 4-9 (omega) and 4-14 (theta).
    Airy 1861, Philosophical Magazine 22:409 (airy); Jordan 1896 (jordan).
    Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, section 3 (flexion, skewness).
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications (fisher).

    Examples
    --------
    Of scales 2 and 1, 2 asin(1 / 3) in degrees, and the root of (4 + 1) / 2 half way between their directions:

    >>> J = [[2.0, 0.0], [0.0, 1.0]]
    >>> [round(float(get_measure(name)(J)), 6) for name in ("omega", "scale@45")]
    [38.942441, 1.581139]
    """
    if isinstance(measure, Measure):
        return measure
    if callable(measure):
        return Measure(getattr(measure, "__name__", "custom"), measure)
    if isinstance(measure, str) and measure.startswith("scale@"):
        return _scale_measure(measure)
    return MEASURES.named(measure)


def _scale_measure(name: str) -> Measure:
    """The measure `scale@AZIMUTH`; raises ValueError."""
    text = name.partition("@")[2]
    try:
        azimuth = float(text)
    except ValueError:
        azimuth = np.nan
    if not np.isfinite(azimuth):
        must = "It must be a number of degrees, as in scale@45."
        raise ValueError(f"Invalid azimuth {quoted(text)} in {quoted(name)}. {must}")
    east, north = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))

    def scale(J: FloatArray) -> FloatArray:
        """Scale in the given azimuth."""
        return _length(J[..., 0, 0] * east + J[..., 0, 1] * north, J[..., 1, 0] * east + J[..., 1, 1] * north)

    return Measure(name, scale, kind="ratio")
