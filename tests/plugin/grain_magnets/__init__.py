"""A package from outside that adds one of each: a law, a scene, a mechanism, a design and an engine."""

from pathlib import Path

MAGNETIC_GRAINS = Path(__file__).with_name("magnetic_grains.toml")
