"""Pictures without a heap, drawn at random: what else ends up in a folder of photographs."""

from collections.abc import Callable

import cv2
import numpy as np

from experiments.evidence.accuracy.photographs.rendering import Phone, stored
from imaging.geometry import Layer, Picture

ROWS, COLUMNS = 600, 840
Canvas = Layer
Painter = Callable[[Canvas, np.random.Generator], None]


def picture_without_heap(seed: int) -> tuple[str, Picture]:
    """Kind and picture of a seed: always the same for the same seed."""
    rng = np.random.default_rng([22, seed])
    kind = list(PAINTERS)[seed % len(PAINTERS)]
    canvas = np.empty((ROWS, COLUMNS, 3), dtype=np.float32)
    canvas[:] = _color(rng)
    PAINTERS[kind](canvas, rng)
    phone = Phone(rng.uniform(0.4, 2.0), rng.uniform(0.5, 6.0), 0.3, int(rng.integers(60, 96)))
    return kind, stored(canvas, phone, rng)


def _color(rng: np.random.Generator) -> tuple[float, float, float]:
    blue, green, red = rng.uniform(15.0, 240.0, 3)
    return float(blue), float(green), float(red)


def _point(rng: np.random.Generator, across: float = 0.2, down: float = 0.3) -> tuple[int, int]:
    column = COLUMNS * (0.5 + rng.uniform(-across, across))
    return round(column), round(ROWS * (0.5 + rng.uniform(-down, down)))


