"""Pieces of the small study, which tests replace, and conditions that they add."""

TUBE = '[scene.lifted-cylinder]\ndiameter = "28 mm"\nheight = "28 mm"\ngrain_count = 30\n'
ANGLE = '[target]\nmean = "30 deg"\nsd = "0.5 deg"\nn = 5\n'
CONDITIONS = """
[condition.base]

[condition.fast]
scene.lifted-cylinder.lift_speed = "0.25 m/s"

[condition.wide]
held_out = true
scene.lifted-cylinder.diameter = "40 mm"
"""
