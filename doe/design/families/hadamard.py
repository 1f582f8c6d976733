"""Matrices of orthogonal -1 and +1: Hadamard and conference matrices, and the published screening tables."""

import math

import numpy as np
from numpy.typing import NDArray

from doe.errors import DesignError

Matrix = NDArray[np.float64]

GENERATORS = {
    8: "+++-+--",
    12: "++-+++---+-",
    16: "++++-+-++--+---",
    20: "++--++++-+-+----++-",
    24: "+++++-+-++--++--+-+----",
    36: "-+-+++---+++++-+++--+----+-+-++--+-",
}
"""First rows of the cyclic designs (Plackett and Burman, Biometrika 33, 1946, p. 323)."""

BLOCKS_28 = (
    "+-++++----+---+--+++-+-++-+",
    "++-+++-----++--+---++++-++-",
    "-+++++---+---+--+-+-+-++-++",
    "---+-++++--+-+---++-+++-+-+",
    "---++-++++----++--++--++++-",
    "----+++++-+-+---+--+++-+-++",
    "+++---+-+--+--+-+-+-++-+++-",
    "+++---++-+--+----+++-++--++",
    "+++----++-+--+-+---++-+++-+",
)
"""First nine rows of the design in 28 runs, same source; its three blocks of columns are rotated in turn."""


def screening_matrix(runs: int, factor_count: int | None = None) -> Matrix:
    """Return the N x (N - 1) matrix of -1 and +1 with orthogonal, balanced columns and a last row of -1.

    It is the published table if there is one; else the Hadamard matrix, among those constructed here, in
    which the interactions of the first ``factor_count`` columns (default: all) coincide least
    (``worst_alias``).
    """
    if runs in GENERATORS:
        first = _signs(GENERATORS[runs])
        return np.vstack([*(np.roll(first, shift) for shift in range(runs - 1)), -np.ones(runs - 1)])
    if runs == 28:
        blocks = np.array([_signs(row) for row in BLOCKS_28])
        return np.vstack([*(np.roll(blocks, 9 * turn, axis=1) for turn in range(3)), -np.ones(27)])
    candidates = [_normalized(matrix) for matrix in hadamard_candidates(runs)]
    if not candidates:
        raise DesignError(
            f"runs must be a multiple of 4 with a known construction (92, 116 and few others lack one here), "
            f"got {runs}"
        )
    return min(candidates, key=lambda matrix: worst_alias(matrix[:, : factor_count or runs - 1]))


def worst_alias(columns: Matrix) -> float:
    """Return the largest absolute correlation of an interaction of two columns with a third one."""
    count = columns.shape[1]
    if count < 3:
        return 0.0
    worst = 0.0
    for place in range(count - 2):
        products = columns[:, place + 1 :] * columns[:, [place]]
        cross = np.abs(products.T @ columns[:, place + 1 :]) / len(columns)
        np.fill_diagonal(cross, 0.0)
        worst = max(worst, float(cross.max()))
    return worst


def constructible(runs: int) -> bool:
    """Return True if ``screening_matrix`` has this size."""
    return runs in GENERATORS or runs == 28 or bool(hadamard_candidates(runs))


