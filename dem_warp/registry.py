"""Registries of laws, scenes and the like by name: built-in ones and those of plugins."""

import logging
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from importlib import import_module
from importlib.metadata import entry_points
from typing import Generic, TypeVar

T = TypeVar("T")

_log = logging.getLogger(__name__)


class Modules(Mapping[str, T], Generic[T]):
    """Lazy mapping of built-in names; a module is imported on first access.

    `places` has the module and attribute of each name, e.g. ``"dem_warp.laws.jkr:JKR"``.
    """

    def __init__(self, places: Mapping[str, str]) -> None:
        self._places = places

    def __getitem__(self, name: str) -> T:
        module, _, thing = self._places[name].partition(":")
        found: T = getattr(import_module(module), thing)
        return found

    def __contains__(self, name: object) -> bool:
        return name in self._places

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


class Registry(Mapping[str, T], Generic[T]):
    """Built-in objects by name, then the entry points of installed packages.

    A package declares an entry point in its pyproject.toml::

        [project.entry-points."dem_warp.laws"]
        magnetism = "grain_magnets.law:Magnetism"

    Entry points of the group are loaded once, on first access. `check` is called with the name and the object
    of an entry, and with all objects before it; it raises ValueError or TypeError for an invalid one, which
    is skipped with a warning.
    """

    def __init__(
        self,
        group: str,
        built_in: Mapping[str, T],
        check: Callable[[str, T, Mapping[str, T]], None] = lambda name, thing, known: None,
    ) -> None:
        self._group, self._built_in, self._check = group, built_in, check

    @cached_property
    def _outside(self) -> dict[str, T]:
        outside: dict[str, T] = {}
        known = ChainMap(outside, self._built_in)  # type: ignore[arg-type]
        for entry in sorted(entry_points(group=self._group), key=lambda entry: entry.name):
            try:
                if entry.name in known:
                    raise ValueError("the name is in use")
                thing = entry.load()
                self._check(entry.name, thing, known)
            except Exception as error:  # an import may raise anything
                package = entry.dist.name if entry.dist else "unknown"
                place = f"package {package}, entry {entry.name} = {entry.value} of {self._group}"
                _log.warning("%s: skipped, %s: %s", place, type(error).__name__, error)
            else:
                outside[entry.name] = thing
        return outside

    def __getitem__(self, name: str) -> T:
        return self._built_in[name] if name in self._built_in else self._outside[name]

    def __contains__(self, name: object) -> bool:
        return name in self._built_in or name in self._outside

    def __iter__(self) -> Iterator[str]:
        yield from self._built_in
        yield from self._outside

    def __len__(self) -> int:
        return len(self._built_in) + len(self._outside)


def require_kind(base: type, name: str, thing: object) -> None:
    """Raise TypeError or ValueError unless an object is a subclass of a base with the name of its entry."""
    if not (isinstance(thing, type) and issubclass(thing, base)):
        raise TypeError(f"must be a subclass of {base.__name__}, got {thing!r}")
    if (own := getattr(thing, "name", None)) != name:
        raise ValueError(f"{thing.__name__}.name: must be {name!r}, the name of the entry, got {own!r}")
