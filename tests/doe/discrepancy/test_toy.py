"""The package as someone uses it who has a plain Python function for a simulator, and arrays for data."""

import doctest
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from doe import discrepancy
from doe.discrepancy import Discovery, Measured, MechanismRange, Outcomes, Point, SearchSpace, Settings, drive

OBSERVABLES = ("rise", "peak", "width", "tail", "area")
SPACE = SearchSpace(
    factors=("gain", "delay"),
    lower=(1.0, 0.1),
    upper=(3.0, 0.5),
    conditions=("slow", "fast"),
    held_out=(False, True),
    mechanisms=tuple(MechanismRange(name, 0.0, 2.0) for name in ("drift", "echo", "leak")),
)
SETTINGS = Settings(bank_points=32, bank_mechanism_points=32)
SCATTER = 0.02


def response(theta: Sequence[float], sizes: Mapping[str, float], condition: str) -> np.ndarray:
    """Return expected observables: mild curvature, and mechanisms that act each in its own way."""
    gain, delay = theta
    speed = {"slow": 1.0, "fast": 1.6}[condition]
    base = np.array([gain / speed, gain**2 / 3.0, delay * speed, gain * delay, gain + delay])
    drift, echo, leak = (sizes.get(name, 0.0) for name in SPACE.names)
    return base + np.array(
        [0.3 * drift * speed, 0.4 * echo, 0.2 * leak, 0.3 * echo - 0.2 * drift, 0.3 * leak * speed]
    )


def simulate(points: Sequence[Point]) -> Outcomes:
    values = []
    for point in points:
        scatter = SCATTER * np.random.default_rng(point.seed).standard_normal(len(OBSERVABLES))
        values.append(response(point.theta, dict(point.sizes), point.condition) + scatter)
    return Outcomes(np.array(values), ("",) * len(points))


def analysed(sizes: Mapping[str, float], seed: int = 3) -> Discovery:
    points = discrepancy.bank_points(SPACE, SETTINGS)
    emulator = discrepancy.fit_emulator(discrepancy.make_bank(SPACE, OBSERVABLES, points, simulate(points)))
    rng = np.random.default_rng(seed)
    measured = Measured(
        SPACE.conditions,
        OBSERVABLES,
        {
            name: response((2.2, 0.3), sizes, name) + SCATTER * rng.standard_normal((5, len(OBSERVABLES)))
            for name in SPACE.conditions
        },
    )
    return drive(discrepancy.analyse(measured, emulator, SETTINGS, seed), simulate)


def test_a_hidden_mechanism_of_a_plain_function_is_named_with_its_size() -> None:
    found = analysed({"echo": 1.1})
    assert found.verdict is discrepancy.Verdict.NAMED
    assert found.named == ("echo",)
    assert found.chosen is not None
    [size] = found.chosen.sizes
    # Five standard errors, of which the 90 % interval is 3.3 wide.
    assert size.value == pytest.approx(1.1, abs=5.0 / 3.3 * (size.high - size.low))
    np.testing.assert_allclose(found.chosen.theta, [2.2, 0.3], atol=5.0 * max(found.chosen.theta_se))
    assert [both.held_out for both in found.before_after] == [False, True]


def test_the_example_of_the_package_runs() -> None:
    failed, tried = doctest.testmod(discrepancy)
    assert tried > 5
    assert failed == 0


def test_the_package_has_never_heard_of_grains() -> None:
    words = re.compile(r"heap|grain|clump|\bdem\b|tube|clog|camera|photograph|friction|sphere", re.IGNORECASE)
    files = sorted(Path(discrepancy.__file__).parent.rglob("*.py"))
    assert len(files) > 20
    found = [
        f"{path.name}:{number}: {line.strip()}"
        for path in files
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if words.search(line)
    ]
    assert found == []
