"""The bank: runs over factors and mechanisms in every condition, made once.

Every data set is analysed from it. Its points are Sobol points. Those without a mechanism are run more than
once, so that the noise is known apart from the misfit of a polynomial; those with one vary its size together
with the factors.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from doe.discrepancy.emulation.kriged_parts import KrigedParts
from doe.discrepancy.problem.outcomes import Outcomes, Point
from doe.discrepancy.problem.settings import Settings
from doe.discrepancy.problem.space import MechanismRange, SearchSpace
from doe.errors import RuleError

LARGEST = 500_000_000
"""Largest size of the arrays of a bank that is read [bytes]."""

SURFACES = "base cubic, additions size times quadratic, rest squared exponential"
"""Form of the surfaces that kriged parts belong to."""

_PARTS = ("space", "observables", "theta", "mechanism", "size", "condition", "values", "reasons")
"""Arrays of every bank's file."""


def sobol_points(count: int, columns: int, seed: int) -> np.ndarray:
    """Return the first points of a scrambled Sobol sequence in the unit cube, (count, columns)."""
    sampler = qmc.Sobol(columns, seed=np.random.default_rng(seed))
    return np.asarray(sampler.random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count])


def bank_points(space: SearchSpace, settings: Settings, seed: int = 0) -> list[Point]:
    """Return the cases of a bank, in an order that never changes.

    They are (points x repeats + mechanisms x mechanism points) x conditions. The cases' own seeds follow from
    that of the points.
    """
    factors = len(space.factors)
    rows: list[tuple[np.ndarray, tuple[str, ...]]] = []
    for row in sobol_points(settings.bank_points, factors, seed):
        rows += [(2.0 * row - 1.0, ())] * settings.bank_repeats
    for number, name in enumerate(space.names, start=1):
        for row in sobol_points(settings.bank_mechanism_points, factors + 1, seed + number):
            rows.append((np.append(2.0 * row[:-1] - 1.0, row[-1]), (name,)))
    cases = [(row, names, condition) for row, names in rows for condition in space.conditions]
    seeds = np.random.SeedSequence(seed).generate_state(len(cases)) >> 1
    return [space.point(row, names, c, int(s)) for (row, names, c), s in zip(cases, seeds, strict=True)]


@dataclass(frozen=True, eq=False)
class Bank:
    """Finished runs of a bank as a table, one row for each case."""

    space: SearchSpace
    observables: tuple[str, ...]
    """Columns of the values."""
    theta: np.ndarray
    """Factors in coded units, (n, factors)."""
    mechanism: np.ndarray
    """Number of the mechanism in the space; -1 without one, (n,)."""
    coded_size: np.ndarray
    """Coded size of the mechanism; 0 without one, (n,)."""
    condition: np.ndarray
    """Number of the condition, (n,)."""
    values: np.ndarray
    """Observables in natural units; NaN in rows that failed, (n, observables)."""
    reasons: np.ndarray
    """Reason of each failed case, empty for the others, (n,)."""
    study: str = ""
    """Fingerprint of the simulated study; empty if unknown."""
    maker: Mapping[str, str] = field(default_factory=dict)
    """Description of the program that made the runs; empty if unknown."""
    kriged: KrigedParts | None = None
    """Kriged parts of its emulator; None before the first fit."""

    def __post_init__(self) -> None:
        if self.values.shape != (len(self.theta), len(self.observables)):
            rule = "must have a row per case and a column per observable"
            raise RuleError("Bank.values", rule, self.values.shape)
        self._check_columns()
        if not np.isfinite(self.values[self.finished]).all():
            raise RuleError("Bank.values", "must be finite wherever a case finished", "NaN")

    def _check_columns(self) -> None:
        rows = len(self.theta)
        space = self.space
        shapes = {
            "theta": (rows, len(space.factors)),
            **dict.fromkeys(("mechanism", "coded_size", "condition", "reasons"), (rows,)),
        }
        for name, shape in shapes.items():
            if (found := getattr(self, name).shape) != shape:
                raise RuleError(f"Bank.{name}", f"must have the shape {shape}", found)
        if rows == 0:
            raise RuleError("Bank.values", "must have at least one case", "no case")
        ranges = {"mechanism": (-1, len(space.names)), "condition": (0, len(space.conditions))}
        for name, (least, end) in ranges.items():
            numbers = getattr(self, name)
            if numbers.dtype.kind not in "iu" or not (least <= numbers.min() <= numbers.max() < end):
                raise RuleError(f"Bank.{name}", f"must be integers from {least} to {end - 1}", numbers.dtype)
        if not (np.isfinite(self.theta).all() and np.isfinite(self.coded_size).all()):
            raise RuleError("Bank.theta, Bank.coded_size", "must be finite", "NaN")
        if self.reasons.dtype.kind != "U":
            raise RuleError("Bank.reasons", "must be text", self.reasons.dtype)

    @cached_property
    def finished(self) -> np.ndarray:
        """True where a case has observables, (n,)."""
        return np.asarray(self.reasons == "")

    @cached_property
    def runs_sha256(self) -> str:
        """Hash of the data of an emulator, values as a file keeps them."""
        odd = [name in self.space.odd for name in self.observables]
        directed = [one.directed for one in self.space.mechanisms]
        text = json.dumps([SURFACES, len(self.space.conditions), odd, directed])
        numbers = (self.theta, self.mechanism, self.coded_size, self.condition, self.finished)
        kept = [np.asarray(array, dtype=np.float64).tobytes() for array in numbers]
        values = np.asarray(self.values, dtype=np.float32).tobytes()
        return hashlib.sha256(b"".join([text.encode(), *kept, values])).hexdigest()

    @property
    def known_parts(self) -> KrigedParts | None:
        """Kriged parts that were found from these runs; None if the runs changed, or before the first fit."""
        return self.kriged if self.kriged and self.kriged.runs == self.runs_sha256 else None

    def rows(self, condition: int, mechanism: int) -> np.ndarray:
        """Return the numbers of the finished cases of a condition with a mechanism (-1: without)."""
        return np.flatnonzero(self.finished & (self.condition == condition) & (self.mechanism == mechanism))

    def renamed(self, names: Mapping[str, str]) -> Bank:
        """Return the same bank with mechanisms renamed, by their names here."""
        mechanisms = tuple(replace(one, name=names.get(one.name, one.name)) for one in self.space.mechanisms)
        return replace(self, space=replace(self.space, mechanisms=mechanisms))

    def saturating(self, saturations: Mapping[str, float | None]) -> Bank:
        """Return the same runs, their sizes coded by other saturations, by the names of the mechanisms."""
        own = self.space.mechanisms
        others = tuple(replace(one, saturation=saturations.get(one.name, one.saturation)) for one in own)
        coded = self.coded_size.copy()
        for number, (one, other) in enumerate(zip(own, others, strict=True)):
            if one != other:
                rows = self.mechanism == number
                coded[rows] = [other.coded(one.natural(size)) for size in coded[rows]]
        return replace(self, space=replace(self.space, mechanisms=others), coded_size=coded)

    def save(self, path: Path) -> None:
        """Write the bank to one compressed .npz file."""
        np.savez_compressed(
            path,
            space=np.array(json.dumps(asdict(self.space))),
            observables=np.array(self.observables),
            theta=self.theta,
            mechanism=self.mechanism.astype(np.int16),
            size=self.coded_size,
            condition=self.condition.astype(np.int16),
            values=self.values.astype(np.float32),
            reasons=self.reasons,
            study=np.array(self.study),
            maker=np.array(json.dumps(dict(self.maker) or None)),
            kriged=np.empty(0) if self.kriged is None else self.kriged.table(),
            kriged_runs=np.array("" if self.kriged is None else self.kriged.runs),
        )


