"""Drawing of spheres with numpy, without OpenGL: exact silhouettes and a depth buffer."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.geometry import FloatArray, Frame, Layer, Picture, Spheres
from imaging.picture_error import PictureError

SUPERSAMPLING = 4
"""Factor by which the drawing of a silhouette is finer than the picture: 17 grey levels at an edge."""
SHADING_SUPERSAMPLING = 2
"""Factor for shaded pictures, whose edges need only look smooth."""
LIGHT = np.array([-0.45, -0.65, 0.61])
"""Direction of the light in the camera's frame (right, away, up)."""
AMBIENT = 0.45
"""Light on a surface that faces away from the lamp."""
BRIGHTNESS = 1.25
CAVITY_SHADING = 0.6
"""Largest darkening of spheres behind their neighbours."""
CAVITY_REACH = 0.02
"""Largest reach of that shading, three radii otherwise, as a share of the picture's width."""
RUNS, MOST_RUNS = 10_000_000, 200_000_000
"""Columns of spheres that a silhouette handles at a time, and in all: a heap of a million has 20 million."""
FRAGMENT_LIMIT = 250_000
"""Pixels of spheres that the depth buffer handles at a time: few enough for a cache."""


def coverage(spheres: Spheres, frame: Frame, azimuth: float) -> Picture:
    """Draw the share of each pixel that the spheres cover, 0 to 255, with a horizontal orthographic camera.

    Every sphere covers one run of fine rows in each fine column; the runs are opened and closed in a
    difference image whose running sum along the columns is the number of spheres over a pixel. The spheres
    are within the frame, centred on its axis (`Frame.select`).
    """
    right, up, radii = _pixel_positions(spheres, frame, azimuth, SUPERSAMPLING)
    rows, columns = (SUPERSAMPLING * size for size in frame.shape)
    size = columns * (rows + 1)
    if (runs := float(np.minimum(2.0 * radii + 1.0, columns).sum())) > MOST_RUNS:
        raise PictureError("spheres", "too many at one place for one frame of one heap", len(radii))
    depth_count = np.zeros(size, dtype=np.int64)
    for part in np.array_split(np.arange(len(radii)), 1 + int(runs / RUNS)):
        span, column = _spans(right[part], radii[part], columns)
        sphere = part[span]
        half_chord = np.sqrt(np.maximum(radii[sphere] ** 2 - (column + 0.5 - right[sphere]) ** 2, 0.0))
        first = np.clip(np.ceil(up[sphere] - half_chord - 0.5), 0, rows).astype(np.int64)
        last = np.clip(np.floor(up[sphere] + half_chord + 0.5), 0, rows).astype(np.int64)
        # column after column: each closes all that it opens, so that one running sum serves them all
        begin = column * (rows + 1)
        depth_count += np.bincount(begin + first, minlength=size)
        depth_count -= np.bincount(begin + np.maximum(first, last), minlength=size)
    covered = np.cumsum(depth_count, out=depth_count).reshape(columns, rows + 1)[:, :rows] > 0
    mask = covered.view(np.uint8) * np.uint8(255)
    return np.ascontiguousarray(cv2.resize(mask, frame.shape, interpolation=cv2.INTER_AREA).T)


def shaded(spheres: Spheres, colors: FloatArray, frame: Frame, azimuth: float) -> Picture:
    """Draw lit spheres, (rows, columns, 4) blue-green-red and opacity, with the camera of `coverage`.

    The light follows Lambert's cosine law; the depth buffer's unsharp mask (Luft et al., ACM Trans. Graphics
    25, 2006) darkens spheres behind their neighbours. `colors` (n, 3) are blue-green-red, 0 to 255.
    """
    owner, normal, distance = _depth_buffer(spheres, frame, azimuth)
    visible = owner >= 0
    diffuse = np.clip(normal @ (LIGHT / np.linalg.norm(LIGHT)), 0.0, None)
    light = AMBIENT + (1.0 - AMBIENT) * diffuse
    behind = np.where(visible, distance, distance[visible].max() if visible.any() else 0.0)
    sphere_pixels = float(np.median(spheres.radii)) * SHADING_SUPERSAMPLING / frame.meters_per_pixel
    reach = min(3.0 * sphere_pixels, CAVITY_REACH * owner.shape[1])
    recess = (behind - cv2.GaussianBlur(behind, (0, 0), reach)) / reach
    light *= 1.0 - CAVITY_SHADING * np.clip(recess, 0.0, 1.0)
    layer = np.zeros((*owner.shape, 4))
    layer[visible, :3] = colors[owner[visible]] * light[visible, None] * BRIGHTNESS
    layer[visible, 3] = 255.0
    return averaged(layer, frame.shape)


