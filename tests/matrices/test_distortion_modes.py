"""The modes of a distortion: sets whose components are known, laws, and maps in closed form."""

import numpy as np
import pytest
import scipy.linalg
from matrix_samples import cost, graded, random_matrices, random_orthogonal
from refusals import refuses
from tables import each

from projdist import mdt, modes, sample, summarize
from projdist.matrices.spd import factor_distance

SIZES = each("n", [1, 2, 3, 5])


def symmetric_basis(rng, n):
    """An orthonormal basis of the symmetric matrices, at random."""
    i, j = np.triu_indices(n)
    turned = random_orthogonal(rng, 1, len(i))[0] / np.where(i == j, 1.0, np.sqrt(2.0))
    E = np.zeros((len(i), n, n))
    E[:, i, j] = E[:, j, i] = turned
    return E


@SIZES
def test_components_that_are_known(n):
    """Matrices that are made of uncorrelated scores along orthonormal directions have these for their modes."""
    rng = np.random.default_rng(n)
    G, E = graded(n, 10.0), symmetric_basis(rng, n)
    d = len(E)
    sizes = 0.8 ** np.arange(d)
    # Each pair of scores is uncorrelated, and all have the mean 0: plus and minus along one direction at a time.
    Z = np.concatenate([sign * size * e[None] for e, size in zip(E, sizes, strict=True) for sign in (-1.0, 1.0)])
    found = modes(G @ scipy.linalg.expm(Z) @ random_orthogonal(rng, 2 * d, n))
    assert factor_distance(G, found.T) < 1e-13
    np.testing.assert_allclose(found.rms**2, sizes**2 / d, rtol=1e-10)
    np.testing.assert_allclose(found.shares, sizes**2 / (sizes**2).sum(), rtol=1e-10)
    assert found.shares.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(np.abs(np.einsum("kij,lij->kl", found.matrices, E)), np.eye(d), atol=1e-9)
    assert (np.abs(np.linalg.eigvalsh(found.matrices)).max(axis=1) <= np.linalg.eigvalsh(found.matrices)[:, -1]).all()


@SIZES
def test_scores(n):
    """Scores are uncorrelated, of the mean 0 and the RMS told; their squares add to Dist_F^2; those of T are 0."""
    rng = np.random.default_rng(n)
    A, w = random_matrices(rng, 40, n, 0.4), rng.uniform(size=40)
    found, mean = modes(A, w), mdt(A, w)
    scores = found.scores(A)
    np.testing.assert_allclose((scores**2).sum(axis=1), mean.distances, rtol=1e-10)
    np.testing.assert_allclose(np.average(scores, axis=0, weights=w), 0.0, atol=1e-13)
    products = np.einsum("i,ik,il->kl", w / w.sum(), scores, scores)
    np.testing.assert_allclose(products, np.diag(found.rms**2), atol=1e-13)
    assert (found.rms**2).sum() == pytest.approx(mean.cost, rel=1e-12)
    np.testing.assert_allclose(found.scores(found.T), 0.0, atol=1e-13)
    assert np.isnan(found.scores(np.zeros((2, n, n)))).all()


@each("n", [2, 3])
def test_laws(n):
    """Shares do not see a common matrix from the left, nor rotations from the right, nor units."""
    rng = np.random.default_rng(n)
    A, w, G = random_matrices(rng, 20, n, 0.4), rng.uniform(size=20), graded(n, 30.0)
    found = modes(A, w).shares
    for other in (G @ A, 1e3 * A, A @ random_orthogonal(rng, 20, n)):
        np.testing.assert_allclose(modes(other, w).shares, found, rtol=1e-9)
    # A lower triangular G keeps the frame in which the modes are described.
    np.testing.assert_allclose(modes(G @ A, w).matrices, modes(A, w).matrices, atol=1e-8)


def test_seen_from_elsewhere():
    """About a T of one's own the squares add to the mean square from there."""
    A, T = random_matrices(np.random.default_rng(2), 9, 3, 0.4), graded(3, 2.0)
    assert (modes(A, T=T).rms ** 2).sum() == pytest.approx(cost(T, A), rel=1e-12)


