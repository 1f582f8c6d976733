"""Drawn pictures of heaps with known angles, anti-aliased, so that the truth is finer than a pixel."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.geometry import FloatArray, Picture

SUPERSAMPLING = 8
"""Shapes are drawn this many times finer than the picture, then averaged."""
SUBPIXEL_BITS = 6
DISCS_PER_GRAIN = 3.0
"""Grains strewn on each grain diameter of the plate, so that they hide the smooth profile below them."""
Color = tuple[int, int, int]
"""Blue, green, red."""


@dataclass(frozen=True)
class DrawnHeap:
    """A heap in profile, in pixels: its left end is the origin, x to the right, y up."""

    left: float
    right: float
    """Angles of the flanks [degrees]."""
    width: float = 400.0
    """Width from end to end on the plate."""
    rounding: float = 0.0
    """Share of each flank, at the apex, that a smooth cap replaces."""
    grain: float = 0.0
    """Diameter of the grains that cover the flanks; 0 draws a smooth heap."""
    seed: int = 0
    """Seed of the grains' places."""

    @property
    def apex(self) -> FloatArray:
        """Point in which the two flanks meet."""
        left, right = np.tan(np.radians([self.left, self.right]))
        x = self.width * right / (left + right)
        return np.array([x, left * x])

    def profile(self) -> FloatArray:
        """Corners (n, 2) of the smooth heap, from its left to its right end."""
        ends = np.array([[0.0, 0.0], [self.width, 0.0]])
        if self.rounding == 0.0:
            return np.stack([ends[0], self.apex, ends[1]])
        start, stop = self.apex + self.rounding * (ends - self.apex)
        t = np.linspace(0.0, 1.0, 65)[:, None]
        cap = (1.0 - t) ** 2 * start + 2.0 * t * (1.0 - t) * self.apex + t**2 * stop
        return np.concatenate([ends[:1], cap, ends[1:]])

    @property
    def overhang(self) -> float:
        """Largest distance of grains from the smooth heap: on its flanks' lines, sunk into the plate."""
        return self.grain / float(np.tan(np.radians(min(self.left, self.right))))

    def grains(self) -> FloatArray:
        """Discs (n, 3), x, y and radius, strewn along both flanks; the plate cuts off the lowest."""
        if self.grain == 0.0:
            return np.empty((0, 3))
        rng = np.random.default_rng(self.seed)
        reach = self.overhang
        drop = reach * np.tan(np.radians([self.left, self.right]))
        corners = np.vstack([[-reach, -drop[0]], self.profile(), [self.width + reach, -drop[1]]])
        count = round(DISCS_PER_GRAIN * (self.width + 2.0 * reach) / self.grain)
        x = rng.uniform(-reach, self.width + reach, count)
        y = np.interp(x, corners[:, 0], corners[:, 1]) + rng.normal(0.0, 0.25 * self.grain, count)
        return np.column_stack([x, y, 0.5 * self.grain * rng.normal(1.0, 0.05, count)])


@dataclass(frozen=True)
class Camera:
    """Faults that a drawn photograph adds to a heap."""

    heap: Color = (45, 70, 95)
    background: Color = (235, 235, 235)
    """Colours, blue-green-red."""
    plate: Color | None = None
    """Colour of the plate, from border to border; None: no plate is drawn."""
    texture: float = 0.0
    """Relative standard deviation of the heap's lightness from grain to grain."""
    light: float = 0.0
    """Relative change of the light from the left to the right border."""
    noise: float = 0.0
    """Standard deviation of the pixels' noise, of 255."""
    tilt: float = 0.0
    """Roll of the camera [degrees]; positive lets the plate fall to the right."""
    margin: float = 0.15
    """Free space on both sides of the heap and above it, in heap widths; negative: the heap is cropped."""
    seed: int = 0
    """Seed of noise and texture."""


