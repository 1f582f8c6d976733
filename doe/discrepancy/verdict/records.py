"""Records of a discovery in natural units, from the arrays of an analysis."""

import numpy as np

from doe.discrepancy.contest.gap import GapTest, condition_fits, drift_p
from doe.discrepancy.contest.held_out import forecast
from doe.discrepancy.contest.signatures import Signatures, projector
from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import Block, Evidence, scale_numbers
from doe.discrepancy.fitting.model_fit import AT_BOUND, Fitted, Interval, weigh
from doe.discrepancy.fitting.size_interval import coded_size_interval
from doe.discrepancy.problem.replicates import Calibration
from doe.discrepancy.problem.settings import Settings
from doe.discrepancy.verdict.conclusion import Assessment, objections
from doe.discrepancy.verdict.discovery import CalibrationUse, Candidate, Data, Drift, Fit

REPORTED = 1.5
"""Variance of replicates over that of the model from which on a note reports it."""


def data_record(emulator: Emulator, evidence: Evidence, base: Fitted | None = None) -> Data:
    """Return the measured means, a row per condition of the emulator, with errors by the calibrated base."""
    conditions, observables = emulator.space.conditions, emulator.observables
    shape = (len(conditions), len(observables))
    means, errors, replicates = np.full(shape, np.nan), np.full(shape, np.nan), np.zeros(shape, dtype=int)
    model = Model(emulator, (), 0.0) if base is None else base.model
    x = model.start if base is None else base.x
    for block in (*evidence.training, *evidence.held_out):
        row = conditions.index(block.condition)
        means[row, block.columns] = block.mean
        own = block.noise(model.run_covariance(x, block.condition), model.excess(x, block.scatter))
        errors[row, block.columns] = np.sqrt(np.diag(own))
        replicates[row, block.columns] = block.replicates
    return Data(conditions, observables, emulator.space.held_out, means, errors, replicates)


def fit_record(fitted: Fitted, gap: GapTest, evidence: Evidence) -> Fit:
    """Return a calibrated model: parameters, predictions of every condition, residuals with p values."""
    emulator = fitted.model.emulator
    space = emulator.space
    factors = len(space.factors)
    theta = space.natural_theta(fitted.x[:factors])
    half_range = (np.array(space.upper) - np.array(space.lower)) / 2.0
    errors = fitted.errors[:factors] * half_range
    at_bounds = (fitted.x < fitted.model.lower + AT_BOUND) | (fitted.x > fitted.model.upper - AT_BOUND)
    names = (*space.factors, *fitted.mechanisms)
    predicted, predicted_se = _predictions(fitted)
    return Fit(
        mechanisms=fitted.mechanisms,
        theta=tuple(float(value) for value in theta),
        theta_se=tuple(float(value) for value in errors),
        sizes=size_intervals(fitted),
        at_bounds=tuple(name for name, at in zip(names, at_bounds, strict=True) if at),
        q=gap.q,
        degrees_of_freedom=gap.freedom,
        q_limit=gap.q_limit,
        p_value=gap.p,
        clearest=gap.clearest,
        predicted=predicted,
        predicted_se=predicted_se,
        residuals=_residual_map(fitted, evidence),
        calibration=calibration_uses(fitted, evidence),
        heading=_heading(fitted),
    )


def calibration_uses(fitted: Fitted, evidence: Evidence) -> tuple[CalibrationUse, ...]:
    """Return declared calibration errors, each with its expected value given all residuals of a model."""
    whole = weigh(Stack(fitted.model, (*evidence.training, *evidence.held_out)), fitted.x)
    offsets, scales = (whole.stack.common @ whole.whitening.T @ whole.residuals).reshape(2, -1)
    observables = fitted.model.emulator.observables
    asked = np.column_stack([offsets, scales[scale_numbers(observables, evidence.calibration)]])
    measured = np.concatenate([block.columns for block in whole.stack.blocks])
    uses = []
    for column, (observable, errors) in enumerate(zip(observables, asked, strict=True)):
        one = evidence.calibration.get(observable, Calibration())
        if column not in measured or not (one.offset or one.scale):
            continue
        z = errors * [1.0, one.scale > 0.0]  # another observable of its instrument may have an error of scale
        offset, scale = (float(each) for each in z * [one.offset, one.scale])
        length = float(np.hypot(*z))
        uses.append(CalibrationUse(observable, one.offset, one.scale, offset, scale, length))
    return tuple(uses)


