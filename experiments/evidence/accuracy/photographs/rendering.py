"""Render a heap, its surroundings and a lamp as a picture that a phone would store."""

from dataclasses import dataclass

import cv2
import numpy as np

from experiments.evidence.accuracy.photographs.phone_camera import PhoneCamera
from imaging.geometry import FloatArray, Layer, Picture

FINE = 2
"""Everything is drawn this many times finer than the picture."""
SHADOW_STEPS = 12
"""Points of a ray to the lamp at which the heap may stand in its way."""
SUBPIXEL_BITS = 4
Color = tuple[float, float, float]
"""Blue, green, red of 255."""


@dataclass(frozen=True)
class Lamp:
    """Direction of the light, and what it leaves dark."""

    direction: tuple[float, float, float] = (-0.4, -0.6, 0.69)
    """To the lamp: right, away, up; of length 1."""
    shadow: float = 0.0
    """Share of the light that a cast shadow lacks."""
    softness: float = 0.05
    """Blur of the shadow's edge, in heap radii."""
    shade: float = 0.3
    """Share of the light that a flank turned away from the lamp lacks."""
    uneven: float = 0.0
    """Change of the light across the picture, relative."""
    near: tuple[tuple[float, float, float], ...] = ()
    """Places of small lamps before the heap, in heap radii. The shadows are then those that the grains throw
    from there, with edges as sharp as `softness` leaves them."""
    cast: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Share of the light in each channel that a shadow lacks more: other lamps have other colours."""


@dataclass(frozen=True)
class Top:
    """Table's top, from -half_width to half_width and from -near to far, and its thickness [heap radii]."""

    half_width: float = 50.0
    near: float = 1.5
    far: float = 2.0
    thickness: float = 50.0


@dataclass(frozen=True)
class Surroundings:
    """Wall and table."""

    wall: Color
    table: Color
    front: Color
    grain: Color
    """Colours of the wall, of the table's top and of its front, and of the grains."""
    spread: float = 0.15
    """Relative standard deviation of the grains' lightness."""
    top: Top = Top()
    wall_distance: float = 4.0
    """Colour of the wall behind the heap."""
    texture: float = 0.0
    """Relative standard deviation of the table's and the wall's pattern."""


@dataclass(frozen=True)
class Phone:
    """Changes of the light in the phone: blur, noise, sharpening, JPEG."""

    blur: float = 0.6
    noise: float = 2.0
    sharpening: float = 0.3
    quality: int = 85


def render(
    spheres: tuple[FloatArray, FloatArray],
    heap_height: float,
    surroundings: Surroundings,
    lamp: Lamp,
    camera: PhoneCamera,
    phone: Phone,
    seed: int,
) -> Picture:
    """Draw and store a photograph, (rows, columns, 3) uint8 in blue-green-red.

    Parameters
    ----------
    spheres
        Centres (n, 3) and radii (n,) in heap radii.
    heap_height
        Height of the cone that casts the shadow.
    seed
        Seed of patterns, lightness and noise.
    """
    rng = np.random.default_rng(seed)
    fine = _surroundings(surroundings, lamp, camera, (heap_height, *spheres), rng)
    _draw_grains(fine, spheres, surroundings, lamp, camera, rng)
    size = (camera.columns, camera.rows)
    image: Layer = np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    slope = np.linspace(-0.5, 0.5, camera.columns, dtype=np.float32)
    image = image * (1.0 + lamp.uneven * slope)[None, :, None]
    return stored(image, phone, rng)


def stored(image: Layer, phone: Phone, rng: np.random.Generator) -> Picture:
    """Blur, noise, sharpening and JPEG of a phone."""
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), max(phone.blur, 0.2)), dtype=np.float32)
    image = image + rng.normal(0.0, phone.noise, image.shape).astype(np.float32)
    if phone.sharpening > 0.0:
        image = image + phone.sharpening * (image - cv2.GaussianBlur(image, (0, 0), 1.5))
    done = np.rint(np.clip(image, 0.0, 255.0)).astype(np.uint8)
    _, data = cv2.imencode(".jpg", done, [cv2.IMWRITE_JPEG_QUALITY, phone.quality])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)


