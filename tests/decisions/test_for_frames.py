"""Recommendations for geopandas' frames."""

import pytest

from projdist import Notice
from projdist.decisions.data_checks import estimate_crs

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