def hadamard_candidates(order: int) -> list[Matrix]:
    """Return the Hadamard matrices of an order (H'H = order I) that can be constructed here.

    They are the two constructions from the squares of a finite field of q elements, with q a prime or the
    square of one (Paley, J. Math. Phys. 12, 1933), in orders q + 1 and 2 (q + 1), and doubling of the matrix
    of half the order (Sylvester 1867). The first column is that of the intercept. A doubled matrix and
    Paley's second have two halves of columns that differ in sign in half of the runs. Interactions within the
    second half coincide with the first, so it comes first, and the column that distinguishes the halves comes
    last: it holds n/2 - 1 interactions wholly or nearly so.
    """
    if order in (1, 2):
        return [np.array([[1.0, 1.0], [1.0, -1.0]])[:order, :order]]
    if order < 4 or order % 4:
        return []
    found = []
    if is_field(order - 1):
        matrix = np.ones((order, order))
        matrix[1:, 0] = -1.0
        matrix[1:, 1:] = residue_matrix(order - 1) + np.eye(order - 1)
        found.append(matrix)
    half = order // 2
    if (half - 1) % 4 == 1 and is_field(half - 1):
        core = conference_matrix(half)
        signs = np.array([[1.0, 1.0], [1.0, -1.0]])
        corner = np.kron(np.array([[1.0, -1.0], [-1.0, -1.0]]), np.eye(half))
        found += _orders(np.kron(signs, core) + corner)
    if half == 28 or half in GENERATORS:
        smaller = np.column_stack([np.ones(half), screening_matrix(half)])
        halves = [smaller]
    else:
        halves = hadamard_candidates(half)
    doubling = np.array([[1.0, 1.0], [1.0, -1.0]])
    return found + [matrix for smaller in halves for matrix in _orders(np.kron(doubling, smaller))]


def conference_matrix(order: int) -> Matrix:
    """Return C with a zero diagonal, -1 and +1 elsewhere, and C'C = (order - 1) I.

    It comes from the squares of a finite field (Paley 1933; Goethals and Seidel, Canad. J. Math. 19, 1967),
    or, where q = order - 1 is no prime or square of one, from doubling a skew one: [[S, S + I], [S - I, -S]].

    Raises DesignError: no construction is known here (orders 22 and 34 have no such matrix).
    """
    if order % 2 == 0 and order > 2 and is_field(order - 1):
        matrix = np.ones((order, order))
        matrix[0, 0] = 0.0
        matrix[1:, 0] = 1.0 if (order - 1) % 4 == 1 else -1.0
        matrix[1:, 1:] = residue_matrix(order - 1)
        return matrix
    if order % 8 == 0:
        skew, unit = conference_matrix(order // 2), np.eye(order // 2)
        return np.block([[skew, skew + unit], [skew - unit, -skew]])
    raise DesignError(f"no conference matrix of order {order} is constructed here")


def has_conference(order: int) -> bool:
    """Return True if ``conference_matrix`` has this order."""
    if order % 2 or order < 4:
        return False
    return is_field(order - 1) or (order % 8 == 0 and has_conference(order // 2))


def is_field(size: int) -> bool:
    """Return True if the size is an odd prime or the square of one."""
    root = math.isqrt(size)
    return size % 2 == 1 and (_is_prime(size) or (_is_prime(root) and root**2 == size))


def residue_matrix(size: int) -> Matrix:
    """Return Q with Q[i, j] = +1 if i - j is a square of the field, 0 if it is zero, else -1."""
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


def _orders(matrix: Matrix) -> list[Matrix]:
    """Return a matrix of two halves, the second's columns first and the one that distinguishes them last.

    The second order also moves the last column of either half back: in a half that was doubled itself it
    distinguished that one's halves.
    """
    half = len(matrix) // 2
    plain = [0, *range(half + 1, 2 * half), *range(1, half), half]
    careful = [0, *range(half + 1, 2 * half - 1), *range(1, half - 1), 2 * half - 1, half - 1, half]
    return [matrix[:, plain], matrix[:, careful]]


def _normalized(matrix: Matrix) -> Matrix:
    matrix = matrix * matrix[:, :1]  # a first column of ones is the intercept ...
    matrix = matrix * -matrix[-1]  # ... and then a last row of -1 is the run with every factor low
    return matrix[:, 1:]


def _signs(text: str) -> Matrix:
    return np.array([1.0 if sign == "+" else -1.0 for sign in text])


def _is_prime(number: int) -> bool:
    return number > 1 and all(number % divisor for divisor in range(2, math.isqrt(number) + 1))


def _square_character(prime: int) -> Matrix:
    """Return the Legendre symbols of 0 .. prime - 1."""
    character = -np.ones(prime)
    character[np.arange(1, prime) ** 2 % prime] = 1.0
    character[0] = 0.0
    return character