@each(("E", "words"), [
    (np.eye(2), "size"),
    (np.diag([1.0, 0.0]), "horizontal"),
    (np.diag([0.0, 1.0]), "vertical"),
    (np.diag([1.0, -1.0]), "shape"),
    (np.array([[0.0, 1.0], [1.0, 0.0]]), "shear"),
    (np.array([[np.cos(0.7), np.sin(0.7)], [np.sin(0.7), -np.cos(0.7)]]), "shape at 20°"),
    (np.outer(*2 * [[np.cos(0.5), np.sin(0.5)]]), "along 29°"),
    (np.diag([1.0, 0.5]), "horizontal 1, vertical 0.50"),
    (np.diag([0.3, -1.0]), "vertical 1, horizontal \N{MINUS SIGN}0.30"),
    (np.eye(3), "size"),
    (np.diag([1.0, 0.0, -1.0]), "x +0.7, z \N{MINUS SIGN}0.7"),
    (np.diag([1.0, 0, 0, 0]), "1 +1.0"),
])  # fmt: skip
def test_words(E, words):
    """What a mode is called, whatever its sign."""
    steps = np.array([-0.2, -0.1, 0.0, 0.1, 0.2])[:, None, None]
    assert [modes(scipy.linalg.expm(sign * steps * E)).words[0] for sign in (1, -1)] == [words] * 2


def test_nothing_distorted_and_wrong_input():
    """Equal matrices have modes without a share, and these are told in order; what is refused is so in a line."""
    one = np.eye(2)[None]
    refuses(r"^Invalid shape \(2, 3, 2, 2\) of matrices\. It must be \(N, n, n\)\.", modes, np.ones((2, 3, 2, 2)))
    refuses(r"^Invalid T of shape \(3, 3\)\. It must be an invertible matrix of shape", modes, one, T=np.eye(3))
    refuses(r"^Invalid shape \(3, 3\) of matrices\. It must be \(\.\.\., 2, 2\)\.", modes(one).scores, np.eye(3))
    found = modes(np.broadcast_to(np.diag([2.0, 3.0]), (4, 2, 2)))
    np.testing.assert_array_equal(found.shares, 0.0)
    assert sorted(found.words) == ["horizontal", "shear", "vertical"]
    assert found.to_dict()["modes"][0]["share"] == 0.0
    pytest.importorskip("pandas")
    assert len(found.to_frame()) == 3


@each(("name", "words", "rms"), [("mercator", "size", 0.5958740917), ("eqc", "horizontal", 0.421346611)])
def test_maps_of_one_mode(name, words, rms):
    """Mercator's map is wrong in size alone, the plate carree from west to east alone; the RMS is the whole error."""
    found = sample(name).modes
    assert found.words[0] == words
    assert found.shares[0] == pytest.approx(1.0, abs=1e-9)
    assert found.rms[0] == pytest.approx(rms, abs=1e-8)


def test_azimuthal_map():
    """About the centre of Lambert's azimuthal map shape and shear are turned into each other: half the error each."""
    # Where the distance is p from the centre, both scales are cos(p / 2) and its inverse. By the area of a cap of 60
    # degrees, even in s = sin^2(p / 2) from 0 to 1/4, the mean of 2 ln^2 cos(p / 2) is that of ln^2(1 - s) / 2.
    found = sample("+proj=laea +lat_0=90 +R=6371008.7714", "cap:0,90,6671.6959").modes  # a third of pi R
    np.testing.assert_allclose(found.shares, [0.5, 0.5, 0.0], atol=1e-6)
    u = 0.75  # the integral of ln^2 u is u ln^2 u - 2 u ln u + 2 u
    integral = 2.0 - (u * np.log(u) ** 2 - 2.0 * u * np.log(u) + 2.0 * u)
    assert (found.rms**2).sum() == pytest.approx(0.5 * integral / 0.25, rel=1e-4)  # of the sphere, a cap of WGS 84


def test_robinson():
    """Three quarters of Robinson's error lie from west to east, the rest is shear."""
    pytest.importorskip("pandas")
    found = summarize("robinson", modes=True)
    assert (found.modes.words[0][:10], found.modes.words[1]) == ("horizontal", "shear")
    np.testing.assert_allclose(found.modes.shares[:2], [0.73, 0.27], atol=0.005)
    assert np.sqrt((found.modes.rms**2).sum()) == pytest.approx(found.airy_kavrayskiy_affine, rel=1e-9)
    assert found.to_frame()["mode_2"][0] == "shear"
    assert summarize("robinson").modes is None