def _surroundings(
    around: Surroundings,
    lamp: Lamp,
    camera: PhoneCamera,
    heap: tuple[float, FloatArray, FloatArray],
    rng: np.random.Generator,
) -> Layer:
    """Wall, table top and table front, with the heap's shadow, as fine pixels.

    `heap` is the height of its cone with the centres and radii of its grains.
    """
    ray = camera.rays(FINE)
    x0, y0, z0 = (np.float32(value) for value in camera.place)
    down = np.minimum(ray[..., 2], -1e-6)
    to_top = -z0 / down
    top_x, top_y = x0 + to_top * ray[..., 0], y0 + to_top * ray[..., 1]
    top = (ray[..., 2] < 0) & (np.abs(top_x) <= around.top.half_width)
    top &= (top_y >= -around.top.near) & (top_y <= around.top.far)
    to_front = (-around.top.near - y0) / ray[..., 1]
    front_z = z0 + to_front * ray[..., 2]
    front = (front_z <= 0.0) & (front_z >= -around.top.thickness)
    front &= np.abs(x0 + to_front * ray[..., 0]) <= around.top.half_width
    front &= ~top
    to_wall = (around.wall_distance - y0) / ray[..., 1]
    image = np.empty((*ray.shape[:2], 3), dtype=np.float32)
    image[:] = np.array(around.wall, dtype=np.float32)
    image[top] = np.array(around.table, dtype=np.float32)
    image[front] = np.array(around.front, dtype=np.float32)
    if around.texture > 0.0:
        image *= (1.0 + around.texture * _pattern(image.shape[:2], rng))[..., None]
    reach = np.where(top, to_top, np.where(front, to_front, to_wall))
    place = ray * reach[..., None] + np.array([x0, y0, z0], dtype=np.float32)
    if lamp.near:
        lacks = lamp.shadow + np.array(lamp.cast, dtype=np.float32)
        for source in lamp.near:
            image *= 1.0 - sharp_shadow(place, source, lamp.softness, heap[1:], camera)[..., None] * lacks
    else:
        image *= (1.0 - lamp.shadow * _shadow(place, lamp, heap[0], camera))[..., None]
    foot = np.hypot(top_x, top_y)
    near_heap = np.where(top, np.clip(1.0 - (foot - 1.0) / 0.12, 0.0, 1.0), 0.0)
    return np.asarray(image * (1.0 - 0.25 * near_heap**2)[..., None], dtype=np.float32)


def _shadow(place: Layer, lamp: Lamp, heap_height: float, camera: PhoneCamera) -> Layer:
    """Share of the lamp, 0 to 1, that the heap hides from each place; drawn coarsely, for it is soft."""
    coarse = place[::4, ::4]
    hidden = np.zeros(coarse.shape[:2], dtype=np.float32)
    if lamp.shadow > 0.0:
        toward = np.array(lamp.direction, dtype=np.float32)
        for step in np.linspace(0.02, heap_height / max(toward[2], 0.1), SHADOW_STEPS):
            point = coarse + np.float32(step) * toward
            under = point[..., 2] < heap_height * (1.0 - np.hypot(point[..., 0], point[..., 1]))
            under &= point[..., 2] > 0.0
            hidden = np.maximum(hidden, under.astype(np.float32))
    pixels = 0.5 * camera.share * camera.columns * FINE / 4.0
    soft = cv2.GaussianBlur(hidden, (0, 0), max(lamp.softness * pixels, 0.7))
    return np.asarray(cv2.resize(soft, place.shape[1::-1], interpolation=cv2.INTER_LINEAR))


