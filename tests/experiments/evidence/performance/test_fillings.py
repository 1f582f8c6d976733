"""The benchmark of fillings, on its smallest drums."""

from __future__ import annotations

import pytest

from experiments.evidence.performance import fillings


def test_fillings_are_told_as_stated_and_as_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fillings, "ACROSS", (8,))
    monkeypatch.setattr(fillings, "LEVEL", (0.4,))
    monkeypatch.setattr(fillings, "INCLINED", (0.4,))
    level, inclined, *rough = fillings.fill("cpu").to_dict("records")
    assert (level["status"], inclined["status"]) == ("finished", "finished")
    # The level bed is struck off; both are within a ball's height over the drum's, an eighth.
    assert 0.4 - 0.125 < level["reached"] < 0.4
    assert level["reached"] < inclined["reached"] < 0.4 + 0.125
    assert level["count"] < inclined["count"]
    # Rough grains stand steeper under the rain, so that the sides of a level bed stay lower.
    assert [row["grains"] for row in rough] == ["rough", "rough"]
    assert rough[0]["reached"] < level["reached"]
