"""The time that a batch of cases still takes, in seconds and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dem_warp import Progress

FIRST_GUESS = 0.01
"""Part of the work that is done before the time left is guessed."""


def time_left(progress: Progress, first: Progress | None = None) -> float | None:
    """Guess the time that is left [s]; None where it is too early to tell, or nothing is left.

    The speed is that since the `first` progress: what an earlier run had done is not this one's speed.
    """
    done, seconds = progress.fraction, progress.seconds
    if first is not None:
        done, seconds = done - first.fraction, seconds - first.seconds
    if done < FIRST_GUESS or progress.fraction >= 1.0:
        return None
    return seconds * (1.0 - progress.fraction) / done


def duration(seconds: float) -> str:
    """Write a time as a person would: ``12 s``, ``1 min 20 s``, ``2 h 5 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
