"""A proven lower bound of the range of scales of all conformal maps of a region."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from projdist import decisions, earth, field, projections, regions
from projdist._typing import BoolArray, ComplexArray, FloatArray, IntArray

# On any two conformal maps the logarithms of the scales differ by a harmonic function w. If u is the logarithm of one,
# and x a place in the region, w(x) is at most the largest w on the border; so on every other map the scales range by
# at least (u on the border at least) - u(x). The best u is found by Newton's method; the proof needs no more than u
# itself: its values on the border, and a bound of what it does between them.

_NODES, _ALONG, _FINER = 2000, 500, 5  # within; on the border, by the region's radius; times as many for the proof
_MOST = 2500  # on the border, for the search
_DEGREE = 16  # of the polynomial whose real part u has
# Logarithmic charges on lines around the region: their distance by its size, and how many by its length.
_LINES = ((0.04, 18.0), (0.1, 10.0), (0.25, 5.0), (0.6, 2.7))
_SHARPNESS = 10.0 * 3.0 ** np.arange(7)  # of the soft minimum along the border, by the range of u there
_STEPS, _DONE, _RIDGE = 25, 1e-6, 1e-4
_SMOOTH = 0.1  # weight of the mean square of u along the border, as wild functions need many points for a proof
_SAME = 1e-7  # of the largest singular value; functions with less are the same
_ROUNDING = 1e-14  # of ln k
_CHUNK = 1000
_WIDEST, _HIGHEST = 60.0, 88.0  # degrees from the middle, and of latitude
_IN_PPM, _LOGARITHM = "max_scale_error_ppm", "max_log_scale"


def proven_least(figure: str, region: regions.Place, ellipsoid: earth.Ellipsoid) -> float | None:
    """A proven lower bound of a figure of all conformal maps of a region; None if nothing is proven."""
    if figure not in (_IN_PPM, _LOGARITHM):
        return None
    log_range = least_log_range(region, ellipsoid)
    if log_range is None:
        return None
    return float(1e6 * np.tanh(0.5 * log_range)) if figure == _IN_PPM else 0.5 * log_range


def least_log_range(region: regions.Place, ellipsoid: earth.Ellipsoid) -> float | None:
    """A proven lower bound of ln(largest / smallest scale) of all conformal maps of a region's largest part.

    None for points, and for regions that are wider than 120 degrees or hold a pole.
    """
    # P. L. Chebyshev 1856, D. A. Grave 1911, J. Milnor 1969: the best map has the same scale all along the border.
    extent, (_, south, _, north) = decisions.extent_of(region), region.bounds
    if extent.radius > _WIDEST or not region.area_km2 or max(-south, north) > _HIGHEST:
        return None
    text = f"+proj=stere +lat_0={extent.lat!r} +lon_0={extent.lon!r} {decisions.ellipsoid_text(ellipsoid)}"
    base = projections.Projection.from_user_input(text)
    outline = _outline(region, extent.lon)
    border = _Border.of(outline, base, extent.radius / _ALONG)
    nodes = field.nodes_of(region, ellipsoid, _NODES)
    west = outline.bounds[0]
    lon = west + np.mod(nodes.lon - west, 360.0)  # as the outline counts, also beyond the antimeridian
    within = shapely.contains_xy(outline, lon, nodes.lat)
    if not within.any():
        return None
    z, log_k = _on_plane(base, lon[within], nodes.lat[within])
    z, charges = z / border.size, _charges(border)
    some = slice(None, None, max(1, border.z.size // _MOST))
    A, inner, along = _functions(border.z[some], charges), _functions(z, charges), border.log_k[some]
    _, values, axes = np.linalg.svd(A - A.mean(axis=0), full_matrices=False)
    kept = values > _SAME * values[0]
    frame = axes[kept].T / values[kept] * np.sqrt(len(A))
    middle, unit = A.mean(axis=0) @ frame, float(np.ptp(along)) or 1.0
    y = _highest(along / unit, A @ frame - middle, log_k / unit, inner @ frame - middle)
    c = unit * (frame @ y)
    fine = _Border.of(outline, base, extent.radius / _ALONG / _FINER, border.size)
    steepest = np.tan(np.radians(np.abs(shapely.get_coordinates(outline)[:, 1]).max()))
    radius = ellipsoid.a * (1.0 - ellipsoid.eccentricity_squared) / border.size
    lowest = _least_along(fine, charges, c, radius, float(steepest)) - _ROUNDING
    return max(0.0, lowest - float((log_k + inner @ c).min()))


def _outline(region: regions.Place, middle: float) -> shapely.Polygon:
    """The largest part of a region, joined across the antimeridian with longitudes that go on beyond 180 degrees."""
    parts = shapely.get_parts(regions.polygons_of(region))
    turns = [360.0 * round((middle - part.centroid.x) / 360.0) for part in parts]
    moved = [
        shapely.transform(part, lambda at, by=by: np.add(at, (by, 0.0))) for part, by in zip(parts, turns, strict=True)
    ]
    return max(shapely.get_parts(earth.merged(moved)), key=lambda part: part.area)


@dataclass(frozen=True)
class _Border:
    """Points (n,) of a border on the plane of the base map, in the unit circle; ln k there; the index of the next."""

    z: ComplexArray
    log_k: FloatArray
    following: IntArray
    size: float  # metres
    rings: list[ComplexArray]  # the outer one first

    @classmethod
    def of(cls, outline: shapely.Polygon, base: projections.Projection, step: float, size: float = 0.0) -> _Border:
        whole = shapely.geometry.polygon.orient(outline)  # by rings, as GEOS mends polygons that it has cut, to several
        cut = shapely.segmentize([whole.exterior, *whole.interiors], step)
        rings = [np.array(ring.coords)[:-1] for ring in cut]
        z, log_k = _on_plane(base, *np.concatenate(rings).T)
        size = size or float(np.abs(z).max())
        ends = np.cumsum([len(ring) for ring in rings])
        following = np.arange(1, z.size + 1)
        following[ends - 1] = ends - [len(ring) for ring in rings]
        return cls(z / size, log_k, following, size, np.split(z / size, ends[:-1]))


def _on_plane(base: projections.Projection, lon: FloatArray, lat: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """x + iy in metres, and the logarithm of the scale, of a conformal map."""
    x, y = base(lon, lat)
    return x + 1j * y, 0.5 * np.log(np.linalg.det(field.jacobian(base, lon, lat)))


def _charges(border: _Border) -> ComplexArray:
    """Places outside the region, denser near it, and one in each hole."""
    outer, *holes = (shapely.Polygon(np.column_stack([ring.real, ring.imag])) for ring in border.rings)
    places = [hole.representative_point() for hole in holes]
    for distance, count in _LINES:
        around = max(shapely.get_parts(outer.buffer(distance)), key=lambda part: part.area).exterior
        places += [around.interpolate(at) for at in np.arange(0.0, around.length, 1.0 / count)]
    found = np.array([complex(place.x, place.y) for place in places])
    return found[_outside(found, border)]


def _outside(places: ComplexArray, border: _Border) -> BoolArray:
    """True for places that the border does not wind around; charges inside the region prove nothing."""
    turns = np.angle((border.z[border.following] - places[:, None]) / (border.z - places[:, None]))
    return np.abs(turns.sum(axis=1)) < 1.0


def _functions(z: ComplexArray, charges: ComplexArray) -> FloatArray:
    """Harmonic functions (n, m): real and imaginary parts of powers, and logarithms of the distances from charges."""
    powers = z[:, None] ** np.arange(1, _DEGREE + 1)
    return np.concatenate([powers.real, powers.imag, np.log(np.abs(z[:, None] - charges))], axis=1)


def _highest(border: FloatArray, A: FloatArray, within: FloatArray, inner: FloatArray) -> FloatArray:
    """Coefficients y that nearly maximise the least of `border` + A y less the least of `within` + inner y."""
    # The least along the border is replaced by a soft minimum, sharper and sharper, which is concave and smooth.
    fitted = np.linalg.lstsq(np.column_stack([A, np.ones(len(A))]), border, rcond=None)[0]
    y = np.asarray(-fitted[:-1], dtype=float)

    def raised(y: FloatArray) -> float:
        return float((border + A @ y).min() - (within + inner @ y).min())

    best = y
    for sharpness in _SHARPNESS.tolist():
        for _ in range(_STEPS):
            place = int((within + inner @ y).argmin())

            def soft(y: FloatArray, sharpness: float = sharpness, place: int = place) -> float:
                u = border + A @ y
                least = -np.log(np.exp(-sharpness * (u - u.min())).sum()) / sharpness + u.min()
                return float(least - within[place] - inner[place] @ y - 0.5 * _SMOOTH * (y @ y))

            u = border + A @ y
            share = np.exp(-sharpness * (u - u.min()))
            share /= share.sum()  # in the limit the harmonic measure of the border, as seen from the place
            mean = A.T @ share
            slope = mean - inner[place] - _SMOOTH * y
            H = sharpness * ((A * share[:, None]).T @ A - np.outer(mean, mean))
            H.ravel()[:: len(H) + 1] += _SMOOTH + _RIDGE * np.trace(H) / len(H)
            step, part, now = np.linalg.solve(H, slope), 1.0, soft(y)
            gain = float(slope @ step)
            while part > _DONE and soft(y + part * step) < now + 0.1 * part * gain:
                part *= 0.5
            y = np.asarray(y + part * step, dtype=float)
            if gain < _DONE:
                break
        best = max(best, y, key=raised)
    return best


def _least_along(border: _Border, charges: ComplexArray, c: FloatArray, radius: float, steepest: float) -> float:
    """A lower bound of u = ln k + the harmonic functions times c along the whole border, between its points, too."""
    # On a chord of length l a function is at least the less of its ends less l^2 / 8 times its second derivative. That
    # of ln k is at most 1 / 2 R^2 on a sphere (here twice that, with the least radius), that of the real part of G is
    # |G''|, and the border bends away from its chords by l^2 / 8 times 2 (1 + tan(lat)) / R at most.
    k, (re, im) = np.arange(1, _DEGREE + 1), c[: 2 * _DEGREE].reshape(2, -1)
    power, q = re - 1j * im, c[2 * _DEGREE :]
    third = float((np.abs(power) * k * (k - 1) * np.maximum(k - 2, 0)).sum())
    bend, lowest = 2.0 * (1.0 + steepest) / radius, np.inf
    for start in range(0, border.z.size, _CHUNK):
        part = np.arange(start, min(start + _CHUNK, border.z.size))
        there = np.concatenate([part, border.following[part]])
        z = border.z[there]
        u, away = border.log_k[there] + _functions(z, charges) @ c, z[:, None] - charges
        powers = z[:, None] ** np.arange(_DEGREE)
        slope = np.abs(powers @ (power * k) + (q / away).sum(axis=1)) + np.abs(z) / radius**2
        second = np.abs(powers[:, :-1] @ (power * k * (k - 1))[1:] - (q / away**2).sum(axis=1))
        n = part.size
        length = np.abs(z[n:] - z[:n])
        nearest = np.maximum(np.abs(away[:n]) - length[:, None], 1e-9)
        bent = np.maximum(second[:n], second[n:]) + length * (third + (2.0 * np.abs(q) / nearest**3).sum(axis=1))
        harm = bent + 1.0 / radius**2 + bend * np.maximum(slope[:n], slope[n:])
        lowest = min(lowest, float((np.minimum(u[:n], u[n:]) - length**2 / 8.0 * harm).min()))
    return lowest
