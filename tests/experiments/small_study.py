"""Pieces of the small study, which tests replace, and conditions that they add."""

from pathlib import Path

SMALL = Path(__file__).with_name("small.toml").read_text(encoding="utf-8")
TUBE = SMALL[SMALL.index("[scene") : SMALL.index("\n[numerics]")]
ANGLE = '[target]\nmean = "30 deg"\nsd = "0.5 deg"\nn = 5\n'
CONDITIONS = """
[condition.base]

[condition.fast]
scene.lifted-cylinder.lift_speed = "0.25 m/s"

[condition.wide]
held_out = true
scene.lifted-cylinder.diameter = "40 mm"
"""
