"""Objects to calibrate by: they have the sizes that are engraved, and they print."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run
from scipy.ndimage import label

from fracslice.checks.layer_checks import check_layers
from fracslice.errors import SceneError
from fracslice.scene import read, reads, to_xml
from fracslice.scene.calibration import OBJECTS, SEGMENTS, calibration
from fracslice.slicing import SliceJob, Slicer, plan_layers
from fracslice.volume.amount import sizing
from fracslice.work import Work

pytestmark = pytest.mark.once


def layer_at(kind: str, z: float, pixel: float, *sizes: float) -> np.ndarray:
    """Share of each pixel of a layer that is solid."""
    scene = calibration(kind, sizes)
    job = SliceJob(layer=0.1, pixel=pixel)
    stack = plan_layers(scene.root, job, Work(1), sizing(scene))
    index = int(np.searchsorted(stack.tops, z))
    return next(Slicer(stack, Work(1)).map(lambda layer: layer.coverage / 255, [index]))


@pytest.mark.parametrize("kind", OBJECTS)
def test_they_print_without_supports(kind: str) -> None:
    scene = calibration(kind, label="-2.5")
    assert reads(to_xml(scene)) == scene
    job = SliceJob(layer=0.2, pixel=0.2)
    report = check_layers(plan_layers(scene.root, job, Work(1), sizing(scene)), work=Work(1))
    assert not [problem.kind for problem in report.problems]


def test_walls_pins_and_slots_have_their_sizes() -> None:
    """The areas of a layer above the plate: walls, pins, and blocks less their slots."""
    made = layer_at("walls", 4.0, 0.02, 0.2, 0.5)
    number, count = label(made > 0)
    areas = sorted((made[number == k + 1].sum() * 0.02**2).tolist() for k in range(count))
    pins = [np.pi * size**2 / 4 for size in (0.2, 0.5)]
    halves = [(5 - size) / 2 * 6 for size in (0.5, 0.5, 0.2, 0.2)]
    assert areas == pytest.approx(sorted([*pins, 0.2 * 6, 0.5 * 6, *halves]), rel=0.02)


def test_holes_are_wider_than_the_peg_by_their_sizes() -> None:
    made = layer_at("tolerance", 2.5, 0.05, 0.1, 0.4)
    number, count = label(made < 1)
    empty = sorted(((1 - made[number == k + 1]).sum() * 0.05**2).item() for k in range(count))
    assert empty[:2] == pytest.approx([np.pi * (6 + size) ** 2 / 4 for size in (0.1, 0.4)], rel=0.01)


def test_slits_begin_at_the_plate() -> None:
    low, high = (layer_at("elephant-foot", z, 0.05, 0.3).sum() * 0.05**2 for z in (1.0, 4.0))
    assert high - low == pytest.approx(0.3 * 10, rel=0.02)


def test_squares_meet_at_a_corner() -> None:
    """Two of 2 mm, which reach 4 mm along both axes together; besides, there is a pin."""
    made = layer_at("exposure", 2.5, 0.05, 0.2)
    rows, columns = np.nonzero(made[: made.shape[0] * 3 // 5] > 0.5)
    assert [0.05 * (np.ptp(at) + 1) for at in (rows, columns)] == pytest.approx([4, 4], abs=0.11)
    assert made.sum() * 0.05**2 == pytest.approx(8 + np.pi * 0.1**2, rel=0.01)


def test_bridges_are_as_thick_as_is_engraved() -> None:
    """Areas of a section through the middle of the gap below, and of one through all bridges."""
    low, high = (layer_at("depth", z, 0.1, 1.0, 1.5).sum() * 0.1**2 for z in (3.0, 4.5))
    walls = 2 * 2 * (2 * 8 + 2)
    assert (low, high) == pytest.approx((walls, 2 * 5 * 10), rel=0.01)


def test_all_signs_of_a_display_differ() -> None:
    assert len({frozenset(segments) for segments in SEGMENTS.values()}) == len(SEGMENTS)


@pytest.mark.parametrize(
    ("sizes", "text", "reported"),
    [
        ([0.001], "", "sizes 0.001: expected 1 to 12"),
        ([0.1] * 13, "", "expected 1 to 12"),
        ([], "a", "label 'a'"),
    ],
)
def test_what_cannot_be_made_is_refused(sizes: list[float], text: str, reported: str) -> None:
    with pytest.raises(SceneError, match=reported):
        calibration("walls", sizes, text)


def test_the_command_writes_scenes_and_layers(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["calibrate", "walls", "-o", "walls.xml", "--sizes", "0.2,0.5mm", "--label", "2.5"]) == 0
    assert read(tmp_path / "walls.xml").root == calibration("walls", (0.2, 0.5), "2.5").root
    coarse = ["--pixel", "0.2mm", "--layer", "0.5mm", "--threads", "1"]
    assert run(["calibrate", "exposure", "-o", "exposure.json", *coarse]) == 0
    for words, reported in (
        (["wall", "-o", "w.xml"], "'wall': expected depth, elephant-foot, exposure, tolerance, walls"),
        (["walls", "-o", "w.xml", "--layer", "1mm"], "--layer: only for layers"),
        (["walls", "-o", "w.goo"], "needs --printer"),
    ):
        capfd.readouterr()
        assert run(["calibrate", *words]) == 2
        error = capfd.readouterr().err
        assert reported in error
        assert error.count("\n") == 1
