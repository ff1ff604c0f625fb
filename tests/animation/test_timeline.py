"""Scenes at a time: tracks of every kind, and their errors."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice import reads
from fracslice.animation import Timeline
from fracslice.errors import SceneError
from fracslice.fields.linker import link
from fracslice.rendering.setup import clearance
from fracslice.scene import Scene, to_xml

FILE = """<scene version="1">
<solid size="80mm"><union>
<transform rotate="0 0 1 0"><julia iterations="8"/></transform><box/><box/><menger/>
</union></solid>
<camera eye="4 0 0"/><light/>
<animation duration="4s" {}/>
{}
</scene>"""


def film(*tracks: str, animation: str = "") -> Scene:
    lines = "\n".join(f"<track {track}/>" for track in tracks)
    return reads(FILE.format(animation, lines), "film.xml")


def test_tracks_move_attributes_of_any_element() -> None:
    timeline = Timeline(
        film(
            'of="julia.c" keys="0s: -0.2 0.8 0 0; 4s: -0.4 0.4 0.2 0" curve="linear"',
            'of="box[2].size" keys="1s: 1 1 1; 3s: 2 2 2"',
            'of="menger.level" keys="0s: 1; 2s: 3"',
            'of="light.strength" keys="0: 1; 4: 16" curve="log"',
            'of="transform.rotate" keys="0s: 0 0 1 0; 4s: 0 0 1 720"',
            'of="camera.target" keys="0s: 0 0 0; 4s: 4 0 0"',
            'of="camera.eye" keys="0s: 4 0 0; 4s: 4 8 0"',
            'of="solid.size" keys="0s: 80mm; 2s: 4cm"',
        )
    )
    at = timeline.at(2.0)
    nodes = {node.formula.name: node for node in at.root.walk()}
    boxes = [node["size"] for node in at.root.walk() if node.formula.name == "box"]
    assert nodes["julia"]["c"] == pytest.approx((-0.3, 0.6, 0.1, 0))
    assert boxes[0] != boxes[1] == pytest.approx((1.5, 1.5, 1.5))
    assert nodes["menger"]["level"] == 3 and timeline.at(1.9).size_mm == 80 and at.size_mm == 40
    assert at.view.lights[0].strength == pytest.approx(4)
    assert nodes["transform"]["rotate"] == pytest.approx((0, 0, 1, 360))
    assert at.view.camera and at.view.camera.eye == pytest.approx((4, 4, 0))
    assert at.animation is None and not at.tracks
    assert timeline.at(-1) == timeline.at(0) and timeline.at(99) == timeline.at(4)


def test_a_track_may_give_slopes_of_its_curve() -> None:
    of, near = "light.strength", 1e-6
    keys = f'of="{of}" keys="0s: 1; 2s: 2; 4s: 1"'
    plain, bent = Timeline(film(keys)), Timeline(film(f'{keys} slopes="2s: 0.5"'))
    ((before,), (after,)) = bent.numbers(of, 2 - near), bent.numbers(of, 2 + near)
    assert (after - before) / (2 * near) == pytest.approx(0.5, abs=1e-5)
    # in the middle of a cubic, by its values and slopes; the first slope stays that of the plain curve
    first = (plain.numbers(of, near)[0] - 1) / near
    assert bent.numbers(of, 1.0) == pytest.approx([1.5 + 2 * (first - 0.5) / 8], abs=1e-5)
    assert bent.at(0.0) == plain.at(0.0) and bent.at(4.0) == plain.at(4.0)
    assert 'slopes="2s: 0.5"' in to_xml(bent.scene)


def test_a_scene_with_an_animation_is_written_and_read_and_otherwise_ignored() -> None:
    scene = film(
        'of="julia.c" keys="0s: 0 0 0 0; 2.5s: 1 0 0 0" ease="both"', animation='fps="12" shutter="0.5"'
    )
    assert reads(to_xml(scene)) == scene
    assert 'keys="0s: 0 0 0 0; 2.5s: 1 0 0 0"' in to_xml(scene)
    assert scene.root == film().root


def test_frames_differ_in_parameters_only_so_one_kernel_draws_them_all() -> None:
    timeline = Timeline(
        film(
            'of="julia.c" keys="0s: -0.2 0.5 0.1 0.1; 4s: -0.3 0.4 0.2 0.1"',
            'of="transform.rotate" keys="0s: 0 0 1 10; 4s: 0 1 1 50"',
            'of="box.size" keys="0s: 1 1 1; 4s: 2 1 1"',
        )
    )
    assert len({link(timeline.at(time).root).program for time in np.linspace(0, 4, 9)}) == 1


def test_an_eye_keeps_its_clearance_and_moves_without_jumps() -> None:
    track = 'of="camera.eye" keys="0s: 4 0.1 0; 4s: 0.9 0.1 0.8"'
    free, kept = Timeline(film(track)), Timeline(film(track, animation='clearance="0.1"'))
    eyes = []
    for time in np.linspace(0, 3.6, 19):
        before, after = free.at(time).view.camera, kept.at(time)
        assert after.view.camera and before
        distance = clearance(after.root, after.view.camera)
        assert distance >= 0.1 * (1 - 1e-9)
        eyes.append(after.view.camera.eye)
        if np.linalg.norm(before.eye) > 3:
            assert after.view.camera == before, "far away, nothing changes"
    assert np.linalg.norm(np.diff(eyes, axis=0), axis=1).max() < 0.3
    trapped = film('of="camera.eye" keys="0s: 4 0 0; 4s: 0.77 0.1 0.867"', animation='clearance="0.1"')
    with pytest.raises(SceneError, match=r"<animation> at 4s: .*0\.1 away from the surface"):
        Timeline(trapped).at(4)


@pytest.mark.parametrize(
    ("track", "message"),
    [
        ('of="julia" keys="0: 1"', r"film.xml:7: <track> of=\"julia\": expected ELEMENT.ATTRIBUTE"),
        ('of="julya.c" keys="0: 1"', r"film.xml:7: <track> of='julya.c': the scene has no <julya>; .*julia"),
        ('of="julia.d" keys="0: 1"', r"film.xml:7: <track> of='julia.d': has no attribute 'd'"),
        ('of="julia.c" keys="0: 1 2"', r"film.xml:7: <track> keys of julia.c: expected 4 numbers"),
        ('of="julia.c" keys="1: 0 0 0 0; 1: 0 0 0 0"', r"film.xml:7: <track> keys=.*in the order of time"),
        ('of="box[3].size" keys="0: 1 1 1"', r"film.xml:7: <track> at 0s: .*has 2 <box>"),
        ('of="menger.level" keys="0: 1; 2: 3" curve="smooth"', r"curve='smooth': expected step"),
        ('of="camera.fov" keys="0: 40; 2: 50" curve="zoom"', "curve='zoom': expected of='camera.eye'"),
        ('of="camera.eye" keys="0: 4 0 0; 2: 5 0 0" curve="rotation"', "expected keys of 4 numbers each"),
        (
            'of="camera.fov" keys="0: 40; 2: 50" slopes="1: 3"',
            r"slopes='3' at 1s: expected 1 number at",
        ),
        (
            'of="camera.fov" keys="0: 40; 2: 50" slopes="2: a"',
            r"slopes='a' at 2s: expected 1 number at",
        ),
        (
            'of="light.strength" keys="0: 1; 2: 5" slopes="2: 1" curve="log"',
            r"slopes: expected curve='smooth'",
        ),
        ('of="camera.eye" keys="0: 0 0 0; 2: 1 0 0" curve="zoom"', r"expected points other than the target"),
        (
            'of="camera.fov" keys="0: 40; 2: 4"/><track of="camera.fov" keys="0: 4"',
            r"film.xml:7.*has a track already",
        ),
    ],
)
def test_what_a_track_cannot_move_is_one_line(track: str, message: str) -> None:
    with pytest.raises(SceneError, match=message) as failure:
        Timeline(film(track))
    assert "\n" not in str(failure.value)


def test_a_film_needs_an_animation_and_a_camera_to_move() -> None:
    with pytest.raises(SceneError, match="expected an <animation>"):
        Timeline(reads('<scene version="1"><solid size="1mm"><sphere/></solid></scene>'))
    with pytest.raises(SceneError, match="needs an <animation>"):
        reads(
            '<scene version="1"><solid size="1mm"><sphere/></solid>'
            '<track of="sphere.radius" keys="0: 1"/></scene>'
        )
    with pytest.raises(SceneError, match="expected a <camera>"):
        Timeline(
            reads(
                '<scene version="1"><solid size="1mm"><sphere/></solid><animation duration="1"/>'
                '<track of="camera.fov" keys="0: 30"/></scene>'
            )
        )
