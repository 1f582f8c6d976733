"""A short search for compatible settings, which made-up models do not need to be long."""

import pytest

from doe.curves import compatible


@pytest.fixture
def few_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take a tenth of the Metropolis steps."""
    monkeypatch.setattr(compatible, "MOVES", 9)
