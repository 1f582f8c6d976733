"""Ways in which LIGGGHTS makes the effects of the library, and what differs from ours."""

from collections.abc import Mapping

MADE: Mapping[str, str] = {
    "contact_adhesion": (
        "`sjkr`: k 2 pi R* d while spheres overlap, with k for JKR's largest pull between two spheres; "
        "no adhesion beyond the touch, and friction takes the load that the attraction leaves"
    ),
    "liquid_bridges": (
        "`easo/capillary/viscous` without viscosity: Soulie's force in place of Willett's, the same when "
        "spheres touch and the same length at the break; liquid is handed on as bridges break"
    ),
    "plate_tilt": "gravity turned towards +x: the same",
    "rolling_torque": (
        "`cdt` or `epsd2` against the relative rotation with the lever R*: `cdt` acts for whole steps, "
        "`epsd2` is a spring"
    ),
    "size_spread": "five classes of size with the moments of the normal spread, at the same mean mass",
    "vibration": "the plate, a mesh, wiggles as ours does, from the lift on for the same time",
}
"""Effects that it can make, and how."""

LAWS = (
    "`hertz` with `tangential history`: Coulomb's limit holds for the spring alone, so that spring and "
    "dashpot of a contact that sticks may pass it together, and takes the size of the normal force; ours "
    "holds for their sum, and takes the push"
)
"""Own ways of its base law."""
