"""A CRS for data and for frames: on their datum, for their country, with little convergence, and with messages."""

from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pyproj
import pytest
from refusals import refuses
from shapely import box
from tables import each

import projdist
from projdist import Notice
from projdist.decisions.data_checks import TURNED, _turned, crs_for_data, estimate_crs
from projdist.decisions.recommendation import ranked_crs
from projdist.projections import datum_transformation, keeps_datum
from projdist.regions import Box

geopandas = pytest.importorskip("geopandas")

PLACES = {
    "Freiburg": (7.80, 47.97), "Colmar": (7.35, 48.08), "Basel": (7.59, 47.55), "Oslo": (10.7, 59.9),
    "Utrecht": (5.1, 52.1), "Madrid": (-3.7, 40.4), "Nairobi": (36.8, -1.3), "Christchurch": (172.6, -43.5),
    "Denver": (-105.0, 39.7),
}  # fmt: skip


def parcels(place, crs):
    """Nine parcels of half a kilometre about a place."""
    lon, lat = PLACES[place]
    corners = [(lon + 0.02 * i, lat + 0.02 * j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    shapes = [box(x, y, x + 0.005, y + 0.005) for x, y in corners]
    return geopandas.GeoDataFrame(geometry=shapes, crs="EPSG:4326").to_crs(crs)


CHANGED = "The datum changes from WGS 84 to"
BESSEL, CLARKE = (6377397.155, 1 / 299.1528128), (6378249.2, 1 - 6356515 / 6378249.2)


def to_older(place, shift, ellipsoid):
    """Metres between a place on WGS 84 and on an older ellipsoid, whose middle lies at a shift: by hand, in space."""
    a, f = 6378137.0, 1 / 298.257223563
    turn, up = np.radians(PLACES[place])
    normal = a / np.sqrt(1 - f * (2 - f) * np.sin(up) ** 2)
    point = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), (1 - f) ** 2 * np.sin(up)]) * normal
    x, y, z = point - shift
    a, f = ellipsoid
    square, out, there = f * (2 - f), np.hypot(x, y), up
    for _ in range(20):
        normal = a / np.sqrt(1 - square * np.sin(there) ** 2)
        there = np.arctan2(z + square * normal * np.sin(there), out)
    meridian = a * (1 - square) / (1 - square * np.sin(there) ** 2) ** 1.5
    return np.hypot(meridian * (there - up), normal * np.cos(there) * (np.arctan2(y, x) - turn))


# CH1903+ to WGS 84 is a shift of 674.374, 15.056, 405.346 m (swisstopo).
SWISS = to_older("Basel", np.array([674.374, 15.056, 405.346]), BESSEL)


@each(("source", "target", "place", "metres", "accuracy"), [
    ("EPSG:4326", "EPSG:2056", "Basel", SWISS, 0.01), ("EPSG:4326", "EPSG:25832", "Freiburg", 0.0, 0.1),
    ("EPSG:4326", "EPSG:2193", "Christchurch", 0.0, 1.0), ("EPSG:4230", "EPSG:4258", "Freiburg", 130.0, 10.0),
    ("EPSG:4258", "EPSG:31467", "Freiburg", 121.0, 3.0),
    pytest.param("EPSG:4267", "EPSG:4269", "Denver", 50.0, 15.0, marks=pytest.mark.slow),
])  # fmt: skip
def test_shifts(source, target, place, metres, accuracy):
    """A change of datum in metres: of geocentric shifts in closed form, else about what is published."""
    found = datum_transformation(source, target, *PLACES[place])
    assert found.metres == pytest.approx(metres, abs=accuracy)
    assert "The datum changes from" in str(found)


def test_prime_meridians_are_no_change_of_datum():
    """From Paris, in grads, or from Greenwich, in degrees: what a change of datum moves is the same (IGN's shift)."""
    ways = (("EPSG:27572", "EPSG:4171"), ("EPSG:4275", "EPSG:4171"), ("EPSG:4171", "EPSG:27572"))
    paris, greenwich, back = (datum_transformation(*way, *PLACES["Colmar"]).metres for way in ways)
    assert greenwich == pytest.approx(to_older("Colmar", np.array([-168.0, -60.0, 320.0]), CLARKE), abs=5.0)
    assert paris == pytest.approx(greenwich, abs=0.01)
    assert back == pytest.approx(greenwich, abs=0.5)


def test_the_convergence_of_a_zone():
    """Near its meridian grid north is off by the difference of longitudes times the sine of the latitude."""
    found = _turned("EPSG:32632", np.array([8.99, 9.01, 9.02]), np.full(3, 50.0))
    assert found == pytest.approx(0.01 * np.sqrt(2.0) * np.sin(np.radians(50.0)), rel=1e-4)


def test_no_shift_is_no_ballpark():
    """What PROJ knows no way for is not known, and not 0; one datum is no change."""
    assert datum_transformation("EPSG:4258", "EPSG:25832", 8.0, 48.0) is None
    assert [keeps_datum(source, "EPSG:3035") for source in ("EPSG:4258", "EPSG:4326")] == [True, False]
    found = datum_transformation(pyproj.CRS("+proj=longlat +ellps=intl +type=crs"), "EPSG:25832", 8.0, 48.0)
    assert np.isnan(found.metres)
    assert str(found).endswith("by how much is not known to PROJ here.")


