"""Animations of one map that flows into another."""

import functools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image
from refusals import refuses

from projdist import Projection, factors, get_measure, get_region, plots
from projdist.plots.morphs import Blend, Track, blend_of, eased, open_edges

R = 6371000.0


@functools.cache
def blend(first: str, second: str, region: str = "globe") -> Blend:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("projdist.surfaces.surface._GLOBE_STEP", 1.5)  # a sixth of the cells
        return blend_of(*map(Projection.from_user_input, (first, second)), get_region(region))


def areas(found: Blend, share: float) -> np.ndarray:
    """Signed areas of the triangles at a share of the way."""
    a, b, c = np.moveaxis(found.at(share, found.vertices)[found.triangles], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


@pytest.mark.slow
def test_both_ends_are_the_maps() -> None:
    """As they are, also where the second is turned for the way: they lie 150 degrees apart."""
    found = blend(f"+proj=stere +lat_0=90 +R={R}", f"+proj=aeqd +lat_0=90 +lon_0=150 +R={R}", "box:-180,30,180,89")
    assert abs(np.degrees(found.turn)) == pytest.approx(150.0, abs=1.0)
    for share, track in ((0.0, found.vertices.first), (1.0, found.vertices.second)):
        np.testing.assert_allclose(found.at(share, found.vertices), track, atol=1e-6)
    # Azimuthal maps would fall into a point half way, were they not turned.
    sizes = [np.abs(areas(found, share)).sum() for share in (0.0, 0.5, 1.0)]
    assert min(sizes[0], sizes[2]) < sizes[1] < max(sizes[0], sizes[2])


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_jacobians_on_the_way_are_those_of_its_points(share: float) -> None:
    """Of linear maps points move linearly, too: where unit vectors come to are the columns of the Jacobian."""
    first, second = np.array([[2.0, 0.3], [-0.1, 1.0]]), np.array([[0.2, -1.5], [1.1, 0.4]])
    nothing = dict.fromkeys("maps region vertices weights triangles edges graticule coast".split())
    found = Blend(jacobians=(first[None], second[None]), turn=np.radians(70.0), **nothing)
    J = found.values(share, lambda matrices: matrices)
    np.testing.assert_allclose(J[0].T, found.at(share, Track(first.T, second.T)), rtol=0, atol=1e-12)
    if share in (0.0, 1.0):
        np.testing.assert_allclose(J[0], first if share == 0.0 else second, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_colours_are_of_the_map_on_the_way() -> None:
    """Half way from plate carree to Mercator k = 1 / cos(lat) and h = (1 + k) / 2 on a sphere."""
    found = blend(f"+proj=eqc +R={R}", f"+proj=merc +R={R}", "box:-60,-40,60,60")
    s, k = (found.values(0.5, get_measure(name))[np.unique(found.triangles)] for name in "sk")
    np.testing.assert_allclose(s, k * 0.5 * (1.0 + k), rtol=1e-8)
    assert k.max() <= factors(f"+proj=merc +R={R}", 0.0, [-40.0, 60.0]).k.max() + 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [("igh", "winkel-tripel"), ("moll", "igh")])
def test_it_is_cut_where_either_is(first: str, second: str) -> None:
    """No triangle reaches across a cut of either map: all keep their side up, but for slivers."""
    found = blend(first, second)
    for share in (0.0, 0.3, 1.0):
        sizes = areas(found, share)
        side = np.sign(np.median(sizes))
        assert (np.clip(-side * sizes, 0.0, None)).sum() < 1e-4 * np.abs(sizes).sum()


def length(segments: np.ndarray) -> float:
    return float(np.hypot(*np.diff(segments, axis=1)[:, 0].T).sum())


@pytest.mark.slow
def test_cuts_close() -> None:
    """The interruptions of Goode's map are no lines on Winkel's: what is left is its rim."""
    found = blend("igh", "winkel-tripel")
    winkel, goode = found.vertices.second, found.vertices.first
    lengths = []
    for edges in (found.edges, open_edges(winkel, found.edges)):
        middle = np.abs(winkel[edges].mean(axis=1))
        lengths.append(length(winkel[edges[(middle < [0.5, 0.8] * middle.max(axis=0)).all(axis=1)]]))
    assert lengths[1] < 0.02 * lengths[0]
    # On Goode's map itself they are open.
    assert length(goode[open_edges(goode, found.edges)]) > 0.9 * length(goode[found.edges])
    # Where a pole that is a line shrinks to a point, its edges are no measure of gaps, and the rim is the rim, at once:
    # an ellipse with half axes of 2 and 1 has a circumference of 9.68845, Mollweide's is sqrt(2) R times as large.
    found = blend("robin", "moll")
    xy = found.at(1.0, found.vertices)
    rim = length(xy[open_edges(xy, found.edges)])
    assert rim == pytest.approx(9.68845 * np.sqrt(2.0) * 6378137.0, rel=0.02)


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_a_film(tmp_path: Path) -> None:
    """There and back for ever, a rest at both ends, and small; progress is told."""
    told: list[tuple[int, int]] = []
    options = {"region": "box:0,0,60,60", "frames": 4, "seconds": 3.0, "size": (3, 3), "dpi": 40}
    path = plots.morph("robin", "moll", tmp_path / "a.gif", progress=lambda *step: told.append(step), **options)
    assert told == [(k, 4) for k in range(1, 5)]
    with Image.open(path) as image:
        assert (image.size, image.n_frames, image.info["loop"]) == ((120, 120), 6, 0)
        frames, durations = [], []
        for k in range(6):
            image.seek(k)
            durations.append(image.info["duration"])
            frames.append(np.asarray(image.convert("RGB"), dtype=int))
    assert durations == [800, 500, 500, 800, 500, 500]
    np.testing.assert_array_equal(frames[1:3], frames[5:3:-1])
    assert np.abs(frames[3] - frames[0]).max() > 50
    with pytest.raises(FileExistsError):
        plots.morph("robin", "moll", path, region="box:0,0,60,60", frames=2, overwrite=False)


@pytest.mark.usefixtures("few_cells")
@pytest.mark.skipif(not FFMpegWriter.isAvailable(), reason="ffmpeg is not installed")
def test_a_film_by_ffmpeg(tmp_path: Path) -> None:
    """A file of MPEG-4 with H.264, of even sizes, as players want it."""
    path = plots.morph("robin", "moll", tmp_path / "a.mp4", region="box:0,0,60,60", frames=3, size=(3.03, 3.05), dpi=50)
    assert (path.read_bytes()[4:8], b"avc1" in path.read_bytes()) == (b"ftyp", True)


def test_films_begin_and_end_slowly(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first and the last step are the least; without ffmpeg an .mp4 is refused in one line."""
    steps = np.diff(eased(11))
    assert steps.sum() == pytest.approx(1.0)
    assert (np.diff(steps)[:4] > 0).all()
    np.testing.assert_allclose(steps, steps[::-1])
    refuses(
        r"^Invalid size '1,0\.5'\. It has no room for an animation\.$",
        plots.morph,
        "robin",
        "moll",
        "a.gif",
        size=(1, 0.5),
    )
    monkeypatch.setattr("projdist.plots.morphs.FFMpegWriter.isAvailable", lambda: False)
    refuses(
        r"Invalid animation 'a\.mp4'\. An \.mp4 needs ffmpeg, which is not found", plots.morph, "robin", "moll", "a.mp4"
    )
