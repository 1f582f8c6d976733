"""Plackett-Burman designs: two-level screening in N = 4, 8, 12, ... runs, and the matrices behind them."""

import math
from collections.abc import Iterable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from doe.design import Design, numbered
from doe.errors import DesignError
from doe.factors import Factor, checked_factors

DEFAULT_RUNS = 12
"""Smallest default size: in 12 runs no interaction hides wholly in one factor's column."""

GENERATORS = {
    8: "+++-+--",
    12: "++-+++---+-",
    16: "++++-+-++--+---",
    20: "++--++++-+-+----++-",
    24: "+++++-+-++--++--+-+----",
}
"""First rows of the cyclic designs (Plackett and Burman, Biometrika 33, 1946, p. 323)."""


def plackett_burman(factors: Iterable[Factor], runs: int | None = None, seed: int | None = None) -> Design:
    """Return the Plackett-Burman design of the factors.

    Every column is orthogonal to every other. The factors take the first columns, the rest are dummies
    (``dummy1``, ...): what they estimate is error and interactions. Where N is a power of two, interactions
    of two factors fall wholly into single columns; otherwise they spread over many.

    Parameters
    ----------
    factors : iterable of Factor
    runs : int, optional
        A multiple of 4 above the number of factors; default 12, or the next size that holds them.
    seed : int, optional
        Seed of the run order; None keeps the standard order.

    Raises
    ------
    DesignError
        Too few runs for the factors, or a size for which no construction is known here.
    """
    factors = checked_factors(factors)
    if runs is None:
        runs = max(DEFAULT_RUNS, 4 * math.ceil((len(factors) + 1) / 4))
        while not _constructible(runs):
            runs += 4
    if runs < len(factors) + 1:
        raise DesignError(f"{len(factors)} factors need at least {len(factors) + 1} runs, received {runs}")
    matrix = screening_matrix(runs)
    names = [factor.name for factor in factors]
    dummies = tuple(f"dummy{number}" for number in range(1, runs - len(factors)))
    return Design(factors, numbered(pd.DataFrame(matrix, columns=[*names, *dummies])), seed, dummies)


def screening_matrix(runs: int) -> NDArray[np.floating]:
    """Return the N x (N - 1) matrix of -1 and +1 with orthogonal, balanced columns and a last row of -1.

    Cyclic shifts of the published generators where there is one, else a Hadamard matrix.
    """
    if runs in GENERATORS:
        first = np.array([1.0 if sign == "+" else -1.0 for sign in GENERATORS[runs]])
        shifts = [np.roll(first, shift) for shift in range(runs - 1)]
        return np.vstack([*shifts, -np.ones(runs - 1)])
    if not _constructible(runs):
        raise DesignError(
            f"runs must be a multiple of 4 with a known construction (92, 116 and few others lack one here), "
            f"received {runs}"
        )
    matrix = hadamard(runs)
    matrix = matrix * matrix[:, :1]  # a first column of ones is the intercept ...
    matrix = matrix * -matrix[-1]  # ... and then a last row of -1 is the run with every factor low
    return matrix[:, 1:]


def hadamard(order: int) -> NDArray[np.floating]:
    """Return a Hadamard matrix: entries -1 and +1, H'H = order * I.

    Doubling (Sylvester 1867) and the two constructions from the squares of a finite field of q elements, with
    q a prime or the square of a prime (Paley, J. Math. Phys. 12, 1933): order q + 1 and 2 (q + 1).
    """
    if order == 1:
        return np.ones((1, 1))
    if order == 2:
        return np.array([[1.0, 1.0], [1.0, -1.0]])
    if _is_field(order - 1) and order % 4 == 0:
        matrix = np.ones((order, order))
        matrix[1:, 0] = -1.0
        matrix[1:, 1:] = _residue_matrix(order - 1) + np.eye(order - 1)
        return matrix
    half = order // 2
    if _is_conference(order):
        conference = np.ones((half, half))
        conference[0, 0] = 0.0
        conference[1:, 1:] = _residue_matrix(half - 1)
        signs = np.array([[1.0, -1.0], [-1.0, -1.0]])
        return np.kron(conference, hadamard(2)) + np.kron(np.eye(half), signs)
    return np.kron(hadamard(half), hadamard(2))


def _constructible(order: int) -> bool:
    if order in (1, 2):
        return True
    if order < 4 or order % 4:
        return False
    return _is_field(order - 1) or _is_conference(order) or _constructible(order // 2)


def _is_conference(order: int) -> bool:
    """Whether Paley's second construction gives this order: 2 (q + 1) with q = 1 mod 4."""
    return order % 4 == 0 and (order // 2 - 1) % 4 == 1 and _is_field(order // 2 - 1)


def _is_field(size: int) -> bool:
    """Whether the size is an odd prime or the square of one."""
    return size % 2 == 1 and (
        _is_prime(size) or (_is_prime(math.isqrt(size)) and math.isqrt(size) ** 2 == size)
    )


def _is_prime(number: int) -> bool:
    return number > 1 and all(number % divisor for divisor in range(2, math.isqrt(number) + 1))


def _residue_matrix(size: int) -> NDArray[np.float64]:
    """Return Q with Q[i, j] = +1, -1 or 0 as element i - j of the field is a square, none, or zero."""
    if _is_prime(size):
        squares = _square_character(size)
        index = np.arange(size)
        return squares[(index[:, None] - index[None, :]) % size]
    prime = math.isqrt(size)
    squares = _square_character(prime)
    root = int(np.flatnonzero(squares == -1.0)[0])
    # In GF(p^2) = {a + b sqrt(root)} an element is a square when its norm a^2 - root b^2 is one in GF(p).
    a, b = np.divmod(np.arange(size), prime)
    real, other = a[:, None] - a[None, :], b[:, None] - b[None, :]
    return squares[(real**2 - root * other**2) % prime]


def _square_character(prime: int) -> NDArray[np.float64]:
    """Return the Legendre symbols of 0 .. prime - 1."""
    character = -np.ones(prime)
    character[np.arange(1, prime) ** 2 % prime] = 1.0
    character[0] = 0.0
    return character
