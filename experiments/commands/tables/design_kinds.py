"""Designs by the names of their kinds."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import doe
from doe import Design, Factor, Mixture
from experiments.io.errors import InputError
from experiments.io.texts import nearest_name

KINDS: dict[str, Callable[..., Design]] = {
    "plackett-burman": doe.plackett_burman,
    "definitive-screening": doe.definitive_screening,
    "full-factorial": doe.full_factorial,
    "fractional-factorial": doe.fractional_factorial,
    "central-composite": doe.central_composite,
    "box-behnken": doe.box_behnken,
    "optimal": doe.optimal_design,
    "latin-hypercube": doe.latin_hypercube,
    "sobol": doe.sobol,
}
"""Designs of factors."""

MIXTURES: dict[str, Callable[..., Mixture]] = {
    "simplex-lattice": doe.simplex_lattice,
    "simplex-centroid": doe.simplex_centroid,
}
"""Designs of components, whose shares add up to 1."""

ADDITIONS: dict[str, Callable[..., Design]] = {
    "foldover": doe.foldover,
    "axial": doe.add_axial,
    "center": doe.add_center,
}
"""Runs added to a table of runs."""

NAMES = (*KINDS, *MIXTURES, *ADDITIONS)
SEED = 1


def make_design(
    kind: str, factors: Sequence[Factor], components: Sequence[str], before: Design | None,
    options: Mapping[str, Any],
) -> Design | Mixture:  # fmt: skip
    """Return the design of a kind.

    Parameters
    ----------
    kind : str
        One of ``NAMES``.
    factors, components, before
        What the kind is made of: factors, components of a mixture, or the design of a table.
    options : mapping
        By the names of the kind's function; those that are None are not given.

    Raises
    ------
    InputError
        An unknown kind, an option that the kind does not have, or nothing to make it of.
    """
    if kind not in NAMES:
        raise InputError("KIND", f"must be a kind of design; {nearest_name(kind, list(NAMES))}", kind)
    makers: tuple[tuple[Mapping[str, Callable[..., Any]], Any, str], ...] = (
        (KINDS, factors, "--factor"),
        (MIXTURES, components, "--component"),
        (ADDITIONS, before, "--table"),
    )
    table, subject, place = next(row for row in makers if kind in row[0])
    if not subject:
        raise InputError(place, f"is needed by {kind}")
    return table[kind](subject, **_options(kind, table[kind], options))


def _options(kind: str, make: Callable[..., Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that were given, by the names of the kind's function."""
    known = inspect.signature(make).parameters
    options = {name: value for name, value in given.items() if value is not None}
    if "center" in options and "count" in known:
        options["count"] = options.pop("center")
    for name in options.keys() - known.keys() - {"seed"}:
        has = ", ".join(f"--{each}" for each in given if each in known) or "none"
        raise InputError(f"--{name}", f"{kind} has no such option; it has {has}", options[name])
    for name, parameter in known.items():
        if parameter.default is parameter.empty and name in given and name not in options and name != "seed":
            raise InputError(f"--{name}", f"is needed by {kind}")
    seeded = {"seed": options.get("seed", SEED)} if "seed" in known else {}
    return {name: value for name, value in options.items() if name in known} | seeded
