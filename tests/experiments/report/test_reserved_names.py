"""Factors and the columns of tables: no name has two meanings."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.calibrate import Campaign
from experiments.studyfile import Study, load_study
from experiments.studyfile.reserved_names import RESERVED


@pytest.mark.parametrize("name", ["E", "mu_2", "Seed"])
def test_any_other_name_will_do(write_study: Callable[..., Path], name: str) -> None:
    study = load_study(write_study(('name = "E"', f'name = "{name}"')))
    assert study.factors[0].name == name


def test_the_reserved_names_are_those_of_the_tables(campaign: Campaign, study: Study) -> None:
    tables = {"cases", "climb", "contour", "surface_design", "verification"}
    factors = {factor.name for factor in campaign.factors}
    responses = {response.name for response in campaign.responses}
    taken = RESERVED | factors | responses | set(study.scene.observables)
    for name in tables:
        columns = {re.sub(r"_coded$", "", column) for column in campaign.tables()[name]}
        assert columns <= taken, name
