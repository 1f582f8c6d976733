"""Clump shapes: mass properties of sphere unions against closed forms, the principal frame, files."""

import math

import numpy as np
import pytest

from dem_warp.clumps import ClumpShape
from dem_warp.sphere_union import union_moments

BALL = 4.0 / 3.0 * math.pi
TETRAHEDRON = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])


def rotation(axis, angle):
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def lens_volume(a, b, distance):
    """Return the volume common to two spheres (MathWorld, Sphere-Sphere Intersection, equation 16)."""
    gap = a + b - distance
    spread = distance**2 + 2.0 * distance * (a + b) - 3.0 * (a - b) ** 2
    return math.pi * gap**2 * spread / (12.0 * distance)


def test_one_sphere_has_its_closed_form_mass_properties():
    shape = ClumpShape.sphere(1.5e-3)
    # The integrand is a polynomial on unbroken arcs: rounding and a 1e-9 azimuth rule are all that is left.
    assert shape.volume == pytest.approx(BALL * 1.5e-3**3, rel=1e-8)
    np.testing.assert_allclose(shape.inertia_over_mass, 0.4 * 1.5e-3**2, rtol=1e-8)
    assert shape.bounding_radius == pytest.approx(1.5e-3, rel=1e-8)
    assert shape.sphere_count == 1


@pytest.mark.parametrize("direction", [[0, 0, 1], [0.3, 0.5, -0.7]])
@pytest.mark.parametrize(("radius", "distance"), [(0.8, 1.3), (1.0, 0.4), (0.2, 1.19), (0.5, 0.51)])
def test_two_overlapping_spheres_have_the_lens_volume(direction, radius, distance):
    direction = np.array(direction) / np.linalg.norm(direction)
    moments = union_moments(np.array([[0.0, 0.0, 0.0], distance * direction]), np.array([1.0, radius]))
    expected = BALL * (1.0 + radius**3) - lens_volume(1.0, radius, distance)
    # Smooth between breakpoints, so the 64 nodes leave the 1e-9 of the azimuth rule.
    assert moments.volume == pytest.approx(expected, rel=1e-7)
    # By symmetry the centre lies on the line of the two.
    assert np.linalg.norm(np.cross(moments.center, direction)) < 1e-7


def test_two_overlapping_spheres_have_the_moments_of_two_caps():
    half, resolution = 0.6, 20001
    moments = union_moments(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), np.array([1.0, 1.0]))
    # Slices across the axis are discs of area pi s^2: Simpson's rule over half the body.
    z = np.linspace(0.0, 1.0 + half, resolution)
    weights = np.where(np.arange(resolution) % 2, 4.0, 2.0) * (z[1] / 3.0)
    weights[[0, -1]] = z[1] / 3.0
    squared = 1.0 - (z - half) ** 2
    volume = 2.0 * math.pi * weights @ squared
    along = 2.0 * math.pi * weights @ (squared * z**2) / volume
    across = 2.0 * math.pi * weights @ (squared**2 / 4.0) / volume
    expected = np.diag([across + along, across + along, 2.0 * across])
    # Polynomials of degree four in z: Simpson's error is below 1e-15 here, the azimuth rule leaves 1e-9.
    np.testing.assert_allclose(moments.inertia_over_mass, expected, rtol=1e-8, atol=1e-8)


def test_many_overlapping_spheres_agree_with_a_fine_voxel_sum():
    rng = np.random.default_rng(7)
    centers, radii = rng.uniform(-0.6, 0.6, (6, 3)), rng.uniform(0.4, 0.8, 6)
    count, reach = 160, 1.4
    axis = (np.arange(count) + 0.5) * (2.0 * reach / count) - reach
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.zeros(len(points), dtype=bool)
    for center, radius in zip(centers, radii, strict=True):
        inside |= ((points - center) ** 2).sum(axis=1) < radius**2
    moments = union_moments(centers, radii)
    # The surface cuts about 60,000 voxels; their errors, independent and of half a voxel at most, sum to
    # some 70 of the 650,000 inside: 1e-4. Three times that.
    assert moments.volume == pytest.approx(inside.mean() * (2.0 * reach) ** 3, rel=3e-4)
    np.testing.assert_allclose(moments.center, points[inside].mean(axis=0), atol=3e-4)
    np.testing.assert_allclose(moments.second, np.cov(points[inside].T), atol=3e-4)


def test_spheres_inside_others_change_nothing():
    outer = union_moments(np.zeros((1, 3)), np.ones(1))
    centers = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    moments = union_moments(
        centers, np.array([1.0, 0.5, 1.0, 0.2])
    )  # touching from inside, equal, concentric
    assert moments.volume == outer.volume
    np.testing.assert_array_equal(moments.second, outer.second)


