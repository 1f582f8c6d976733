"""Batches that fail as a whole: they are halved and repeated, down to the case that fails."""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable
from concurrent.futures import BrokenExecutor

from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.engines.program import empty_result
from experiments.cases.workers.call_results import CallResults
from experiments.io.errors import InputError
from experiments.io.plug_ins import described, fault_of

FULL = ("failed to allocate", "out of memory")
"""Messages of Warp and of CUDA when the memory of a device is used up."""

_log = logging.getLogger(__name__)


def run_divided(results: CallResults, members: list[int], run: Callable[[list[int]], None]) -> None:
    """Run a batch; if memory runs out or a case raises, run its halves, without what has finished.

    A case that fails alone ends with the status `NO_ANSWER` and its reason. Errors of the caller, of files,
    of the input and of a machine without memory for a single case are raised.
    """
    pile = [members]
    while pile:
        batch = results.left(pile.pop())
        if not batch:
            continue
        reason = _attempt(results, batch, run)
        if reason is None:
            continue
        # arrays of the attempt, which its error held, give their memory back
        gc.collect()
        left = results.left(batch)
        if len(batch) == 1 and left:
            results.take(batch[0], empty_result(NO_ANSWER, reason, {}))
        elif left:
            half = (len(left) + 1) // 2
            _log.info("a batch of %d cases is divided: %s", len(batch), reason)
            pile += [part for part in (left[half:], left[:half]) if part]


def _attempt(results: CallResults, batch: list[int], run: Callable[[list[int]], None]) -> str | None:
    """Run a batch; return the reason if it ended early, else None."""
    try:
        run(batch)
    except (BrokenExecutor, OSError, InputError):
        raise
    except MemoryError:
        if results.fault is not None or len(batch) == 1:
            raise
        return "there is not enough memory for it"
    except Exception as error:
        if results.fault is not None:
            raise
        text = described(error)
        if any(words in text.lower() for words in FULL):
            return f"the device has not enough memory for it ({text})"
        made = "" if fault_of(error) else results.outside(batch[0])
        return f"its simulation raised {text}" + (f", in {made}" if made else "")
    return None
