"""CRSs that draw the same map, against their coordinates as PROJ computes them."""

import numpy as np
import pyproj
import pytest

from projdist.projections import codes_of_same_map, database

GRID = np.meshgrid(np.linspace(-1.0, 1.0, 5), np.linspace(-1.0, 1.0, 5))


def coordinates(code: str, lon, lat):
    """Metres east and north in a CRS of points on its own datum, less the first point's."""
    crs = pyproj.CRS(code)
    forward = pyproj.Transformer.from_crs(crs.geodetic_crs.to_2d(), crs, always_xy=True)
    turn = pyproj.CRS(code).prime_meridian.longitude * crs.prime_meridian.unit_conversion_factor
    unit = crs.geodetic_crs.axis_info[0].unit_conversion_factor
    xy = np.array(forward.transform((np.radians(lon) - turn) / unit, np.radians(lat) / unit))
    return (xy - xy[:, :1]) * crs.axis_info[0].unit_conversion_factor


@pytest.mark.parametrize(
    ("code", "place", "some"),
    [
        ("EPSG:2154", (3, 46), {"EPSG:9793", "EPSG:9794"}),
        ("EPSG:3035", (10, 52), {"EPSG:5636", "IGNF:ETRS89LAEA"}),
        ("EPSG:32633", (15, 50), {"EPSG:32733", "EPSG:25833", "EPSG:3006", "EPSG:3045"}),
        ("EPSG:27572", (2, 46), {"EPSG:27562"}),
        ("EPSG:2056", (8, 47), {"EPSG:21781"}),
    ],
)
def test_they_differ_by_a_shift(code: str, place: tuple[float, float], some: set[str]) -> None:
    """And those that are known to be the same are among them; none is deprecated, or the CRS itself."""
    found = codes_of_same_map(code)
    assert some <= set(found)
    assert code not in found
    lon, lat = (centre + part.ravel() for centre, part in zip(place, GRID, strict=True))
    own = coordinates(code, lon, lat)
    for other in found:
        assert not pyproj.CRS(other).is_deprecated
        assert np.abs(coordinates(other, lon, lat) - own).max() < 2e-5, other  # WGS 84 and GRS 80 differ so much


def test_others_are_not_the_same() -> None:
    """Of another ellipsoid, another meridian; of none that the database has in columns, or of nothing."""
    found = codes_of_same_map("EPSG:32633")
    assert not {"EPSG:23033", "EPSG:32632", "EPSG:32233"} & set(found)
    assert codes_of_same_map("EPSG:27700") == {}
    assert codes_of_same_map("nothing:1") == {}


def test_no_database(monkeypatch, tmp_path) -> None:
    """Where PROJ's database is no file nothing is known."""
    monkeypatch.setattr("projdist.projections.catalogue.get_data_dir", lambda: str(tmp_path))
    assert codes_of_same_map("EPSG:2154") == {}


@pytest.mark.parametrize(("value", "degrees"), [(52.3, 52.5), (-2.2033, -2.3425), (22.18432, 22.312)])
def test_sexagesimal_degrees(value: float, degrees: float) -> None:
    """DDD.MMSSsss, as EPSG has it under 9110."""
    assert database._value(value, 9110, {9102: 1.0}) == pytest.approx(degrees, abs=1e-12)
