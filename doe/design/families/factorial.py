"""Factorial designs: every combination of levels, and regular fractions of the two-level ones."""

import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from doe.arguments import MOST, checked_count, checked_list
from doe.design.design import Design, design_of_blocks
from doe.design.factors import Category, Factor, checked_factors, two_level_factors
from doe.design.families.aliases import alias_structure
from doe.design.families.blocking import block_labels
from doe.design.polynomial_terms import term_name
from doe.errors import DesignError

CATALOGUE: dict[int, dict[int, tuple[int, ...]]] = {
    4: {3: (3,)},
    8: {4: (7,), 5: (3, 5), 6: (3, 5, 6), 7: (3, 5, 6, 7)},
    16: {
        5: (15,), 6: (7, 11), 7: (7, 11, 13), 8: (7, 11, 13, 14), 9: (3, 5, 9, 14, 15),
        10: (3, 5, 6, 9, 14, 15), 11: (3, 5, 6, 9, 10, 13, 14), 12: (3, 5, 6, 9, 10, 13, 14, 15),
        13: (3, 5, 6, 7, 9, 10, 11, 12, 13),
        14: (3, 5, 6, 7, 9, 10, 11, 12, 13, 14), 15: (3, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15),
    },
    32: {
        6: (31,), 7: (7, 27), 8: (7, 11, 29), 9: (7, 11, 19, 29), 10: (7, 11, 19, 29, 30),
        11: (7, 11, 13, 19, 21, 25), 12: (7, 11, 13, 14, 19, 21, 25), 13: (7, 11, 13, 14, 19, 21, 22, 25),
        14: (7, 11, 13, 14, 19, 21, 22, 25, 26), 15: (7, 11, 13, 14, 19, 21, 22, 25, 26, 28),
        16: (7, 11, 13, 14, 19, 21, 22, 25, 26, 28, 31),
    },
    64: {
        7: (63,), 8: (15, 51), 9: (7, 27, 45), 10: (7, 27, 43, 53), 11: (7, 11, 29, 45, 51),
        12: (7, 11, 29, 45, 51, 62), 13: (7, 11, 21, 25, 38, 58, 60), 14: (7, 11, 19, 30, 37, 41, 49, 60),
        15: (7, 11, 19, 30, 37, 41, 49, 60, 63), 16: (7, 11, 13, 19, 21, 35, 37, 57, 58, 60),
    },
    128: {8: (127,), 9: (31, 103), 10: (31, 103, 43), 11: (31, 103, 43, 85), 12: (31, 103, 43, 85, 121)},
}  # fmt: skip
"""Generators of the fractions of least aberration by runs and factors: the bits of a number name the basic
factors whose product the further factor is, 7 = 4 + 2 + 1 = A:B:C (Chen, Sun and Wu, Int. Stat. Rev. 61,
1993, p. 131; 64 and 128 runs: Block and Mee, J. Qual. Technol. 37, 2005, p. 312)."""


def full_factorial(
    factors: Iterable[Factor],
    levels: int | Sequence[int] = 2,
    *,
    blocks: int = 1,
    center: int = 0,
    seed: int | None = None,
) -> Design:
    """Return every combination of the factors' levels, the first factor fastest.

    Parameters
    ----------
    factors : iterable of Factor
        Numbers or categories (all of whose levels are used).
    levels : int or one per factor
        Equally spaced levels of the numbers, with -1 and +1.
    blocks : int
        Blocks of equal size, for two-level designs: 2, 4, ...; they cost the interactions of most factors.
    center : int
        Runs at the center, in every block (numbers only).
    seed : int, optional
        Seed of the run order. Default: the standard order.
    """
    factors = checked_factors(factors)
    given = [levels] * len(factors) if isinstance(levels, int) else checked_list("levels", levels)
    counts = [checked_count("levels", count, least=2, most=MOST) for count in given]
    if len(counts) != len(factors):
        raise DesignError(f"levels must be two or more for each of {len(factors)} factors, got {levels}")
    grids = [
        np.array(factor.codes) if isinstance(factor, Category) else np.linspace(-1.0, 1.0, count)
        for factor, count in zip(factors, counts, strict=True)
    ]
    size = math.prod(len(grid) for grid in grids)
    if size > MOST:
        raise DesignError(f"a full factorial of {size} runs: take a fraction of it")
    coded = np.array(list(itertools.product(*grids[::-1])))[:, ::-1]
    return _with_blocks(factors, coded, blocks, center, seed)


