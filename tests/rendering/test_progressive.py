"""Passes: what they show, that they stop, and that stopping changes nothing."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest

from fracslice.errors import Cancelled, RenderError
from fracslice.formulas import material, menger, sphere, union
from fracslice.rendering import Renderer, packets, progressive
from fracslice.rendering.accumulator import CHANNELS, COUNT, COVER, GOAL, smoothed
from fracslice.rendering.units.camera import sample
from fracslice.scene import library, read
from fracslice.scene.view import Camera, Film, Light, View
from fracslice.work import Work

pytestmark = pytest.mark.once

ROOT = union(menger(level=2), material(sphere(radius=1.2), reflect=0.4))
VIEW = View(
    camera=Camera(eye=(2.5, -3, 1.6), aperture=0.05),
    lights=(Light(kind="sun", size=4), Light(kind="sky")),
    film=Film(samples=12),
)
SIZE = (50, 34)


def renderer(threads: int = 1) -> Renderer:
    return Renderer(ROOT, VIEW, SIZE, Work(threads=threads), "cpu")


def finished(of: Renderer, samples: int = 12) -> np.ndarray:
    *_, last = of.passes(samples, tolerance=0.01)
    return last.image


def test_the_first_pass_shows_something_everywhere_and_the_second_has_every_pixel() -> None:
    of = renderer()
    passes = of.passes()
    first = next(passes)
    assert 0 < first.samples < 0.08
    assert (first.image.sum(2) > 0).all()
    second = next(passes)
    assert second.samples == 1
    assert (of.accumulator.counts == 1).all()


def test_a_draft_is_the_first_sample_of_every_pixel_and_smooth_it_is_nearer_to_the_picture() -> None:
    *_, first = renderer().passes(1)
    sharp = first.shown
    draft = renderer().draft()
    np.testing.assert_array_equal(draft.shown, sharp)
    *_, last = renderer().passes(256)
    errors = [np.abs(made.astype(float) - last.shown).mean() for made in (draft.shown, draft.smooth)]
    assert errors[1] < 0.75 * errors[0]


def test_smoothing_leaves_out_what_is_behind_an_edge() -> None:
    mean = np.zeros((3, 4, 4), np.float32)
    mean[:, :2] = (1.0, 2.0, 3.0, 1.0)
    mean[1, 1, :3] = 10.0
    mean[:, 2:, :3] = 7.0  # missed
    made = smoothed(mean)
    np.testing.assert_array_equal(made[:, 2:], mean[:, 2:])
    np.testing.assert_allclose(made[1, 1, :3], (5 * np.array([1.0, 2.0, 3.0]) + 10) / 6, rtol=1e-6)


def test_samples_reduce_the_error_and_clean_pixels_get_no_more() -> None:
    of = renderer()
    errors, counts = [], []
    for done in of.passes(40, tolerance=0.01):
        errors.append(done.error)
        counts.append(of.accumulator.counts.copy())
    assert errors[-1] < errors[4] / 2
    assert counts[-1].min() < counts[-1].max() <= 40
    assert counts[-1].min() >= 8


def test_threads_change_no_bit() -> None:
    assert finished(renderer(1)).tobytes() == finished(renderer(3)).tobytes()


def test_resuming_changes_no_bit(tmp_path: Path) -> None:
    of = renderer()
    for done in of.passes(12, tolerance=0.01):
        if done.number == 5:
            break
    with open(tmp_path / "state.npz", "wb") as file:
        of.save(file)
    again = renderer()
    again.resume(tmp_path / "state.npz")
    assert again.accumulator.passes == 5
    assert finished(again).tobytes() == finished(renderer()).tobytes()


def test_a_state_of_another_picture_is_refused(tmp_path: Path) -> None:
    with open(tmp_path / "state.npz", "wb") as file:
        renderer().save(file)
    other = Renderer(ROOT, VIEW, (34, 50), Work(threads=1), "cpu")
    with pytest.raises(RenderError, match="another scene"):
        other.resume(tmp_path / "state.npz")


@pytest.mark.parametrize("left", [0, 2, 500, -30])
def test_a_state_that_was_cut_off_is_refused(tmp_path: Path, left: int) -> None:
    of, path = renderer(), tmp_path / "state.npz"
    with open(path, "wb") as file:
        of.save(file)
    path.write_bytes(path.read_bytes()[:left])
    with pytest.raises(RenderError, match=r"state.npz: expected a picture in progress"):
        of.resume(path)


FORGED: dict[str, Callable[[dict[str, np.ndarray]], object]] = {
    "of another type": lambda s: s.update(sums=s["sums"].astype(np.float16)),
    "of fewer pixels": lambda s: s.update(sums=s["sums"][:-CHANNELS]),
    "smaller": lambda s: s.update(sums=s["sums"][: 8 * 8 * CHANNELS], shape=np.array([8, 8, 1])),
    "with too many samples": lambda s: s["sums"].__setitem__([COUNT, GOAL], 1e9),
    "with more samples than its goal": lambda s: s["sums"].__setitem__(COUNT, 8),
    "with half a sample": lambda s: s["sums"].__setitem__([COUNT, GOAL], 0.5),
    "with less than none": lambda s: s["sums"].__setitem__(COUNT, -1),
    "with no number of them": lambda s: s["sums"].__setitem__(GOAL, np.nan),
    "with more hits than samples": lambda s: s["sums"].__setitem__(COVER, 1),
    "without a shape": lambda s: s.pop("shape"),
    "with code": lambda s: s.update(shape=np.array([print] * 3, dtype=object)),
    "too large": lambda s: s.update(sums=np.zeros(len(s["sums"]) + 10000, s["sums"].dtype)),
}


@pytest.mark.parametrize("forged", FORGED)
def test_a_state_that_no_renderer_wrote_is_refused(tmp_path: Path, forged: str) -> None:
    """Native code is given its numbers and its size."""
    of, path = renderer(), tmp_path / "state.npz"
    with open(path, "wb") as file:
        of.save(file)
    with np.load(path) as arrays:
        state = {name: arrays[name].copy() for name in arrays}
    FORGED[forged](state)
    np.savez_compressed(path, allow_pickle=True, **state)
    with pytest.raises(RenderError, match=r"state.npz: expected a picture in progress"):
        of.resume(path)


def test_a_state_is_of_one_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open(tmp_path / "state.npz", "wb") as file:
        renderer().save(file)
    monkeypatch.setattr(progressive, "program", lambda: "another")
    with pytest.raises(RenderError, match="another scene, view, size, seed or version"):
        renderer().resume(tmp_path / "state.npz")


@pytest.mark.parametrize("saved", [np.save, lambda file, a: file.write(b"text")])
def test_what_is_no_state_is_refused(tmp_path: Path, saved: Callable[[BinaryIO, np.ndarray], object]) -> None:
    with open(tmp_path / "state.npz", "wb") as file:
        saved(file, np.zeros(4))
    with pytest.raises(RenderError, match=r"state.npz: expected a picture in progress"):
        renderer().resume(tmp_path / "state.npz")


def test_a_picture_that_was_not_looked_at_in_time_is_gone() -> None:
    passes = renderer().passes()
    first, second = next(passes), next(passes)
    assert second.shown.dtype == np.uint8
    with pytest.raises(RenderError, match="pass 1: its picture was replaced"):
        _ = first.image


def test_most_samples_go_where_they_take_most_error_away() -> None:
    of = renderer()
    for done in of.passes(256, tolerance=0.0):
        if done.samples > 24:
            break
    n = of.accumulator.host().counts
    assert n.min() >= 8
    assert n.max() >= 4 * n.min()
    assert (n == 2 ** np.round(np.log2(n))).all(), "every net of samples is complete"


def test_a_cancelled_pass_keeps_its_samples_and_continues_to_the_same_picture(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    work = Work(threads=1)
    of = Renderer(ROOT, VIEW, SIZE, work, "cpu")
    passes = of.passes(12, tolerance=0.01)
    next(passes), next(passes), next(passes)
    tile, calls = of.tracer._tile, []

    def stopping(*arguments: object) -> None:
        calls.append(arguments)
        tile(*arguments)
        work.cancel.set()

    monkeypatch.setattr(packets, "TILE", 512)
    of.tracer._tile = stopping
    with pytest.raises(Cancelled):
        next(passes)
    assert len(calls) == 1
    assert 2 < of.seen().samples < 4
    of.tracer._tile = tile
    work.cancel.clear()
    buffer = io.BytesIO()
    of.save(buffer)
    assert finished(of).tobytes() == finished(renderer()).tobytes()


def test_a_pass_that_is_cancelled_in_its_last_tile_counts() -> None:
    bulb, work = read(library.path("mandelbulb")), Work(threads=2)
    of, again = (Renderer(bulb.root, bulb.view, (80, 60), work, "cpu") for _ in range(2))
    tile = of.tracer._tile

    def stopping(*arguments: object) -> None:
        tile(*arguments)
        *_, count, goal, _ = of.accumulator.host().channels.T
        if of.accumulator.passes == 1 and (count >= goal).all():
            work.cancel.set()

    of.tracer._tile = stopping
    with pytest.raises(Cancelled):
        finished(of)
    of.tracer._tile = tile
    work.cancel.clear()
    assert finished(of).tobytes() == finished(again).tobytes()


def test_the_mean_does_not_depend_on_where_sampling_stopped() -> None:
    rough, clean = finished(renderer(), 16), finished(renderer(), 200)
    assert abs(rough.mean() - clean.mean()) < 0.01 * clean.mean()


def test_looking_back_again_gives_the_same_picture() -> None:
    of, camera = renderer(), VIEW.camera
    assert camera is not None
    wanted = finished(of)
    of.look(camera.moved(right=0.2).turned(yaw=5))
    assert abs(finished(of) - wanted).mean() > 0.01
    of.look(camera)
    assert finished(of).tobytes() == wanted.tobytes()


def test_the_last_pixels_take_no_pass_each() -> None:
    """A pass of a few pixels costs as much as one of many, and all threads wait for it."""
    view = View(camera=Camera(eye=(1.9, -2.3, 1.2), fov=50), lights=(Light(size=5), Light(kind="sky")))
    active = [done.active for done in Renderer(menger(level=2), view, (96, 64), Work(1), "cpu").passes(64)]
    assert len(active) < 16


@pytest.mark.parametrize(("samples", "tolerance"), [(8, 0.0), (64, 0.01)])
def test_a_part_of_a_picture_has_the_pixels_of_the_whole(samples: int, tolerance: float) -> None:
    """Its own random numbers, rays and goals would be others; the blocks of rays start elsewhere, too."""
    *_, whole = renderer().passes(samples, tolerance)
    for x, y, width, height in ((0, 18, 50, 9), (21, 17, 11, 17)):
        of = Renderer(ROOT, VIEW, SIZE, Work(2), "cpu", crop=(x, y, width, height))
        *_, part = of.passes(samples, tolerance)
        assert (part.image == whole.image[y : y + height, x : x + width]).all()
        assert part.shown.shape == (height, width, 3)


def test_rows_far_down_have_random_numbers_of_their_own() -> None:
    assert len({sample(12345, y << 16, 2) for y in range(0, 32768, 1024)}) == 32
