"""Picture files: sizes that are refused before decoding, HEIC, focal lengths."""

import struct
import sys
import types
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw
from PIL import Image

from imaging import PictureError, View, measure_photograph, read_picture, save_picture
from imaging.photo.picture_file import FILM_DIAGONAL, MAXIMUM_PIXELS, focal_length


def png_of(path: Path, columns: int, rows: int) -> Path:
    """Write a PNG of a few bytes whose header claims a size."""
    chunks = b"\x89PNG\r\n\x1a\n"
    for kind, data in (
        (b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(b"\0" * 1000)),
        (b"IEND", b""),
    ):
        chunks += struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    path.write_bytes(chunks)
    return path


@pytest.mark.parametrize("size", [(12_001, 10_000), (100_000, 100_000)])
def test_a_picture_that_claims_too_many_pixels_is_not_decoded(tmp_path: Path, size: tuple[int, int]) -> None:
    assert size[0] * size[1] > MAXIMUM_PIXELS
    with pytest.raises(PictureError, match="at most 120 million pixels"):
        read_picture(png_of(tmp_path / "bomb.png", *size))


def test_heic_without_its_package_says_how_to_convert(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    (tmp_path / "phone.HEIC").write_bytes(b"ftypheic")
    (tmp_path / "renamed.jpg").write_bytes(b"\0\0\0\x18ftypheic\0\0\0\0")
    for name in ("phone.HEIC", "renamed.jpg"):
        with pytest.raises(PictureError, match=r"dem-warp\[heic\].*save the picture as JPEG"):
            read_picture(tmp_path / name)


def test_heic_is_read_as_blue_green_red(tmp_path: Path, monkeypatch) -> None:
    class Decoded:
        size = (40, 20)

        def __array__(self, dtype=None, copy=None) -> np.ndarray:
            return np.broadcast_to(np.array([200, 100, 50], np.uint8), (20, 40, 3)).copy()

    package = types.SimpleNamespace(open_heif=lambda file, convert_hdr_to_8bit: Decoded())
    monkeypatch.setitem(sys.modules, "pillow_heif", package)
    (tmp_path / "phone.heic").write_bytes(b"ftypheic")
    picture = read_picture(tmp_path / "phone.heic")
    assert (picture.shape, picture[0, 0].tolist()) == ((20, 40, 3), [50, 100, 200])


def with_focal_length(path: Path, picture: np.ndarray, film: int, taken: tuple[int, int]) -> Path:
    """Store a picture with the tags of a phone."""
    image = Image.fromarray(picture[:, :, ::-1])
    exif = image.getexif()
    exif.get_ifd(0x8769).update({0xA405: film, 0xA002: taken[0], 0xA003: taken[1]})
    image.save(path, exif=exif, quality=95)
    return path


def test_a_near_camera_is_corrected_by_its_focal_length(tmp_path: Path) -> None:
    picture = draw(DrawnHeap(30, 30, 200), Camera(plate=(90, 90, 90), margin=0.8))
    size = picture.shape[1::-1]
    path = with_focal_length(tmp_path / "phone.jpg", picture, 26, size)
    assert focal_length(path) == pytest.approx(26.0 / FILM_DIAGONAL * np.hypot(*size), rel=1e-6)
    near = measure_photograph(path)
    # The heap is 200 of 520 pixels wide: the camera was 1 or 2 heap widths away and saw it flatter.
    assert 1.0 < near.outline.distance < 2.0
    assert near.mean > measure_photograph(save_picture(tmp_path / "plain.png", picture)).mean + 0.5
    # Cut by hand, without a focal length, nothing says how far the camera was.
    assert measure_photograph(tmp_path / "plain.png").outline.nearest is None
    # Cut to another size than the camera's, a picture no longer has its angle of view.
    assert focal_length(with_focal_length(tmp_path / "cut.jpg", picture, 26, (4000, 3000))) is None
    assert focal_length(save_picture(tmp_path / "none.png", picture)) is None


def test_an_unknown_distance_is_in_the_interval_of_a_whole_picture(tmp_path: Path) -> None:
    """The camera may have had the widest usual lens; the heap of 200 pixels has 0.6 and 0.3 of the width."""
    for angle, columns, doubts in ((46, 322, ["distance"]), (30, 334, []), (30, 666, [])):
        drawn = draw(DrawnHeap(angle, angle, 200, grain=5), Camera(plate=(90, 90, 90), margin=0.05))
        side, above = (columns - drawn.shape[1]) // 2, columns * 3 // 4 - len(drawn)
        whole = cv2.copyMakeBorder(drawn, above, 0, side, side, cv2.BORDER_REPLICATE)
        plain = measure_photograph(save_picture(tmp_path / "plain.png", whole))
        far = measure_photograph(tmp_path / "plain.png", view=View(distance=np.inf))
        near = measure_photograph(tmp_path / "plain.png", view=View(distance=plain.outline.nearest))
        assert ([doubt.name for doubt in plain.doubts], far.doubts) == (doubts, ())
        # As wrong at the nearest place as from far away.
        assert plain.mean - far.mean == pytest.approx(near.mean - plain.mean, abs=1e-9)
        # Two standard errors reach both ends. Other grains, seen from nearby, are as rough.
        others = min(np.degrees(0.5 / plain.outline.likely_distance) / 6.0, 2.0)
        unknown = np.sqrt(plain.se**2 - (1.0 + others) * far.se**2)
        # The roughness at the likely distance is that of the lines from afar within a tenth.
        assert unknown / (near.mean - far.mean) == pytest.approx(0.25, rel=0.15)


@pytest.mark.parametrize("bits", [10, 12, 14])
def test_the_bits_of_a_camera_in_a_file_of_16_bits_are_scaled(tmp_path: Path, bits: int) -> None:
    eight = draw(DrawnHeap(30, 30))
    deep = eight.astype(np.uint16) << (bits - 8)
    assert deep.max() >= 1 << (bits - 2)
    assert np.array_equal(read_picture(save_picture(tmp_path / "deep.png", deep)), eight)


def test_a_picture_of_16_bits_keeps_its_upper_eight(tmp_path: Path) -> None:
    deep = draw(DrawnHeap(30, 30)).astype(np.uint16) << 8
    read = read_picture(save_picture(tmp_path / "deep.tif", deep))
    # the library may round the lower eight bits
    assert np.abs(read.astype(int) - (deep >> 8)).max() <= 1


@pytest.mark.parametrize(
    ("name", "tags"), [("a.tif", {254: 1}), ("b.tif", {50706: b"\1\4\0\0"}), ("c.nef", {})]
)
def test_a_raw_file_is_not_measured_on_its_thumbnail(tmp_path: Path, name: str, tags: dict) -> None:
    Image.fromarray(draw(DrawnHeap(30, 30))).save(tmp_path / name, format="TIFF", tiffinfo=tags)
    with pytest.raises(PictureError, match="RAW file: develop it"):
        read_picture(tmp_path / name)


@pytest.mark.parametrize("content", [b"", b"units si\natom_style sphere\n", bytes(range(256))])
def test_a_file_that_is_no_picture_is_not_called_one(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "heap.png").write_bytes(content)
    with pytest.raises(PictureError, match="not a picture in a known format"):
        read_picture(tmp_path / "heap.png")
    cut = save_picture(tmp_path / "cut.png", draw(DrawnHeap(30, 30)))
    cut.write_bytes(cut.read_bytes()[:60])
    with pytest.raises(PictureError, match="damaged or cut off"):
        read_picture(cut)
    Image.fromarray(draw(DrawnHeap(30, 30))).save(tmp_path / "heap.pcx")
    with pytest.raises(PictureError, match="in a format that is not read here: save it as PNG"):
        read_picture(tmp_path / "heap.pcx")
