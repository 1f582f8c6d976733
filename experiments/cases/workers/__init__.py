"""Workers that simulate cases: those of this machine, or of a cluster; the same cases give the same bits."""
