"""A projection times a matrix, and the forms in which it leaves: each is run through pyproj and compared."""

import pickle

import numpy as np
import pytest
from projection_points import make
from pyproj import CRS, Transformer
from tables import each

from projdist.projections import Projection, ProjectionError, compose, parameters_of, pipeline_of, wkt_of

M = np.array([[1.2, 0.1], [0.05, 0.9]])
LON, LAT = np.array([5.0, 10.0, 14.0]), np.array([44.0, 47.0, 50.0])
# Sphere, ellipsoid, feet, grads from Paris, axes south and west, both axes along meridians, oblique.
BASES = ["moll", "winkel-tripel", "EPSG:3035", "EPSG:2264", "EPSG:27561", "EPSG:2065", "EPSG:32661", "EPSG:3857"]
_METRE = 1e-9
_ROUNDING = 4e-16  # two units in the last place


def truth(base):
    """Coordinates of the base times the matrix."""
    return M @ np.array(make(base)(LON, LAT))


@each("base", [*BASES, "+proj=utm +zone=32 +ellps=GRS80 +units=us-ft"])
def test_pipelines(base):
    """pyproj runs the pipeline, both ways, with the coordinates of the product."""
    projection = make(base)
    transformer = Transformer.from_pipeline(pipeline_of(projection, M))
    found = np.array(transformer.transform(LON, LAT))
    np.testing.assert_allclose(found, truth(base), rtol=_ROUNDING, atol=_METRE)
    composed = compose(projection, M, "x")
    for made in (composed, make(composed.definition)):  # which is read here, too
        np.testing.assert_allclose(made(LON, LAT), truth(base), rtol=_ROUNDING, atol=_METRE)
    back = transformer.transform(*found, direction="INVERSE")
    np.testing.assert_allclose(back, [LON, LAT], rtol=0, atol=1e-7)  # PROJ's own iterations


@pytest.mark.slow
@each("base", BASES)
def test_wkt(base):
    """The derived projected CRS is read back by pyproj and gives the same coordinates."""
    wkt, reason = wkt_of(make(base), M, 'A "quoted" name')
    crs = CRS.from_wkt(wkt)
    assert (reason, crs.type_name, crs.name) == (None, "Derived Projected CRS", 'A "quoted" name')
    np.testing.assert_allclose(make(wkt)(LON, LAT), truth(base), rtol=0, atol=5e-8)  # WKT has 15 digits


@each("base", ["+proj=pipeline +step +proj=moll +R=1", lambda lon, lat: (lon, lat)])
def test_no_wkt(base):
    """Where a CRS cannot hold the map there is a reason."""
    wkt, reason = wkt_of(make(base), M, "x")
    assert (wkt, bool(reason)) == (None, True)


@each(("base", "stretch", "changed"), [
    *(("plate-carree", (0.8, 1.0), "+lat_ts=36.869897"), ("hammer", (0.8, 1.25), "+M=0.8")),
    *(("+proj=merc +R=1000", (0.9, 0.9), "+k_0=0.9"), ("EPSG:3413", (0.99, 0.99), "+proj=stere")),
    *((code, (0.999, 0.999), "+k_0=0.999") for code in ("EPSG:2056", "EPSG:2264")),
    *(("EPSG:26591", (0.999, 0.999), "+pm=rome"), ("EPSG:32733", (1.001, 1.001), "+proj=tmerc +lon_0=15")),
    ("+proj=utm +zone=33 +south +units=us-ft", (1.001, 1.001), "+proj=tmerc +lon_0=15"),
    *((f"+proj={name} +R=6371000 +lat_ts=30d", (0.8, 1.0), None) for name in ("eqc", "cea")),
    *(("moll", (0.9, 0.9), None), ("plate-carree", (0.8, 0.9), None)),
])  # fmt: skip
def test_parameters(base, stretch, changed):
    """A scale is k_0, a stretch of an equidistant cylindrical map lat_ts, where the projection has them."""
    projection = make(base)
    found = parameters_of(projection, np.diag(stretch))
    if changed is None:
        assert found is None
        return
    assert changed in found
    expected = np.diag(stretch) @ np.array(projection(LON, LAT))
    np.testing.assert_allclose(make(found)(LON, LAT), expected, rtol=1e-11)


def test_compositions_are_values():
    """A composition can be pickled, a singular matrix is refused; two matrices become one, on the first base."""
    composed = compose(make("robin"), M, "x")
    assert pickle.loads(pickle.dumps(composed)) == composed
    with pytest.raises(ProjectionError, match="invertible"):
        compose(composed, np.zeros((2, 2)), "x")
    twice = compose(compose(make("moll"), M, "once"), M, "twice")
    np.testing.assert_allclose(twice(LON, LAT), M @ truth("moll"), rtol=1e-15)
    assert twice.definition.count("+proj=affine") == 1


def test_compositions_end_where_their_bases_do():
    """A small matrix does not bring back what is too far to be of the map."""
    base = Projection.from_function(lambda lon, lat: (np.where(lon > 10, 1e20, 1e5 * lon), 1e5 * lat))
    x, _ = compose(base, np.eye(2) * 1e-9, "x")([5.0, 15.0], [0.0, 0.0])
    assert np.isfinite(x).tolist() == [True, False]