def draw(heap: DrawnHeap, camera: Camera | None = None) -> Picture:
    """Draw a photograph of a heap, (rows, columns, 3) uint8 in blue-green-red."""
    camera = camera or Camera()
    margin = camera.margin * heap.width
    border = margin + (heap.overhang if margin > 0.0 else 0.0)
    rise = 0.5 * heap.width * abs(np.tan(np.radians(camera.tilt)))
    shape = (
        max(int(np.ceil(heap.apex[1] + heap.grain + 2.0 * (abs(margin) + rise))), 32),
        int(np.ceil(heap.width + 2.0 * border)),
    )
    middle = np.array([0.5 * shape[1], shape[0] - abs(margin) - rise])
    body, plate = _coverage(heap, camera.tilt, middle, shape)
    rng = np.random.default_rng(camera.seed)
    image = np.broadcast_to(np.array(camera.background, dtype=np.float64), (*shape, 3))
    if camera.plate is not None:
        image = image + plate[:, :, None] * (np.array(camera.plate) - image)
    grains = 1.0 + camera.texture * _texture(shape, max(heap.grain, 0.02 * heap.width), rng)
    image = image + body[:, :, None] * (grains[:, :, None] * np.array(camera.heap) - image)
    image = image * (1.0 + camera.light * np.linspace(-0.5, 0.5, shape[1]))[None, :, None]
    image = image + rng.normal(0.0, camera.noise, image.shape)
    return np.rint(np.clip(image, 0.0, 255.0)).astype(np.uint8)


def _coverage(
    heap: DrawnHeap, tilt: float, middle: FloatArray, shape: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Share of every pixel that the heap and that the plate cover; `middle` is where the heap's base lies."""
    reach = 4.0 * heap.width
    low = np.array([[heap.width + reach, 0.0], [heap.width + reach, -reach], [-reach, -reach], [-reach, 0.0]])
    body, plate = (np.zeros((SUPERSAMPLING * shape[0], SUPERSAMPLING * shape[1]), np.uint8) for _ in range(2))
    cv2.fillPoly(body, [_to_fine_pixels(heap.profile(), heap, tilt, middle)], 255, shift=SUBPIXEL_BITS)
    fixed = 2**SUBPIXEL_BITS * SUPERSAMPLING
    for x, y, radius in heap.grains():
        center = _to_fine_pixels(np.array([[x, y]]), heap, tilt, middle)[0]
        cv2.circle(body, center.tolist(), round(radius * fixed), 255, -1, cv2.LINE_8, SUBPIXEL_BITS)
    cv2.fillPoly(plate, [_to_fine_pixels(low, heap, tilt, middle)], 255, shift=SUBPIXEL_BITS)
    body[plate > 0] = 0
    return _average(body, shape), _average(plate, shape)


def _average(layer: Picture, shape: tuple[int, int]) -> FloatArray:
    """Fine pixels, 0 or 255, to the share of each pixel that is covered."""
    small = cv2.resize(layer, shape[::-1], interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float64) / 255.0


def _to_fine_pixels(
    points: FloatArray, heap: DrawnHeap, tilt: float, middle: FloatArray
) -> NDArray[np.int32]:
    """Heap coordinates to OpenCV's fixed-point coordinates in the fine picture."""
    cosine, sine = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    along, up = points[:, 0] - 0.5 * heap.width, points[:, 1]
    column = middle[0] + along * cosine + up * sine
    row = middle[1] + along * sine - up * cosine
    fine = SUPERSAMPLING * np.column_stack([column, row]) - 0.5
    return np.rint(fine * 2**SUBPIXEL_BITS).astype(np.int32)


def _texture(shape: tuple[int, int], grain: float, rng: np.random.Generator) -> FloatArray:
    """Random field of standard deviation 1 that changes from grain to grain."""
    field = cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), max(0.5 * grain, 0.5))
    return field / field.std()


def cone_of_spheres(
    angle: float, radius: float, sphere_radius: float, sphere_count: int, seed: int = 0
) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 3) and radii (n,) [m] of spheres strewn evenly through a cone on the plate z = 0."""
    rng = np.random.default_rng(seed)
    below_tip = radius * np.tan(np.radians(angle)) * np.cbrt(rng.uniform(size=sphere_count))
    distance = below_tip / np.tan(np.radians(angle)) * np.sqrt(rng.uniform(size=sphere_count))
    turn = rng.uniform(0.0, 2.0 * np.pi, sphere_count)
    height = radius * np.tan(np.radians(angle)) - below_tip
    centers = np.column_stack([distance * np.cos(turn), distance * np.sin(turn), height])
    return centers, np.full(sphere_count, sphere_radius)
