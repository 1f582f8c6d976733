"""A phone's camera before a heap: perspective, height, tilt and lens, from points to pixels and back."""

from dataclasses import dataclass

import numpy as np

from imaging.geometry import FloatArray


@dataclass(frozen=True)
class PhoneCamera:
    """A camera that looks at a heap of radius 1 about the origin of the plate z = 0."""

    columns: int
    rows: int
    """Width and height of the picture."""
    distance: float = 6.0
    """Distance from the heap's axis, along the plate, in heap radii."""
    elevation: float = 0.0
    """Elevation of the camera over the plate, seen from the heap's foot [degrees]."""
    share: float = 0.5
    """Share of the columns that the heap covers."""
    tilt: float = 0.0
    """About the line of sight [degrees]."""
    middle: tuple[float, float] = (0.0, 0.0)
    """Place of the heap's middle, in columns and rows from the picture's middle, as shares of them."""
    height: float = 0.2
    """Height of the point that the camera aims at."""
    bulge: float = 0.0
    """Radial distortion of the lens at the picture's corner, relative."""

    @property
    def place(self) -> FloatArray:
        """Position of the camera."""
        rise = self.distance * np.tan(np.radians(self.elevation))
        return np.array([0.0, -self.distance, rise])

    @property
    def focus(self) -> float:
        """Focal length [pixels]."""
        return 0.5 * self.share * self.columns * float(np.linalg.norm(self.place))

    def _axes(self) -> FloatArray:
        """Rows: right, down and forward of the camera."""
        forward = np.array([0.0, 0.0, self.height]) - self.place
        forward /= np.linalg.norm(forward)
        right = np.array([1.0, 0.0, 0.0])
        return np.stack([right, np.cross(forward, right), forward])

    def _turn(self) -> FloatArray:
        cosine, sine = np.cos(np.radians(self.tilt)), np.sin(np.radians(self.tilt))
        return np.array([[cosine, -sine], [sine, cosine]])

    @property
    def _middle(self) -> FloatArray:
        return np.array([(0.5 + self.middle[0]) * self.columns, (0.5 + self.middle[1]) * self.rows])

    @property
    def _corner(self) -> float:
        return 0.5 * float(np.hypot(self.columns, self.rows))

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels (n, 2), column and row, of points (n, 3), and pixels per unit of length there (n,)."""
        seen = (points - self.place) @ self._axes().T
        flat = self.focus * seen[:, :2] / seen[:, 2:] @ self._turn().T
        swell = 1.0 + self.bulge * (flat**2).sum(axis=1, keepdims=True) / self._corner**2
        return flat * swell + self._middle, self.focus / seen[:, 2]

    def rays(self, scale: int) -> FloatArray:
        """Directions (rows, columns, 3) of the pixels' rays, `scale` times finer than the picture."""
        row, column = np.mgrid[0 : scale * self.rows, 0 : scale * self.columns].astype(np.float32)
        flat = np.stack([column, row], axis=-1)
        flat = (flat + 0.5) / scale - 0.5 - self._middle.astype(np.float32)
        swell = 1.0 + self.bulge * (flat**2).sum(axis=-1, keepdims=True) / self._corner**2
        flat = (flat / swell) @ self._turn().astype(np.float32)
        axes = self._axes().astype(np.float32)
        return np.asarray(flat @ axes[:2] + np.float32(self.focus) * axes[2], dtype=np.float32)
