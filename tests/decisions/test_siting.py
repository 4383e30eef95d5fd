"""A CRS for data and for frames: on their datum, for their country, with little convergence, and with messages."""

from types import SimpleNamespace

import numpy as np
import pyproj
import pytest
from shapely import box
from tables import each

import projdist
from projdist import Notice
from projdist.decisions.data_checks import TURNED, _turned, crs_for_data, estimate_crs
from projdist.projections import datum_transformation, keeps_datum
from projdist.regions import Box

geopandas = pytest.importorskip("geopandas")

# What is there, by any atlas: the country of each place.
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


# ---- datums ---------------------------------------------------------------------------------


BESSEL, CLARKE = (6377397.155, 1 / 299.1528128), (6378249.2, 1 - 6356515 / 6378249.2)


def to_older(lon, lat, shift, ellipsoid):
    """Metres between a place on WGS 84 and on an older ellipsoid, whose middle lies at a shift: by hand, in space."""
    a, f = 6378137.0, 1 / 298.257223563
    turn, up = np.radians([lon, lat])
    normal = a / np.sqrt(1 - f * (2 - f) * np.sin(up) ** 2)
    place = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), (1 - f) ** 2 * np.sin(up)]) * normal
    x, y, z = place - shift
    a, f = ellipsoid
    square, out, there = f * (2 - f), np.hypot(x, y), up
    for _ in range(20):
        normal = a / np.sqrt(1 - square * np.sin(there) ** 2)
        there = np.arctan2(z + square * normal * np.sin(there), out)
    meridian = a * (1 - square) / (1 - square * np.sin(there) ** 2) ** 1.5
    return np.hypot(meridian * (there - up), normal * np.cos(there) * (np.arctan2(y, x) - turn))


@each(("source", "target", "place", "metres", "accuracy"), [
    # CH1903+ to WGS 84 is a shift of 674.374, 15.056, 405.346 m (swisstopo).
    ("EPSG:4326", "EPSG:2056", "Basel", None, 1.0), ("EPSG:4326", "EPSG:25832", "Freiburg", 0.0, 0.1),
    ("EPSG:4326", "EPSG:2193", "Christchurch", 0.0, 1.0), ("EPSG:4230", "EPSG:4258", "Freiburg", 130.0, 10.0),
    ("EPSG:4258", "EPSG:31467", "Freiburg", 121.0, 3.0),
    pytest.param("EPSG:4267", "EPSG:4269", "Denver", 50.0, 15.0, marks=pytest.mark.slow),
])  # fmt: skip
def test_shifts(source, target, place, metres, accuracy):
    """A change of datum in metres: of geocentric shifts in closed form, else about what is published."""
    lon, lat = PLACES[place]
    found = datum_transformation(source, target, lon, lat)
    if metres is None:
        assert found.metres == pytest.approx(to_older(lon, lat, np.array([674.374, 15.056, 405.346]), BESSEL), abs=0.01)
    else:
        assert found.metres == pytest.approx(metres, abs=accuracy)
    assert "The datum changes from" in str(found)


def test_prime_meridians_are_no_change_of_datum():
    """From Paris, in grads, or from Greenwich, in degrees: what a change of datum moves is the same (IGN's shift)."""
    lon, lat = PLACES["Colmar"]
    paris, greenwich = (datum_transformation(source, "EPSG:4171", lon, lat) for source in ("EPSG:27572", "EPSG:4275"))
    back = datum_transformation("EPSG:4171", "EPSG:27572", lon, lat)
    assert greenwich.metres == pytest.approx(to_older(lon, lat, np.array([-168.0, -60.0, 320.0]), CLARKE), abs=5.0)
    assert paris.metres == pytest.approx(greenwich.metres, abs=0.01)
    assert back.metres == pytest.approx(greenwich.metres, abs=0.5)


def test_the_convergence_of_a_zone():
    """Near its meridian grid north is off by the difference of longitudes times the sine of the latitude."""
    found = _turned("EPSG:32632", np.array([8.99, 9.01, 9.02]), np.full(3, 50.0))
    assert found == pytest.approx(0.01 * np.sqrt(2.0) * np.sin(np.radians(50.0)), rel=1e-4)


