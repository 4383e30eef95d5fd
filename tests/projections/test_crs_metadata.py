"""What projections say of themselves, against EPSG's registry and PROJ's strings."""

import math

import pytest

from projdist.projections import CrsAxis, Projection, Setting, metadata_of


def of(given):
    return metadata_of(Projection.from_user_input(given))


def test_a_crs() -> None:
    """EPSG:27572, whose angles are grads from Paris."""
    found = of("EPSG:27572")
    assert (found.kind, found.code, found.prime_meridian) == ("projected CRS", "EPSG:27572", "Paris")
    assert found.geographic_crs == "EPSG:4807 NTF (Paris)"
    assert found.method == "Lambert Conic Conformal (1SP)"
    assert Setting("Latitude of natural origin", 52.0, "grad") in found.parameters
    assert Setting("Scale factor at natural origin", 0.99987742, "") in found.parameters
    assert found.axes == (CrsAxis("Easting", "east"), CrsAxis("Northing", "north"))


def test_a_deprecated_one() -> None:
    """EPSG names EPSG:2953 in place of EPSG:2036."""
    found = of("EPSG:2036")
    assert (found.deprecated, found.replaced_by) == (True, ("EPSG:2953",))
    assert not of("EPSG:2953").deprecated


def test_kinds() -> None:
    """Of CRSs PROJ's types; of others what they are made of."""
    kinds = {
        "EPSG:7405": "compound CRS",
        "robinson": "PROJ string",
        "+proj=pipeline +step +proj=moll +step +proj=affine +s11=2": "PROJ pipeline",
        "gott-elliptical": "map that PROJ lacks",
        "gott-elliptical+lon_0=10": "map that PROJ lacks",
    }
    assert {given: of(given).kind for given in kinds} == kinds
    assert of(lambda lon, lat: (lon, lat)).kind == "function of longitude and latitude"


def test_a_proj_string() -> None:
    """Its parameters but for those of the figure and the unit; a flag has no value."""
    found = of("+proj=utm +zone=33 +south +units=us-ft +ellps=WGS84")
    assert found.parameters == (Setting("zone", "33", ""), Setting("south", None, ""))
    assert (found.unit, found.ellipsoid_name) == ("us-ft", "WGS 84")
    assert found.unit_metres == pytest.approx(1200 / 3937, rel=1e-14)
    assert of("robinson").unit == "metre"
    assert math.isnan(of(lambda lon, lat: (lon, lat)).unit_metres)
