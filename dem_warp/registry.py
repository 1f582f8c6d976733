"""Registries: laws, scenes and the like by name, those of this tree and those of packages from outside."""

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
    """Things of this tree by name, each imported when it is first wanted: names alone load nothing.

    Parameters
    ----------
    places : mapping
        Module and name of each, as ``"dem_warp.laws.jkr:JKR"``.
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
    """Built-in things by name, then those that installed packages announce as entry points.

    A package from outside announces what it adds in its pyproject.toml; the name is the entry's own::

        [project.entry-points."dem_warp.laws"]
        magnetism = "grain_magnets.law:Magnetism"

    Its entries are loaded when the registry is first looked at, and once. One that cannot be loaded, or that
    breaks a rule, is left out with a warning; the others stay.

    Parameters
    ----------
    group : str
        Group of the entry points, as ``"dem_warp.laws"``.
    built_in : mapping
        Things of this tree by name.
    check : callable
        Called with name and thing of an entry, and with all that is known before it; raises ValueError or
        TypeError for one that breaks a rule.
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
        """Entries that packages from outside announce."""
        outside: dict[str, T] = {}
        known = ChainMap(outside, self._built_in)  # type: ignore[arg-type]
        for entry in sorted(entry_points(group=self._group), key=lambda entry: entry.name):
            try:
                if entry.name in known:
                    raise ValueError("the name is taken")
                thing = entry.load()
                self._check(entry.name, thing, known)
            except Exception as error:  # whatever a package from outside does at its import
                package = entry.dist.name if entry.dist else "unknown"
                place = f"package {package}, entry {entry.name} = {entry.value} of {self._group}"
                _log.warning("%s: left out, %s: %s", place, type(error).__name__, error)
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
    """Check that a thing is a kind of another and has the name of its entry.

    Raises
    ------
    TypeError, ValueError
        When it is none, or has another name.
    """
    if not (isinstance(thing, type) and issubclass(thing, base)):
        raise TypeError(f"must be a subclass of {base.__name__}, got {thing!r}")
    if (own := getattr(thing, "name", None)) != name:
        raise ValueError(f"must have the name of its entry, got {own!r}")
