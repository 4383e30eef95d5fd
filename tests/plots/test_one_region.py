"""All maps of a figure are of one region, which the figure names."""

import pytest

from projdist import plots


@pytest.fixture(autouse=True)
def few_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    """Words need no fine surface."""
    monkeypatch.setattr("projdist.surfaces.surface._REGION_NODES", 30)
    monkeypatch.setattr("projdist.surfaces.surface._GLOBE_STEP", 4.0)


@pytest.mark.parametrize("projections", ["EPSG:2056", ["EPSG:2056", "EPSG:2056"]])
def test_the_region_is_named(projections):
    """In the line of the ellipses, and in that of the colours."""
    area = "over 5.96°E to 10.49°E, 45.82°N to 47.81°N"
    tissot = plots.tissot_figure(projections, size=(3, 2))
    assert tissot.texts[-1].get_text().endswith(f", {area}")
    heatmap = plots.heatmap_figure(projections, size=(3, 2))
    assert heatmap.axes[-1].get_xlabel() == f"Fisher distortion, {area}"


def test_the_globe_is_not():
    """Nor where one CRS among others has an area of its own."""
    figure = plots.tissot_figure(["EPSG:3857", "robin"], size=(3, 2))
    assert "over" not in figure.texts[-1].get_text()
