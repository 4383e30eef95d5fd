"""Layers of old maps: displacements, and isolines of a known field."""

from dataclasses import replace

import numpy as np
import pytest

from projdist import Projection
from projdist.applications.oldmaps import ControlPoints, isolines, old_map

MESH = 2e-3  # of a value, by straight sides of triangles a hundredth of the sheet large

A, B = 40.0 * np.exp(0.2j), 6.0 - 9.0j


def conformal(flip=1.0):
    """An old map that f = A z + B z^2 / 2 leads to the truth from."""
    x, y = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 2), axis=-1).reshape(-1, 2).T
    f = A * (x + 1j * y) + 0.5 * B * (x + 1j * y) ** 2
    return old_map(ControlPoints(np.stack([x, flip * y], -1), np.stack([f.real, f.imag], -1)), model="polynomial2")


@pytest.mark.slow
@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_isolines_of_a_conformal_map(flip):
    """At places f(z) of isolines the scale is that of the MDT over |A + B z|, the turn arg(A + B z) less its mean."""
    found = conformal(flip)
    parts = found.rectifications["mdt"].parts
    truths = {
        "scale": lambda slope: float(parts.scale) / np.abs(slope),
        "rotation": lambda slope: np.degrees(np.angle(slope)) - float(parts.rotation),
    }
    for measure, value in truths.items():
        levels = isolines(found, measure)
        assert 4 <= len(levels) <= 12
        for level, pieces in levels.items():
            f = pieces.reshape(-1, 2) @ [1.0, 1.0j]
            slope = np.sqrt(A * A + 2.0 * B * f)  # A + B z, by the formula of quadratic equations
            np.testing.assert_allclose(value(slope), level, atol=MESH * max(1.0, abs(level)))


@pytest.mark.slow
def test_no_isolines_of_what_does_not_vary():
    """An affine map is the same everywhere: its layer is that of displacements."""
    gis = pytest.importorskip("projdist.gis")
    pytest.importorskip("geopandas")
    old = np.random.default_rng(1).uniform(0.0, 100.0, (20, 2))
    found = old_map(ControlPoints(old, old @ [[9.0, 1.0], [2.0, 8.0]]), model="affine")
    assert list(gis.old_map_layers(found)) == ["displacements"]


@pytest.mark.slow
def test_layers_in_feet(tmp_path):
    """Lines lead from where the rectification has the points to the truth, in the CRS's unit; isolines are whole."""
    pyogrio = pytest.importorskip("pyogrio")
    from projdist import gis

    found = conformal()
    layers = gis.old_map_layers(found, by="affine", crs="EPSG:2230")
    known = replace(found, points=replace(found.points, crs=Projection.from_user_input("EPSG:2230")))
    assert gis.old_map_layers(known, by="affine")["displacements"].equals(layers["displacements"])
    moved = layers["displacements"]
    assert moved.crs.to_epsg() == 2230
    foot = 1200.0 / 3937.0
    start = found.rectifications["affine"].affine(found.points.old)
    ends = np.array([line.coords for line in moved.geometry]) * foot
    np.testing.assert_allclose(ends, np.stack([start, found.points.new], axis=1), atol=1e-9)
    np.testing.assert_allclose(moved["length"], np.hypot(*(found.points.new - start).T), rtol=1e-12)
    assert not moved["outlier"].any()
    # Lines of equal scale are arcs about one point: one each.
    assert layers["scale"]["level"].is_unique
    path = gis.save_layers(layers, tmp_path / "x.gpkg")
    assert len(pyogrio.read_dataframe(path, layer="scale")) == len(layers["scale"])
    with pytest.raises(ValueError, match=r"Its suffix must be .gpkg, which has room for several layers"):
        gis.save_layers(layers, tmp_path / "x.geojson")
    with pytest.raises(FileExistsError):
        gis.save_layers(layers, path, overwrite=False)


def test_wrong_words():
    """Rectifications and CRSs that are none."""
    gis = pytest.importorskip("projdist.gis")
    with pytest.raises(ValueError, match=r"Invalid rectification 'fit'. It must be one of mdt, affine, helmert"):
        gis.old_map_layers(conformal(), by="fit")
    with pytest.raises(ValueError, match=r"PROJ has no CRS of it"):
        gis.old_map_layers(conformal(), crs="+proj=pipeline +step +proj=merc +step +proj=affine +s11=2")
