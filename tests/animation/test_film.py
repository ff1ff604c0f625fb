"""Frames and films: kept, resumed, decorrelated, encoded."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from fracslice.cli.main import run
from PIL import Image, ImageSequence

from fracslice import read, reads
from fracslice.animation import FilmJob, Timeline, encode, write_frames
from fracslice.animation.film import CODECS
from fracslice.common.files import locked_folder
from fracslice.errors import Cancelled, ExportError, RenderError
from fracslice.rendering import Renderer, develop
from fracslice.work import Work

pytestmark = pytest.mark.once

FILMS = Path(__file__).parents[2] / "examples/films"
SCENE = """<scene version="1"><solid size="80mm"><material colour="1 1 1"><sphere/></material></solid>
<camera eye="0 -4 0"/><light kind="{light}" position="1 -1 1"/><film width="40" height="24" samples="8"/>
<animation duration="1s" fps="8" {animation}/>{tracks}</scene>"""
MOVING = '<track of="camera.eye" keys="0s: 0 -4 0; 1s: 1 -4 0"/>'


def scene(light: str = "sun", animation: str = "", tracks: str = MOVING) -> str:
    return SCENE.format(light=light, animation=animation, tracks=tracks)


def job(text: str, samples: int = 8) -> FilmJob:
    return FilmJob(Timeline(reads(text)), (40, 24), samples, 8.0, device="cpu")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "ball.xml"
    path.write_text(scene())
    return path


def animate(*arguments: object) -> int:
    return run(["animate", *map(str, arguments), "--device", "cpu", "--quiet"])


def test_a_film_that_stopped_goes_on_and_is_the_same(path: Path, tmp_path: Path) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    whole.mkdir()
    (whole / ".fracslice~k1ll3d.film.json.part").write_bytes(b"killed before the film began")
    assert animate(path, "-o", whole) == 0
    assert animate(path, "-o", parts, "--frames", "2..5") == 0
    kept = (parts / "frame00003.png").stat().st_mtime_ns
    (parts / ".fracslice~k1ll3d.frame00006.png.part").write_bytes(b"killed here")
    (parts / "frame00004.png").write_bytes((parts / "frame00002.png").read_bytes())
    assert animate(path, "-o", parts, "--resume", "--threads", 1) == 0
    assert (parts / "frame00003.png").stat().st_mtime_ns == kept
    names = [f"frame{k:05}.png" for k in range(8)]
    for folder in (whole, parts):
        assert sorted(file.name for file in folder.iterdir()) == ["film.json", *names]
    for name in ["film.json", *names]:
        assert (whole / name).read_bytes() == (parts / name).read_bytes()
    assert (whole / names[0]).read_bytes() != (whole / names[7]).read_bytes()


def test_a_stopped_film_says_what_is_there(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    encoded = FilmJob.file

    def interrupted(job: FilmJob, number: int, work: Work) -> bytes:
        if number == 3:
            os.kill(os.getpid(), signal.SIGINT)
        return encoded(job, number, work)

    monkeypatch.setattr(FilmJob, "file", interrupted)
    assert animate(path, "-o", tmp_path / "film.gif", "--threads", 1) == 130
    assert "film.frames are whole" in capsys.readouterr().err
    frames = sorted(file.name for file in (tmp_path / "film.frames").iterdir())
    assert frames == ["film.json", "frame00000.png", "frame00001.png", "frame00002.png"]
    assert not (tmp_path / "film.gif").exists()


def test_frames_are_made_at_once(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert animate(path, "-o", tmp_path / "one", "--threads", 1) == 0
    encoded, both = FilmJob.file, threading.Barrier(2, timeout=60)

    def waiting(job: FilmJob, number: int, work: Work) -> bytes:
        both.wait()
        return encoded(job, number, work)

    monkeypatch.setattr(FilmJob, "file", waiting)
    assert animate(path, "-o", tmp_path / "two", "--threads", 2) == 0
    for frame in (tmp_path / "one").glob("*.png"):
        assert frame.read_bytes() == (tmp_path / "two" / frame.name).read_bytes()


@pytest.mark.nightly
def test_shards_make_the_frames_of_one_film(path: Path, tmp_path: Path) -> None:
    alone, shared = tmp_path / "alone", tmp_path / "shared"
    exr = ["--frames", "0..1", "--exr", "--layers"]
    assert animate(path, "-o", alone, *exr) == 0
    with OpenEXR.File(str(alone / "frame00001.exr"), separate_channels=True) as file:
        channels = file.channels()
        assert {"R", "Z", "Normal.X", "Position.Y", "Albedo.B"} < set(channels)
        assert channels["Z"].pixels[12, 20] == pytest.approx(3, abs=0.1)
        assert channels["Samples.V"].pixels.max() == 8
    assert animate(path, "-o", shared, *exr, "--shard", "2/2") == 0
    assert not shared.exists()
    assert animate(path, "-o", shared, *exr, "--shard", "1/2") == 0
    for frame in alone.iterdir():
        assert frame.read_bytes() == (shared / frame.name).read_bytes()


def test_frames_of_another_film_are_not_mixed_in(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "frames"
    assert animate(path, "-o", folder, "--samples", 1) == 0
    assert animate(path, "-o", folder, "--samples", 2, "--frames", "0", "--resume") == 2
    assert "another film" in capsys.readouterr().err and len(list(folder.iterdir())) == 9
    assert animate(path, "-o", folder, "--samples", 2, "--frames", "0") == 0
    assert sorted(file.name for file in folder.iterdir()) == ["film.json", "frame00000.png"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(RenderError, match="expected an empty folder"):
        write_frames(job(scene()), range(1), tmp_path / "mine", False, Work(1))
    for text in ("{}", "[]", "dear"):
        (tmp_path / "mine" / "film.json").write_text(text)
        with pytest.raises(RenderError, match=r"film\.json: expected the journal of a film"):
            write_frames(job(scene()), range(1), tmp_path / "mine", False, Work(1))


def test_frames_below_another_sky_are_another_film(tmp_path: Path) -> None:
    sky = tmp_path / "sky.png"
    text = scene().replace('kind="sun"', f'kind="environment" file="{sky}"')
    keys = []
    for colour in ("red", "blue", "red"):
        Image.new("RGB", (8, 4), colour).save(sky)
        keys.append(job(text).key)
    assert keys[0] == keys[2] != keys[1]


def test_frames_of_another_device_are_another_film(monkeypatch: pytest.MonkeyPatch) -> None:
    def keys() -> list[str]:
        return [replace(job(scene()), device=device).key for device in ("cpu", "auto")]

    monkeypatch.setattr("fracslice.expr.cuda_driver.missing", lambda: "no GPU")
    cpu, auto = keys()
    assert cpu == auto
    monkeypatch.setattr("fracslice.expr.cuda_driver.missing", lambda: "")
    assert keys()[0] == cpu != keys()[1]


def test_two_films_at_once_do_not_mix_their_frames(tmp_path: Path) -> None:
    (tmp_path / "frames").mkdir()
    with locked_folder(tmp_path / "frames"), pytest.raises(ExportError, match="another process"):
        write_frames(job(scene()), range(1), tmp_path / "frames", False, Work(1))
    assert not list((tmp_path / "frames").iterdir())


def test_noise_changes_with_the_frame_unless_it_is_fixed() -> None:
    still = [job(scene("sky", f'noise="{noise}"', "")) for noise in ("moving", "fixed")]
    moving, fixed = ([film.light(k, Work(1)) for k in range(8)] for film in still)
    assert all(np.array_equal(fixed[0], other) for other in fixed)
    noise = np.array(moving) - job(scene("sky", tracks=""), 512).light(0, Work(1))
    one, mean = (np.sqrt((error**2).mean()) for error in (noise[0], noise.mean(0)))
    assert mean < 0.55 * one, "the mean of eight frames is nearly as good as eight times the samples"


def test_an_open_shutter_averages_the_times_and_divides_the_samples() -> None:
    turning = '<track of="camera.eye" keys="0s: 0 -4 0; 1s: 24 -4 0" curve="linear"/>'
    open_shutter = job(scene(animation='shutter="1" times="4"', tracks=turning), 16).light(2, Work(1))
    timeline, parts = job(scene(tracks=turning)).timeline, []
    for k in range(4):
        at = timeline.at((2 + (k + 0.5) / 4) / 8)
        *_, done = Renderer(at.root, at.view, (40, 24), Work(1), "cpu").passes(64)
        parts.append(done.mean)
    expected = np.mean(parts, 0)
    closed = job(scene(tracks=turning), 16).light(2, Work(1))
    assert abs(open_shutter - expected).mean() < 0.3 * abs(closed - expected).mean()


def test_a_frame_has_all_of_its_samples(tmp_path: Path) -> None:
    """12 samples at 8 times: one or two at each."""
    (tmp_path / "ball.xml").write_text(scene("sky", 'shutter="0.5" times="8"'))
    exr = ["--frames", "0", "--exr", "--layers", "--samples", 12]
    assert animate(tmp_path / "ball.xml", "-o", tmp_path / "out", *exr) == 0
    with OpenEXR.File(str(tmp_path / "out/frame00000.exr"), separate_channels=True) as file:
        assert file.channels()["Samples.V"].pixels.max() == 12


def test_a_film_all_around_for_two_eyes() -> None:
    """Two pictures side by side, of 360 degrees; their distance is an attribute that a track moves."""
    eyes = '<track of="camera.stereo" keys="0s: 0; 1s: 1"/>'
    text = scene(tracks=eyes).replace("<camera ", '<camera kind="equirectangular" ')
    alpha = job(text).light(7, Work(1))[:, :, 3]
    halves = alpha[:, :20].sum(0), alpha[:, 20:].sum(0)
    left, right = (half @ np.arange(20) / half.sum() for half in halves)
    expected = 20 * 2 * np.arctan(0.875 / 2 / 4) / (2 * np.pi)
    assert left - right == pytest.approx(expected, rel=0.2), (
        "the angle between the eyes at the ball's distance"
    )


def test_the_camera_of_a_frame_becomes_a_scene(path: Path, tmp_path: Path) -> None:
    assert animate(path, "-o", tmp_path / "at.xml", "--frames", "4") == 0
    at = read(tmp_path / "at.xml")
    assert at.view.camera and at.view.camera.eye == pytest.approx((0.5, -4, 0)) and at.animation is None
    assert animate(path, "-o", tmp_path / "at.xml", "--frames", "8") == 2, "there are eight"


def test_pictures_that_move_and_contact_sheets(path: Path, tmp_path: Path) -> None:
    for name in ("film.gif", "film.apng"):
        assert animate(path, "-o", tmp_path / name, "--resume") == 0
        with Image.open(tmp_path / name) as film:
            assert (film.n_frames, film.size) == (8, (40, 24))  # type: ignore[attr-defined]
            assert film.info["duration"] == pytest.approx(125, abs=5)
    assert animate(path, "-o", tmp_path / "film.png", "--resume") == 0
    with Image.open(tmp_path / "film.png") as sheet:
        assert sheet.size == (240, 48)
    assert len(list((tmp_path / "film.frames").iterdir())) == 9, "made once"


def test_a_contact_sheet_needs_its_frames_alone(path: Path, tmp_path: Path) -> None:
    assert animate(path, "-o", tmp_path / "film.png", "--preview", "--fps", 40) == 0
    made = sorted((tmp_path / "film.preview.frames").glob("*.png"))
    assert (len(made), made[-1].name) == (24, "frame00039.png")
    assert Image.open(made[0]).size == (10, 6)
    assert Image.open(tmp_path / "film.png").size == (60, 24)


def test_samples_of_a_preview(path: Path, tmp_path: Path) -> None:
    shown = []
    for name, samples in (("few", []), ("some", ["--samples", 4]), ("more", ["--samples", 16])):
        assert animate(path, "-o", tmp_path / name, "--preview", "--frames", 0, *samples) == 0
        shown.append((tmp_path / name / "frame00000.png").read_bytes())
    assert shown[0] == shown[1] != shown[2]


@pytest.mark.parametrize("fps", [12, 24, 29.97, 50])
def test_a_gif_is_as_long_as_its_film(fps: float, tmp_path: Path) -> None:
    frames = []
    for k in range(24):
        frames.append(tmp_path / f"f{k}.png")
        Image.new("RGB", (8, 8), (10 * k, 0, 0)).save(frames[-1])
    encode(frames, tmp_path / "film.gif", fps, Work(1))
    with Image.open(tmp_path / "film.gif") as film:
        shown = [frame.info["duration"] for frame in ImageSequence.Iterator(film)]
    assert len(shown) == 24 and min(shown) >= 20
    assert sum(shown) == pytest.approx(24000 / fps, abs=5)


def test_a_gif_keeps_small_vivid_colours(tmp_path: Path) -> None:
    """Beside the noise of many pixels; a median cut is 22 levels off."""
    random = np.random.default_rng(1)
    pixels = np.full((90, 160, 3), 130.0) + np.linspace(-40, 40, 90)[:, None, None]
    pixels[:, 80:] += random.normal(0, 40, (90, 80, 3))
    pixels[:6, :6] = random.uniform((140, 0, 30), (230, 70, 100), (6, 6, 3))
    Image.fromarray(pixels.clip(0, 255).astype(np.uint8)).save(tmp_path / "frame.png")
    encode([tmp_path / "frame.png"], tmp_path / "film.gif", 10.0, Work(1))
    with Image.open(tmp_path / "film.gif") as film:
        error = abs(np.asarray(film.convert("RGB")) - pixels.clip(0, 255))
    assert error[:6, :6].mean() < 16


def test_encoding_is_cancelled(path: Path, tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    cancel, stages = threading.Event(), []

    def progress(stage: str, done: float) -> None:
        stages.append((stage, done))
        cancel.set()

    Image.new("RGB", (16, 16)).save(tmp_path / "frame.png")
    with pytest.raises(Cancelled):
        encode([tmp_path / "frame.png"] * 4, tmp_path / "film.mp4", 8.0, Work(1, progress, cancel))
    assert stages == [("film", 0.25)] and not (tmp_path / "film.mp4").exists()


def test_a_film_says_how_its_colours_are_stored(tmp_path: Path) -> None:
    """Without the tags, a player takes a film of more than 576 rows for BT.709 and others for BT.601."""
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    Image.new("RGB", (16, 16), (30, 200, 60)).save(tmp_path / "frame.png")
    for ending in CODECS:
        encode([tmp_path / "frame.png"] * 2, tmp_path / f"film{ending}", 8.0, Work(1))
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(tmp_path / f"film{ending}")]
        assert "bt709" in subprocess.run(command, capture_output=True, text=True).stderr


@pytest.mark.parametrize("ending", [".mp4", ".webm", ".mov", ".mkv"])
def test_films(ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    frames = []
    for k in range(4):
        frames.append(tmp_path / f"f{k}.png")
        Image.new("RGB", (33, 17), (60 * k, 0, 200)).save(frames[-1])
    for name in ("film", "again"):
        encode(frames, tmp_path / f"{name}{ending}", 8.0, Work(1))
    assert (tmp_path / f"film{ending}").read_bytes() == (tmp_path / f"again{ending}").read_bytes()
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / f"film{ending}"))
    assert (count, seconds) == (4, pytest.approx(0.5))
    film = imageio_ffmpeg.read_frames(str(tmp_path / f"film{ending}"))
    assert next(film)["size"] == (34, 18), "the codecs need pairs of pixels"
    pixels = np.array([np.frombuffer(data, np.uint8).reshape(18, 34, 3) for data in film])
    assert np.allclose(pixels[:, 8, 16, 0], [0, 60, 120, 180], atol=8)
    assert np.allclose(pixels[:, -1, -1], pixels[:, 8, 16], atol=8), "no black edge"
    monkeypatch.setitem(CODECS, ending, ("none",))
    with pytest.raises(ExportError, match="ffmpeg: "):
        encode(frames, tmp_path / f"bad{ending}", 8.0, Work(1))
    assert not (tmp_path / f"bad{ending}").exists()


@pytest.mark.parametrize("name", ["flight", "julia"])
def test_shipped_films_are_what_their_scenes_show(name: str) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    film = Timeline(read(FILMS / f"{name}.xml"))
    small = FilmJob(film, (80, 45), 16, film.animation.fps, device="cpu")
    assert small.frames == 60
    shown = develop(small.light(8, Work()), film.scene.view)
    frames = imageio_ffmpeg.read_frames(str(FILMS / f"{name}.mp4"))
    size = next(frames)["size"]
    data = [np.frombuffer(frame, np.uint8) for frame in frames]
    assert (len(data), size) == (60, (320, 180))
    shipped = data[8].reshape(45, 4, 80, 4, 3).mean((1, 3))
    assert abs(255 * shown - shipped).mean() < 12
    assert abs(255 * shown - data[45].reshape(45, 4, 80, 4, 3).mean((1, 3))).mean() > 12


def test_a_mesh_of_a_time(tmp_path: Path) -> None:
    path = tmp_path / "ball.xml"
    path.write_text(scene(tracks='<track of="solid.size" keys="0s: 20mm; 1s: 40mm" curve="step"/>'))
    for seconds, size in (("0.5s", 20), ("1s", 40)):
        output = tmp_path / f"{size}.stl"
        assert (
            run(["mesh", str(path), "-o", str(output), "--resolution", "16", "--time", seconds, "--quiet"])
            == 0
        )
        points = np.frombuffer(
            output.read_bytes()[84:], np.dtype([("n", "<3f4"), ("v", "<9f4"), ("a", "<u2")])
        )["v"]
        assert np.ptp(points.reshape(-1, 3), axis=0) == pytest.approx(size, abs=0.2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "none/film.mp4"], "none/film.mp4: the folder"),
        (["-o", "film.avi"], "known are .mp4"),
        (["-o", "film.mp4", "--exr"], "expected a folder"),
        (["-o", "f", "--layers"], "expected --exr"),
        (["-o", "f", "--frames", "9..3"], "such as 10..20"),
        (["-o", "f", "--fps", "0"], "--fps"),
        (["-o", "film.png", "--fly", "0s"], "expected a time in seconds above zero"),
        (["-o", "f", "--set", "camera . eye=0 -3 0"], "a <track> moves it"),
        (["-o", "frame.xml", "--samples", "2"], "--samples: only for frames"),
        (["-o", "film.gif", "--fps", "60"], "expected at most 50 for .gif"),
    ],
)
def test_bad_options_are_one_line(
    arguments: list[str], message: str, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert animate(path, *arguments) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["ball.xml"]