def averaged(layer: Layer, shape: tuple[int, int]) -> Picture:
    """Average a fine layer, colours times opacity and opacity, to a picture of colours and opacity."""
    small = cv2.resize(layer, shape[::-1], interpolation=cv2.INTER_AREA)
    opacity = small[:, :, 3:] / 255.0
    small[:, :, :3] = np.divide(
        small[:, :, :3], opacity, out=np.zeros_like(small[:, :, :3]), where=opacity > 0
    )
    return np.rint(np.clip(small, 0.0, 255.0)).astype(np.uint8)


def _depth_buffer(
    spheres: Spheres, frame: Frame, azimuth: float
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Find the nearest sphere of every fine pixel (-1: no sphere), its normal and distance [fine pixels].

    The normal is in the camera's frame: right, away, up.
    """
    right, up, radii = _pixel_positions(spheres, frame, azimuth, SHADING_SUPERSAMPLING)
    away = spheres.seen_from(azimuth)[:, 1] * SHADING_SUPERSAMPLING / frame.meters_per_pixel
    shape = (SHADING_SUPERSAMPLING * frame.shape[0], SHADING_SUPERSAMPLING * frame.shape[1])
    nearest = np.full(shape[0] * shape[1], np.inf)
    owner = np.full(shape[0] * shape[1], -1, dtype=np.int64)
    for chunk in _chunks(radii):
        pixel, sphere, distance = _fragments(chunk, right, up, away, radii, shape)
        before = nearest[pixel]
        np.minimum.at(nearest, pixel, distance)
        wins = (distance == nearest[pixel]) & (distance < before)
        owner[pixel[wins]] = sphere[wins]
    owner = owner.reshape(shape)
    return owner, _normals(owner, right, up, radii), nearest.reshape(shape)


def _pixel_positions(
    spheres: Spheres, frame: Frame, azimuth: float, supersampling: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Columns, rows and radii of the spheres in fine pixels; a pixel's middle is at its index + 0.5."""
    scale = supersampling / frame.meters_per_pixel
    right, _, up = spheres.seen_from(azimuth).T
    middle = 0.5 * supersampling * frame.shape[1]
    return middle + right * scale, supersampling * frame.ground_rows - up * scale, spheres.radii * scale


def _spans(position: FloatArray, radii: FloatArray, size: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All (sphere, column) pairs in which a column's middle is within the sphere's width."""
    first = np.clip(np.ceil(position - radii - 0.5), 0, size).astype(np.int64)
    last = np.clip(np.floor(position + radii + 0.5), 0, size).astype(np.int64)
    counts = np.maximum(last - first, 0)
    sphere = np.repeat(np.arange(len(position)), counts)
    return sphere, np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts - first, counts)


def _chunks(radii: FloatArray) -> list[NDArray[np.intp]]:
    """Sphere indices in groups of about `FRAGMENT_LIMIT` pixels."""
    group = np.cumsum((2.0 * radii + 1.0) ** 2) // FRAGMENT_LIMIT
    return np.split(np.arange(len(radii)), np.flatnonzero(np.diff(group)) + 1)


def _fragments(
    chunk: NDArray[np.intp],
    right: FloatArray,
    up: FloatArray,
    away: FloatArray,
    radii: FloatArray,
    shape: tuple[int, int],
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Pixel, sphere and distance of every pixel that each sphere of a chunk covers."""
    rows, columns = shape
    span, column = _spans(right[chunk], radii[chunk], columns)
    sphere = chunk[span]
    half_chord = np.sqrt(np.maximum(radii[sphere] ** 2 - (column + 0.5 - right[sphere]) ** 2, 0.0))
    run, row = _spans(up[sphere], half_chord, rows)
    sphere, column = sphere[run], column[run]
    across = (column + 0.5 - right[sphere]) ** 2 + (row + 0.5 - up[sphere]) ** 2
    distance = away[sphere] - np.sqrt(np.maximum(radii[sphere] ** 2 - across, 0.0))
    return row * columns + column, sphere, distance


def _normals(owner: NDArray[np.int64], right: FloatArray, up: FloatArray, radii: FloatArray) -> FloatArray:
    row, column = np.nonzero(owner >= 0)
    sphere = owner[row, column]
    x = (column + 0.5 - right[sphere]) / radii[sphere]
    z = (up[sphere] - row - 0.5) / radii[sphere]
    y = -np.sqrt(np.maximum(1.0 - x**2 - z**2, 0.0))
    normal = np.zeros((*owner.shape, 3))
    normal[row, column] = np.column_stack([x, y, z])
    return normal
