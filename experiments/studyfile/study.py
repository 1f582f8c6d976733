"""Studies: everything that a person configures, frozen, with typed setters.

`experiments.studyfile.loading` builds a study from its file. A setter returns another study.
"""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import Field, PrivateAttr, field_validator

from dem_warp import Case
from doe import Factor
from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.studyfile.campaign import TARGET_SCENE, CampaignSettings, Direct, FidelitySettings, Target
from experiments.studyfile.candidate_section import Candidate, CandidateSection, build_candidates
from experiments.studyfile.cluster_section import ClusterSection
from experiments.studyfile.conditions import BASE, Condition, Conditions, free_of
from experiments.studyfile.direct_section import DirectSection, build_direct
from experiments.studyfile.engine_section import EngineSection
from experiments.studyfile.factor_section import FactorSection, FactorTable, merge, natural_value
from experiments.studyfile.observables import Observable, measurable
from experiments.studyfile.physics import GrainCountError, Physics, Scene
from experiments.studyfile.places import KeyPath, Places, drop, nested, value_at
from experiments.studyfile.reserved_names import check_factor_names
from experiments.studyfile.scene_sections import SceneSection
from experiments.studyfile.schema import RawQuantity, Section, first_problem, validated
from experiments.studyfile.setters import changed, revised
from experiments.studyfile.solver_section import SolverSection
from experiments.studyfile.target_section import ResponseSection, TargetSection, build_target
from imaging import FITS


class MeasurementSection(Section):
    """``[measurement]``: the reading of an angle from a heap; only angles read the same way compare."""

    fit: str = "flank"
    """Part of the flank that the line is fitted to: flank (all of it), trimmed, middle, lower or upper."""
    azimuths: int = Field(default=8, ge=2, le=360)
    """Views of one heap, over half a turn."""
    pixels: int = Field(default=800, ge=50, le=4000)
    """Width of the heap in a view."""
    outline: bool = False
    """True: the heights of the outline are observables too, ``outline_1`` to ``outline_8``."""

    @property
    def settings(self) -> dict[str, Any]:
        """Settings by name, for keys and cards; without ``outline`` where it is off."""
        return self.model_dump(exclude=None if self.outline else {"outline"})

    @field_validator("fit")
    @classmethod
    def _is_known(cls, fit: str) -> str:
        if fit not in FITS:
            raise ValueError(f"must be one of {', '.join(FITS)}")
        return fit


class DiscoverSection(Section):
    """``[discover]``: the search for a missing effect; every part is optional."""

    mechanisms: tuple[str, ...] | None = Field(default=None, min_length=1)
    """Names of the effects that are looked for. Default: all of the library that the study can have."""
    maxima: dict[str, RawQuantity] = Field(default={})
    """Largest sizes that are searched, by the effect's name. Default: the library's."""
    settings: dict[str, int | float] = Field(default={})
    """Numbers of runs and levels that differ from the defaults, by name."""