def fractional_factorial(
    factors: Iterable[Factor],
    runs: int | None = None,
    *,
    resolution: int | None = None,
    generators: Sequence[str] | None = None,
    blocks: int = 1,
    center: int = 0,
    seed: int | None = None,
) -> Design:
    """Return a regular fraction of a two-level factorial design.

    Its ``notes`` give the generators and the resolution; ``alias_structure`` describes its aliases. pyDOE3
    1.6 has no table of the best fractions.

    Parameters
    ----------
    factors : iterable of Factor
        Numbers, or categories of two levels.
    runs : int, optional
        A power of two. Default: the smallest of the requested resolution.
    resolution : int, optional
        Least resolution. Default: 4 without ``runs``.
    generators : sequence of str, optional
        Further factors as products of the earlier ones, with a sign: ``["D = A:B:C", "E = -A:B"]``.
    blocks, center, seed
        As in ``full_factorial``.

    Raises
    ------
    DesignError
        No fraction of that size or resolution in the catalogue, an invalid generator, or a number of blocks
        that would cost a main effect.
    """
    factors = two_level_factors(factors, "a two-level fraction")
    names = [factor.name for factor in factors]
    if resolution is not None:
        resolution = checked_count("resolution", resolution, least=2)
    if generators is not None:
        coded, written = _generated(names, checked_list("generators", generators))
    else:
        if runs is not None:
            runs = checked_count("runs", runs, least=2)
        coded, written = _from_catalogue(names, runs, resolution)
    design = _with_blocks(factors, coded, blocks, center, seed)
    structure = alias_structure(design, order=1)
    if resolution is not None and structure.resolution < resolution:
        raise DesignError(
            f"a fraction of {len(coded)} runs in {len(names)} factors has resolution "
            f"{structure.resolution_text} here, asked for {resolution}"
        )
    notes = (f"generators {', '.join(written) or 'none'}", f"resolution {structure.resolution_text}")
    return Design(design.factors, design.coded, seed, blocks=design.blocks, notes=notes)


def basic_factorial(count: int) -> NDArray[np.float64]:
    """Return all corners of two-level factors, shape (2^count, count), the first one fastest."""
    return np.array(list(itertools.product([-1.0, 1.0], repeat=count)))[:, ::-1]


def _from_catalogue(
    names: list[str], runs: int | None, resolution: int | None
) -> tuple[NDArray[np.float64], list[str]]:
    count = len(names)
    if runs is None:
        wanted = 4 if resolution is None else resolution
        for size in (4, 8, 16, 32, 64, 128):
            if 2**count <= size:
                return basic_factorial(count), []
            if count in CATALOGUE[size]:
                coded, written = _from_catalogue(names, size, None)
                if _resolution(CATALOGUE[size][count], int(math.log2(size))) >= wanted:
                    return coded, written
        raise DesignError(
            f"no fraction of resolution {wanted} in {count} factors and up to 128 runs in the catalogue"
        )
    if runs == 2**count:
        return basic_factorial(count), []
    if count not in CATALOGUE.get(runs, {}):
        sizes = [size for size, table in CATALOGUE.items() if count in table]
        raise DesignError(
            f"{count} factors have fractions of {sizes or 'no'} runs in the catalogue, got {runs}; name "
            "the generators, or use plackett_burman"
        )
    basic = basic_factorial(int(math.log2(runs)))
    written, further = [], []
    for name, word in zip(names[basic.shape[1] :], CATALOGUE[runs][count], strict=True):
        bits = [bit for bit in range(basic.shape[1]) if word >> bit & 1]
        further.append(basic[:, bits].prod(axis=1))
        written.append(f"{name} = {term_name(tuple(names[bit] for bit in bits))}")
    return np.column_stack([basic, *further]), written


def _resolution(words: tuple[int, ...], basic: int) -> int:
    """Return the resolution of a fraction: the shortest of all products of its defining words."""
    defining = [word | 1 << (basic + place) for place, word in enumerate(words)]
    shortest = basic + len(words)
    for size in range(1, len(words) + 1):
        for chosen in itertools.combinations(defining, size):
            product = 0
            for word in chosen:
                product ^= word
            shortest = min(shortest, product.bit_count())
    return shortest


def _generated(names: list[str], generators: Sequence[str]) -> tuple[NDArray[np.float64], list[str]]:
    """Return the runs of a fraction whose last factors are products of the first ones."""
    basic_names = names[: len(names) - len(generators)]
    if not basic_names:
        raise DesignError(f"{len(generators)} generators leave no basic factor of {', '.join(names)}")
    basic = basic_factorial(len(basic_names))
    further: dict[str, NDArray[np.float64]] = {}
    for text in generators:
        if not isinstance(text, str):
            raise DesignError(f"a generator must be text such as 'D = A:B:C', got {text!r}")
        name, equal, word = (part.strip() for part in text.partition("="))
        parts = [part.strip() for part in word.lstrip("+-").split(":")]
        unknown = [part for part in parts if part not in basic_names]
        if not equal or name not in names[len(basic_names) :] or unknown or name in further:
            raise DesignError(
                f"a generator must give one of {', '.join(names[len(basic_names) :])} as a product of "
                f"{', '.join(basic_names)}, such as {names[-1]!r} = {':'.join(basic_names[:2])!r}, "
                f"got {text!r}"
            )
        sign = -1.0 if word.startswith("-") else 1.0
        further[name] = sign * basic[:, [basic_names.index(part) for part in parts]].prod(axis=1)
    columns = [further[name] for name in names[len(basic_names) :]]
    return np.column_stack([basic, *columns]), [" ".join(text.split()) for text in generators]


def _with_blocks(
    factors: tuple[Factor, ...], coded: NDArray[np.float64], blocks: int, center: int, seed: int | None
) -> Design:
    """Return the design of these runs, in blocks, each with its center runs."""
    center, blocks = checked_count("center", center, least=0, most=MOST), checked_count("blocks", blocks)
    if center and any(isinstance(factor, Category) for factor in factors):
        raise DesignError("a category has no center: choose center=0")
    labels = block_labels(coded, blocks)
    order = np.argsort(labels, kind="stable")
    parts = [
        np.vstack([coded[order][labels[order] == label], np.zeros((center, coded.shape[1]))])
        for label in range(1, blocks + 1)
    ]
    return design_of_blocks(factors, parts, seed)
