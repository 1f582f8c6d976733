"""The target of a study from photographs, a file of measured heaps, profiles, or a search."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dem_warp import Drum
from doe import Sample
from experiments.io.errors import InputError
from experiments.io.units import Quantity
from experiments.measurement.measured_file import read_measured
from experiments.measurement.profile_files import Profiles, profiles_of
from experiments.measurement.profile_responses import counted_twice, with_profiles
from experiments.measurement.readings import require_same_fit
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import ANGLE, BY_NAME, SURFACE, SURFACE_PROFILE, filling
from experiments.studyfile.target_section import ResponseSection, TargetSection

if TYPE_CHECKING:
    from experiments.measurement.photographs import PictureOptions


DRUM_ANGLE = "dynamic_angle"
DRUM_GIVES = (DRUM_ANGLE, SURFACE_PROFILE)
"""Observables of the target that photographs of a drum give."""


@dataclass(frozen=True)
class Replicated:
    """An observable with several measurements under a condition."""

    condition: str
    observable: str
    sample: Sample
    """Measurements, in the unit of the observable."""


def with_measurements(study: Study) -> tuple[Study, tuple[str, ...]]:
    """Replace pictures, a file and profiles of a study's target by their numbers.

    Returns
    -------
    study
        The same study with numbers; the study itself if it has numbers already.
    notes
        Notes about the measurements.
    """
    study = with_profiles(study, _pictured_profiles(study))
    taken, notes = _with_source(study)
    return taken, (*notes, *counted_twice(taken))


def _with_source(study: Study) -> tuple[Study, tuple[str, ...]]:
    section, place = study.target_section, f"{study.file}: target"
    if section is None or section.twin is not None:
        return study, ()
    if section.fit is not None:
        require_same_fit(section.fit, study.measurement.fit, f"{place}.fit")
    if section.pictures is not None:
        return _with_pictures(study, f"{place}.pictures")
    if section.file is not None:
        path = study.file.parent / section.file
        measured = read_measured(path, study, filled=True)
        found, notes = [], list(measured.notes)
        for condition in measured.conditions:
            for name, column in zip(measured.observables, measured.values[condition].T, strict=True):
                values = column[np.isfinite(column)]
                if len(values) > 1 and np.ptp(values) > 0.0:
                    found.append(Replicated(condition, name, Sample.of(values)))
                elif len(values):
                    notes.append(f"{condition}: {name} shows no scatter and is not matched")
        leading = _asked(study, found, notes, path)
        return _given(study, found, f"file {section.file}", leading), tuple(notes)
    return study, ()


def _with_pictures(study: Study, place: str) -> tuple[Study, tuple[str, ...]]:
    from experiments.measurement.photographs import left_out_notes, measure_pictures, target_sample, used_rows

    options = _options(study)
    rows = measure_pictures(find_pictured(study), options)
    sample = target_sample(rows, options, place)
    names = [Path(row["picture"]).name for row in used_rows(rows, options)]
    note = f"{len(names)} pictures: {', '.join(names)}"
    read = [
        f"{row['picture']}: {row['source']}" for row in rows if row["source"] not in ("photograph", "drum")
    ]
    target = _given(study, [Replicated(TARGET_SCENE, DRUM_ANGLE if options.drum else ANGLE, sample)], note)
    return target, (*read, *left_out_notes(rows, options))


def _pictured_profiles(study: Study) -> Profiles | None:
    """Read the profiles of a drum from the pictures of a study's target; None where it asks for none."""
    section = study.target_section
    if section is None or section.pictures is None or section.observable != SURFACE_PROFILE:
        return None
    from experiments.measurement.photographs import measure_pictures, used_rows

    options, scene = _options(study), study.case({}, 0, TARGET_SCENE).scene
    rows = measure_pictures(find_pictured(study), replace(options, diameter=scene.diameter))
    found: dict[str, list[dict[int, float]]] = {}
    for row in used_rows(rows, options):
        path = Path(row["picture"])
        heights = {number: row[name] for number, name in enumerate(SURFACE) if row[name] is not None}
        found.setdefault(path.parent.name if options.by == "folder" else path.name, []).append(heights)
    return profiles_of(found, f"{study.file}: target.pictures")


