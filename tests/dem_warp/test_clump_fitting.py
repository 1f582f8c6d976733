"""Clumps fitted to solids: closed forms of single spheres, inscription, monotony, files and refused input."""

import numpy as np
import pytest
import trimesh

from dem_warp.clump_fitting import fit_clump
from dem_warp.solids import MESH_KINDS, parse_solid, read_mesh

# Resolution 40 leaves samples 1/40 of the longest side apart, and a polyhedron of 48 sides to a circle is
# 0.3 % short of its area: relative volumes of these solids are known to about a percent.
PERCENT = 0.01


def test_a_sphere_is_filled_by_one_sphere_of_three():
    fit = fit_clump(parse_solid("sphere:4"), 3)
    assert fit.shape.sphere_count == 1
    # The inscribed ball of the polyhedron is 0.1 % smaller, and the centre is found to a tenth of a sample.
    assert fit.shape.radii[0] == pytest.approx(2e-3, rel=PERCENT)
    assert fit.coverage == pytest.approx(1.0, abs=PERCENT)
    assert fit.overshoot == 0.0


def test_the_first_sphere_of_a_cylinder_is_the_largest_inscribed_one():
    fit = fit_clump(parse_solid("cylinder:6x2"), 1)
    # The centre misses the axis by a tenth of a sample at most: 0.1 * 6 mm / 40, of the radius 1.5 %.
    assert fit.shape.radii[0] == pytest.approx(1e-3, rel=0.02)
    ball_over_cylinder = (4.0 / 3.0) * 1.0 / 6.0
    assert fit.coverage == pytest.approx(ball_over_cylinder, abs=PERCENT)


def test_a_capsule_is_its_row_of_spheres():
    fit = fit_clump(parse_solid("capsule:6x2"), 7)
    np.testing.assert_allclose(fit.shape.radii, 1e-3, rtol=0.02)
    spread = np.sort(np.linalg.norm(fit.shape.centers, axis=1))[-2:]
    # The end spheres sit 2 mm from the middle; they may be two samples short of it without loss.
    np.testing.assert_allclose(spread, 2e-3, atol=2.0 * 6e-3 / 40.0)
    assert fit.coverage > 0.9


def test_inscribed_spheres_stay_inside_and_more_cover_more_and_protruding_ones_overshoot():
    solid = parse_solid("tri-pyramid:5.90x3.93")
    fits = [fit_clump(solid, count) for count in (1, 3, 9)]
    for fit in fits:
        assert fit.overshoot == 0.0
        assert fit.shape.volume <= fit.solid_volume
        # The same volume by samples and by the surface of the union.
        assert fit.coverage == pytest.approx(fit.shape.volume / fit.solid_volume, abs=2.0 * PERCENT)
    coverages = [fit.coverage for fit in fits]
    assert coverages == sorted(coverages)
    assert coverages[-1] > 1.5 * coverages[0]
    protruding = fit_clump(solid, 9, protrusion=0.2e-3)
    assert protruding.coverage > coverages[-1]
    assert protruding.overshoot > 0.0
    # Inside and outside together are the union's volume.
    total = protruding.coverage + protruding.overshoot
    assert total == pytest.approx(protruding.shape.volume / protruding.solid_volume, abs=2.0 * PERCENT)


def test_a_fit_is_repeatable_and_scales_with_its_solid():
    solid = parse_solid("ellipsoid:6x3x2.5")
    fit, again = fit_clump(solid, 4), fit_clump(solid, 4)
    assert fit.shape == again.shape
    double = fit_clump(solid.copy().apply_scale(2.0), 4)
    # Twice as large is the same problem in units of the longest side: float32 distances are left, 1e-7.
    np.testing.assert_allclose(double.shape.radii, 2.0 * fit.shape.radii, rtol=1e-6)


def test_a_mesh_file_comes_back_in_metres(tmp_path):
    mesh = trimesh.creation.box((4.0, 2.0, 1.0))
    mesh.export(tmp_path / "grain.stl")
    read = read_mesh(tmp_path / "grain.stl")
    assert read.volume == pytest.approx(8e-9, rel=1e-6)  # float32 of the STL format
    inches = read_mesh(tmp_path / "grain.stl", unit=25.4e-3)
    assert inches.volume == pytest.approx(8.0 * 25.4e-3**3, rel=1e-6)
    assert fit_clump(read, 1).shape.radii[0] == pytest.approx(0.5e-3, rel=0.02)  # a tenth of a sample


@pytest.mark.parametrize("kind", MESH_KINDS)
def test_faces_turned_over_are_turned_back_without_networkx(tmp_path, monkeypatch, kind):
    """Read two bodies, some of their faces turned over; trimesh itself would need networkx."""
    for module in (trimesh.graph, trimesh.repair):
        monkeypatch.setattr(module, "nx", None)
    ball, box = (
        trimesh.creation.icosphere(subdivisions=2),
        trimesh.creation.box(bounds=[[3, 0, 0], [4, 1, 1]]),
    )
    whole = trimesh.util.concatenate([ball, box])
    faces = np.array(whole.faces)
    faces[::3] = faces[::3, ::-1]
    trimesh.Trimesh(whole.vertices, faces, process=False).export(tmp_path / f"grain.{kind}")
    read = read_mesh(tmp_path / f"grain.{kind}", unit=1.0)
    assert read.is_winding_consistent
    # coordinates of a file have seven digits
    assert read.volume == pytest.approx(ball.volume + 1.0, rel=1e-6)


def test_bad_mesh_files_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"missing\.stl"):
        read_mesh(tmp_path / "missing.stl")
    (tmp_path / "text.doc").write_text("no mesh")
    with pytest.raises(ValueError, match=r"text\.doc: must end in stl, obj, ply, off, got doc"):
        read_mesh(tmp_path / "text.doc")
    (tmp_path / "text.ply").write_text("no mesh")
    with pytest.raises(ValueError, match=r"text\.ply: not a readable mesh"):
        read_mesh(tmp_path / "text.ply")
    open_box = trimesh.creation.box((1.0, 1.0, 1.0))
    open_box.update_faces(np.arange(len(open_box.faces)) > 0)
    open_box.export(tmp_path / "open.stl")
    with pytest.raises(ValueError, match=r"open\.stl: the surface must be closed"):
        read_mesh(tmp_path / "open.stl")
    with pytest.raises(ValueError, match="unit: must be positive and finite"):
        read_mesh(tmp_path / "open.stl", unit=0.0)
