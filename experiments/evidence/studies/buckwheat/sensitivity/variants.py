"""Variants of the study: what the paper does not say, changed one thing at a time (``variants.toml``)."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import Field

from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, planned_cases
from experiments.io.errors import InputError
from experiments.io.texts import nearest_name
from experiments.studyfile import Study, load_study
from experiments.studyfile.factor_section import merge
from experiments.studyfile.places import Places
from experiments.studyfile.schema import Section, validated

BASE = "base"
"""The study as written, which every variant is held against."""

_FILE = Path(__file__).with_name("variants.toml")


class Variant(Section):
    """One change of the study."""

    name: str
    group: str
    """Property that is varied, in words."""
    title: str
    """Its new value, in words."""
    candidate: bool = True
    """True for a variant as plausible as the base, False for a check of the numerics."""
    study: dict[str, Any] = Field(default_factory=dict)
    """Changes merged over the study file."""
    settings: dict[str, float] = Field(default_factory=dict)
    """Factors that have one value in all runs, in natural units."""

    @property
    def full_title(self) -> str:
        """Property that is varied and its new value, in words."""
        return f"{self.group}: {self.title}"

    def load_study(self, scale: str | None = None, modulus_scale: float | None = None) -> Study:
        """Load the buckwheat study with this change, its shear modulus divided as the variant says.

        Where it says nothing, `modulus_scale` does; None: the scale of the study.
        """
        softened = {} if modulus_scale is None else {"numerics": {"modulus_scale": modulus_scale}}
        return load_study(scale=scale, changes=merge(softened, self.study))

    def planned_cases(self, replicates: int) -> pd.DataFrame:
        """Lay out the 31 runs of the designs, each so many times."""
        return planned_cases(replicates, DESIGNS).assign(**self.settings)


class _Variants(Section):
    variant: tuple[Variant, ...]


@cache
def variants() -> dict[str, Variant]:
    """Every variant by name, most important first."""
    text = _FILE.read_text(encoding="utf-8")
    read = validated(_Variants, tomllib.loads(text), Places.read(_FILE, text))
    return {variant.name: variant for variant in read.variant}


def chosen_variants(names: Iterable[str]) -> list[Variant]:
    """Look variants up in the order of the file; no names: all of them."""
    known, wanted = variants(), list(names)
    for name in wanted:
        if name not in known:
            raise InputError("--variant", f"must name a variant, {nearest_name(name, list(known))}", name)
    return [variant for name, variant in known.items() if name in wanted or not wanted]