@pytest.mark.parametrize(("axis", "angle"), [([1, 2, 3], 0.7), ([3, -1, 1], 3.0)])
def test_the_principal_frame_diagonalises_the_inertia_of_a_turned_clump(axis, angle):
    centers = np.array([[-2.0, 0.0, 0.0], [0.0, 0.7, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.4]])
    radii = np.array([1.0, 0.8, 1.0, 1.2])
    turned = centers @ rotation(axis, angle).T + [5.0, -3.0, 2.0]
    shape = ClumpShape.from_spheres(turned, radii)
    again = union_moments(shape.centers, shape.radii)
    # The inertia is exact to the quadrature's 1e-4 in both frames.
    tolerance = 2e-4 * shape.inertia_over_mass.max()
    np.testing.assert_allclose(again.inertia_over_mass, np.diag(shape.inertia_over_mass), atol=tolerance)
    np.testing.assert_allclose(again.center, 0.0, atol=2e-4)
    straight = ClumpShape.from_spheres(centers, radii)
    np.testing.assert_allclose(
        np.sort(shape.inertia_over_mass), np.sort(straight.inertia_over_mass), atol=tolerance
    )


def test_the_principal_frame_turns_less_than_a_relabelling_of_axes():
    # A long body turned by a little must turn back by a little: the diagonal of the way back stays near one.
    centers = np.array([[-2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [2.0, 0.0, 0.0]])
    turned = centers @ rotation([0, 0, 1], 0.2).T
    shape = ClumpShape.from_spheres(turned, np.ones(3))
    # Symmetric about x = 0, so the long axis is x exactly, up to the quadrature's 1e-4.
    np.testing.assert_allclose(shape.centers[2] - shape.centers[0], [4.0, 0.0, 0.0], atol=4e-4)


def test_a_file_comes_back_as_it_was_written(tmp_path):
    shape = ClumpShape.from_spheres(1e-3 * TETRAHEDRON, [1.6e-3, 1.5e-3, 1.4e-3, 1.3e-3])
    shape.write(tmp_path / "clump.txt")
    again = ClumpShape.read(tmp_path / "clump.txt")
    # Written to 1e-12 m; the centre is found again to the rounding of that.
    np.testing.assert_allclose(again.centers, shape.centers, atol=3e-9)
    np.testing.assert_allclose(again.radii, shape.radii, atol=1e-12)
    assert again.volume == pytest.approx(shape.volume, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0 0 0 1\n0 0 1\n", r"clump.txt, line 2: must be four finite numbers .* got '0 0 1'"),
        ("# head\n0 0 0 -1\n", r"clump.txt, line 2: .* with r > 0, got '0 0 0 -1'"),
        ("# nothing\n", r"clump.txt: must have at least one line"),
    ],
)
def test_a_bad_file_is_refused_with_its_line(tmp_path, text, message):
    path = tmp_path / "clump.txt"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        ClumpShape.read(path)


def test_a_shape_is_a_value():
    one, same, other = ClumpShape.sphere(1e-3), ClumpShape.sphere(1e-3), ClumpShape.sphere(2e-3)
    assert one == same
    assert hash(one) == hash(same)
    assert one != other
    assert one.to_dict() == {"centers": one.centers.tolist(), "radii": [1e-3]}
    with pytest.raises(ValueError, match="read-only"):
        one.radii[0] = 2e-3


def test_an_elongated_chain_is_longer_thinner_and_as_large():
    elongation = 0.2
    chain = ClumpShape.from_spheres([[0.0, 0.0, -1e-3], [0.0, 0.0, 0.0], [0.0, 0.0, 1e-3]], [1e-3] * 3)
    drawn = chain.elongated(elongation)
    assert drawn.volume == chain.volume
    assert drawn.sphere_count == 3
    spacing = np.diff(drawn.centers[:, 2]) / drawn.radii[1:]
    np.testing.assert_allclose(spacing, 1.0 + elongation, rtol=1e-12)
    assert (drawn.radii < chain.radii).all()
    # As said, its mass properties are those of the union of its spheres, scaled without another quadrature.
    union = ClumpShape.from_spheres(drawn.centers, drawn.radii)
    assert union.volume == pytest.approx(drawn.volume, rel=1e-9)
    np.testing.assert_allclose(union.inertia_over_mass, drawn.inertia_over_mass, rtol=1e-9)


def test_a_shape_is_drawn_out_along_its_longest_axis():
    plate = ClumpShape.from_spheres(
        1e-3 * np.array([[0, -2, 0], [0, 2, 0], [1, 0, 0], [-1, 0, 0]]), [1e-3] * 4
    )
    drawn = plate.elongated(0.5)
    scale = drawn.radii / plate.radii
    np.testing.assert_allclose(drawn.centers, plate.centers * [1.0, 1.5, 1.0] * scale[:, None], atol=1e-12)


def test_an_elongation_of_0_is_the_shape_itself():
    ball = ClumpShape.sphere(1e-3)
    assert ball.elongated(0.0) is ball
