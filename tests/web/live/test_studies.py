"""What is said of maps on the page: what a design gains, and which features are worst."""

import json
from types import SimpleNamespace

import pytest

from projdist.projections import Projection
from projdist.regions import get_region
from projdist.web.live.handlers import checked, designed


def test_a_design_is_told_beside_its_best_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of several; and beside none where there is none."""
    made = {"proj": "+proj=horner", "degree": 3, "base": SimpleNamespace(label="laea"), "notes": (), "error": 1e-9}
    for values, before in (((0.02, 0.01, 0.03), 0.01), ((), None)):
        found = SimpleNamespace(**made, value=0.005, rivals=[SimpleNamespace(value=value) for value in values])
        monkeypatch.setattr("projdist.designs.design", lambda *_, found=found, **__: found)
        told = designed(get_region("cap:0,0,100"), {}, lambda *_: None)
        assert (told["before"], told["after"], told["words"]) == (before, 0.005, "Degree 3 on laea.")


def test_the_worst_features_come_first() -> None:
    """Of squares on Mercator's map, where areas grow by 1 / cos^2 of the latitude."""
    pytest.importorskip("geopandas")
    features = [
        {
            "type": "Feature",
            "properties": {"name": f"{lat} N"},
            "geometry": {
                "type": "Polygon",
                "coordinates": [[[0, lat], [1, lat], [1, lat + 1], [0, lat + 1], [0, lat]]],
            },
        }
        for lat in (30, 60, 0, 45)
    ]
    file = json.dumps({"type": "FeatureCollection", "features": features}).encode()
    found, lines = checked(Projection.from_user_input("+proj=merc +ellps=WGS84"), file)
    assert [row["name"] for row in found["rows"]] == ["60 N", "45 N", "30 N", "0 N"]
    assert lines["points"][::5, 1].tolist() == [60.0, 45.0, 30.0, 0.0]