def load_bank(path: Path) -> Bank:
    """Read a bank that `Bank.save` wrote; raise RuleError for any other file."""
    try:
        columns = _read_columns(path)
        if missing := [name for name in _PARTS if name not in columns]:
            raise ValueError(f"an archive without {', '.join(missing)}")
        document = json.loads(str(columns.pop("space")))
        ranges = tuple(MechanismRange(**entry) for entry in document.pop("mechanisms"))
        space = SearchSpace(**{name: tuple(value) for name, value in document.items()}, mechanisms=ranges)
        names = tuple(str(name) for name in columns.pop("observables"))
        columns["values"] = columns["values"].astype(float)
        columns["coded_size"] = columns.pop("size")
        made_for = str(columns.pop("study", ""))
        made_by = json.loads(str(columns.pop("maker", "null"))) or {}
        table, runs = columns.pop("kriged", None), str(columns.pop("kriged_runs", ""))
        kriged = KrigedParts.from_table(runs, table) if runs else None
        return Bank(space, names, **columns, study=made_for, maker=made_by, kriged=kriged)
    except Exception as error:
        # the libraries raise errors of many kinds for a damaged file
        raise RuleError(str(path), "must be a bank that this program wrote", str(error)) from error


def _read_columns(path: Path) -> dict[str, Any]:
    """Return the arrays of a file by name, of at most the size of a bank, with their checksums verified."""
    if not path.is_file():
        raise ValueError("it is not a regular file")
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        # a damaged directory may end early, which zipfile does not notice
        if len(members) != int.from_bytes(path.read_bytes()[-12:-10], "little"):
            raise ValueError("its directory has another number of arrays than it states")
        if (size := sum(member.file_size for member in members)) > LARGEST:
            raise ValueError(f"arrays of {size:,} bytes, at most {LARGEST:,}")
        # whole, so that its checksum is verified
        content = {member.filename.removesuffix(".npy"): archive.read(member) for member in members}
    return {name: np.load(io.BytesIO(array), allow_pickle=False) for name, array in content.items()}


def make_bank(
    space: SearchSpace,
    observables: Sequence[str],
    points: Sequence[Point],
    outcomes: Outcomes,
    study: str = "",
    maker: Mapping[str, str] | None = None,
) -> Bank:
    """Return the bank of finished runs.

    Raises
    ------
    RuleError
        A point with two mechanisms.
    """
    if any(len(point.sizes) > 1 for point in points):
        raise RuleError("points of a bank", "must have at most one mechanism each", "two")
    names = space.names
    sizes = [point.sizes[0] if point.sizes else None for point in points]
    coded = [0.0 if entry is None else space.coded_size(*entry) for entry in sizes]
    return Bank(
        space,
        tuple(observables),
        theta=space.coded_theta(np.array([point.theta for point in points])),
        mechanism=np.array([-1 if entry is None else names.index(entry[0]) for entry in sizes]),
        coded_size=np.array(coded),
        condition=np.array([space.conditions.index(point.condition) for point in points]),
        values=np.asarray(outcomes.values, dtype=float),
        reasons=np.array(outcomes.reasons, dtype=np.str_),
        study=study,
        maker=maker or {},
    )
