"""Wrong partners in clouds: they are named, and left out by robust fits; right ones are seldom named."""

import numpy as np
import pytest
from refusals import refuses

from projdist.applications.pointclouds import register


def noisy_clouds(rng, count, size, n, noise):
    """Affine images of one cloud with normal errors of their own, and the matrices."""
    base = rng.normal(size=(size, n))
    A = np.eye(n) + 0.3 * rng.normal(size=(count, n, n))
    return [(base + noise * rng.normal(size=base.shape)) @ one.T for one in A]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "size", "n", "noise"), [(2, 15, 2, 0.02), (3, 20, 3, 0.1), (2, 12, 2, 1e-12), (2, 15, 2, 0.0)]
)
def test_right_partners_are_seldom_named(count, size, n, noise):
    """Of clouds without wrong partners 5 % have a point named, whatever the noise; where there is none, hardly any."""
    rng = np.random.default_rng(8)
    sets, named = 200, 0
    for _ in range(sets):
        named += bool(register(noisy_clouds(rng, count, size, n, noise)).wrong)
    # The chance of more than 10 + 3.5 sqrt(9.5) of 200 at a rate of 5 % is 2 in 1000.
    assert named <= 21


@pytest.mark.parametrize("count", [2, 4])
def test_wrong_partners_are_named_and_left_out(count):
    """Exchanged rows are named, and no others; the robust fit is that without them."""
    rng = np.random.default_rng(3)
    clouds = noisy_clouds(rng, count, 40, 2, 0.01)
    exchanged = [4, 11, 17, 30]
    wrong = [cloud.copy() for cloud in clouds]
    wrong[1][exchanged] = wrong[1][np.roll(exchanged, 1)]
    told, robust = register(wrong), register(wrong, robust=True)
    for found in (told, robust):
        assert sorted(int(one.point) for one in found.wrong) == [5, 12, 18, 31]
        assert count == 2 or {one.cloud for one in found.wrong} == {"1"}
    assert "Wrong partners, which a robust fit leaves out" in told.warnings[0]
    assert robust.warnings[0].startswith("Left out as wrong partners (with a chance of 5 %")
    # Distances are those by the fit without the point, which the wrong ones do not draw to themselves.
    assert min(one.distance for one in robust.wrong) > 0.3
    assert {one.point for one in robust.worst[1][:4]} == {"5", "12", "18", "31"}
    without = [cloud.copy() for cloud in wrong]
    for one in robust.wrong:
        without[int(one.cloud)][int(one.point) - 1] = np.nan
    np.testing.assert_allclose(robust.matrices, register(without).matrices, atol=1e-12)
    assert robust.rms_total < 0.02 < told.rms_total
    assert robust.to_dict()["robust"] is True


def test_wrong_ids():
    """Points are named by their ids; a third of wrong ones is still found."""
    rng = np.random.default_rng(4)
    first, second = noisy_clouds(rng, 2, 30, 2, 0.01)
    ids = [f"p{k}" for k in range(30)]
    mixed = list(ids)
    mixed[:10] = [*ids[1:10], ids[0]]
    found = register([first, second], correspond="id", ids=[ids, mixed], robust=True)
    assert {one.point for one in found.wrong} == set(ids[:10])
    refuses(r"^Invalid robust with the correspondence icp\.", register, [first, second], correspond="icp", robust=True)
    refuses(r"^Invalid robust '1'\. It must be True or False\.", register, [first, second], robust=1)