def sharp_shadow(
    place: Layer,
    source: tuple[float, float, float],
    softness: float,
    spheres: tuple[FloatArray, FloatArray],
    camera: PhoneCamera,
) -> Layer:
    """Share of a small lamp, 0 to 1, that the grains hide from each place around the heap or behind it.

    The grains are drawn as the lamp sees them; each place looks there whether one is in its way.
    """
    centers, radii = spheres
    lamp = np.array(source)
    ahead = -lamp / np.linalg.norm(lamp)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(ahead, right), ahead])
    pixels = 0.5 * camera.share * camera.columns * FINE * float(np.linalg.norm(lamp))
    seen = (centers - lamp) @ axes.T
    flat, depth = seen[:, :2] / seen[:, 2:], seen[:, 2]
    margin = 2.0 * float((radii / depth).max()) + 8.0 * softness / float(np.linalg.norm(lamp))
    low = flat.min(axis=0) - margin
    columns, rows = np.ceil((flat.max(axis=0) + margin - low) * pixels).astype(int)
    view = np.zeros((rows, columns), np.uint8)
    fixed = pixels * 2**SUBPIXEL_BITS
    for middle, size in zip(np.rint((flat - low) * fixed).astype(int), radii / depth, strict=True):
        cv2.circle(view, middle.tolist(), round(size * fixed), 255, -1, cv2.LINE_AA, SUBPIXEL_BITS)
    blur = max(softness * 0.5 * camera.share * camera.columns * FINE, 0.5)
    hidden = cv2.GaussianBlur(view, (0, 0), blur).astype(np.float32) / 255.0
    turned = ((place - lamp.astype(np.float32)) @ axes.T.astype(np.float32)).astype(np.float32)
    # Places level with the lamp or behind it see no heap in its way.
    before = np.maximum(turned[..., 2:], 0.1)
    at = ((turned[..., :2] / before - low) * pixels).astype(np.float32)
    return np.asarray(cv2.remap(hidden, at[..., 0], at[..., 1], cv2.INTER_LINEAR), dtype=np.float32)


def _pattern(shape: tuple[int, int], rng: np.random.Generator) -> Layer:
    """Random field of standard deviation 1 with a grain along the rows, as of wood or cloth."""
    small = rng.standard_normal((shape[0] // 4 + 1, shape[1] // 16 + 1)).astype(np.float32)
    field = cv2.resize(small, shape[::-1], interpolation=cv2.INTER_CUBIC)
    return np.asarray(field / field.std(), dtype=np.float32)


def _draw_grains(
    fine: Layer,
    spheres: tuple[FloatArray, FloatArray],
    around: Surroundings,
    lamp: Lamp,
    camera: PhoneCamera,
    rng: np.random.Generator,
) -> None:
    """Paint the grains far to near, each as discs that grow brighter towards the lamp."""
    centers, radii = spheres
    pixels, scale = camera.project(centers)
    light = np.array(lamp.direction)
    outward = centers / np.maximum(np.linalg.norm(centers, axis=1, keepdims=True), 1e-9)
    outward[:, 2] = np.abs(outward[:, 2]) + 0.7
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    lit = 1.0 - lamp.shade * (1.0 - np.clip(outward @ light, 0.0, 1.0))
    color = np.array(around.grain) * (1.0 + around.spread * rng.standard_normal((len(radii), 1)))
    color = color * lit[:, None]
    aside = np.array([light[0], -light[2]])
    order = np.argsort(scale)
    fixed = 2**SUBPIXEL_BITS
    for index in order:
        size = radii[index] * scale[index] * FINE
        middle = (pixels[index] + 0.5) * FINE - 0.5
        for share, shift, bright in ((1.0, 0.0, 0.78), (0.8, 0.15, 0.95), (0.5, 0.35, 1.12)):
            at = np.rint((middle + shift * size * aside) * fixed).astype(int).tolist()
            shade = np.clip(bright * color[index], 0.0, 255.0).tolist()
            cv2.circle(fine, at, round(share * size * fixed), shade, -1, cv2.LINE_8, SUBPIXEL_BITS)
