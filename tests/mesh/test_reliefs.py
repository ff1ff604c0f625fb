"""Pictures as heights: planes and steps in closed form, slopes, and pictures that are refused."""

from __future__ import annotations

import math
import shutil
import struct
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice import make_mesh
from fracslice.errors import SceneError
from fracslice.fields.devices import reference
from fracslice.formulas import Node, box, heightmap, lithophane, relief
from fracslice.mesh.reliefs import grey
from fracslice.scene import read, reads, scene, to_xml
from tests.examples import EXAMPLES, HILLS, stamped

pytestmark = pytest.mark.once

SHAPES = ["heightmap", "lithophane", "lithophane wall", "lithophane ball", "relief"]


def saved(path: Path, levels: object, kind: type = np.uint8) -> str:
    Image.fromarray(np.array(levels, kind)).save(path)
    return str(path)


def test_a_ramp_is_a_plane(tmp_path: Path) -> None:
    """257 columns of 16 bits in equal steps of 255."""
    file = saved(tmp_path / "ramp.png", [np.arange(257) * 255] * 65, np.uint16)
    root = heightmap(file, size=1, height=0.5, base=0.1, place="bed")
    rise = 0.5 * 256 * 255 / 65535
    x, y = np.random.default_rng(1).uniform((-0.49, -0.12), (0.49, 0.12), (20_000, 2)).T
    z = np.random.default_rng(2).uniform(0.01, 0.8, x.size)
    known = z - (0.1 + rise * (x + 0.5))
    found = reference(root)(x, y, z)
    above = known > -0.003  # deeper, a side or the bottom is nearer
    np.testing.assert_allclose(found[above], known[above], atol=1e-12)
    assert (found[~above] < 0).all()
    assert root.bounds.lipschitz == pytest.approx(math.hypot(1, rise), rel=1e-9)
    mesh = make_mesh(root, resolution=129)
    assert mesh.is_watertight
    volume = 0.25 * (0.1 + rise / 2) * (mesh.bounds[1] - mesh.bounds[0])[0] ** 3
    assert mesh.volume == pytest.approx(volume, rel=1e-6)


def test_a_step_is_as_wide_as_a_pixel(tmp_path: Path) -> None:
    """Pixels 0 0 0 255 255 255, a unit apart, of heights 1 and 3: slopes of 2 between x = -1/2 and 1/2."""
    file = saved(tmp_path / "step.png", [[0, 0, 0, 255, 255, 255]] * 4)
    root = heightmap(file, size=5, height=2, base=1, place="bed")
    x = np.linspace(-2.4, 2.4, 97)
    above = reference(root)(x, 0 * x, 4 + 0 * x)
    np.testing.assert_allclose(above, 4 - np.clip(2 + 2 * x, 1, 3), atol=1e-12)
    assert root.bounds.box.size == (5, 3, 3) and root.bounds.lipschitz == pytest.approx(math.sqrt(5))
    mesh = make_mesh(root, resolution=61)
    assert mesh.volume == pytest.approx(5 * 3 * 2 * (np.ptp(mesh.vertices[:, 0]) / 5) ** 3, rel=1e-3)


def test_thickness_is_that_of_levels_on_every_form(tmp_path: Path) -> None:
    """Half black and half white: 3 and 1 thick, across the smooth face."""
    file = saved(tmp_path / "halves.png", [[0] * 8 + [255] * 8] * 8)
    given = {"thinnest": 0.1, "thickest": 0.3, "place": "bed"}
    plate, wall, ball = (lithophane(file, form=form, **given) for form in ("flat", "cylinder", "sphere"))
    assert [float(plate.distance(x, 0, 0.4)) for x in (-0.3, 0.3)] == pytest.approx([0.1, 0.3], abs=1e-6)
    radius = 16 / 7 / (2 * math.pi)  # 16 columns of the step of 7 rows, on a height of 1
    assert [float(wall.distance(x, 0, 0.5)) for x in (-radius - 0.4, radius + 0.4)] == pytest.approx(
        [0.1, 0.3]
    )
    assert float(wall.distance(0, 0, 0.5)) == pytest.approx(radius)
    assert [float(ball.distance(x, 0, 0.8)) for x in (-0.9, 0.9)] == pytest.approx([0.1, 0.3], abs=1e-6)
    half = lithophane(file, form="cylinder", degrees=180, **given)
    assert half.bounds.box.hi[1] < 0.01 and float(half.distance(0, 0.5, 0.5)) > 0.1


@pytest.mark.parametrize("name", SHAPES)
def test_fields_keep_their_slope_and_box(name: str) -> None:
    root = EXAMPLES[name]
    far = 0.7 * max(root.bounds.box.size)
    points = (
        np.random.default_rng(3).uniform(-far, far, (3, 40_000)) + np.array(root.bounds.box.centre)[:, None]
    )
    steps = np.random.default_rng(4).normal(0, 2e-3, points.shape)
    field = reference(root)
    change = np.abs(field(*(points + steps)) - field(*points))
    assert (change <= root.bounds.lipschitz * np.linalg.norm(steps, axis=0) * (1 + 1e-9)).all()
    inside = field(*points) < 0
    assert inside.sum() > 200
    low, high = (np.array(corner)[:, None] for corner in (root.bounds.box.lo, root.bounds.box.hi))
    assert ((points >= low) & (points <= high))[:, inside].all()
    assert np.abs(root.kernel().points(*points) - field(*points)).max() < 1e-5


