"""Running the cases of a study: each is stored as it finishes, and its heap is measured."""

from experiments.cases.engine import Engine
from experiments.cases.engines import ENGINES, engine_of, with_engine
from experiments.cases.execute import run_cases
from experiments.cases.folder import open_folder, require_unused
from experiments.cases.heap import Heap, heap_picture, simulate_heap, write_heap
from experiments.cases.store import Store
from experiments.cases.workers.opening import open_workers
from experiments.cases.workers.own import OwnWorkers
from experiments.cases.workers.resources import Resources
from experiments.cases.workers.workers import Workers

__all__ = [
    "ENGINES",
    "Engine",
    "Heap",
    "OwnWorkers",
    "Resources",
    "Store",
    "Workers",
    "engine_of",
    "heap_picture",
    "open_folder",
    "open_workers",
    "require_unused",
    "run_cases",
    "simulate_heap",
    "with_engine",
    "write_heap",
]
