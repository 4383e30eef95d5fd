"""Flexion and skewness, the mean bending of great circles on a map, in closed form."""

from collections.abc import Callable

import numpy as np

from projdist._typing import FloatArray


def flexion(J: FloatArray, H: FloatArray) -> FloatArray:
    """Goldberg and Gott's flexion |v x w| / |v|^2, the mean over all directions."""
    # v is the velocity and w the acceleration on the map of a unit-speed great circle; the unit is one per radian of
    # arc when J and H are per radian. Goldberg & Gott 2007, section 3.
    return _mean_over_directions(J, H, lambda v, w: np.asarray(v[..., 0] * w[..., 1] - v[..., 1] * w[..., 0]))


def skewness(J: FloatArray, H: FloatArray) -> FloatArray:
    """Goldberg and Gott's skewness |v . w| / |v|^2, the mean over all directions (as `flexion`)."""
    return _mean_over_directions(J, H, _dot)


def _dot(v: FloatArray, w: FloatArray) -> FloatArray:
    """Inner products of vectors (..., 2)."""
    return np.asarray(v[..., 0] * w[..., 0] + v[..., 1] * w[..., 1])


# A cubic form p cos^3 + q cos^2 sin + r cos sin^2 + s sin^3, and the half-axes a >= b of |v|.
_Form = tuple[FloatArray, ...]


def _mean_over_directions(
    J: FloatArray, H: FloatArray, product: Callable[[FloatArray, FloatArray], FloatArray]
) -> FloatArray:
    """Mean over t in [0, pi) of |product(J t, H(t, t))| / |J t|^2; NaN where J is singular."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        form = _in_principal_axes(J, H, product)
        start = _roots(form)
        stop = np.concatenate([start[..., 1:], start[..., :1] + np.pi], axis=-1)
        ends = _antiderivative(form, np.concatenate([start, stop], axis=-1))
        mean = np.abs(ends[..., 3:] - ends[..., :3]).sum(axis=-1) / np.pi
    return np.where(np.isfinite(mean), mean, np.nan)


def _in_principal_axes(J: FloatArray, H: FloatArray, product: Callable[[FloatArray, FloatArray], FloatArray]) -> _Form:
    """The form with angles counted from the direction in which |v| is largest; each part has one trailing axis."""
    east, north = J[..., 0], J[..., 1]
    axis = 0.5 * np.arctan2(2.0 * _dot(east, north), _dot(east, east) - _dot(north, north))[..., None]
    cos, sin = np.cos(axis), np.sin(axis)
    first, second = east * cos + north * sin, north * cos - east * sin
    along, mixed, across = H[..., 0, 0], H[..., 0, 1], H[..., 1, 1]
    w11 = along * cos**2 + 2.0 * mixed * cos * sin + across * sin**2
    w12 = (across - along) * cos * sin + mixed * (cos - sin) * (cos + sin)
    w22 = along * sin**2 - 2.0 * mixed * cos * sin + across * cos**2
    parts = (
        product(first, w11),
        product(second, w11) + 2.0 * product(first, w12),
        product(first, w22) + 2.0 * product(second, w12),
        product(second, w22),
        np.hypot(first[..., 0], first[..., 1]),
        np.hypot(second[..., 0], second[..., 1]),
    )
    return tuple(part[..., None] for part in parts)


def _antiderivative(form: _Form, angle: FloatArray) -> FloatArray:
    """Antiderivative, at angles, of the form over a^2 cos^2 + b^2 sin^2."""
    # The form is cos (p + (r - p) sin^2) + sin (s + (q - s) cos^2). With x the sine in the first half and the cosine in
    # the second, the denominator is a^2 (1 - k x^2) or b^2 (1 + l x^2). Nothing cancels as a - b goes to 0.
    p, q, r, s, a, b = form
    sin, cos = np.sin(angle), np.cos(angle)
    gap, ratio = (a - b) * (a + b), b / a
    k, l = gap / a**2, gap / b**2  # noqa: E741 the names of the formula
    zeroth, first = _fractions(k * sin**2, cos**2 + (ratio * sin) ** 2)
    by_sine = (p * zeroth + (r - p) * sin**2 * first) * sin / a**2
    zeroth, first = _fractions(-l * cos**2, 1.0 + l * cos**2)
    by_cosine = (s * zeroth + (q - s) * cos**2 * first) * cos / b**2
    return np.asarray(by_sine - by_cosine)


_SMALL, _TERMS = 0.1, 16  # of the series: 0.1^16 is below rounding


def _fractions(x: FloatArray, complement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The sums of x^j / (2 j + 1) and of x^j / (2 j + 3), for x < 1; `complement` is 1 - x."""
    root = np.sqrt(np.abs(x))
    # artanh(z) / z and arctan(z) / z.
    zeroth = np.where(x > 0, 0.5 * np.log((1.0 + root) ** 2 / complement), np.arctan(root)) / root
    first = (zeroth - 1.0) / x
    small = np.abs(x) < _SMALL
    near = x[small]
    series = np.zeros_like(near)
    for j in reversed(range(_TERMS)):
        series = series * near + 1.0 / (2 * j + 3)
    first[small] = series
    zeroth[small] = 1.0 + near * series
    return zeroth, first