def _asked(study: Study, found: Sequence[Replicated], notes: Iterable[str], path: Path) -> Replicated | None:
    """Return the observable that ``[target]`` names, or None; raise `InputError` if the file lacks it."""
    section = study.target_section
    if section is None or not {"observable", "scene"} & section.model_fields_set:
        return None
    fitted = [one for one in found if one.condition not in _held_out(study)]
    wanted = (section.observable, _scene(study, section.scene))
    for one in fitted:
        if (_column(one), _scene(study, one.condition)) == wanted:
            return one
    has = ", ".join(f"{_column(one)} ({one.condition})" for one in fitted) or "nothing"
    problem = f"needs two different values under the target's condition; {path} has {has}"
    problem += "".join(f"; {note}" for note in notes if section.observable in note)
    raise InputError(f"{study.file}: target.observable", problem, f"{section.observable} ({section.scene})")


def _options(study: Study) -> PictureOptions:
    from experiments.measurement.heap_files import HeapSettings
    from experiments.measurement.photographs import PictureOptions
    from imaging import View

    section, fit = study.target_section, study.measurement.fit
    if section is None:
        return PictureOptions(fit)
    view = section.view.view if section.view else View()
    heaps, drum = HeapSettings(types=tuple(map(str, section.types))), issubclass(study.scene.kind, Drum)
    return PictureOptions(fit, view, heaps, section.by, section.keep_doubtful, drum)


def find_pictured(study: Study) -> list[Path]:
    """Find the photographs of heaps that are the target of a study; empty where it names no photographs."""
    section, place = study.target_section, f"{study.file}: target.pictures"
    if section is None or section.pictures is None:
        return []
    given = DRUM_GIVES if issubclass(study.scene.kind, Drum) else (ANGLE,)
    if given == (ANGLE,) and not study.scene.leaves_a_heap:
        raise InputError(place, "this test leaves no heap to photograph", study.scene.kind.name)
    if section.observable not in given or section.scene != TARGET_SCENE:
        problem = f"photographs give only the observable {' or '.join(given)} of the study's own scene"
        raise InputError(place, problem, section.title)
    from experiments.measurement.photographs import find_pictures, require_separate

    paths = find_pictures(section.pictures, study.file.parent, place, section.by)
    require_separate(paths, _options(study), place)
    return paths


def target_sections(
    study: Study, measured: Iterable[Replicated], note: str = "", asked: Replicated | None = None
) -> tuple[TargetSection | None, tuple[ResponseSection, ...]]:
    """Turn measurements into a ``[target]`` and ``[[response]]``s; the target is None if none can be fitted.

    The target is the one asked for, or else the angle of the first fitted condition, or its first observable.
    """
    held_out = _held_out(study)
    order = [TARGET_SCENE, *(condition.name for condition in study.conditions)]
    ranked = sorted(
        measured,
        key=lambda one: (
            one is not asked,
            one.condition in held_out,
            order.index(one.condition),
            _column(one) != ANGLE,
        ),
    )
    if not ranked or ranked[0].condition in held_out:
        return None, ()
    first, *others = [_values(study, one) for one in ranked]
    noted: dict[str, Any] = {"note": note} if note else {}
    return TargetSection(**first, **noted), tuple(ResponseSection(**each) for each in others)


def _given(study: Study, measured: list[Replicated], note: str, asked: Replicated | None = None) -> Study:
    """Return the study with measurements as its target, and its own responses."""
    target, responses = target_sections(study, measured, note, asked)
    if target is None:
        problem = "needs an observable with two values or more under a condition that is not held out"
        raise InputError(f"{study.file}: target", problem, note)
    return study.with_responses(target, (*responses, *study.response_sections))


def _values(study: Study, one: Replicated) -> dict[str, Any]:
    """Return the values of a measurement's section."""
    known = (*study.measurable, *filling(study.scene.observables))
    units = {name: each.unit for each in known for name in (each.name, each.column)}
    unit, column = units[one.observable], _column(one)
    unit = "" if unit == "1" else unit
    numbers: dict[str, Any] = {
        "mean": Quantity(float(one.sample.mean), unit),
        "sd": Quantity(float(one.sample.sd), unit),
        "n": one.sample.n,
    }
    if _scene(study, one.condition) == TARGET_SCENE:
        return {"observable": column, **numbers}
    name = f"{column}_{one.condition}".replace("-", "_")
    return {"name": name, "observable": column, "scene": one.condition, **numbers}


def _held_out(study: Study) -> set[str]:
    return {condition.name for condition in study.conditions if condition.held_out}


def _scene(study: Study, condition: str) -> str:
    """Return the scene of a condition: the study's own where the condition changes nothing."""
    same = any(not each.changes for each in study.conditions if each.name == condition)
    return TARGET_SCENE if same else condition


def _column(one: Replicated) -> str:
    return BY_NAME[one.observable].column if one.observable in BY_NAME else one.observable
