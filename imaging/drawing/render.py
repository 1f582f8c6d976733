"""Pictures of a heap of spheres: silhouettes for measurements, shaded snapshots for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from imaging.drawing import opengl, raster
from imaging.geometry import FloatArray, Frame, Picture, Spheres
from imaging.picture_error import PictureError

GRAIN_COLOR = (62.0, 94.0, 138.0)
"""Buckwheat brown, blue-green-red."""
SHADE_SPREAD = 0.10
"""Standard deviation of the relative lightness of grains."""
PLATE_COLOR = (206, 202, 198)
PLATE_EDGE_COLOR = (120, 116, 112)


@dataclass(frozen=True)
class Snapshot:
    """A picture of a heap, with its scale."""

    image: Picture
    """Picture, grey or blue-green-red."""
    meters_per_pixel: float
    ground_row: float
    """Row of the plate's surface; whole numbers are the middles of pixels."""
    azimuth: float
    """Direction of the camera [rad]: at 0 the picture's right is +x and the camera looks along +y."""


def silhouette(
    centers: ArrayLike,
    radii: ArrayLike,
    azimuth: float = 0.0,
    pixels: int = 800,
    backend: str = "raster",
    frame: Frame | None = None,
) -> Snapshot:
    """Draw the black silhouette of a heap on white, without the plate.

    Parameters
    ----------
    centers, radii : (n, 3) and (n,) arrays
        Spheres [m], z up, on the plate z = 0.
    azimuth : float
        Direction of the camera [rad].
    pixels : int
        Width of the heap in the picture; strays make the picture wider.
    backend : {"raster", "pyvista", "auto"}
        `raster` needs only numpy; `pyvista` needs OpenGL; `auto` uses pyvista where OpenGL works.
    frame : Frame, optional
        Frame of the picture, where several share it; `pixels` is then unused.
    """
    spheres = Spheres.of(centers, radii)
    frame = frame or Frame.around(spheres, pixels)
    shown, _ = frame.select(spheres)
    image = 255 - _renderer(backend).coverage(shown, frame, azimuth)
    return Snapshot(image, frame.meters_per_pixel, frame.ground_row, azimuth)


def snapshot(
    centers: ArrayLike,
    radii: ArrayLike,
    azimuth: float = 0.0,
    pixels: int = 800,
    backend: str = "auto",
    frame: Frame | None = None,
    grains: ArrayLike | None = None,
) -> Snapshot:
    """Draw a shaded picture of a heap on its plate.

    The frame is that of `silhouette`, so that lines measured on one can be drawn on the other. The parameters
    are those of `silhouette`, and `grains`, the grain of each sphere, which makes grains differ in shade.
    """
    spheres = Spheres.of(centers, radii)
    frame = frame or Frame.around(spheres, pixels)
    shown, indices = frame.select(spheres)
    colors = _sphere_colors(grains, len(spheres.radii))[indices]
    layer = _renderer(backend).shaded(shown, colors, frame, azimuth)
    opacity = layer[:, :, 3:].astype(np.float64) / 255.0
    image = np.rint(opacity * layer[:, :, :3] + (1.0 - opacity) * empty_plate(frame)).astype(np.uint8)
    return Snapshot(image, frame.meters_per_pixel, frame.ground_row, azimuth)


class Renderer(Protocol):
    """Drawer of spheres with a horizontal orthographic camera: see `raster`."""

    def coverage(self, spheres: Spheres, frame: Frame, azimuth: float) -> Picture: ...

    def shaded(self, spheres: Spheres, colors: FloatArray, frame: Frame, azimuth: float) -> Picture: ...


def _renderer(backend: str) -> Renderer:
    if backend == "auto":
        return opengl if opengl.opengl_works() else raster
    renderers: dict[str, Renderer] = {"raster": raster, "pyvista": opengl}
    if backend not in renderers:
        raise PictureError("backend", "must be raster, pyvista or auto", repr(backend))
    return renderers[backend]


def _sphere_colors(grains: ArrayLike | None, sphere_count: int) -> FloatArray:
    """Colours of the spheres (n, 3), by grain: always the same for the same number of grains."""
    if grains is None:
        return np.tile(GRAIN_COLOR, (sphere_count, 1))
    owner = np.asarray(grains)
    if owner.shape != (sphere_count,):
        raise PictureError("grains", "must be one number for each sphere", owner.shape)
    _, rank = np.unique(owner, return_inverse=True)
    lightness = 1.0 + SHADE_SPREAD * np.random.default_rng(0).standard_normal(rank.max() + 1)
    return np.clip(np.outer(lightness[rank], GRAIN_COLOR), 0.0, 255.0)


def empty_plate(frame: Frame) -> Picture:
    """Draw the plate of a frame without a heap, blue-green-red."""
    image = np.full((*frame.shape, 3), 255, dtype=np.uint8)
    image[frame.ground_rows :] = PLATE_COLOR
    image[frame.ground_rows : frame.ground_rows + 1] = PLATE_EDGE_COLOR
    return image
