"""Properties of random designs: orthogonality where it is claimed, and what must not change the analysis."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from doe import Design, Factor, Surface, box_behnken, central_composite, fit_surface

QUICK = settings(max_examples=4, deadline=None, derandomize=True)
SEEDS = st.integers(0, 2**16)


def factors(count: int) -> list[Factor]:
    return [Factor(f"x{number}", -1.0, 1.0) for number in range(count)]


def response_of(design: Design, seed: int, sd: float = 0.3) -> np.ndarray:
    """Return a quadratic of random coefficients and noise."""
    rng = np.random.default_rng(seed)
    x = design.points.to_numpy()
    second = x[:, :, None] * x[:, None, :]
    mean = (
        5.0
        + x @ rng.normal(size=x.shape[1])
        + np.einsum("nij,ij->n", second, rng.normal(size=second.shape[1:]))
    )
    return mean + rng.normal(scale=sd, size=len(x))


def sums(surface: Surface) -> np.ndarray:
    return surface.anova["sum_sq"].to_numpy()


@st.composite
def composites(draw) -> Design:
    count = draw(st.integers(2, 4))
    alpha = draw(st.sampled_from(["rotatable", "face", "spherical", "blocks"]))
    blocks = draw(st.sampled_from([1, 2]))
    return central_composite(factors(count), alpha, center=draw(st.integers(2, 4)), blocks=blocks)


@QUICK
@given(composites(), SEEDS)
def test_sums_of_squares_do_not_depend_on_the_order_of_rows(design, seed):
    response = response_of(design, seed)
    order = np.random.default_rng(seed).permutation(len(response))
    blocks = None if design.blocks is None else design.blocks.iloc[order]
    shuffled = Design(design.factors, design.coded.iloc[order], blocks=blocks)
    # The same projection with rows in another order: rounding.
    assert sums(fit_surface(shuffled, response[order])) == pytest.approx(
        sums(fit_surface(design, response)), rel=1e-8, abs=1e-9
    )


@QUICK
@given(composites(), SEEDS, st.floats(-1e3, 1e3), st.floats(1e-3, 1e3))
def test_sums_of_squares_do_not_depend_on_units(design, seed, zero, unit):
    response = response_of(design, seed)
    scaled = tuple(Factor(f.name, zero + unit * f.low, zero + unit * f.high) for f in design.factors)
    natural = Design(scaled, design.coded).natural
    block = None if design.blocks is None else "block"
    table = natural if block is None else natural.assign(block=design.blocks)
    again = Design.from_table(table, scaled, coded=False, block=block)
    # Coding loses the digits by which the zero is larger than the range.
    loss = 1e-8 * max(1.0, abs(zero) / unit)
    assert sums(fit_surface(again, response)) == pytest.approx(
        sums(fit_surface(design, response)), rel=loss, abs=loss
    )


@QUICK
@given(composites(), SEEDS, st.floats(1.2, 3.0), st.floats(-0.5, 0.5))
def test_the_model_does_not_depend_on_the_coding(design, seed, stretch, shift):
    """Other levels called -1 and +1 give the same model, residual, lack of fit and predictions."""
    response = response_of(design, seed)
    first = fit_surface(design, response)
    wide = tuple(Factor(f.name, shift - stretch, shift + stretch) for f in design.factors)
    table = design.natural if design.blocks is None else design.natural.assign(block=design.blocks)
    block = None if design.blocks is None else "block"
    second = fit_surface(Design.from_table(table, wide, coded=False, block=block), response)
    for row in ("model", "residual", "lack of fit", "pure error", "total"):
        ours, theirs = (surface.anova.loc[row, "sum_sq"] for surface in (first, second))
        assert ours == pytest.approx(theirs, rel=1e-7, abs=1e-8)
    point = {f.name: 0.3 for f in design.factors}
    ours, theirs = (surface.predict(point).to_numpy() for surface in (first, second))
    assert ours == pytest.approx(theirs, rel=1e-7, abs=1e-8)


@QUICK
@given(composites(), SEEDS)
def test_sums_of_squares_add_up(design, seed):
    surface = fit_surface(design, response_of(design, seed))
    table = surface.anova_by_order["sum_sq"]
    parts = table.drop(["lack of fit", "pure error", "total"]).sum()
    assert parts == pytest.approx(table["total"], rel=1e-10)
    assert table["lack of fit"] + table["pure error"] == pytest.approx(table["residual"], rel=1e-8)


@QUICK
@given(st.integers(3, 5), SEEDS, st.floats(-50.0, 50.0))
def test_a_shift_between_orthogonal_blocks_changes_nothing_else(count, seed, shift):
    design = (
        box_behnken(factors(count), blocks=True)
        if count > 3
        else central_composite(factors(3), "blocks", center=2, blocks=3)
    )
    response = response_of(design, seed)
    moved = response + shift * (design.blocks == design.blocks.iloc[0]).to_numpy()
    ours, theirs = fit_surface(design, moved), fit_surface(design, response)
    terms = ours.coded_coefficients.index[1:]
    assert ours.anova.loc[[*terms, "residual"], "sum_sq"].to_numpy() == pytest.approx(
        theirs.anova.loc[[*terms, "residual"], "sum_sq"].to_numpy(), rel=1e-8, abs=1e-9
    )