def _roots(form: _Form) -> FloatArray:
    """Three ascending angles in an interval of length pi where the form is zero; a single zero is repeated."""
    # The direction, of four, with the largest form is put at infinity, so that the leading coefficient does not vanish.
    p, q, r, s = form[:4]
    angles = np.arange(4) * (np.pi / 4)
    cos, sin = np.cos(angles), np.sin(angles)
    values = p * cos**3 + q * cos**2 * sin + r * cos * sin**2 + s * sin**3
    best = np.argmax(np.abs(np.nan_to_num(values)), axis=-1)[..., None]
    turn = angles[best]
    # With (cos, sin) = (c x - d y, d x + c y), the coefficients of x^3, x^2 y, x y^2 and y^3.
    c, d = cos[best], sin[best]
    lead = np.take_along_axis(values, best, axis=-1)
    second = -3 * p * c * c * d + q * c * (c * c - 2 * d * d) + r * d * (2 * c * c - d * d) + 3 * s * c * d * d
    third = 3 * p * c * d * d + q * d * (d * d - 2 * c * c) + r * c * (c * c - 2 * d * d) + 3 * s * c * c * d
    last = -p * d**3 + q * c * d * d - r * c * c * d + s * c**3
    sized = np.isfinite(lead) & (lead != 0)
    cotangents = _cubic_roots(*(np.where(sized, value / lead, 0.0) for value in (second, third, last)))
    return np.sort(np.arctan2(1.0, cotangents), axis=-1) + turn


def _cubic_roots(b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Real roots (..., 3) of x^3 + b x^2 + c x + d, coefficients (..., 1); a single root is repeated."""
    shift = b / 3.0
    # y^3 + 3 m y + 2 n with x = y - b / 3.
    m, n = c / 3.0 - shift**2, shift**3 - 0.5 * shift * c + 0.5 * d
    discriminant = n * n + m * m * m
    # Three roots: y = 2 sqrt(-m) cos of a third of an angle, and of that plus one or two thirds of a turn.
    size = np.sqrt(np.maximum(-m, 0.0))
    third = np.arctan2(np.sqrt(np.maximum(-discriminant, 0.0)), -n) / 3.0
    three = 2.0 * size * np.cos(third + np.array([0.0, 2.0, 4.0]) * (np.pi / 3))
    # One root (Cardano): the larger of the two cube roots, and the other from their product, -m.
    large = -np.copysign(np.cbrt(np.abs(n) + np.sqrt(np.maximum(discriminant, 0.0))), n)
    one = large - np.divide(m, large, out=np.zeros_like(m), where=large != 0)
    return np.asarray(np.where(discriminant < 0, three, one) - shift)
