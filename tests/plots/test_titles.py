"""Titles of pictures: every name as the literature prints it, codes with names, true minus signs."""

import numpy as np
import pytest
from tables import each

from projdist import plots
from projdist.plots.colours import level_labels
from projdist.plots.style import shortened, title_of, with_minus
from projdist.projections import NAMES, WORLD_MAPS, Projection
from projdist.projections.catalogue import TITLES

BOX = "box:-10,35,40,70"

# As Snyder & Voxland 1989, Snyder 1993, or who made the map print them.
PRINTED = {
    "van-der-grinten": "Van der Grinten I",
    "gall-peters": "Gall-Peters",
    "plate-carree": "Plate carrée",
    "winkel-tripel": "Winkel Tripel",
    "equal-earth": "Equal Earth",
    "eckert-4": "Eckert IV",
    "kavrayskiy-7": "Kavrayskiy VII",
    "mcbryde-thomas-flat-polar-quartic": "McBryde-Thomas flat-polar quartic",
    "+proj=vandg +R=6371000": "Van der Grinten I",
    "sinu": "Sinusoidal",
    "van-der-grinten@10,20": "Van der Grinten I, 10° N, 20° E",
    "EPSG:3035": "EPSG:3035 · ETRS89-extended / LAEA Europe",
    "esri:54030": "ESRI:54030 · World_Robinson",
}


def test_every_entry_of_the_catalogue_has_a_title() -> None:
    """And no title is without an entry; none is a name's letters made large."""
    assert set(TITLES) == {*NAMES, *WORLD_MAPS}
    assert all("-2" not in title and title[0].isupper() for title in TITLES.values())


@each("given", PRINTED)
def test_titles(given: str) -> None:
    """A picture has the title that people write."""
    assert title_of(Projection.from_user_input(given)) == PRINTED[given]


def test_long_titles() -> None:
    """A long name ends with a whole word and an ellipsis."""
    assert shortened("North Pole / Very Long Name of a Zone", 30) == "North Pole / Very Long Name…"
    title = title_of(Projection.from_user_input("EPSG:8692"))
    assert len(title) <= 64


@each(
    ("text", "printed"),
    [
        ("-0.5", "−0.5"),
        ("from -5 to -.5 m", "from −5 to −.5 m"),
        ("2e-05", "2e−05"),
        ("10-20", "10-20"),
        ("Eckert-4", "Eckert-4"),
        ("ETRS89-extended", "ETRS89-extended"),
    ],
)
def test_minus(text: str, printed: str) -> None:
    """A hyphen before a number that stands alone is a minus sign; others stay."""
    assert with_minus(text) == printed


def test_labels_have_minus_signs() -> None:
    """Of isolines and of colour bars."""
    assert level_labels(np.array([-1.0, -0.5, 0.0])) == ["−1", "−0.5", "0"]


@pytest.mark.slow
def test_a_picture_has_minus_signs() -> None:
    """The ticks of a convergence that goes both ways do."""
    figure = plots.heatmap_figure(
        "+proj=tmerc +lon_0=20 +R=6371000", measure="convergence", region=BOX, levels=[-20, 0]
    )
    figure.canvas.draw()
    assert [text.get_text() for text in figure.axes[-1].get_xticklabels()] == ["−20", "0"]
