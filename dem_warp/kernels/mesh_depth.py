"""Depth of points below a closed triangle mesh."""

import warp as wp

_FAR = wp.constant(1.0e6)  # farther than any point of a mesh of unit size


@wp.kernel
def mesh_depth(
    # model
    mesh: wp.uint64,
    # state in
    points_in: wp.array(dtype=wp.vec3),
    # state out
    depths_out: wp.array(dtype=wp.float32),
):
    """Set the distance of each point to the nearest face, positive inside (by the winding number)."""
    index = wp.tid()
    point = points_in[index]
    query = wp.mesh_query_point_sign_winding_number(mesh, point, _FAR)
    nearest = wp.mesh_eval_position(mesh, query.face, query.u, query.v)
    depths_out[index] = -query.sign * wp.length(nearest - point)
