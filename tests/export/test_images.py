"""Pictures in files, read back by other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice._slices import filtered
from fracslice.errors import ExportError
from fracslice.export.images import BANDED, write_bands, write_image
from fracslice.work import Work

pytestmark = pytest.mark.once

RNG = np.random.default_rng(0)
SHOWN = RNG.uniform(0, 1, (13, 21, 3)).astype(np.float32)
SMOOTH = np.linspace(0, 1, 64 * 48 * 3, dtype=np.float32).reshape(48, 64, 3)


@pytest.mark.parametrize("picture", [SHOWN, SMOOTH, SHOWN[:1, :1]])
def test_png_of_8_bits_reads_back(tmp_path: Path, picture: np.ndarray) -> None:
    write_image(tmp_path / "a.png", picture, picture, 8, {"scene_hash": "abc", "Title": "größer"})
    with Image.open(tmp_path / "a.png") as image:
        assert (np.asarray(image) == np.round(picture * 255)).all()
        assert image.text["scene_hash"] == "abc"  # type: ignore[attr-defined]
        assert image.text["Title"] == "größer"  # type: ignore[attr-defined]


def test_png_of_16_bits_reads_back(tmp_path: Path) -> None:
    vtk = pytest.importorskip("vtkmodules.vtkIOImage")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    write_image(tmp_path / "a.png", SHOWN, SHOWN, 16)
    reader = vtk.vtkPNGReader()
    reader.SetFileName(str(tmp_path / "a.png"))
    reader.Update()
    result = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
    assert result.dtype == np.uint16
    assert (result.reshape(SHOWN.shape)[::-1] == np.round(SHOWN * np.float64(65535))).all()


@pytest.mark.parametrize("ending", ["jpg", "jpeg", "webp"])
def test_pictures_for_the_web_read_back(tmp_path: Path, ending: str) -> None:
    write_image(tmp_path / f"a.{ending}", SMOOTH, SMOOTH, text={"scene_hash": "abc"})
    with Image.open(tmp_path / f"a.{ending}") as image:
        assert abs(np.asarray(image).astype(float) - SMOOTH * 255).mean() < 2
        assert "scene_hash: abc" in image.getexif()[0x010E]


@pytest.mark.parametrize("ending", ["png", "webp", "exr", "tif"])
def test_alpha_reads_back(tmp_path: Path, ending: str) -> None:
    import OpenEXR

    clear = np.dstack([SMOOTH, np.linspace(0, 1, 48 * 64, dtype=np.float32).reshape(48, 64)])
    write_image(path := tmp_path / f"a.{ending}", clear, clear)
    if ending == "exr":
        with OpenEXR.File(str(path)) as file:
            assert (file.channels()["RGBA"].pixels == clear).all()
    elif ending == "tif":
        tifffile = pytest.importorskip("tifffile")
        assert (tifffile.imread(path) == clear).all()
    else:
        with Image.open(path) as image:
            assert image.mode == "RGBA"
            assert abs(np.asarray(image)[..., 3].astype(float) - clear[..., 3] * 255).max() <= 0.5


def test_tiff_holds_the_light_as_floats(tmp_path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    light = SHOWN * 1000
    write_image(tmp_path / "a.tif", SHOWN, light, text={"Title": "a"})
    result = tifffile.imread(tmp_path / "a.tif")
    assert result.dtype == np.float32
    assert (result == light).all()


def test_exr_holds_the_light_as_floats_and_the_text(tmp_path: Path) -> None:
    import OpenEXR

    light = SHOWN * 1000
    write_image(tmp_path / "a.exr", SHOWN, light, text={"scene_hash": "abc", "Title": "größer"})
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert (file.channels()["RGB"].pixels == light).all()
        assert file.header()["scene_hash"] == "abc"
        assert file.header()["Title"] == "größer"


def test_an_ending_in_capitals_is_the_same(tmp_path: Path) -> None:
    assert write_image(tmp_path / "a.EXR", SHOWN, SHOWN).stat().st_size > 100


def test_smooth_pictures_make_small_files(tmp_path: Path) -> None:
    assert write_image(tmp_path / "a.png", SMOOTH, SMOOTH).stat().st_size < SMOOTH.size / 8


@pytest.mark.parametrize("ending", BANDED)
def test_a_file_written_in_bands_is_that_of_the_whole_picture(tmp_path: Path, ending: str) -> None:
    picture, text = RNG.random((150, 21, 4), np.float32), {"Title": "a"}
    whole = write_image(tmp_path / f"a{ending}", picture, picture, 16, text)
    bands = ((part, part) for part in (picture[:64], picture[64:128], picture[128:]))
    write_bands(path := tmp_path / f"b{ending}", (21, 150), bands, 4, 16, text, Work(2))
    assert path.read_bytes() == whole.read_bytes()


def test_unknown_endings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"known are \.png"):
        write_image(tmp_path / "a.bmp", SHOWN, SHOWN)


def by_the_standard(rows: np.ndarray, pixel: int) -> list[np.ndarray]:
    """Rows after the first one by each of the five filters of ISO/IEC 15948, as signed numbers."""
    value = rows.astype(np.int16)
    row, above = value[1:], value[:-1]
    left, corner = (np.pad(x, ((0, 0), (pixel, 0)))[:, : x.shape[1]] for x in (row, above))
    guess = left + above - corner
    a, b, c = abs(guess - left), abs(guess - above), abs(guess - corner)
    paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, above, corner))
    return [(row - p).astype(np.int8) for p in (0 * row, left, above, (left + above) // 2, paeth)]


@pytest.mark.parametrize("pixel", [1, 3, 8])
def test_each_row_has_the_filter_of_the_smallest_sum(pixel: int) -> None:
    rng = np.random.default_rng(pixel)
    noise = rng.integers(0, 256, (30, 9 * pixel))
    smooth = [np.cumsum(noise % 5, axis) for axis in (0, 1)]
    rows = np.vstack([noise, *smooth, smooth[0] + smooth[1]]).astype(np.uint8)
    tried = by_the_standard(rows, pixel)
    best = np.argmin([abs(t.astype(int)).sum(1) for t in tried], 0)
    expected = b"".join(bytes([k]) + tried[k][y].tobytes() for y, k in enumerate(best))
    assert len(set(best)) == 5
    assert filtered(rows, pixel) == expected
