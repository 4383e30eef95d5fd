"""Regions from tables and files of points: what they stand for, and what is refused."""

import json
import math

import numpy as np
import pytest
from region_texts import refused

from projdist.answers.point_factors import factors
from projdist.answers.summaries import compare, summarize
from projdist.regions import PointSet, get_region

CSV = "name,lon,lat,weight,height\nA,2.35,48.85,2,35\nB,13.4,52.5,1,34\nC,-3.7,40.4,3,660\n\n"


def test_points(tmp_path):
    """The errors over points are weighted means of their factors; so are a measure's statistics."""
    path = tmp_path / "cities.csv"
    path.write_text(CSV)
    region = get_region(f"points:{path}")
    assert region.height.tolist() == [35, 34, 660]
    found = summarize("robin", region, measures=["omega"])
    at = factors("robin", region.lon, region.lat)
    square = np.average(np.log(at.a) ** 2 + np.log(at.b) ** 2, weights=[2, 1, 3])
    assert found.airy_kavrayskiy == pytest.approx(math.sqrt(square), rel=1e-12)
    assert found.error_estimate < 1e-10
    assert found.measures["omega"].mean == pytest.approx(np.average(at.omega, weights=[2, 1, 3]), rel=1e-12)
    assert found.measures["omega"].max == pytest.approx(at.omega.max(), rel=1e-15)
    assert found.measures["omega"].max_at == pytest.approx(
        (region.lon[at.omega.argmax()], region.lat[at.omega.argmax()])
    )
    assert compare(["robin"], region).to_dict()["region"] == {"name": f"points:{path}", "area_km2": 0.0, "points": 3}


def test_points_beyond_the_map(tmp_path):
    """Points that a map does not show are not covered, by their share of the weight."""
    points = PointSet(np.array([0.0, 10.0, 180.0]), np.zeros(3), np.array([1.0, 2.0, 1.0]))
    assert summarize("+proj=ortho", points).coverage == 0.75


@pytest.mark.slow
def test_points_combine(tmp_path):
    """Points may be chosen by regions, and stand on the left only."""
    path = tmp_path / "cities.csv"
    path.write_text(CSV.replace(",", ";"))
    assert get_region(f"points:{path} & country:DE").weight.tolist() == [1]
    assert get_region(f"points:{path} - country:DE").weight.tolist() == [2, 3]
    assert refused(f"points:{path} & country:JP").endswith("Nothing is left of it.")
    assert refused(f"land & points:{path}").endswith("Points can only stand on the left of & and -.")


def test_bounds_of_points():
    """The bounds of points hold them with a margin, and may cross the antimeridian."""
    west, _, east, _ = PointSet(np.array([179.0, -178.0]), np.array([0.0, 1.0]), np.ones(2)).bounds
    assert (west, east) == pytest.approx((178.85, 182.15))


def points_of(*coordinates):
    """Features of points as GeoJSON, without a geometry where there are no coordinates."""
    shapes = [None if one is None else {"type": "Point", "coordinates": one} for one in coordinates]
    features = [{"type": "Feature", "properties": {}, "geometry": shape} for shape in shapes]
    return json.dumps({"type": "FeatureCollection", "features": features})


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("p.csv", "name,lon,lat,weight,h\na,1,2,1,5\nb,,2,1,6\nc,3,NA,1,7\nd,4,5,2,8\ne,nan,5,2,9\n"),
        ("p.geojson", points_of([1, 2], None, [], [4, 5], None)),
    ],
)
def test_points_without_coordinates_are_left_out(file, text, tmp_path):
    """The others are read, and a note says how many are not."""
    (tmp_path / file).write_text(text)
    points = get_region(f"points:{tmp_path / file}")
    assert (points.lon.tolist(), points.lat.tolist()) == ([1.0, 4.0], [2.0, 5.0])
    assert points.notes == (f"{points.name}: 3 of 5 points have no longitude or no latitude, and are left out.",)
    if file.endswith(".csv"):
        assert (points.weight.tolist(), points.height.tolist()) == ([1.0, 2.0], [5.0, 8.0])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "It is empty."),
        ("x,y\n1,2\n", "Its header must have lon and lat; it has x, y."),
        ("lon,lat\n", "It has no points."),
        ("lon,lat\n1,2\n3,north\n", "Line 3 must have numbers for lon, lat."),
        ("lon,lat,weight\n1,2\n", "Line 2 must have numbers for lon, lat, weight."),
        ("lon,lat,name\n,2,a\n3,,b\n", "It has no points with a longitude and a latitude."),
        ("lon,lat,weight\n1,2,\n", "Line 2 must have numbers for lon, lat, weight."),
        ("lon,lat\n1,2\n8,5,47,a\n", "Line 3 has 4 cells; it must have 2."),
        (
            "lon,lat\n1,2\n8,5,47,3\n",
            "Line 3 has 4 cells; it must have 2. Decimal commas are read where all numbers have them and cells stand "
            "apart by semicolons, tabs or blanks.",
        ),
        (
            "lon;lat\n1.5;2\n8,5;47,3\n",
            "Line 3 must have numbers for lon, lat. Decimal commas are read where all numbers have them and cells "
            "stand apart by semicolons, tabs or blanks.",
        ),
        ("lon,lat\n1,2\n1_0,2\n", "Line 3 must have numbers for lon, lat."),
        (
            'lon,lat,name\n1,2,a\n3,4,"b\n5,6,c\n7,8,d"\n',
            "Line 3 has a quotation mark that does not end its cell on the line.",
        ),
        ("lon,lat,name\n1,2," + 200_000 * "a" + "\n", "Line 2 has a cell of more than 131072 letters."),
    ],
)
def test_wrong_points_files(tmp_path, text, reason):
    """A table without points is refused with the line that is wrong."""
    path = tmp_path / "points.csv"
    path.write_text(text)
    assert refused(f"points:{path}") == f"Invalid points file '{path}'. {reason}"


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("1,95,1", "Point 1 is at 1, 95; it must have a longitude within -360 and 360, a latitude within -90 and 90."),
        (
            "inf,5,1",
            "Point 1 is at inf, 5; it must have a longitude within -360 and 360, a latitude within -90 and 90.",
        ),
        ("1,5,-1", "Point 1 has the weight -1; it must be finite and not negative."),
        ("1,5,nan", "Point 1 has the weight nan; it must be finite and not negative."),
        ("1,5,0", "Their weights must not all be zero."),
    ],
)
def test_wrong_points(tmp_path, row, reason):
    """So are points off the Earth, and weights that are none."""
    path = tmp_path / "points.csv"
    path.write_text(f"lon,lat,weight\n{row}\n")
    assert refused(f"points:{path}") == f"Invalid points 'points:{path}'. {reason}"
