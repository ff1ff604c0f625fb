"""Automatic depths of films: they change without a jump."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.animation import FilmJob, Timeline
from fracslice.animation.film import gradual_depths
from fracslice.formulas import mandelbulb
from fracslice.rendering import Renderer, develop
from fracslice.scene.reader import reads
from fracslice.scene.view import Camera
from fracslice.work import Work

pytestmark = pytest.mark.once

SIZE, COUNT = (48, 32), 8
SCENE = """<scene version="1"><solid size="80mm"><mandelbulb iterations="{}"/></solid>
<camera eye="1.6 0 0" target="0.9 0.1 0.2"/><animation duration="1s" fps="4" noise="fixed"/></scene>"""


def film(depth: object) -> FilmJob:
    return FilmJob(Timeline(reads(SCENE.format(depth))), SIZE, COUNT, 4.0, device="cpu")


def test_one_share_of_the_samples_changes_its_depth_at_a_time() -> None:
    root, sums = mandelbulb(), []
    for x in np.linspace(1.6, 1.4, 24):
        camera = Camera(eye=(float(x), 0.0, 0.0), target=(0.9, 0.1, 0.2))
        depths = [int(node["iterations"]) for node in gradual_depths(root, camera, SIZE, COUNT)]
        assert depths == sorted(depths)
        sums.append(sum(depths))
    assert set(np.diff(sums)) <= {0, 1}
    assert sums[-1] - sums[0] > 1


def test_a_frame_is_the_mean_of_its_depths() -> None:
    depths = [int(scene.root["iterations"]) for scene in film("auto").moments(0)]
    alone = {depth: film(depth).light(0, Work(1)) for depth in depths}
    assert len(alone) > 1
    frame = film("auto").light(0, Work(1))
    errors = [np.abs(frame - light).mean() for light in alone.values()]
    assert np.abs(frame - np.mean([alone[depth] for depth in depths], axis=0)).mean() < min(errors)


def test_a_given_depth_is_kept() -> None:
    assert {int(scene.root["iterations"]) for scene in film(5).moments(0)} == {5}


@pytest.mark.nightly
def test_a_zoom_by_a_million_keeps_its_detail() -> None:
    """The last frames need float64; at every distance the surface fills the picture, and is no plain."""
    towards, far, near = np.array([2.0, -2.0, 1.0]) / 3, 2.0406517501933905, 2.0406517501933905e-6
    target = towards * (3 - far)
    eyes = [" ".join(map(repr, (target + towards * distance).tolist())) for distance in (far, near)]
    zoomed = reads(
        f"""<scene version="1"><solid size="80mm"><mandelbulb iterations="auto"/></solid>
        <camera eye="{eyes[0]}" target="{" ".join(map(repr, target.tolist()))}"/><animation duration="1s"/>
        <track of="camera.eye" keys="0s: {eyes[0]}; 1s: {eyes[1]}" curve="zoom"/></scene>"""
    )
    of, depths, kinds = FilmJob(Timeline(zoomed), (24, 16), 2, 3.0, device="cpu"), [], []
    for number, time in enumerate((0.4, 0.7, 1.0)):
        scene = of.timeline.at(time)
        renderer = Renderer(scene.root, scene.view, (24, 16), Work(1), "cpu")
        assert scene.view.camera
        distance = np.linalg.norm(np.array(scene.view.camera.eye) - target)
        assert distance == pytest.approx(far * 1e-6**time, rel=0.01)
        *_, done = renderer.passes(2)
        shown = develop(done.mean, scene.view)
        assert np.isfinite(shown).all() and shown.std() > 0.05, number
        depths.append(renderer.setup.root["iterations"])
        kinds.append(renderer.setup.precision)
    assert kinds == ["float32", "float64", "float64"] and depths == sorted(set(depths))