@pytest.mark.parametrize("name", SHAPES)
def test_enclosures_hold_all_values(name: str) -> None:
    root, half, rng = EXAMPLES[name], 0.05, np.random.default_rng(5)
    centres = rng.uniform(-1, 1, (3, 300))
    within = centres[:, :, None] + rng.uniform(-half, half, (3, 300, 50))
    values = reference(root)(*within)
    low, high = root.cells("float64").bounds(centres, half)
    assert (low[:, None] <= values).all() and (values <= high[:, None]).all()
    assert (low > 0).any()


@pytest.mark.parametrize("name", stamped(SHAPES, {"relief", "lithophane ball"}))
def test_meshes_are_closed(name: str) -> None:
    mesh = make_mesh(EXAMPLES[name], resolution=65)
    assert mesh.is_watertight and mesh.volume > 0


def test_a_relief_raises_the_element(tmp_path: Path) -> None:
    file = saved(tmp_path / "grey.png", [[51] * 4] * 4)
    raised = relief(box(size=(2, 2, 1)), file=file, height=0.5)
    assert float(raised.distance(0, 0, 1)) == pytest.approx(0.4)


def test_levels_of_all_kinds_of_pictures(tmp_path: Path) -> None:
    for kind, most in ((np.uint8, 255), (np.uint16, 65535)):
        file = saved(tmp_path / "levels.png", [[0, most // 5], [most // 5 * 2, most]], kind)
        np.testing.assert_allclose(grey(file), [[0, 0.2], [0.4, 1]], atol=1e-12)
    Image.new("RGB", (3, 2), (255, 255, 255)).save(tmp_path / "white.webp", lossless=True)
    Image.new("P", (3, 2)).save(tmp_path / "palette.png")
    assert (grey(str(tmp_path / "white.webp")) == 1).all() and grey(str(tmp_path / "palette.png")).shape == (
        2,
        3,
    )
    saved(tmp_path / "large.png", np.full((3000, 3000), 51))
    assert grey(str(tmp_path / "large.png")).shape == (1500, 1500)


def test_a_scene_knows_its_picture_by_its_hash(tmp_path: Path) -> None:
    shutil.copy(HILLS, tmp_path / "a.png")
    (tmp_path / "a.xml").write_text(
        '<scene version="1"><solid size="20mm"><heightmap file="a.png"/></solid></scene>'
    )
    root = read(tmp_path / "a.xml").root
    assert root["sha256"] and reads(to_xml(scene(root, unit=1.0)), files_outside=True).root == root
    saved(tmp_path / "a.png", [[0, 1], [2, 3]])
    assert read(tmp_path / "a.xml").root != root
    with pytest.raises(SceneError, match="the file is another now"):
        heightmap(HILLS, sha256="0" * 64)


def huge(path: Path) -> str:
    """Header of a picture of 10^9 pixels."""
    chunk = b"IHDR" + struct.pack(">IIBBBBB", 31623, 31623, 8, 0, 0, 0, 0)
    data = struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))
    pixels = struct.pack(">I", 0) + b"IDAT" + struct.pack(">I", zlib.crc32(b"IDAT"))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + data + pixels)
    return str(path)


def test_pictures_are_refused_in_one_line(tmp_path: Path) -> None:
    half = Path(HILLS).read_bytes()[:-60]
    (tmp_path / "half.png").write_bytes(half)
    (tmp_path / "words.png").write_text("no picture")
    (tmp_path / "empty.png").touch()
    cases = {
        huge(tmp_path / "huge.png"): "too many pixels: expected at most 67108864 of them",
        str(tmp_path / "half.png"): "not a picture",
        str(tmp_path / "words.png"): "not a picture",
        str(tmp_path / "empty.png"): "not a picture",
        saved(tmp_path / "dot.png", [[1]]): "1 x 1 pixels: expected at least 2 x 2",
        str(tmp_path / "none.png"): "no such file",
        "a.stl": "not a picture that can be read; known are",
    }
    for file, reason in cases.items():
        begun = time.perf_counter()
        with pytest.raises(SceneError, match=reason) as caught:
            heightmap(file).bounds  # noqa: B018
        assert "\n" not in str(caught.value) and time.perf_counter() - begun < 5


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"thinnest": 0.2, "thickest": 0.1}, "thinnest=0.2: expected at most thickest=0.1"),
        ({"degrees": 90}, 'degrees=90: expected form="cylinder"'),
        ({"form": "cone"}, "expected flat, cylinder or sphere"),
    ],
)
def test_values_that_do_not_fit(values: dict[str, object], reason: str) -> None:
    with pytest.raises(SceneError, match=reason):
        lithophane(HILLS, **values)


def test_it_is_a_shape_like_any_other() -> None:
    plate: Node = heightmap(HILLS, place="bed")
    made = make_mesh((plate | box(size=(0.2, 0.2, 0.4))) - box(size=(0.05, 0.05, 1)), resolution=65)
    assert made.is_watertight
