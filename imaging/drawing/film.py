"""Films of moving grains and walls: GIF or MP4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike

from imaging.drawing.render import empty_plate, snapshot
from imaging.geometry import FloatArray, Frame, Picture
from imaging.picture_error import PictureError

KINDS = (".gif", ".mp4")
"""Endings of films."""

CODECS = ("vp09", "mp4v")
"""Codecs of MP4; the first that OpenCV can write is used: VP9, which browsers play, or MPEG-4 part 2."""

WALL_COLOR = (150.0, 128.0, 106.0)
WALL_OPACITY, EDGE_OPACITY = 0.14, 0.75
TEXT_COLOR = (40, 32, 28)
SUBPIXEL_BITS = 4


@dataclass(frozen=True)
class Scenery:
    """Part of space in every picture of a film, seen horizontally from far away."""

    half_width: float
    height: float
    """Extent on either side of the axis, and above z = 0 [m]."""
    pixels: int = 640
    """Columns."""

    @property
    def frame(self) -> Frame:
        """Frame of the pictures, with a strip of plate below."""
        scale = 2.0 * self.half_width / self.pixels
        return Frame((0.0, 0.0), self.half_width, self.height, 0.06 * self.half_width, scale)

    def draw(
        self, centers: ArrayLike, radii: ArrayLike, grains: ArrayLike, walls: Sequence[FloatArray], text: str
    ) -> Picture:
        """Draw spheres as `snapshot` does, thin walls of triangles (n, 3, 3) [m], and a line of ASCII."""
        frame = self.frame
        points, sizes = np.asarray(centers, dtype=float), np.asarray(radii, dtype=float)
        image = empty_plate(frame)
        if np.any(np.hypot(*points.T[:2]) + sizes <= frame.half_width):
            image = snapshot(points, sizes, backend="raster", frame=frame, grains=grains).image
        for triangles in walls:
            _glaze(image, self._on_picture(triangles))
        size = self.pixels / 1000.0
        place, font = (round(16 * size), round(36 * size)), cv2.FONT_HERSHEY_DUPLEX
        cv2.putText(image, text, place, font, size, TEXT_COLOR, 1, cv2.LINE_AA)
        return image

    def _on_picture(self, triangles: FloatArray) -> FloatArray:
        frame = self.frame
        columns = frame.shape[1] / 2 + triangles[:, :, 0] / frame.meters_per_pixel
        rows = frame.ground_rows - triangles[:, :, 2] / frame.meters_per_pixel
        return np.stack([columns, rows], axis=-1) - 0.5


def _glaze(image: Picture, triangles: FloatArray) -> None:
    """Draw the transparent silhouette of a wall over a picture, and its rim."""
    mask = np.zeros(image.shape[:2], dtype=np.uint8)
    fixed = np.rint(triangles * 2**SUBPIXEL_BITS).astype(np.int32)
    for corners in fixed:
        cv2.fillConvexPoly(mask, corners, 255, cv2.LINE_8, SUBPIXEL_BITS)
    rim, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    opacity = np.where(mask > 0, WALL_OPACITY, 0.0)
    drawn = cv2.drawContours(np.zeros_like(mask), rim, -1, 255, 2, cv2.LINE_AA)
    opacity = np.maximum(opacity, EDGE_OPACITY * drawn / 255.0)[:, :, None]
    image[:] = np.rint((1.0 - opacity) * image + opacity * np.array(WALL_COLOR)).astype(np.uint8)


def save_film(path: str | Path, pictures: Sequence[Picture], each: float) -> None:
    """Write pictures of one size as a film, .gif or .mp4, that shows each picture for a time [s]."""
    kind = Path(path).suffix.lower()
    if kind not in KINDS:
        raise PictureError(str(path), f"must end in {' or '.join(KINDS)}", kind or "no ending")
    if not pictures:
        raise PictureError(str(path), "a film needs at least one picture")
    (_save_gif if kind == ".gif" else _save_mp4)(str(path), pictures, each)


def _save_gif(path: str, pictures: Sequence[Picture], each: float) -> None:
    from PIL import Image

    # one palette for all: colours that change from picture to picture flicker
    palette = Image.fromarray(np.vstack(pictures[:: max(1, len(pictures) // 4)])[:, :, ::-1]).quantize(128)
    drawn = [
        Image.fromarray(picture[:, :, ::-1]).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in pictures
    ]
    drawn[0].save(path, save_all=True, append_images=drawn[1:], duration=round(1000 * each), loop=0)


def _save_mp4(path: str, pictures: Sequence[Picture], each: float) -> None:
    rows, columns = (2 * (side // 2) for side in pictures[0].shape[:2])
    for codec in CODECS:
        writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*codec), 1.0 / each, (columns, rows))
        if writer.isOpened():
            for picture in pictures:
                writer.write(np.ascontiguousarray(picture[:rows, :columns]))
            writer.release()
            return
    raise PictureError(path, f"this OpenCV cannot write MP4 ({' or '.join(CODECS)})")