def size_intervals(fitted: Fitted) -> tuple[Interval, ...]:
    """Return the natural size of each mechanism with its 90 % interval."""
    space = fitted.model.emulator.space
    out = []
    for number, (name, size) in enumerate(zip(fitted.mechanisms, fitted.coded_sizes, strict=True)):
        ends = [space.natural_size(name, end) for end in coded_size_interval(fitted, number)]
        out.append(Interval(min(ends), space.natural_size(name, float(size)), max(ends)))
    return tuple(out)


def scatter_notes(fitted: Fitted) -> tuple[str, ...]:
    """Note replicates that scatter more than the model at its optimum."""
    stack = fitted.stack
    excess = fitted.model.excess(fitted.x, stack.blocks[0].scatter)
    notes = []
    if excess.runs > REPORTED:
        notes.append(f"replicates scatter {excess.runs**0.5:.1f} times as much as the model's, and count so")
    notes += [
        f"readings of {name} scatter {reading**0.5:.1f} times as much as the model's runs do, each by itself,"
        " and count so"
        for name, reading in zip(fitted.model.emulator.observables, excess.reading, strict=True)
        if reading > REPORTED - 1.0
    ]
    return tuple(notes)


def _predictions(fitted: Fitted) -> tuple[np.ndarray, np.ndarray]:
    """Return every observable of every condition, and its standard error from the fit and the emulator."""
    emulator = fitted.model.emulator
    count = len(emulator.observables)
    values, errors = [], []
    for condition in emulator.space.conditions:
        seen = forecast(fitted, (Block.of_runs(condition, np.arange(count), 1),))
        values.append(seen.predicted)
        errors.append(np.sqrt(np.maximum(np.diag(seen.covariance - seen.noise), 0.0)))
    return np.array(values), np.array(errors)


def _residual_map(fitted: Fitted, evidence: Evidence) -> np.ndarray:
    """Return residuals in standard deviations, (conditions, observables)."""
    emulator = fitted.model.emulator
    residuals = np.full((len(emulator.space.conditions), len(emulator.observables)), np.nan)
    # the variance of a training residual is the part that a refit leaves
    root = np.linalg.inv(fitted.whitening) @ projector(fitted.sensitivities)
    training = np.sqrt(np.maximum((root**2).sum(axis=1), 1e-12 * np.diag(fitted.covariance)))
    raw = [(fitted.stack.target - fitted.stack.predict(fitted.x[None])[0]) / training]
    blocks = list(evidence.training)
    for block in evidence.held_out:
        seen = forecast(fitted, (block,))
        raw.append((seen.measured - seen.predicted) / np.sqrt(np.diag(seen.covariance)))
        blocks.append(block)
    whole = np.concatenate(raw)
    start = 0
    for block in blocks:
        row, end = emulator.space.conditions.index(block.condition), start + len(block.mean)
        residuals[row, block.columns] = whole[start:end]
        start = end
    return residuals


def drift_records(base: Fitted) -> tuple[Drift, ...]:
    """Return each factor fitted to one condition at a time."""
    fits = condition_fits(base)
    if len(fits) < 2:
        return ()
    space = base.model.emulator.space
    half_range = (np.array(space.upper) - np.array(space.lower)) / 2.0
    conditions = tuple(one.stack.blocks[0].condition for one in fits)
    values = np.array([space.natural_theta(one.x) for one in fits])
    errors = np.array([one.errors * half_range for one in fits])
    return tuple(
        Drift(
            factor,
            conditions,
            tuple(float(value) for value in values[:, column]),
            tuple(float(value) for value in errors[:, column]),
            drift_p(values[:, column], errors[:, column]),
        )
        for column, factor in enumerate(space.factors)
    )


def candidate_record(
    assessment: Assessment, base: Signatures, scores: np.ndarray, settings: Settings
) -> Candidate:
    """Return one row of the evidence table; for a pair, score and share are those of the stronger."""
    fitted = assessment.fitted
    numbers = [base.names.index(name) for name in assessment.mechanisms]
    found = objections(assessment, settings)
    return Candidate(
        mechanisms=assessment.mechanisms,
        score=float(max(scores[number] for number in numbers)),
        visible_share=float(max(base.shares[number] for number in numbers)),
        sizes=size_intervals(fitted),
        size_over_se=tuple(float(value) for value in assessment.ratios),
        q=assessment.gap.q,
        degrees_of_freedom=assessment.gap.freedom,
        p_value=assessment.gap.p,
        explained=assessment.explained,
        held_out_gain=assessment.gain,
        simulated=assessment.simulated,
        admitted=not found,
        objection=found[0] if found else "",
        heading=_heading(fitted),
    )


def _heading(fitted: Fitted) -> float | None:
    return fitted.model.heading if fitted.model.is_directed else None