def test_no_shift_is_no_ballpark():
    """What PROJ knows no way for is not known, and not 0; one datum is no change."""
    assert datum_transformation("EPSG:4258", "EPSG:25832", 8.0, 48.0) is None
    assert keeps_datum("EPSG:4258", "EPSG:3035")
    assert not keeps_datum("EPSG:4326", "EPSG:3035")
    odd = pyproj.CRS.from_user_input("+proj=longlat +ellps=intl +type=crs")
    found = datum_transformation(odd, "EPSG:25832", 8.0, 48.0)
    assert np.isnan(found.metres)
    assert str(found).endswith("by how much is not known to PROJ here.")


# ---- CRSs -----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("place", "crs", "datum"), [
    ("Freiburg", "EPSG:4258", "ETRS89"), ("Freiburg", "EPSG:25832", "ETRS89"), ("Freiburg", "EPSG:4230", "ED50"),
    ("Colmar", "EPSG:4258", "ETRS89"), ("Basel", "EPSG:4258", "ETRS89"), ("Oslo", "EPSG:4258", "ETRS89"),
    ("Utrecht", "EPSG:4258", "ETRS89"), ("Madrid", "EPSG:4258", "ETRS89"), ("Nairobi", "EPSG:4210", "Arc 1960"),
    ("Christchurch", "EPSG:4167", "NZGD2000"), ("Denver", "EPSG:4269", "NAD83"), ("Denver", "EPSG:4267", "NAD27"),
])  # fmt: skip
def test_data_keep_their_datum(place, crs, datum):
    """Data that state a datum get a CRS on it, without a word about any change; the box of its use holds the data."""
    found = estimate_crs(parcels(place, crs), authorities=["EPSG"])
    assert found.geodetic_crs.name == datum
    area, (lon, lat) = found.area_of_use, PLACES[place]
    assert area.west <= lon <= area.east
    assert area.south <= lat <= area.north


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "foreign"), [("Freiburg", ("France", "Switzerland")), ("Colmar", ("Germany", "Switzerland"))]
)
@pytest.mark.parametrize("purpose", ["any", "conformal"])
def test_data_keep_their_country(place, foreign, purpose):
    """Parcels in the Black Forest are not sent to France, those in Alsace not to Germany, though boxes overlap."""
    found = _sited(place, "EPSG:4326", purpose)
    name = pyproj.CRS(found.code).area_of_use.name
    assert not name.startswith(foreign)
    assert found.foreign == ""


def _sited(place, crs, purpose="any", **options):
    west, south, east, north = parcels(place, "EPSG:4326").total_bounds
    lon, lat = np.array([west, east, east, west]), np.array([south, south, north, north])
    return crs_for_data(crs, Box(west, south, east, north), lon, lat, purpose=purpose, authorities=["EPSG"], **options)


@pytest.mark.slow
def test_convergence_counts_and_is_told():
    """It is that of pyproj, as RMS; what is turned by more than three degrees is told."""
    found = _sited("Freiburg", "EPSG:4258")
    lon, lat = PLACES["Freiburg"]
    truth = pyproj.Proj(found.code).get_factors(lon, lat).meridian_convergence
    assert found.convergence == pytest.approx(abs(truth), abs=0.03)  # across the parcels
    assert found.convergence < TURNED
    assert f"{found.convergence:.2g} degrees" in found.notes[-1]
    turned = _sited("Madrid", "EPSG:4258", "equal-area")
    assert turned.convergence > TURNED
    assert "off true north by" in turned.warnings[-1]


@pytest.mark.slow
def test_check_tells_of_datum_and_north():
    """The notes name the recommended CRS, the change of datum with its size, and the convergence."""
    found = projdist.check(parcels("Basel", "EPSG:4326"), "EPSG:3857", authorities=["EPSG"])
    code = found.recommended.projection.definition
    assert code == "EPSG:2056"
    assert found.notes[0].startswith(
        "EPSG:2056: The datum changes from WGS 84 to CH1903+: coordinates of the same place"
    )
    assert "171 m, to 1 m." in found.notes[0]  # by swisstopo's three shifts, as above
    assert "degrees in the data (RMS)" in found.notes[1]


@pytest.mark.slow
def test_a_change_of_datum_is_told():
    """Data in longitudes and latitudes of WGS 84 may go to any datum, with a word where that is metres away."""
    with pytest.warns(Notice, match=r"^EPSG:2056: The datum changes from WGS 84 to CH1903\+: .* differ by 171 m"):
        assert estimate_crs(parcels("Basel", "EPSG:4326"), authorities=["EPSG"]).to_epsg() == 2056


