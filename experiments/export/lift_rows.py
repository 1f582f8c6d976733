"""Rows of the README that all inputs of the lifted cylinder share, and what no input has."""

from __future__ import annotations

from dem_warp import LiftedCylinder
from experiments.export.laws import Translated
from experiments.export.lift import SIDES, Lift
from experiments.export.sizes import sizes_text


def lift_rows(lift: Lift, exact_tube: bool = False) -> tuple[Translated, ...]:
    """Return the translation of the parts of the test that all codes share; the tube is a prism or exact."""
    scene = lift.scene
    prism = f"prism of {SIDES} sides that touch it from outside"
    return (
        *filling_rows(lift),
        Translated("tube", "cylinder", "the same" if exact_tube else prism),
        Translated("plate", _plate(lift), _plate(lift)),
        Translated("lift", f"{scene.lift_speed:g} m/s", f"{scene.lift_speed:g} m/s, until clear of the heap"),
        *end_rows(lift),
    )


def filling_rows(lift: Lift) -> tuple[Translated, ...]:
    """Return the translation of the grains and of the filling."""
    case, scene = lift.case, lift.scene
    scale = case.numerics.modulus_scale
    shear, softened = case.grains.material.shear_modulus, case.grain_material.shear_modulus
    softening = "as it is" if scale == 1.0 else f"softened by {scale:g}: {softened:.6g} Pa"
    sizes = sizes_text(case.grains)
    filled = f"{scene.grain_count} grains" if scene.grain_count else "to the rim, struck off there"
    rate = f"{lift.rain_rate:.4g} grains a second, {scene.rain_speed:g} m/s"
    slower = "" if lift.rain_rate == lift.given_rate else _slower(lift)
    return (
        Translated("shear modulus of the grains", f"{shear:.6g} Pa", f"{softening}; calibrated so, keep it"),
        Translated("sizes", sizes, f"{len(lift.templates)} templates: mean, variance and mean mass the same"),
        Translated("mass and inertia", "of the union of the spheres", "the same, given with each template"),
        Translated("filling", f"{filled}; {lift.given_rate:g} grains a second", f"{filled}; {rate}{slower}"),
    )


def end_rows(lift: Lift) -> tuple[Translated, ...]:
    """Return the translation of the end, the numerics and the seed."""
    case, scene = lift.case, lift.scene
    return (
        Translated(
            "end",
            f"at rest: rms speed below {scene.rest_speed:g} m/s, none above {lift.calm_speed:g} m/s, for "
            f"{scene.rest_time:g} s",
            "the same, of the spheres' speeds",
        ),
        Translated("time step", f"{case.time_step:.6g} s", f"{case.time_step:.6g} s"),
        Translated("gravity", _gravity(lift), _gravity(lift)),
        Translated("seed", f"{case.seed}", "seeds made from it: another heap of the same kind"),
    )


def _slower(lift: Lift) -> str:
    """Say what a slower rain does, and how the study can have the same."""
    rate = f"rain_rate = {lift.rain_rate:.4g}"
    return (
        " (the most that find a place at random: a slower rain packs denser, and heaps of a flat kernel were "
        f"1.2 degrees flatter at a sixth of the rate; {rate} in the study's scene gives it the same filling)"
    )


def lift_warnings(lift: Lift, ends_in_time: bool = False) -> tuple[str, ...]:
    """Name what no input has; some can end at a given time."""
    scene = lift.scene
    left_out = {
        f"air_drag = {scene.air_drag:g} /s": scene.air_drag > 0.0,
    }
    if isinstance(scene, LiftedCylinder):
        left_out |= {
            f"vibration_amplitude = {scene.vibration_amplitude:g} m": scene.vibration_amplitude > 0.0,
            f"duration = {scene.duration} s, in place of it the test ends at rest": scene.duration is not None
            and not ends_in_time,
        }
    return tuple(f"scene {name}: left out" for name, present in left_out.items() if present)


def _plate(lift: Lift) -> str:
    diameter = lift.scene.plate_diameter
    return "endless plane" if diameter is None else f"disc of {diameter:g} m, over whose rim grains are lost"


def _gravity(lift: Lift) -> str:
    return f"({', '.join(f'{part:.4g}' for part in lift.scene.gravity)}) m/s2"