@pytest.mark.slow
@pytest.mark.parametrize(("place", "crs", "datum"), [
    ("Freiburg", "EPSG:4258", "ETRS89"), ("Freiburg", "EPSG:25832", "ETRS89"), ("Freiburg", "EPSG:4230", "ED50"),
    ("Colmar", "EPSG:4258", "ETRS89"), ("Basel", "EPSG:4258", "ETRS89"), ("Oslo", "EPSG:4258", "ETRS89"),
    ("Utrecht", "EPSG:4258", "ETRS89"), ("Madrid", "EPSG:4258", "ETRS89"), ("Nairobi", "EPSG:4210", "Arc 1960"),
    ("Christchurch", "EPSG:4167", "NZGD2000"), ("Denver", "EPSG:4269", "NAD83"), ("Denver", "EPSG:4267", "NAD27"),
])  # fmt: skip
def test_data_keep_their_datum(place, crs, datum):
    """Data that state a datum get a CRS on it, without a word about any change; the box of its use holds the data."""
    found, (lon, lat) = estimate_crs(parcels(place, crs), authorities=["EPSG"]), PLACES[place]
    assert found.geodetic_crs.name == datum
    west, south, east, north = found.area_of_use.bounds
    assert (west <= lon <= east, south <= lat <= north) == (True, True)


def _sited(place, crs, purpose="any", **options):
    bounds = parcels(place, "EPSG:4326").total_bounds
    lon, lat = bounds[[0, 2, 2, 0]], bounds[[1, 1, 3, 3]]
    return crs_for_data(crs, Box(*bounds), lon, lat, purpose=purpose, authorities=["EPSG"], **options)


@pytest.mark.slow
@pytest.mark.parametrize("purpose", ["any", "conformal"])
@pytest.mark.parametrize(("place", "foreign"), [
    ("Freiburg", ("France", "Switzerland")), ("Colmar", ("Germany", "Switzerland")),
])  # fmt: skip
def test_data_keep_their_country(place, foreign, purpose):
    """Parcels in the Black Forest are not sent to France, those in Alsace not to Germany, though boxes overlap."""
    found = _sited(place, "EPSG:4326", purpose)
    assert not pyproj.CRS(found.code).area_of_use.name.startswith(foreign)
    assert found.foreign == ""


@pytest.mark.slow
def test_convergence_counts_and_is_told():
    """It is that of pyproj, as RMS; what is turned by more than three degrees is told."""
    found = _sited("Freiburg", "EPSG:4258")
    truth = pyproj.Proj(found.code).get_factors(*PLACES["Freiburg"]).meridian_convergence
    assert found.convergence == pytest.approx(abs(truth), abs=0.03)  # across the parcels
    assert found.convergence < TURNED
    assert f"{found.convergence:.2g} degrees" in found.notes[-1]
    turned = _sited("Madrid", "EPSG:4258", "equal-area")
    assert turned.convergence > TURNED
    assert "off true north by" in turned.warnings[-1]


@pytest.mark.slow
def test_a_change_of_datum_is_told():
    """With its size, by swisstopo's shifts; the notes of a check name the recommended CRS, and the convergence, too."""
    basel = parcels("Basel", "EPSG:4326")
    found = projdist.check(basel, "EPSG:3857", authorities=["EPSG"])
    assert found.recommended.projection.definition == "EPSG:2056"
    assert found.notes[0].startswith(f"EPSG:2056: {CHANGED} CH1903+: coordinates of the same place")
    assert "171 m, to 1 m." in found.notes[0]
    assert "degrees in the data (RMS)" in found.notes[1]
    with pytest.warns(Notice, match=rf"^EPSG:2056: {CHANGED} CH1903\+: .* differ by 171 m"):
        assert estimate_crs(basel, authorities=["EPSG"]).to_epsg() == 2056


def candidate(code, area_name, value=1.0):
    usual = {"same": (), "share": 1.0, "wide": False, "national": True, "since": 1989}
    return SimpleNamespace(code=code, codes=(code,), area_name=area_name, key=(value, 0.0), **usual)


def sited(monkeypatch, place, crs, answers, **options):
    """The CRS for a box about a place, when `ranked_crs` has these answers; and what it was asked."""
    ranked_crs = Mock(side_effect=[one if isinstance(one, Exception) else tuple(one) for one in answers])
    monkeypatch.setattr("projdist.decisions.data_checks.ranked_crs", ranked_crs)
    (west, east), (south, north) = corners = np.add.outer(PLACES[place], [-0.1, 0.1])
    found = crs_for_data(crs, Box(west, south, east, north), *corners, **options)
    return found, [call.kwargs for call in ranked_crs.call_args_list]


