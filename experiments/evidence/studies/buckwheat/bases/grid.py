"""Bases that are tried (``bases.toml``): every law with every clump and plate, and ways to read heaps."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

from pydantic import Field

from experiments.evidence.studies.buckwheat.sensitivity.variants import Variant
from experiments.io.errors import InputError
from experiments.io.texts import nearest_name
from experiments.studyfile.factor_section import merge
from experiments.studyfile.places import Places
from experiments.studyfile.schema import Section, validated
from imaging import FITS

_FILE = Path(__file__).with_name("bases.toml")


class Option(Section):
    """One law, clump, plate or estimator."""

    name: str
    title: str
    """It in words."""
    study: dict[str, Any] = Field(default_factory=dict)
    """Changes merged over the study file."""


class Grid(Section):
    """Options that every base is made of, in the order of the file."""

    law: tuple[Option, ...]
    clump: tuple[Option, ...]
    plate: tuple[Option, ...]
    estimator: tuple[Option, ...]
    """Named by a key of `imaging.FITS`; nothing is simulated anew for one."""


@dataclass(frozen=True)
class Base:
    """One law, clump and plate together."""

    law: Option
    clump: Option
    plate: Option

    @property
    def name(self) -> str:
        """Name of its file: those of its three options."""
        return "-".join(option.name for option in self.options)

    @property
    def options(self) -> tuple[Option, Option, Option]:
        """Its three options."""
        return self.law, self.clump, self.plate

    @property
    def variant(self) -> Variant:
        """It as a variant of the study."""
        study: dict[str, Any] = {}
        for option in self.options:
            study = merge(study, option.study)
        title = "; ".join(option.title for option in self.options)
        return Variant(name=self.name, group="base", title=title, study=study)


@cache
def grid() -> Grid:
    """Read the options."""
    text = _FILE.read_text(encoding="utf-8")
    read = validated(Grid, tomllib.loads(text), Places.read(_FILE, text))
    for estimator in read.estimator:
        if estimator.name not in FITS:
            raise InputError(
                str(_FILE), f"must be a fit, {nearest_name(estimator.name, list(FITS))}", estimator.name
            )
    return read


@cache
def bases() -> dict[str, Base]:
    """Every base by name, in the order in which they are simulated."""
    read = grid()
    every = (Base(*options) for options in product(read.law, read.clump, read.plate))
    return {base.name: base for base in every}


def chosen_bases(names: Iterable[str]) -> list[Base]:
    """Look bases up in the order of the grid; no names: all of them."""
    known, wanted = bases(), list(names)
    for name in wanted:
        if name not in known:
            raise InputError("--base", f"must name a base, {nearest_name(name, list(known))}", name)
    return [base for name, base in known.items() if name in wanted or not wanted]
