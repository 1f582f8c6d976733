"""Running the cases of a study: each is stored as it finishes, and its heap is measured."""

from experiments.cases.engine import Engine
from experiments.cases.engines import ENGINES, engine_of, with_engine
from experiments.cases.execute import run_cases
from experiments.cases.folder import open_folder, require_unused
from experiments.cases.heap import Heap, heap_snapshot, simulate_heap, write_heap
from experiments.cases.store import Store

__all__ = [
    "ENGINES",
    "Engine",
    "Heap",
    "Store",
    "engine_of",
    "heap_snapshot",
    "open_folder",
    "require_unused",
    "run_cases",
    "simulate_heap",
    "with_engine",
    "write_heap",
]
