"""The time that a batch of cases still takes, in seconds and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dem_warp import Progress

FIRST_GUESS = 0.01
"""Part of the work that is done before the time left is guessed."""
WELL_BEGUN, LEAST_LEFT = 0.1, 0.1
"""Part of the work from which on its speed alone counts, and of the time expected that is always left."""


def time_left(progress: Progress, first: Progress | None = None) -> float | None:
    """Guess the time that is left [s]; None where it is too early to tell, or nothing is left.

    The speed is that since the `first` progress: what an earlier run had done is not this one's speed. Before
    that shows, it is what was expected of this machine.
    """
    done, seconds = progress.fraction, progress.seconds
    if first is not None:
        done, seconds = done - first.fraction, seconds - first.seconds
    left = _seconds_left(progress, done, seconds)
    return left if progress.fraction < 1.0 else None


def _seconds_left(progress: Progress, done: float, seconds: float) -> float | None:
    """Time left by the speed so far, and before that shows by what was expected of this machine."""
    expected, rest = getattr(progress, "expected", None), 1.0 - progress.fraction
    if expected is None:
        return seconds * rest / done if done >= FIRST_GUESS else None
    trust = min(done / WELL_BEGUN, 1.0)
    # what has shown nothing yet has still the time to come that has passed
    begun = max(expected * rest - (seconds if done < FIRST_GUESS else 0.0), LEAST_LEFT * expected)
    return begun if done <= 0.0 else trust * seconds * rest / done + (1.0 - trust) * begun


def duration(seconds: float) -> str:
    """Write a time as a person would: ``12 s``, ``1 min 20 s``, ``2 h 5 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