def _portrait(canvas: Canvas, rng: np.random.Generator) -> None:
    column, row = _point(rng, 0.2, 0.1)
    size = int(rng.integers(60, 130))
    clothes, skin, hair = _color(rng), _color(rng), _color(rng)
    cv2.ellipse(canvas, (column, row + 3 * size), (int(1.9 * size), 2 * size), 0, 0, 360, clothes, -1)
    cv2.ellipse(canvas, (column, row - size // 4), (int(0.9 * size), int(1.1 * size)), 0, 0, 360, hair, -1)
    cv2.ellipse(canvas, (column, row), (int(0.75 * size), size), 0, 0, 360, skin, -1)
    for side in (-1, 1):
        cv2.circle(canvas, (column + side * size // 3, row - size // 5), size // 10, (30, 30, 30), -1)


def _logo(canvas: Canvas, rng: np.random.Generator) -> None:
    for _ in range(int(rng.integers(1, 5))):
        corners = int(rng.integers(3, 12))
        turn = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
        reach = rng.uniform(60.0, 250.0, corners)
        middle = np.array(_point(rng))
        points = middle + reach[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
        cv2.fillPoly(canvas, [np.rint(points).astype(np.int32)], _color(rng), cv2.LINE_AA)


def _write(
    canvas: Canvas,
    text: str,
    origin: tuple[int, int],
    font: int,
    scale: float,
    color: tuple[float, float, float],
    weight: int,
) -> None:
    page = np.clip(canvas, 0.0, 255.0).astype(np.uint8)
    cv2.putText(page, text, origin, font, scale, color, weight, cv2.LINE_AA)
    canvas[:] = page


def _letters(canvas: Canvas, rng: np.random.Generator) -> None:
    word = "".join(chr(int(code)) for code in rng.integers(65, 91, int(rng.integers(1, 6))))
    scale, weight = rng.uniform(3.0, 9.0), int(rng.integers(6, 30))
    font = int(rng.choice([cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_TRIPLEX]))
    origin = (int(rng.integers(10, 250)), int(rng.integers(250, 550)))
    _write(canvas, word, origin, font, scale, _color(rng), weight)


def _page(canvas: Canvas, rng: np.random.Generator) -> None:
    for row in range(int(rng.integers(30, 90)), ROWS - 30, int(rng.integers(22, 45))):
        text = "".join(chr(int(code)) for code in rng.integers(97, 123, 42))
        _write(canvas, text, (40, row), cv2.FONT_HERSHEY_DUPLEX, 0.9, (30.0, 30.0, 30.0), 1)


def _food(canvas: Canvas, rng: np.random.Generator) -> None:
    column, row = _point(rng, 0.15, 0.15)
    flat = rng.uniform(0.2, 0.9)
    size = int(rng.integers(200, 330))
    cv2.ellipse(canvas, (column, row + 40), (size, int(flat * size)), 0, 0, 360, _color(rng), -1, cv2.LINE_AA)
    base, radius = np.array(_color(rng)), rng.uniform(0.35, 0.7) * size
    for _ in range(int(rng.integers(3, 300))):
        at = rng.normal(0.0, 0.4, 2) * np.array([radius, flat * radius]) + np.array([column, row])
        shade = np.clip(base * rng.uniform(0.6, 1.3), 0.0, 255.0).tolist()
        cv2.circle(canvas, np.rint(at).astype(int).tolist(), int(rng.integers(8, 45)), shade, -1, cv2.LINE_AA)


def _dome(canvas: Canvas, rng: np.random.Generator) -> None:
    column, row = COLUMNS // 2, int(rng.integers(330, 480))
    size = (int(rng.integers(120, 300)), int(rng.integers(60, 260)))
    cv2.ellipse(canvas, (column, row), size, 0, 180, 360, _color(rng), -1, cv2.LINE_AA)
    if rng.uniform() < 0.5:
        canvas[row:] = _color(rng)


def _landscape(canvas: Canvas, rng: np.random.Generator) -> None:
    sky = np.linspace(1.1, 0.8, ROWS, dtype=np.float32)
    canvas *= sky[:, None, None]
    for level in np.sort(rng.uniform(0.3, 0.8, int(rng.integers(1, 4)))):
        steps = rng.standard_normal(COLUMNS)
        ridge = np.cumsum(steps) - np.linspace(0.0, steps.sum(), COLUMNS)
        ridge = cv2.GaussianBlur(ridge[None, :], (0, 0), rng.uniform(1.0, 12.0))[0]
        top = ROWS * level + ridge * rng.uniform(1.0, 6.0)
        canvas[np.arange(ROWS)[:, None] > top] = _color(rng)


def _noise(canvas: Canvas, rng: np.random.Generator) -> None:
    grain = rng.normal(0.0, 1.0, canvas.shape).astype(np.float32)
    field = np.asarray(cv2.GaussianBlur(grain, (0, 0), rng.uniform(0.5, 60.0)))
    canvas += rng.uniform(5.0, 70.0) * field / field.std()


def _plate(canvas: Canvas, rng: np.random.Generator) -> None:
    row = int(rng.integers(200, 480))
    canvas[row:] = _color(rng)
    if rng.uniform() < 0.5:
        canvas[row + int(rng.integers(20, 100)) :] = _color(rng)
    for _ in range(int(rng.integers(0, 20))):
        cv2.circle(canvas, (int(rng.integers(20, COLUMNS - 20)), row - 3), 4, _color(rng), -1, cv2.LINE_AA)


def _things(canvas: Canvas, rng: np.random.Generator) -> None:
    row = int(rng.integers(350, 520))
    canvas[row:] = _color(rng)
    for _ in range(int(rng.integers(1, 5))):
        left, width = int(rng.integers(60, 600)), int(rng.integers(40, 240))
        top = row - int(rng.integers(40, 300))
        cv2.rectangle(canvas, (left, top), (left + width, row), _color(rng), -1, cv2.LINE_AA)
        if rng.uniform() < 0.5:
            at, size = (left + width // 2, top), (width // 2, int(rng.integers(8, 80)))
            cv2.ellipse(canvas, at, size, 0, 0, 360, _color(rng), -1, cv2.LINE_AA)


def _animal(canvas: Canvas, rng: np.random.Generator) -> None:
    fur = _color(rng)
    column, row = _point(rng, 0.1, 0.1)
    size = int(rng.integers(90, 180))
    cv2.ellipse(canvas, (column, row), (size, int(0.55 * size)), 0, 0, 360, fur, -1, cv2.LINE_AA)
    for step in (-0.7, -0.4, 0.4, 0.7):
        foot = (column + round(step * size), row + size)
        cv2.line(canvas, (foot[0], row), foot, fur, size // 6, cv2.LINE_AA)
    cv2.circle(canvas, (column + size, row - size // 2), size // 2, fur, -1, cv2.LINE_AA)


def _from_above(canvas: Canvas, rng: np.random.Generator) -> None:
    column, row = _point(rng, 0.1, 0.1)
    radius, flat = rng.uniform(150.0, 260.0), rng.uniform(0.6, 1.0)
    base = np.array(_color(rng))
    for _ in range(2500):
        turn, reach = rng.uniform(0.0, 2.0 * np.pi), radius * np.sqrt(rng.uniform())
        at = (round(column + reach * np.cos(turn)), round(row + flat * reach * np.sin(turn)))
        shade = np.clip(base * rng.normal(1.0, 0.15), 0.0, 255.0).tolist()
        cv2.circle(canvas, at, 8, shade, -1, cv2.LINE_AA)


def _dish(canvas: Canvas, rng: np.random.Generator) -> None:
    row, half = int(rng.integers(330, 430)), int(rng.integers(150, 260))
    column, deep = COLUMNS // 2, int(rng.integers(60, 140))
    grains = np.array([[column - half, row], [column, row - half // 2], [column + half, row]])
    cv2.fillPoly(canvas, [grains.astype(np.int32)], _color(rng), cv2.LINE_AA)
    cv2.ellipse(canvas, (column, row), (half, deep), 0, 0, 180, _color(rng), -1, cv2.LINE_AA)


PAINTERS: dict[str, Painter] = {
    "portrait": _portrait,
    "logo": _logo,
    "letters": _letters,
    "page": _page,
    "food": _food,
    "dome": _dome,
    "landscape": _landscape,
    "noise": _noise,
    "plate": _plate,
    "things": _things,
    "animal": _animal,
    "from above": _from_above,
    "dish": _dish,
}
"""Painters by kind."""
