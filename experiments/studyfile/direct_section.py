"""``[[direct]]``: a parameter that was measured by itself, on the bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, PlainValidator, model_validator

from doe import Sample, StatedValue
from experiments.grains.bench_readings import Formula, formula_of, read_columns
from experiments.io.errors import InputError, StudyError
from experiments.io.texts import nearest_name
from experiments.io.units import Quantity
from experiments.studyfile.campaign import Direct
from experiments.studyfile.factor_section import FactorSection
from experiments.studyfile.places import Places
from experiments.studyfile.schema import RawQuantity, Section, StudyFile
from experiments.studyfile.target_section import TargetSection

MODEL_SHARE = 0.05
"""Default of ``model_sd``, as a share of the value."""


def read_quantities(value: object) -> dict[str, tuple[Quantity, ...]]:
    """Read a quantity, a list of them, or a table of either by name; alone they have the name ``""``."""
    named = value if isinstance(value, Mapping) else {"": value}
    columns = {}
    for name, given in named.items():
        several = given if isinstance(given, Sequence) and not isinstance(given, str) else [given]
        columns[str(name)] = tuple(Quantity.parse(each) for each in several)
    if not columns or not all(columns.values()):
        raise ValueError("must have at least one reading")
    return columns


Quantities = Annotated[dict[str, tuple[Quantity, ...]], PlainValidator(read_quantities)]
"""Quantities by name, as written."""


class DirectSection(Section):
    """``[[direct]]``: a factor that was measured by itself; it takes part in the fit and needs no cases."""

    parameter: str
    """The factor's name, or a place that it varies, as ``contact.grain-wall.static_friction``."""
    by: Literal[
        "incline", "sledge", "rolling-start", "rolling-run", "rebound", "rebound-45", "pendulum", "value"
    ]
    """Method; ``dem-warp reading --help`` lists their quantities and formulas."""
    name: str | None = Field(default=None, pattern=r"^[A-Za-z_]\w*$", max_length=100)
    """Name in tables. Default: the factor and the method, as ``F_incline``."""
    file: StudyFile | None = None
    """Table of single readings: a CSV relative to the study, a column for each quantity of the method."""
    readings: Quantities | None = None
    """Single readings, instead of a file: a list; for several quantities a table of lists by name, in which
    one value alone holds for all readings."""
    mean: Quantities | None = None
    """Mean of the readings, instead of them; for several quantities a table of values by name."""
    sd: Quantities | None = None
    """Standard deviation of one reading, of each quantity that scatters. In a twin study without readings
    or a mean it is that of the parameter itself, and n readings are drawn around the hidden value."""
    n: int | None = Field(default=None, ge=1)
    """Number of readings; of 1 the sd is that of the instrument and counts as known."""
    model_sd: RawQuantity | None = None
    """Standard deviation by which the model's parameter may differ from that of the real surface. Default:
    5 % of the value."""

    @model_validator(mode="after")
    def _has_one_form(self) -> DirectSection:
        forms = [name for name in ("file", "readings", "mean") if getattr(self, name) is not None]
        summary = [name for name in ("sd", "n") if getattr(self, name) is not None]
        if len(forms) > 1 or not (forms or summary):
            raise ValueError(f"must have one of file, readings and mean, got {' and '.join(forms) or 'none'}")
        if forms in ([], ["mean"]) and len(summary) < 2:
            raise ValueError(f"{forms[0] if forms else 'readings that a twin study draws'} needs sd and n")
        if forms not in ([], ["mean"]) and summary:
            raise ValueError(f"{forms[0]} must not have {' and '.join(summary)}, which belong to mean")
        return self

    @property
    def is_drawn(self) -> bool:
        """True where a twin study draws the readings."""
        return self.file is None and self.readings is None and self.mean is None

    def direct(self, factor: FactorSection, hidden: float, rng: np.random.Generator) -> Direct:
        """Build the reading of a factor in its natural unit; ValueError where it is impossible.

        Where none was made it is drawn around the ``hidden`` value, from which the real surface differs.
        """
        if self.is_drawn:
            model_sd, sd = self._model_sd(factor, hidden), self._drawn_sd(factor)
            drawn = rng.normal(hidden + rng.normal(0.0, model_sd), sd, self.n)
            return self._direct(factor, Sample.of(drawn))
        formula, sample = self._sample(factor.dimension.name)
        keys = {path[-1] for path in factor.paths}
        if formula.parameter and keys != {formula.parameter}:
            raise ValueError(f"{self.by} measures a {formula.parameter}, not {', '.join(sorted(keys))}")
        size = factor.dimension.size(factor.unit)
        return self._direct(factor, type(sample)(sample.mean / size, sample.sd / size, sample.n))

    def _direct(self, factor: FactorSection, sample: Sample) -> Direct:
        least, most = factor.limits
        if not least <= sample.mean <= most:
            raise ValueError(
                f"must be within {least:g} and {most:g} {factor.unit}".rstrip() + f", got {sample.mean:.4g}"
            )
        name = self.name or f"{factor.name}_{self.by}".replace("-", "_")
        model_sd = self._model_sd(factor, sample.mean)
        return Direct(name, factor.name, sample, model_sd, self.by, factor.unit or "1")

    def _model_sd(self, factor: FactorSection, value: float) -> float:
        model_sd = MODEL_SHARE * abs(value) if self.model_sd is None else factor.natural(self.model_sd)
        if model_sd < 0.0:
            raise ValueError(f"model_sd must not be negative, got {model_sd:g}")
        return model_sd

    def _drawn_sd(self, factor: FactorSection) -> float:
        """Return the standard deviation of a reading that is drawn; ValueError where there is no scatter."""
        sd = (self.sd or {}).get("", ())
        if len(sd) != 1 or not (found := factor.natural(sd[0])) > 0.0 or (self.n or 0) < 2:
            raise ValueError("readings that a twin study draws need one sd, positive, and n of 2 or more")
        return found

    def _sample(self, dimension: str) -> tuple[Formula, Sample | StatedValue]:
        if self.mean is not None:
            formula = formula_of(self.by, self.mean)
            return formula, formula.of_means(self.mean, self.sd or {}, self.n or 0, dimension)
        columns = self.readings if self.file is None else read_columns(self.file, self.by)
        formula = formula_of(self.by, columns or {})
        return formula, formula.of_readings(columns or {}, dimension)


