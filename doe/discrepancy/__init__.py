"""Discrepancy between a simulator and measurements, and the effect that the model lacks.

A simulator answers points with observables. It has factors, which every calibration adjusts, and mechanisms,
which it may have beyond its base model; it is run under several conditions. Given measured replicates, an
analysis calibrates the base, tests the residuals against the noise, lets the mechanisms compete to explain
them with fresh runs of the simulator, and names one where the data distinguish it from every other.

The folders are in the order of use: `problem` (ranges, measured data, rules), `emulation` (a bank of runs and
the emulator fitted to it), `fitting`, `contest`, `verdict`. `analyse` is the whole, as a generator of the
runs that it needs; `drive` answers it.

>>> import numpy as np
>>> def run(point):  # two factors, two conditions, one mechanism
...     rng, (a, b), hot = np.random.default_rng(point.seed), point.theta, point.condition == "hot"
...     leak = dict(point.sizes).get("leak", 0.0)
...     return [a + b, a - b + leak, a * b + hot - leak, b + hot * leak] + 0.05 * rng.standard_normal(4)
>>> def simulate(points):
...     return Outcomes(np.array([run(point) for point in points]), ("",) * len(points))
>>> space = SearchSpace(
...     factors=("a", "b"), lower=(0.0, 0.0), upper=(1.0, 1.0),
...     conditions=("cold", "hot"), held_out=(False, True), mechanisms=(MechanismRange("leak", 0.0, 1.0),))
>>> settings = Settings(bank_points=32, bank_mechanism_points=32)
>>> points = bank_points(space, settings)
>>> emulator = fit_emulator(make_bank(space, ("w", "x", "y", "z"), points, simulate(points)))
>>> seen = {name: [run(Point((0.4, 0.6), (("leak", 0.5),), name, seed)) for seed in range(5)]
...         for name in space.conditions}
>>> measured = Measured(space.conditions, emulator.observables, {c: np.array(v) for c, v in seen.items()})
>>> found = drive(analyse(measured, emulator, settings, seed=1), simulate)
>>> found.verdict.value, found.named
('named', ('leak',))
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
