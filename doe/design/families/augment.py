"""Further runs for a design: foldover, centers, axial points, joining; each addition is a block."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from doe.arguments import MOST, checked_count, checked_kind, checked_list, checked_number
from doe.design.design import Design, numbered
from doe.design.factors import Category, numeric_factors
from doe.errors import DesignError


def join(*designs: Design, blocks: Sequence | None = None) -> Design:
    """Return one design of the runs of several, renumbered from 1, the earlier ones first.

    Parameters
    ----------
    designs : Design
        Designs with the same factors in name, unit and order. If the ranges differ, the first design's coding
        holds.
    blocks : sequence, optional
        A label for each design, whose runs become a block. Default: 1, 2, ... Designs with blocks of their
        own keep those as ``label.block``.
    """
    for design in designs:
        checked_kind("design", design, Design)
    if len(designs) < 2:
        raise DesignError(f"designs must be two or more, got {len(designs)}")
    first = designs[0]
    labels = list(range(1, len(designs) + 1)) if blocks is None else checked_list("blocks", blocks)
    if len(labels) != len(designs) or len(set(labels)) < len(labels):
        raise DesignError(
            f"blocks must be a different label for each of {len(designs)} designs, got {labels}"
        )
    for design in designs[1:]:
        if design.names != first.names or [f.unit for f in design.factors] != [f.unit for f in first.factors]:
            raise DesignError(f"designs must have the same factors, got {first.names} and {design.names}")
    dummies = [name for name in first.dummies if all(name in design.dummies for design in designs)]
    tables: list[pd.DataFrame] = []
    blocked: list = []
    for label, design in zip(labels, designs, strict=True):
        tables.append(_recoded(design, first)[[*first.names, *dummies]])
        own = design.blocks
        blocked += [label] * len(design.coded) if own is None else [f"{label}.{block}" for block in own]
    table = numbered(pd.concat(tables, ignore_index=True))
    series = pd.Series(blocked, index=table.index)
    return Design(first.factors, table, first.seed, tuple(dummies), series)


def foldover(design: Design, factors: Sequence[str] | None = None) -> Design:
    """Return a two-level design with its mirror image as a second block.

    With every sign reversed, main effects of the whole are clear of interactions of two factors; with one
    factor's sign reversed, that factor and all its interactions are (Montgomery, Design and Analysis of
    Experiments, section 8.6).

    Parameters
    ----------
    design : Design
        Two-level design; center runs stay as they are.
    factors : names, optional
        Factors whose signs are reversed. Default: all, and the dummies.
    """
    checked_kind("design", design, Design)
    turned = (
        list(design.coded.columns)
        if factors is None
        else [design.factor(name).name for name in checked_list("factors", factors)]
    )
    if not turned:
        raise DesignError("factors must be one or more, got an empty list")
    many = [f.name for f in design.factors if isinstance(f, Category) and len(f.levels) > 2]
    if many:
        raise DesignError(f"a category of more than two levels has no mirror image: {many[0]!r}")
    mirrored = design.coded.copy()
    mirrored[turned] = -mirrored[turned] + 0.0
    return join(design, replace(design, coded=mirrored, notes=()), blocks=("original", "foldover"))


def add_center(design: Design, count: int) -> Design:
    """Return the design with center runs after its own (in every block, if it has blocks).

    They show curvature (``screen``) and give an error without replicates of the rest.
    """
    checked_kind("design", design, Design)
    numeric_factors(design.factors, "a center")
    count = checked_count("count, the number of center runs,", count, most=MOST)
    labels = (
        []
        if design.blocks is None
        else [label for label in dict.fromkeys(design.blocks) for _ in range(count)]
    )
    center = pd.DataFrame(0.0, index=range(len(labels) or count), columns=design.coded.columns)
    table = numbered(pd.concat([design.coded, center], ignore_index=True))
    blocks = None if design.blocks is None else pd.Series([*design.blocks, *labels], index=table.index)
    return replace(design, coded=table, blocks=blocks)


def add_axial(design: Design, alpha: float, center: int = 0) -> Design:
    """Return a two-level design that has run with axial points and centers as a second block.

    A factorial whose centers are off the plane becomes a central composite design.

    Parameters
    ----------
    alpha : float
        Coded distance of the axial points, positive.
    center : int
        Center runs in the new block.
    """
    checked_kind("design", design, Design)
    numeric_factors(design.factors, "an axial point")
    alpha = checked_number("alpha", alpha, above=0.0)
    center = checked_count("center", center, least=0, most=MOST)
    count = len(design.factors)
    coded = np.vstack([np.kron(np.eye(count), [[-alpha], [alpha]]), np.zeros((center, count))])
    axial = Design(design.factors, numbered(pd.DataFrame(coded, columns=design.names)))
    return join(replace(design, blocks=None), axial, blocks=("factorial", "axial"))


def _recoded(design: Design, like: Design) -> pd.DataFrame:
    """Return a design's runs in the coding of another one."""
    if design.factors == like.factors:
        return design.coded
    coded = {factor.name: factor.to_coded(design.natural[factor.name]) for factor in like.factors}
    return design.coded.assign(**coded)