def test_where_a_crs_is_sought(monkeypatch):
    """On the data's datum first; among all where the registry has none of it, or nothing that serves."""
    german = candidate("EPSG:25832", "Germany - onshore.")
    found, asked = sited(monkeypatch, "Freiburg", "EPSG:4258", [[german]])
    assert (found.code, [one["datum"] for one in asked]) == ("EPSG:25832", ["ETRS89"])
    for answer in (ValueError("Invalid datum 'ETRS89'. None."), []):
        found, asked = sited(monkeypatch, "Freiburg", "EPSG:4258", [answer, [german]])
        assert (found.code, ["datum" in one for one in asked]) == ("EPSG:25832", [True, False])
    assert sited(monkeypatch, "Freiburg", "EPSG:4258", [[], []])[0] is None
    assert "datum" not in sited(monkeypatch, "Freiburg", "EPSG:4326", [[german]])[1][0]
    refuses("Invalid purpose", sited, monkeypatch, "Freiburg", "EPSG:4258", [ValueError("Invalid purpose.")])


def test_the_order_alone_takes_the_options_of_recommend():
    """`check` and `estimate_crs` pass any on, also those that make no difference to the order."""
    options = {"authorities": ["EPSG"], "codes": ["EPSG:2056", "EPSG:21781"], "limit": 1, "progress": Mock()}
    found = ranked_crs("box:7.5,46.5,8.5,47.5", custom=True, **options)
    assert [one.code for one in found] == ["EPSG:2056"]
    done, total = options["progress"].call_args.args
    assert done == total
    with pytest.raises(TypeError, match=r"^got an unexpected keyword argument 'year'"):
        ranked_crs("box:7.5,46.5,8.5,47.5", year=2026)


@pytest.mark.slow
def test_the_best_of_the_country(monkeypatch):
    """The first may be of the country beside, whose box reaches there; where there is nothing else it is said."""
    french = candidate("EPSG:2154", "France - onshore.", value=0.5)
    german = candidate("EPSG:25832", "Germany - onshore.", value=5.0)
    for place, code in (("Freiburg", "EPSG:25832"), ("Colmar", "EPSG:2154")):
        assert sited(monkeypatch, place, "EPSG:4326", [[french, german]])[0].code == code
    foreign, _ = sited(monkeypatch, "Freiburg", "EPSG:4326", [[french]])
    said = "None was found for the country of the data; this one is for France - onshore."
    assert (foreign.code, foreign.foreign) == ("EPSG:2154", said)


def test_less_turned_maps_are_better(monkeypatch):
    """Where north is off by more than 3 degrees, the next less turned, if its figure is at most twice as large."""
    turned = candidate("EPSG:25830", "Europe.", value=1.0)
    for value, code in ((1.9, "EPSG:25832"), (2.1, "EPSG:25830")):
        upright = candidate("EPSG:25832", "Europe.", value=value)
        found, _ = sited(monkeypatch, "Freiburg", "EPSG:4258", [[turned, upright]])
        assert found.code == code
    # Eleven degrees from the meridian of zone 30.
    assert found.convergence == pytest.approx(np.sin(np.radians(47.97)) * 10.8, rel=0.02)
    assert "EPSG:25830: Its grid north" in found.warnings[0]


def frame(text):
    return geopandas.GeoSeries.from_wkt([text], crs="EPSG:4326")


@pytest.mark.slow
def test_fiji():
    """Islands on both sides of the antimeridian get Fiji's grid, and not a zone at Greenwich."""
    islands = frame(
        "MULTIPOLYGON(((177.2 -18.3,178.7 -18.3,178.7 -17.3,177.2 -17.3,177.2 -18.3)),"
        "((-180 -17,-179.8 -17,-179.8 -16.2,-180 -16.2,-180 -17)))"
    )
    with pytest.warns(Notice, match=rf"^EPSG:3460: {CHANGED} Fiji 1986: .* differ by 16.8 m"):
        assert estimate_crs(islands, authorities=["EPSG"]).to_epsg() == 3460


@pytest.mark.slow
def test_polygons_count_themselves():
    """Croatia, two arms: its official transverse Mercator map is the best; over their box, its conic would be."""
    north, south = "13.5 45.5,16.3 46.5,19.4 45.3,19 44.9,16 45.1,15.9 44.3", "18.5 42.4,17.5 42.8,14.5 44.5,13.5 45.5"
    croatia = frame(f"POLYGON(({north},{south}))")
    for shape, code in ((croatia, 3765), (croatia.envelope, 3766), (croatia.boundary, 3766)):
        assert estimate_crs(shape, authorities=["EPSG"]).to_epsg() == code


@pytest.mark.slow
def test_purpose():
    """Data in any CRS, and a purpose: the European Union's grid for its statistics."""
    places = frame("MULTIPOINT(6 47.5,15 55)").to_crs(25832)
    with pytest.warns(Notice, match=r"^EPSG:3035: Its grid north is off true north by 3\.\d degrees in the data"):
        assert estimate_crs(places, purpose="equal-area", authorities=["EPSG"]).to_epsg() == 3035


def test_refused():
    for text, crs, must in (("POINT(1 2)", None, "a CRS"), ("POINT EMPTY", "EPSG:4326", "a geometry")):
        data = geopandas.GeoSeries.from_wkt([text], crs=crs)
        refuses(rf"^Invalid data. It must have {must}", estimate_crs, data)
