"""Entries name each sphere of a grain, and as many partners as the largest worlds have."""

import pytest

from dem_warp.entries import MAX_SPHERES_PER_GRAIN, max_partners, partner_bits


@pytest.mark.parametrize("spheres", [1, 2, 3, 9, 128, 129, MAX_SPHERES_PER_GRAIN])
def test_the_last_sphere_and_the_last_partner_come_back_from_an_entry(spheres: int) -> None:
    own, partner = spheres - 1, max_partners(spheres) - 1
    entry = own << partner_bits(spheres) | partner
    assert 0 <= entry < 2**31
    assert divmod(entry, max_partners(spheres)) == (own, partner)


def test_three_million_clumps_of_three_fit_into_a_world() -> None:
    assert max_partners(3) > 3 * 3_000_000
