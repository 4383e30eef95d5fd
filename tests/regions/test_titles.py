"""Regions in words that people read."""

from tables import each

from projdist.earth import latitude_text, longitude_text
from projdist.regions import get_region, region_title


@each(
    ("text", "title"),
    [
        ("country:DE", "Germany (DE)"),
        ("country:Fiji", "Fiji (FJ)"),
        ("country:DE + country:AT", "Germany (DE) + Austria (AT)"),
        ("country:FR@all", "France (FR)"),
        ("country:NO@main", "Norway (NO), main part"),
        ("country:Somaliland", "Somaliland"),
        ("continent:North America", "North America"),
        ("state:california", "California (CA)"),
        ("state:WA + state:OR", "Washington (WA) + Oregon (OR)"),
        ("box:170,-20,-170,-10", "170°E to 170°W, 20°S to 10°S"),
        ("cap:2.35,48.85,50", "50 km around 48.85°N, 2.35°E"),
        ("globe", "globe"),
    ],
)
def test_titles(text: str, title: str) -> None:
    """Names with their codes, degrees with their hemispheres."""
    assert region_title(get_region(text)) == title


@each(
    ("value", "text"),
    [
        (10.0, "10°E"),
        (-10.5, "10°30′W"),
        (190.0, "170°W"),
        (180.0, "180°"),
        (-180.0, "180°"),
        (0.0, "0°"),
        (7 + 5 / 60 + 20 / 3600, "7°05′20″E"),
        (359 + 59.9999 / 60, "0°00′00.01″W"),
    ],
)
def test_longitudes(value: float, text: str) -> None:
    """With as many minutes and seconds as there are."""
    assert longitude_text(value, minutes=True) == text


def test_latitudes() -> None:
    """South below the equator, and decimals where no minutes are asked for."""
    assert latitude_text(-33.25) == "33.25°S"
    assert latitude_text(0.0, minutes=True) == "0°"
    assert latitude_text(51.5, minutes=True) == "51°30′N"
