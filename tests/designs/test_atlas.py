"""The regions of the atlas, and an entry of it against what is known of caps."""

import json
import math

import pytest

from projdist.decisions import WIDE_FACTOR
from projdist.designs import atlas_areas, measured_entry
from projdist.regions import get_region

CAP_KM = 300.0
MEAN_RADIUS_KM = 6371.0
OF_LIMIT = 0.02  # the Earth is no sphere, and a made map stops where degrees gain less than 1 %


@pytest.mark.slow
def test_every_region_once() -> None:
    areas = atlas_areas()
    assert len({(area.kind, area.title) for area in areas}) == len({area.text for area in areas}) == len(areas)
    kinds = [area.kind for area in areas]
    assert (kinds.count("country"), kinds.count("continent"), kinds.count("state")) == (240, 7, 56)


@pytest.mark.slow
def test_parts_make_the_whole() -> None:
    """A country's main part and those far away have its area; those of boxes lose or win nothing."""
    areas = atlas_areas()
    for main in (area for area in areas if area.text.endswith("@main") and area.kind == "country"):
        parts = [area for area in areas if area.kind == "part" and area.title.startswith(f"{main.title}, ")]
        together = sum(get_region(area.text).area_km2 for area in (main, *parts))
        assert together == pytest.approx(get_region(f"country:{main.title}@all").area_km2, rel=1e-9), main.title


@pytest.mark.slow
def test_an_entry() -> None:
    """Over a cap of radius r no map has less than r^2 / sqrt(192), no conformal one than sqrt(2) times that."""
    least = (CAP_KM / MEAN_RADIUS_KM) ** 2 / math.sqrt(192.0)
    entry = measured_entry(get_region(f"cap:10,50,{CAP_KM}"))
    for purpose, times in (("any", 1.0), ("conformal", math.sqrt(2.0))):
        found = entry["purposes"][purpose]
        assert found["limit"] == pytest.approx(times * least, rel=OF_LIMIT)
        assert found["made"]["airy_kavrayskiy"] == pytest.approx(times * least, rel=OF_LIMIT)
        assert found["custom"]["airy_kavrayskiy"] > (1.0 - OF_LIMIT) * times * least
        assert found["existing"]["airy_kavrayskiy"] >= found["custom"]["airy_kavrayskiy"]
    assert "conformal" in entry["purposes"]["conformal"]["existing"]["keeps"]
    assert "equal-area" in entry["purposes"]["equal-area"]["existing"]["keeps"]
    scale = entry["purposes"]["least scale error"]["existing"]["max_scale_error_ppm"]
    assert all(scale <= WIDE_FACTOR * one["existing"]["max_scale_error_ppm"] for one in entry["purposes"].values())
    assert json.loads(json.dumps(entry)) == entry