def candidate(code, area_name, value=1.0, **others):
    """What is asked of a candidate."""
    usual = {"same": (), "share": 1.0, "wide": False, "national": True, "since": 1989}
    figures = usual | others
    codes = (code, *(other for other, _ in figures["same"]))
    return SimpleNamespace(code=code, codes=codes, area_name=area_name, value=value, **figures)


def sited(monkeypatch, place, crs, answers, **options):
    """The CRS for a box about a place, when `recommend` has these answers; and what it was asked."""
    lon, lat = PLACES[place]
    asked, left = [], list(answers)

    def recommend(region, **words):
        asked.append(words)
        answer = left.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return SimpleNamespace(results=tuple(answer))

    monkeypatch.setattr("projdist.decisions.data_checks.recommend", recommend)
    corners = np.array([lon - 0.1, lon + 0.1]), np.array([lat - 0.1, lat + 0.1])
    return crs_for_data(crs, Box(lon - 0.1, lat - 0.1, lon + 0.1, lat + 0.1), *corners, **options), asked


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
    with pytest.raises(ValueError, match="Invalid purpose"):
        sited(monkeypatch, "Freiburg", "EPSG:4258", [ValueError("Invalid purpose.")])


@pytest.mark.slow
def test_the_best_of_the_country(monkeypatch):
    """The first may be of the country beside, whose box reaches there; where there is nothing else it is said."""
    french = candidate("EPSG:2154", "France - onshore.", value=0.5)
    german = candidate("EPSG:25832", "Germany - onshore.", value=5.0)
    assert sited(monkeypatch, "Freiburg", "EPSG:4326", [[french, german]])[0].code == "EPSG:25832"
    assert sited(monkeypatch, "Colmar", "EPSG:4326", [[french, german]])[0].code == "EPSG:2154"
    foreign, _ = sited(monkeypatch, "Freiburg", "EPSG:4326", [[french]])
    assert (foreign.code, foreign.foreign) == (
        "EPSG:2154",
        "None was found for the country of the data; this one is for France - onshore.",
    )


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


gpd = pytest.importorskip("geopandas")


@pytest.mark.slow
def test_fiji():
    """Islands on both sides of the antimeridian get Fiji's grid, and not a zone at Greenwich."""
    frame = gpd.GeoSeries.from_wkt(
        ["MULTIPOLYGON(((177.2 -18.3,178.7 -18.3,178.7 -17.3,177.2 -17.3,177.2 -18.3)),((-180 -17,-179.8 -17,"
         "-179.8 -16.2,-180 -16.2,-180 -17)))"],
        crs="EPSG:4326",
    )  # fmt: skip
    with pytest.warns(Notice, match=r"^EPSG:3460: The datum changes from WGS 84 to Fiji 1986: .* differ by 16.8 m"):
        assert estimate_crs(frame, authorities=["EPSG"]).to_epsg() == 3460


@pytest.mark.slow
def test_polygons_count_themselves():
    """Croatia, two arms: its official transverse Mercator map is the best; over their box, its conic would be."""
    croatia = gpd.GeoSeries.from_wkt(
        ["POLYGON((13.5 45.5,16.3 46.5,19.4 45.3,19 44.9,16 45.1,15.9 44.3,18.5 42.4,17.5 42.8,14.5 44.5,13.5 45.5))"],
        crs="EPSG:4326",
    )
    assert estimate_crs(croatia, authorities=["EPSG"]).to_epsg() == 3765
    assert estimate_crs(croatia.envelope, authorities=["EPSG"]).to_epsg() == 3766
    assert estimate_crs(croatia.boundary, authorities=["EPSG"]).to_epsg() == 3766


@pytest.mark.slow
def test_purpose():
    """Data in any CRS, and a purpose: the European Union's grid for its statistics."""
    frame = gpd.GeoDataFrame(geometry=gpd.points_from_xy([6.0, 15.0], [47.5, 55.0]), crs="EPSG:4326").to_crs(25832)
    with pytest.warns(Notice, match=r"^EPSG:3035: Its grid north is off true north by 3\.\d degrees in the data"):
        assert estimate_crs(frame, purpose="equal-area", authorities=["EPSG"]).to_epsg() == 3035


def test_refused():
    """Data without a CRS, or without geometry."""
    with pytest.raises(ValueError, match=r"^Invalid data. It must have a CRS"):
        estimate_crs(gpd.GeoSeries.from_wkt(["POINT(1 2)"]))
    with pytest.raises(ValueError, match=r"^Invalid data. It must have a geometry"):
        estimate_crs(gpd.GeoSeries.from_wkt(["POINT EMPTY"], crs="EPSG:4326"))