def build_direct(
    sections: Sequence[DirectSection],
    factors: Sequence[FactorSection],
    names: Sequence[str],
    places: Places,
    target: TargetSection | None = None,
    seed: int = 1,
) -> tuple[Direct, ...]:
    """Build the direct readings of a study, which has responses of these names.

    In a twin study readings that were not made are drawn around its hidden values by the seed. Raise
    StudyError where one is of no factor, is impossible, or has the name of another response.
    """
    known = {place: factor for factor in factors for place in (factor.name, *factor.parameter)}
    taken, built = list(names), []
    twin = target.twin if target else None
    for index, section in enumerate(sections):
        place = places.of(("direct", index))
        if section.parameter not in known:
            rule = (
                f"must be a factor or a place that one varies, {nearest_name(section.parameter, list(known))}"
            )
            hint = "A parameter that is no factor is exact: write its value in the study."
            raise StudyError(places.of(("direct", index, "parameter")), rule, section.parameter, hint)
        factor = known[section.parameter]
        try:
            if section.is_drawn and twin is None:
                raise ValueError("must have one of file, readings and mean: only a twin study draws readings")
            hidden = (twin.truth if twin else {}).get(factor.name, factor.factor().center)
            direct = section.direct(factor, hidden, np.random.default_rng((seed, index)))
        except InputError:
            raise
        except ValueError as error:
            raise StudyError(place, str(error)) from None
        if direct.name in taken:
            raise StudyError(place, "must have a name that no other response has", direct.name, "Set name.")
        taken.append(direct.name)
        built.append(direct)
    return tuple(built)
