"""The codes that a settled column can be compared with."""

from enum import StrEnum

from experiments.evidence.performance.peers import lammps, liggghts, yade
from experiments.evidence.performance.peers.peer import Peer


class PeerName(StrEnum):
    """Names of the codes."""

    LAMMPS = "lammps"
    LIGGGHTS = "liggghts"
    YADE = "yade"


PEERS = {
    PeerName.LAMMPS: Peer("lmp", "lammps", lammps.simulate),
    PeerName.LIGGGHTS: Peer("liggghts", "liggghts", liggghts.simulate),
    PeerName.YADE: Peer("yade", "yade", yade.simulate),
}
