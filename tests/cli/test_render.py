"""fracslice render."""

from __future__ import annotations

import os
import re
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fracslice.cli.main import run
from PIL import Image

from fracslice.jobs import pictures
from fracslice.rendering import Pass, Renderer, packets
from fracslice.rendering.accumulator import CHANNELS, COARSE, COUNT, PassPlan
from fracslice.rendering.progressive import BYTES

SCENE = """<scene version="1">
  <solid size="80mm"><material colour="0.9 0.3 0.2"><sphere/></material></solid>
  <camera eye="3 -2 1"/>
  <film width="40" height="24" samples="3"/>
  <light position="1 -2 3"/>
</scene>"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "ball.xml"
    path.write_text(SCENE)
    return path


def test_a_picture_with_what_it_is_of(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["render", str(scene), "-o", str(tmp_path / "a.png"), "--device", "cpu"]) == 0
    assert "40 x 24 pixels, 3.0 samples a pixel" in capsys.readouterr().out
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (40, 24)
        assert image.text["Title"] == "ball"  # type: ignore[attr-defined]
        assert len(image.text["scene_hash"]) == 12  # type: ignore[attr-defined]
        middle, corner = np.asarray(image)[12, 20], np.asarray(image)[0, 0]
    assert middle[0] > 2 * middle[2], "the ball is red"
    assert corner[2] > corner[0], "and the background is not"


def test_layers_have_the_names_and_units_of_compositors(scene: Path, tmp_path: Path) -> None:
    import OpenEXR

    common = ["render", str(scene), "-q", "--device", "cpu", "--samples", "1"]
    assert run([*common, "-o", str(tmp_path / "a.exr"), "--layers"]) == 0
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        held = {name: channel.pixels for name, channel in file.channels().items()}
    expected = {"R", "G", "B", "Z", "Samples.V", "Trap.V", "Albedo.R", "Albedo.G", "Albedo.B"}
    assert set(held) == expected | {f"{layer}.{axis}" for layer in ("Normal", "Position") for axis in "XYZ"}
    place, normal = (np.stack([held[f"{n}.{axis}"] for axis in "XYZ"], -1) for n in ("Position", "Normal"))
    hit = held["Z"] < 1e9
    assert 0.1 < hit.mean() < 0.9 and (held["Z"][~hit] == 1e10).all()
    forward = -np.array((3, -2, 1)) / np.sqrt(14)
    assert np.allclose((place[hit] - (3, -2, 1)) @ forward, held["Z"][hit], atol=1e-3)
    assert ((place * normal).sum(2)[hit] > 0.9).mean() > 0.9, "on a ball, the normal is the position"
    assert np.allclose(held["Albedo.R"][hit], ((0.9 + 0.055) / 1.055) ** 2.4)
    assert (held["Samples.V"] == 1).all()
    assert run([*common, "-o", str(tmp_path / "a.png"), "--layers"]) == 2


def test_a_part_of_a_picture_is_that_part(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ["render", str(scene), "-q", "--device", "cpu", "--samples", "1"]
    assert run([*common, "-o", str(tmp_path / "a.png")]) == 0
    assert run([*common, "-o", str(tmp_path / "b.png"), "--crop", "13,6,16,9"]) == 0
    whole, cut = (np.asarray(Image.open(tmp_path / f"{name}.png")) for name in "ab")
    assert (cut == whole[6:15, 13:29]).all()
    assert run([*common, "-o", str(tmp_path / "b.png"), "--crop", "30,6,16,9"]) == 2
    assert "crop=30,6,16,9: expected a part of 40 x 24 pixels" in capsys.readouterr().err


@pytest.mark.parametrize("ending", ["png", "exr"])
def test_a_picture_larger_than_the_memory_is_rendered_in_bands(
    scene: Path,
    tmp_path: Path,
    ending: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    common = ["render", str(scene), "-q", "--device", "cpu", "--samples", "16", "--size", "40x150"]
    whole, banded = tmp_path / f"a.{ending}", tmp_path / f"b.{ending}"
    assert run([*common, "-o", str(whole)]) == 0
    monkeypatch.setattr(pictures, "available_bytes", lambda: BYTES * 40 * 149)
    assert run([*common, "-o", str(banded)]) == 0
    assert "40 x 150 pixels need 0.0 GB of memory, more than is free: rendered in 3 bands of 64 rows" in (
        capsys.readouterr().err
    )
    assert (picture(banded) == picture(whole)).all()
    assert run([*common, "-o", str(tmp_path / "b.jpg")]) == 2
    assert run([*common, "-o", str(banded), "--denoise"]) == 2
    assert run([*common, "-o", str(tmp_path / "b.png"), "--set", "film.bloom=0.1"]) == 2
    assert sorted(path.suffix for path in tmp_path.iterdir()) == sorted([f".{ending}"] * 2 + [".xml"])


def picture(path: Path) -> np.ndarray:
    """Pixels of a PNG or an OpenEXR file."""
    import OpenEXR

    if path.suffix == ".png":
        return np.asarray(Image.open(path))
    with OpenEXR.File(str(path)) as file:
        return np.array(file.channels()["RGB"].pixels)


def test_a_seed_changes_the_noise_alone(scene: Path, tmp_path: Path) -> None:
    pictures = []
    for seed in ("0", "0", "5"):
        assert run(["render", str(scene), "-q", "-o", str(tmp_path / "a.png"), "--seed", seed]) == 0
        pictures.append(np.asarray(Image.open(tmp_path / "a.png")).astype(int))
    assert (pictures[0] == pictures[1]).all() and (pictures[0] != pictures[2]).any()
    assert abs(pictures[0].mean() - pictures[2].mean()) < 2


def test_pass_images_and_going_on_from_a_state(scene: Path, tmp_path: Path) -> None:
    common = ["render", str(scene), "-q", "--device", "cpu"]
    state = ["--state", str(tmp_path / "s.npz")]
    assert run([*common, "-o", str(tmp_path / "a.png"), "--samples", "2", *state]) == 0
    passes = ["--pass-images", str(tmp_path / "passes")]
    assert run([*common, "-o", str(tmp_path / "a.png"), "--samples", "5", *state, *passes]) == 0
    assert sorted(p.name for p in (tmp_path / "passes").iterdir()) == ["pass0004.png", "pass0005.png"]
    assert run([*common, "-o", str(tmp_path / "b.png"), "--samples", "5"]) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--size", "0x10"], "expected pixels across and down"),
        (["--samples", "0"], "expected a whole number from 1 to 1000000"),
        (["--time", "never"], "expected a time"),
        (["--set", "camera.eye=0.3 0 0.2"], "outside the solid"),
        (["--set", "camera.up=3 -2 1"], "other than the one the camera looks in"),
        (["--set", "light.strength=nan"], "expected a number"),
        (["--set", "light[2].strength=1"], "the scene has 1 <light>"),
        (["--set", "film.width=0"], "expected a whole number"),
        (["--set", "shading.mode=cel"], "expected light, normal"),
        (["--set", "shading.glitter=1"], "no attribute 'glitter'"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(
    scene: Path, tmp_path: Path, options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["render", str(scene), "-o", str(tmp_path / "a.png"), *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ('<light position="1 -2 3"/>', '<light position="1 -2"/>', 5),
        ('eye="3 -2 1"', 'eye="0 0 0"', 3),
        ('<camera eye="3 -2 1"/>', '<camera eye="3 -2 1"/>\n<camera eye="1 -2 1"/>', 4),
        ('samples="3"', 'grain="3"', 4),
    ],
)
def test_mistakes_in_the_file_have_their_line(
    scene: Path, tmp_path: Path, old: str, new: str, line: int, capsys: pytest.CaptureFixture[str]
) -> None:
    scene.write_text(SCENE.replace(old, new))
    assert run(["render", str(scene), "-o", str(tmp_path / "a.png")]) == 2
    assert f"ball.xml:{line}: " in capsys.readouterr().err


def stopped_after(
    passes: int, monkeypatch: pytest.MonkeyPatch, number: signal.Signals = signal.SIGINT
) -> None:
    """Send a signal, that of Ctrl-C, in the pass after some others."""
    receive = Renderer._pass

    def pressed(self: Renderer, plan: PassPlan) -> Pass:
        if self.accumulator.passes == passes:
            os.kill(os.getpid(), number)
        return receive(self, plan)

    monkeypatch.setattr(Renderer, "_pass", pressed)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_keeps_the_picture_and_its_state(
    scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    number: signal.Signals,
    status: int,
) -> None:
    common = ["render", str(scene), "--device", "cpu", "--samples", "8", "-o"]
    stopped_after(3, monkeypatch, number)
    state = ["--state", str(tmp_path / "s.npz")]
    assert run([*common, str(tmp_path / "a.png"), *state]) == status
    assert "stopped; " in (error := capsys.readouterr().err)
    assert "a.png: 40 x 24 pixels, 2.0 samples a pixel" in error
    with Image.open(tmp_path / "a.png") as image:
        assert np.ptp(np.asarray(image)) > 50
    monkeypatch.undo()
    assert run([*common, str(tmp_path / "a.png"), *state]) == 0
    assert run([*common, str(tmp_path / "b.png")]) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_ctrl_c_before_the_first_sample_writes_nothing(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stopped_after(0, monkeypatch)
    assert run(["render", str(scene), "--device", "cpu", "-o", str(tmp_path / "a.png")]) == 130
    assert "nothing was written" in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()


def test_a_time_limit_interrupts_the_first_pass(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """No tile is begun after the limit, and all pixels have light."""
    load, begun = packets.load_functions, list[np.ndarray]()

    def slow(*of: Any) -> dict[str, Any]:
        functions = load(*of)

        def tile(*arguments: Any) -> None:
            begun.append(arguments[6].copy())
            functions["tile"](*arguments)
            time.sleep(0.5)

        return functions | {"tile": tile}

    monkeypatch.setattr(packets, "load_functions", slow)
    options = ["--size", "800x600", "--time", "0.1s", "--device", "cpu", "--threads", "1"]
    options += ["--set", "shading.ambient=0.1", "--state", str(tmp_path / "s.npz")]
    assert run(["render", str(scene), "-o", str(tmp_path / "a.png"), *options]) == 0
    assert len(begun) == 1 and len(begun[0]) < 800 * 600 / COARSE**2
    samples = float(re.search(r"([\d.]+) samples", capsys.readouterr().out)[1])  # type: ignore[index]
    assert samples == pytest.approx(len(begun[0]) / 800 / 600, rel=0.1)
    with np.load(tmp_path / "s.npz") as state:
        assert state["sums"].reshape(-1, CHANNELS)[:, COUNT].sum() == len(begun[0])
    with Image.open(tmp_path / "a.png") as image:
        assert np.asarray(image).reshape(-1, 3).max(1).min() > 0, "no pixel is empty"


@pytest.mark.parametrize("name", ["guides", "denoise"])
def test_a_signal_while_noise_is_removed_keeps_the_picture(
    scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    def stopped(renderer: Renderer, *_: Any) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        renderer.work.check()

    monkeypatch.setattr(pictures, name, stopped)
    options = ["--denoise", "--device", "cpu", "-o", str(tmp_path / "a.png")]
    assert run(["render", str(scene), *options]) == 143
    assert "a.png: 40 x 24 pixels, 3.0 samples a pixel" in capsys.readouterr().err
    assert (tmp_path / "a.png").exists()


def test_a_time_limit_includes_the_removal_of_noise(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits, limited = list[float](), pictures._limit_time

    def seen(renderer: Renderer, samples: int | None, limit: float) -> Any:
        limits.append(limit)
        return limited(renderer, samples, limit)

    def slow(*of: Any) -> Any:
        time.sleep(1)
        return remove(*of)

    remove = pictures.denoise
    monkeypatch.setattr(pictures, "denoise", slow)
    monkeypatch.setattr(pictures, "_limit_time", seen)
    options = ["--denoise", "--time", "60s", "--device", "cpu", "-o", str(tmp_path / "a.png")]
    assert run(["render", str(scene), *options]) == 0
    assert 6 <= limits[0] < 58.01


def test_a_time_limit_before_the_first_sample_is_doubled(scene: Path, tmp_path: Path) -> None:
    options = ["--size", "300x200", "--time", ".000001s", "--device", "cpu", "-q"]
    assert run(["render", str(scene), "-o", str(tmp_path / "a.png"), *options]) == 0


def test_noise_is_removed_from_a_picture_of_light(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from fracslice.jobs.pictures import advice

    common = ["render", str(scene), "-q", "--device", "cpu", "-o"]
    assert run([*common, str(tmp_path / "a.png")]) == 0
    assert run([*common, str(tmp_path / "b.png"), "--denoise"]) == 0
    note = capsys.readouterr().err
    assert ("--denoise: by non-local means" in note) == bool(advice())
    noisy, clean = (np.asarray(Image.open(tmp_path / f"{name}.png")).astype(int) for name in "ab")
    assert abs(noisy - clean).max() > 0 and abs(noisy - clean).mean() < 2
    assert run([*common, str(tmp_path / "c.png"), "--denoise", "--set", "shading.mode=depth"]) == 2
    assert 'expected a scene with shading mode="light"' in capsys.readouterr().err
    assert not (tmp_path / "c.png").exists()


def test_the_error_of_less_than_a_sample_is_unknown():
    assert pictures.describe_samples(0.25, float("inf")) == "0.2 samples a pixel, error unknown"
    assert pictures.describe_samples(4.0, 0.0123) == "4.0 samples a pixel, error 0.012"
