"""The public names: each is loaded with its module when it is first used."""

from .engines.engine import Engine
from .engines.engines import ENGINES, engine_of, with_engine
from .execute import run_cases
from .show.heap import Heap, heap_snapshot, simulate_heap, write_heap
from .store.folder import open_folder, require_unused
from .store.store import Store
from .workers.opening import open_workers
from .workers.own import OwnWorkers
from .workers.resources import Resources
from .workers.workers import Workers

__all__ = [
    "ENGINES",
    "Engine",
    "Heap",
    "OwnWorkers",
    "Resources",
    "Store",
    "Workers",
    "engine_of",
    "heap_snapshot",
    "open_folder",
    "open_workers",
    "require_unused",
    "run_cases",
    "simulate_heap",
    "with_engine",
    "write_heap",
]
