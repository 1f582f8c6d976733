"""Cases of the shipped studies: each has the bits that it had when the keys were written down."""

import hashlib
import json
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from dem_warp import Case
from experiments.cases.engines.key import described
from experiments.discover.mechanism_files import library_for
from experiments.studyfile import BUCKWHEAT, Study, load_study, study_scales, write_template
from experiments.studyfile.mechanism_factor import with_mechanisms

KEYS = Path(__file__).with_name("case_keys.json")
"""Digests of `keys_of` by study and scale."""

STUDIES = {
    "buckwheat": BUCKWHEAT,
    "curve_to_point": BUCKWHEAT.with_name("curve_to_point.toml"),
    "trial": BUCKWHEAT.parents[1] / "trial" / "study.toml",
}

DIGITS = 12


def keys_of(study: Study) -> Iterator[tuple[str, str]]:
    """Name cases all over a study's ranges, scenes, conditions and mechanisms, each with its digest."""
    draw = random.Random(study.name)
    for number in range(3):
        drawn = {factor.name: draw.uniform(factor.low, factor.high) for factor in study.factors}
        for scene in study.scenes:
            yield f"{scene} {number}", digest(study.case(drawn, number, scene))
        for name in drawn:
            yield f"{name} {number}", digest(study.case({name: drawn[name]}, number))
        if study.condition_sections:
            for condition in study.conditions:
                yield f"{condition.name} {number}", digest(study.under(condition.name).case(drawn, number))
            for mechanism in library_for(study):
                extended = with_mechanisms(study, [mechanism])
                size = draw.uniform(mechanism.null, mechanism.maximum)
                settings = drawn | {mechanism.name: size}
                yield f"{mechanism.name} {number}", digest(extended.case(settings, number))
                wide = extended.under("wide").case(settings, number)
                yield f"{mechanism.name} wide {number}", digest(wide)


def digest(case: Case) -> str:
    """Hash all of a case that determines its result, but for the engine's own code."""
    text = json.dumps(described(case), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


@pytest.mark.parametrize("name", STUDIES)
def test_a_case_of_a_shipped_study_has_the_bits_that_it_had(name: str) -> None:
    kept = json.loads(KEYS.read_text(encoding="utf-8"))
    for scale in (None, *study_scales(STUDIES[name])):
        found = dict(keys_of(load_study(STUDIES[name], scale)))
        assert found == kept[f"{name} {scale or 'as written'}"]


def test_the_template_gives_the_case_that_it_gave(tmp_path: Path) -> None:
    kept = json.loads(KEYS.read_text(encoding="utf-8"))
    # under the base law, with the faster rain, the longer steps and the narrow ranges that it had at first
    rain = {"lifted-cylinder": {"rain_rate": "3000 1/s"}}
    changes = {"scene": rain, "solver": {"laws": "edem"}, "numerics": {"time_step_fraction": 0.25}}
    path = write_template("grain", tmp_path)
    ranges = {"mu_gw": (0.2, 0.6), "mu_r_gg": (0.03, 0.08), "mu_r_gw": (0.02, 0.09)}
    lines = (f"{name} = {{ low = {low}, high = {high} }}\n" for name, (low, high) in ranges.items())
    first = "[scale.first.factor]\n" + "".join(lines)
    path.write_text(path.read_text(encoding="utf-8") + first, encoding="utf-8")
    template = load_study(path, "first", changes)
    assert dict(keys_of(template)) == kept["template"]