class Study(Physics):
    """Everything that a person configures; built by `load_study`."""

    name: str
    """Name of what is calibrated, in words."""
    note: str = ""
    """Note that a reader needs of the study at this scale."""
    companion: str = ""
    """Folder of ``experiments/studies`` whose ``companion.py`` brings published numbers and chapters."""
    measurement: MeasurementSection = MeasurementSection()
    """The reading of the angle."""
    target_section: TargetSection | None = Field(default=None, alias="target")
    """The angle to be matched."""
    response_sections: tuple[ResponseSection, ...] = Field(default=(), alias="response")
    """Further numbers to be matched."""
    direct_sections: tuple[DirectSection, ...] = Field(default=(), alias="direct")
    """Factors that were measured by themselves."""
    candidate_sections: tuple[CandidateSection, ...] = Field(default=(), alias="candidate", max_length=20)
    """Tests that could be done."""
    response_scenes: dict[str, Scene] = Field(default_factory=dict, alias="response-scene")
    """Further scenes, by the names that responses call them by."""
    factor_sections: tuple[FactorSection, ...] = Field(default=(), alias="factor")
    """The factors as written, in order."""
    condition_sections: Conditions = Field(default={}, alias="condition")
    """The conditions as written."""
    campaign: CampaignSettings = CampaignSettings()
    """Every decision of the campaign."""
    discover: DiscoverSection = DiscoverSection()
    """The search for a missing effect."""
    engine: EngineSection | None = None
    """The program that simulates the cases. Default: dem-warp itself."""
    cluster: ClusterSection | None = None
    """The workers that simulate the cases. Default: this machine's own."""

    _document: dict[str, Any] = PrivateAttr(default_factory=dict)
    _places: Places = PrivateAttr(default_factory=lambda: Places(Path(), {}))
    _fixed: frozenset[str] = PrivateAttr(default=frozenset())
    _under: dict[str, Study] = PrivateAttr(default_factory=dict)
    _target: Target | None = PrivateAttr(default=None)

    def __repr_args__(self) -> list[tuple[str | None, Any]]:
        return [("name", self.name), ("scale", self.scale), ("factors", [*self._factors])]

    @cached_property
    def file(self) -> Path:
        return self._places.file

    @cached_property
    def scale(self) -> str | None:
        """The chosen scale; None: the study as written."""
        return self._places.scale

    @cached_property
    def document(self) -> dict[str, Any]:
        """The study as written, the scale merged over it: plain JSON-able data, a copy to be read only."""
        return copy.deepcopy(self._document)

    @cached_property
    def identity(self) -> dict[str, Any]:
        """All of the study that its results depend on, its clumps included, as JSON-able data."""
        digests = [hashlib.sha256(clump.read_bytes()).hexdigest() for clump in self.grain.files]
        document = {key: value for key, value in self.document.items() if key != "cluster"}
        tables = [each.file for each in self.direct_sections if each.file is not None]
        direct = [hashlib.sha256(table.read_bytes()).hexdigest() for table in tables]
        known = {"study": document, "scale": self.scale, "clump_sha256": digests}
        return known | ({"direct_sha256": direct} if direct else {})

    @cached_property
    def sha256(self) -> str:
        """Hash of the study's identity, which its outputs carry."""
        text = json.dumps(self.identity, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def target(self) -> Target:
        """Responses that the cases must match; StudyError where they are missing or still to be measured."""
        if self.target_section is not None and self.target_section.lacks_a_heap(self.scenes):
            problem = "needs an observable: this test leaves no heap whose angle could be the target"
            raise StudyError(f"{self.file}: target", problem)
        if self._target is None and self.target_section is not None:
            problem = "with_measurements must first take its numbers from the pictures, profiles or file"
            raise StudyError(f"{self.file}: target", problem)
        if self._target is None:
            raise StudyError(str(self.file), "needs a [target] or a [[response]] to be calibrated")
        return self._target

    @cached_property
    def direct(self) -> tuple[Direct, ...]:
        """Direct readings of factors, in the order of the file."""
        given = self.target_section, self.campaign.seeds.target
        return build_direct(self.direct_sections, self.factor_sections, self._titles, self._places, *given)

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        """Tests that could be done, in the order of the file."""
        return build_candidates(self.candidate_sections, self.factor_sections, self.scenes, self._places)

    @property
    def _titles(self) -> list[str]:
        """Names of the responses as written."""
        return [section.title for section in (self.target_section, *self.response_sections) if section]

    @cached_property
    def scenes(self) -> dict[str, SceneSection]:
        """Every scene by its name: the study's own, further ones, those of its conditions."""
        tests = {name: self.under(name).scene for name in self.condition_sections}
        return {TARGET_SCENE: self.scene, **self.response_scenes, **tests}

    @cached_property
    def measurable(self) -> tuple[Observable, ...]:
        """Observables that a laboratory can measure of the study's test, in the order of every table."""
        return measurable(self.scene.observables, self.scene.leaves_a_heap, self.measurement.outline)

    @cached_property
    def factors(self) -> tuple[Factor, ...]:
        """Factors of the designs in natural units, in the order of the file."""
        return tuple(section.factor() for section in self.factor_sections)

    @cached_property
    def labels(self) -> dict[str, str]:
        """Meaning of every factor, in words."""
        return {section.name: section.label for section in self.factor_sections}

    @cached_property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Hard physical limits of every factor in its natural unit, infinite where it has no bound."""
        return {section.name: section.limits for section in self.factor_sections}

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """Conditions of the tests, in the order of the file. Default: the test as it is."""
        return tuple(self.condition_sections.values()) or (BASE,)

    def under(self, condition: str) -> Study:
        """Return the study of the test under one condition; it takes settings of all factors of this one."""
        known = {each.name: each for each in self.conditions}
        if condition not in known:
            rule = f"must be a condition of the study, {nearest_name(condition, list(known))}"
            raise StudyError(str(self.file), rule, condition)
        return self._under[condition] if known[condition].changes else self

    def with_target(self, target: Target) -> Study:
        """Return the same study, whose cases must match something else."""
        study = self._changed(self._document)
        study._target = target
        return study

    def with_engine(self, engine: Mapping[str, Any]) -> Study:
        """Return the same study, whose cases another engine simulates: an ``[engine]`` as written."""
        section = validated(EngineSection, engine, self._places, ("engine",))
        return self._changed(self.document | {"engine": dict(engine)}, engine=section)

    def with_fidelity(self, settings: Mapping[str, Any]) -> Study:
        """Return the same study, whose design is run at a cheaper scale: the section as written."""
        document = merge(self._document, {"campaign": {"fidelity": dict(settings)}})
        section = validated(FidelitySettings, settings, self._places, ("campaign", "fidelity"))
        return self._changed(document, campaign=self.campaign.model_copy(update={"fidelity": section}))

    def with_responses(
        self,
        target: TargetSection,
        responses: Iterable[ResponseSection] = (),
        measurement: MeasurementSection | None = None,
    ) -> Study:
        """Return the same study, whose cases must match other numbers, also read in another way."""
        sections, reading = tuple(responses), measurement or self.measurement
        document = {key: value for key, value in self.document.items() if key not in ("target", "response")}
        document["target"] = target.table
        if target.twin is not None:
            document["target"]["twin"] = self._document["target"]["twin"]
        document |= {"response": [self._row(section) for section in sections]} if sections else {}
        if measurement is not None:
            document["measurement"] = measurement.model_dump(exclude_unset=True)
        study = self._changed(
            document, target_section=target, response_sections=sections, measurement=reading
        )
        study.match()
        return study

    def _row(self, section: ResponseSection) -> dict[str, Any]:
        """Return a ``[[response]]`` as the study file writes it, or as it would."""
        own = zip(self.response_sections, self._document.get("response", []), strict=False)
        return next((row for each, row in own if each is section), section.table)

    def with_factors(
        self,
        tables: Sequence[Mapping[str, Any]],
        settings: Mapping[str, float | str] | None = None,
        solver: SolverSection | None = None,
    ) -> Study:
        """Return the same study with more factors, each in the place of the value that it varies.

        Raise StudyError when the study cannot have the factors.

        Parameters
        ----------
        tables
            The ``[[factor]]`` sections; a level is a number, a text or a quantity.
        settings
            Values by place, for places without a value in the study.
        solver
            Conventions of the contact law in place of the study's.
        """
        study = self._with_factors(tables, settings or {}, solver or self.solver)
        for name, condition in self.condition_sections.items():
            if condition.changes:
                free = [free_of(condition, table) for table in tables]
                found = self.under(name)._with_factors(
                    [table for table in free if table["parameter"]], settings or {}, solver or self.solver
                )
                found._fixed |= {table["name"] for table in free if not table["parameter"]}
                study._under[name] = found
        study._check_names()
        return study

    def _with_factors(
        self, tables: Sequence[Mapping[str, Any]], settings: Mapping[str, float | str], solver: SolverSection
    ) -> Study:
        rows = [*self.factor_sections, *tables]
        sections = validated(FactorTable, {"factor": rows}, self._places).factor
        added, document = sections[len(self.factor_sections) :], copy.deepcopy(self._document)
        change: dict[str, Any] = {}
        for path, middle in ((path, section.middle) for section in added for path in section.paths):
            drop(document, path)
            change = merge(change, nested(path, middle))
        for keys, value in ((place.split("."), value) for place, value in settings.items()):
            if value_at(document, keys) is None:
                document, change = (merge(each, nested(keys, value)) for each in (document, change))
        document["factor"] = [*document.get("factor", []), *(section.table for section in added)]
        try:
            physics = revised(self._physics.model_copy(update={"solver": solver}), change)
        except ValueError as error:
            raise StudyError(str(self.file), first_problem(error)) from None
        study = self._changed(document, **dict(physics), factor_sections=sections)
        check_restitution(study)
        return study

    def _changed(self, document: dict[str, Any], **fields: Any) -> Study:
        """Copy the study with other sections and the document that has them."""
        study = self.model_copy(update=fields)
        for name in set(vars(study)) - set(Study.model_fields):
            del vars(study)[name]  # properties of the study as it was
        study._document, study._under = document, dict(self._under)
        return study

    def _check_names(self) -> None:
        """Refuse factors named like a column of the results' tables."""
        names = [section.name for section in self.factor_sections]
        titles = [*self._titles, *(direct.name for direct in self.direct)]
        check_factor_names(names, self._places, self.scenes.values(), titles)

    def match(self) -> None:
        """Build the target of the responses."""
        self._check_names()
        _ = self.candidates  # refuses wrong ones
        held_out = [condition.name for condition in self.conditions if condition.held_out]
        target, responses = self.target_section, self.response_sections
        self._target = build_target(target, responses, self.scenes, held_out, self._places)

    def natural_settings(self, settings: Mapping[str, object], source: str = "settings") -> dict[str, float]:
        """Read factor values with their units, as ``{"B": "34 MPa", "E": 0.46}``, in natural units."""
        natural = {}
        for name, value in settings.items():
            try:
                natural[name] = natural_value(self.factor_sections, name, value)
            except ValueError as error:
                raise StudyError(f"{source}: {name}", str(error), value) from None
        return natural

    def case(self, settings: Mapping[str, float], seed: int, scene: str = TARGET_SCENE) -> Case:
        """Build one case of a scene or a condition; its seed is that of everything random.

        Settings are values by factor name in natural units; a factor that is not named is at its middle.
        Raise StudyError when there is no such factor or scene, or a value leaves what is physical.
        """
        if scene in self.condition_sections:
            return self.under(scene).case(settings, seed)
        if scene not in self.scenes:
            rule = f"must name a scene of the study, {nearest_name(scene, list(self.scenes))}"
            raise StudyError(str(self.file), rule, scene)
        changes: dict[str, Any] = {}
        for name, value in settings.items():
            if name in self._factors:
                self._factors[name].write(changes, value, self._places)
            elif name not in self._fixed:
                rule = f"must name a factor, {nearest_name(name, list(self._factors))}"
                raise StudyError(str(self.file), rule, name)
        if scene != TARGET_SCENE:
            changes["scene"] = self.response_scenes[scene]
        try:
            return changed(self._physics, changes).build_case(seed)
        except GrainCountError as error:
            raise StudyError(self._place_of_grains(scene), error.problem, error.number) from None
        except ValueError as error:
            hint = f"The settings are {dict(settings)}."
            raise StudyError(str(self.file), str(error), hint=hint) from error

    def _place_of_grains(self, scene: str) -> str:
        """Place of the number of a scene's grains, or of the container that it follows from."""
        path: KeyPath = ("scene",) if scene == TARGET_SCENE else ("response-scene", scene)
        [(kind, section)] = self.scenes[scene].given.items()
        given = getattr(section, "grain_count", None) is not None
        return self._places.of((*path, kind, *(["grain_count"] if given else [])))

    @cached_property
    def _physics(self) -> Physics:
        """Physics alone, every factor at its middle."""
        return Physics.model_construct(**{key: getattr(self, key) for key in Physics.model_fields})

    @cached_property
    def _factors(self) -> dict[str, FactorSection]:
        return {section.name: section for section in self.factor_sections}


def check_restitution(study: Study) -> None:
    """Refuse a factor that varies a restitution which the laws make nothing of."""
    for section in study.factor_sections if study.solver.laws.damping_rate is not None else ():
        if any(path[-1] == "restitution" for path in section.paths):
            damping = study.solver.laws.normal_damping
            problem = f"varies a restitution, which the damping {damping!r} ignores"
            raise StudyError(f"{study.file}: factor {section.name}", problem, hint="Remove the factor.")
