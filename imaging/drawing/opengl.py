"""Drawing of spheres with pyvista (VTK), without a display and without messages on stderr."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from imaging.drawing.raster import averaged
from imaging.geometry import FloatArray, Frame, Picture, Spheres
from imaging.picture_error import PictureError

if TYPE_CHECKING:
    import pyvista

SUPERSAMPLING = 3
"""Factor by which the drawing is finer than the picture."""
SECTORS, RINGS = 24, 5
"""Facets of a sphere: round the line of sight, and from its rim to its middle."""
LIGHT_POSITION = (-0.45, 0.61, 0.65)
"""Direction of the light for a VTK headlight: right, up, towards the camera."""
QUIET_ENVIRONMENT = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow", "EGL_LOG_LEVEL": "fatal"}
"""Variables that keep VTK on Linux from asking an X server first, and from complaining on stderr."""
PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.OffScreenRenderingOn()
window.AddRenderer(vtkRenderer())
window.Render()
raise SystemExit(0 if window.SupportsOpenGL() else 1)
"""


@functools.cache
def opengl_works() -> bool:
    """Return True if VTK can draw on this machine.

    The test runs once, in a child process: without a driver VTK ends the process instead of raising an error.
    """
    environment = os.environ | QUIET_ENVIRONMENT
    probe = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, check=False, env=environment)
    return probe.returncode == 0


def coverage(spheres: Spheres, frame: Frame, azimuth: float) -> Picture:
    """Draw the share of each pixel that the spheres cover, 0 to 255, like `raster.coverage`."""
    return shaded(spheres, np.zeros((len(spheres.radii), 3)), frame, azimuth)[:, :, 3]


def shaded(spheres: Spheres, colors: FloatArray, frame: Frame, azimuth: float) -> Picture:
    """Draw lit spheres, (rows, columns, 4) blue-green-red and opacity, like `raster.shaded`."""
    if not opengl_works():
        raise PictureError("backend 'pyvista'", "VTK has no OpenGL driver to draw with (EGL or OSMesa)")
    import pyvista

    rows, columns = frame.shape
    with _quiet_environment():
        plotter = pyvista.Plotter(
            off_screen=True, window_size=[SUPERSAMPLING * columns, SUPERSAMPLING * rows], lighting="none"
        )
        plotter.add_mesh(
            _sphere_mesh(spheres, colors, azimuth),
            scalars="color",
            rgb=True,
            smooth_shading=False,
            ambient=0.35,
        )
        plotter.add_light(pyvista.Light(position=LIGHT_POSITION, light_type="camera light", intensity=1.1))
        _aim(plotter, frame)
        picture = plotter.screenshot(return_img=True, transparent_background=True)
        plotter.close()
    layer = np.asarray(picture)[:, :, [2, 1, 0, 3]].astype(np.float32)
    layer[:, :, :3] *= layer[:, :, 3:] / 255.0
    return averaged(layer, frame.shape)


@contextmanager
def _quiet_environment() -> Iterator[None]:
    before = {name: os.environ.get(name) for name in QUIET_ENVIRONMENT}
    os.environ.update(QUIET_ENVIRONMENT)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _aim(plotter: pyvista.Plotter, frame: Frame) -> None:
    """Look along +y at the frame's middle, with a parallel projection."""
    rows = frame.shape[0]
    middle = (frame.ground_rows - 0.5 * rows) * frame.meters_per_pixel
    distance = 4.0 * frame.half_width
    plotter.camera.focal_point = (0.0, 0.0, middle)
    plotter.camera.position = (0.0, -distance, middle)
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 0.5 * rows * frame.meters_per_pixel
    plotter.camera.clipping_range = (0.5 * distance, 1.5 * distance)


def _sphere_mesh(spheres: Spheres, colors: FloatArray, azimuth: float) -> pyvista.PolyData:
    """Build the near half of every sphere, in the camera's frame, with smooth normals."""
    import pyvista

    unit, triangles = _hemisphere()
    count = len(spheres.radii)
    points = spheres.seen_from(azimuth)[:, None] + spheres.radii[:, None, None] * unit
    corners = (triangles + len(unit) * np.arange(count)[:, None, None]).reshape(-1, 3)
    faces = np.column_stack([np.full(len(corners), 3), corners])
    mesh = pyvista.PolyData(points.reshape(-1, 3), faces=faces.ravel())
    mesh.point_data.active_normals = np.tile(unit / np.linalg.norm(unit, axis=1, keepdims=True), (count, 1))
    mesh["color"] = np.repeat(np.rint(colors[:, ::-1]).astype(np.uint8), len(unit), axis=0)
    return mesh


def _hemisphere() -> tuple[FloatArray, NDArray[np.int64]]:
    """Points and triangles of the half sphere towards -y; its rim is a polygon of the circle's area."""
    step = 2.0 * np.pi / SECTORS
    rim = np.sqrt(step / np.sin(step))
    tilt, turn = np.meshgrid(
        np.linspace(0.5 * np.pi, 0.0, RINGS + 1), step * np.arange(SECTORS), indexing="ij"
    )
    unit = np.stack(
        [rim * np.sin(tilt) * np.cos(turn), -np.cos(tilt), rim * np.sin(tilt) * np.sin(turn)], axis=-1
    )
    ring, sector = np.mgrid[0:RINGS, 0:SECTORS]
    here, following = ring * SECTORS + sector, ring * SECTORS + (sector + 1) % SECTORS
    lower = np.stack([here, following, following + SECTORS], axis=-1)
    upper = np.stack([here, following + SECTORS, here + SECTORS], axis=-1)
    return unit.reshape(-1, 3), np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)])
