"""The codes that a settled column can be compared with."""

from enum import StrEnum

from experiments.evidence.performance.peers import lammps_peer, liggghts_peer, yade_peer
from experiments.evidence.performance.peers.peer import Peer


class PeerName(StrEnum):
    """Names of the codes."""

    LAMMPS = "lammps"
    LIGGGHTS = "liggghts"
    YADE = "yade"


PEERS = {
    PeerName.LAMMPS: Peer("lmp", "lammps", lammps_peer.simulate),
    PeerName.LIGGGHTS: Peer("liggghts", "liggghts", liggghts_peer.simulate),
    PeerName.YADE: Peer("yade", "yade", yade_peer.simulate),
}
