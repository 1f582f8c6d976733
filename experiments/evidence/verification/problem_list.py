"""Problems of the verification: each is one file of `problems` and one line here."""

from experiments.evidence.verification.check import Problem
from experiments.evidence.verification.problems.bench import bench
from experiments.evidence.verification.problems.beverloo import beverloo, coned
from experiments.evidence.verification.problems.deme_contacts import deme_contacts
from experiments.evidence.verification.problems.energy import energy
from experiments.evidence.verification.problems.heap_angle import heap_angle
from experiments.evidence.verification.problems.janssen import janssen
from experiments.evidence.verification.problems.lammps_contacts import lammps_contacts
from experiments.evidence.verification.problems.liggghts_clumps import liggghts_clumps
from experiments.evidence.verification.problems.liggghts_contacts import liggghts_contacts
from experiments.evidence.verification.problems.micro_slip_path import micro_slip
from experiments.evidence.verification.problems.normal_impact import elastic_impact, restitution
from experiments.evidence.verification.problems.oblique_impact import oblique_impact, spinning_impact
from experiments.evidence.verification.problems.pair_laws import pair_laws
from experiments.evidence.verification.problems.penetrated import penetrated
from experiments.evidence.verification.problems.pressed import pressed, sheared
from experiments.evidence.verification.problems.released_boxes import released
from experiments.evidence.verification.problems.rigid_body import rigid_body
from experiments.evidence.verification.problems.single_grains import single_grains
from experiments.evidence.verification.problems.stability import stability
from experiments.evidence.verification.problems.yade_contacts import yade_contacts

PROBLEMS: dict[str, Problem] = {
    "elastic-impact": elastic_impact,
    "restitution": restitution,
    "oblique-impact": oblique_impact,
    "micro-slip": micro_slip,
    "spinning-impact": spinning_impact,
    "pair-laws": pair_laws,
    "rigid-body": rigid_body,
    "liggghts-contacts": liggghts_contacts,
    "liggghts-clumps": liggghts_clumps,
    "lammps-contacts": lammps_contacts,
    "yade-contacts": yade_contacts,
    "deme-contacts": deme_contacts,
    "energy": energy,
    "janssen": janssen,
    "beverloo": beverloo,
    "coned": coned,
    "heap-angle": heap_angle,
    "released": released,
    "pressed": pressed,
    "penetrated": penetrated,
    "sheared": sheared,
    "bench": bench,
    "single-grains": single_grains,
    "stability": stability,
}

PEERS = ("liggghts-contacts", "liggghts-clumps", "lammps-contacts", "yade-contacts", "deme-contacts")
"""Problems that run another code, which must be installed."""

BENCH = ("released", "pressed", "penetrated", "sheared", "bench")
HEAVY = ("beverloo", "coned", "heap-angle", "stability", *BENCH, *PEERS)
"""Problems that run only when they are named: minutes on a GPU, up to hours on two cores, or another code."""
