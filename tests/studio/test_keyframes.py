"""The film of a document, made by keyframes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from fracslice.animation import Timeline
from fracslice.errors import SceneError
from fracslice.scene.view import Camera, Keyframes
from fracslice.studio import keyframes
from fracslice.studio.curve_page import graph_of
from fracslice.studio.document import Document
from fracslice.studio.session import Session
from tests.waiting import wait_until

from .conftest import Begin

pytestmark = pytest.mark.once

TEXT = """<scene version="1">
  <!-- kept -->
  <solid unit="1mm">
    <sphere radius="5"/>
    <sphere radius="3"/>
  </solid>
  <film samples="1"/>
</scene>
"""
CAMERA = Camera(eye=(20.0, 0.0, 3.0), target=(0.0, 0.0, 0.0))


@pytest.fixture
def document(tmp_path: Path) -> Document:
    return Document(TEXT, tmp_path / "two.xml")


def test_keys_are_one_edit_with_the_film_that_they_begin(document: Document) -> None:
    sphere = document.find((0, 1))
    assert sphere
    of = keyframes.path_of(document, sphere, "radius")
    assert of == "sphere[2].radius"
    keyframes.set_keys(document, 0.0, {of: "3"})
    keyframes.set_keys(document, 2.0, {of: "5"})
    assert document.undoes == 2 and not document.problem
    assert "<!-- kept -->" in document.text
    assert keyframes.duration(document) == keyframes.LENGTH
    (row,) = keyframes.rows(document)
    assert (row["of"], row["times"]) == (of, [0.0, 2.0])
    document.undo()
    document.undo()
    assert document.text == TEXT


def test_keys_are_replaced_moved_and_removed(document: Document) -> None:
    of = "sphere[1].radius"
    for seconds, value in (0.0, "5"), (1.0, "6"), (1.0, "7"), (2.0, "5"):
        keyframes.set_keys(document, seconds, {of: value})
    assert keyframes.keys_of(keyframes.track_of(document, of)) == ((0.0, "5"), (1.0, "7"), (2.0, "5"))
    keyframes.move_key(document, of, 1.0, 3.0)
    with pytest.raises(SceneError, match="a keyframe at 2s already"):
        keyframes.move_key(document, of, 0.0, 2.0)
    keyframes.set_curve(document, of, "linear")
    assert keyframes.rows(document)[0]["curve"] == "linear" and document.version.at == (0, 0)
    assert keyframes.rows(document)[0]["times"] == [0.0, 2.0, 3.0]
    for seconds in 0.0, 2.0, 3.0:
        keyframes.remove_key(document, of, seconds)
    assert keyframes.rows(document) == []
    with pytest.raises(SceneError, match="no keyframes"):
        keyframes.remove_key(document, of, 0.0)


def test_slopes_move_and_go_with_their_keys(document: Document) -> None:
    of = "sphere[1].radius"

    def slopes() -> Keyframes:
        return keyframes.keys_of(keyframes.track_of(document, of), "slopes")

    for seconds, value in (0.0, "5"), (1.0, "6"), (2.0, "5"):
        keyframes.set_keys(document, seconds, {of: value})
    keyframes.set_slope(document, of, 1.0, [2.5])
    keyframes.set_slope(document, of, 0.0, [1.0])
    keyframes.move_key(document, of, 1.0, 1.5)
    assert slopes() == ((0.0, "1"), (1.5, "2.5")) and not document.problem
    keyframes.set_number(document, of, 1.5, 0, 7.25)
    assert keyframes.keys_of(keyframes.track_of(document, of))[1] == (1.5, "7.25")
    keyframes.remove_key(document, of, 1.5)
    keyframes.set_slope(document, of, 0.0, None)
    assert slopes() == () and not document.problem
    keyframes.set_slope(document, of, 0.0, [1.0])
    keyframes.set_curve(document, of, "linear")
    assert slopes() == () and not document.problem


def test_a_curve_is_drawn_with_its_dots_and_handles(document: Document) -> None:
    of = "sphere[1].radius"
    for seconds, value in (0.0, "5"), (2.0, "7"), (4.0, "5"):
        keyframes.set_keys(document, seconds, {of: value})
    keyframes.set_slope(document, of, 2.0, [1.0])
    graph = graph_of(Timeline(document.scene), of, (5.0, 9.0))
    first, middle, last = graph["dots"]
    assert [dot["at"] for dot in graph["dots"]] == [(0, 100), (50, 50), (100, 100)]
    assert middle["slope"] == pytest.approx(1.0, abs=1e-3) and first["value"] == last["value"] == 5.0
    (before, low), (after, high) = middle["handles"]
    arm = 4 * (after - 50) / 100
    assert before == pytest.approx(100 - after) and arm > 0
    assert (low, high) == pytest.approx((50 + 25 * arm, 50 - 25 * arm), abs=0.01)
    assert graph["lines"][0].startswith("0.00,100.00 ") and graph["lines"][0].endswith(" 100.00,100.00")
    keyframes.set_curve(document, of, "linear")
    assert graph_of(Timeline(document.scene), of)["dots"][1]["handles"] == []


def test_views_are_keys_of_a_camera_that_the_scene_is_given(document: Document) -> None:
    keyframes.key_view(document, 0.0, CAMERA)
    keyframes.key_view(document, 1.0, replace(CAMERA, eye=(0.0, 20.0, 3.0), fov=30.0))
    assert {row["of"] for row in keyframes.rows(document)} == {"camera.eye", "camera.target", "camera.fov"}
    assert document.scene.view.camera == CAMERA
    assert document.undoes == 2


def test_what_fails_halfway_is_not_done(document: Document) -> None:
    def fail() -> None:
        with document.one_edit():
            document.append("<fog/>")
            document.remove(())

    with pytest.raises(SceneError):
        fail()
    assert document.text == TEXT and document.undoes == 0


@pytest.fixture
def studio(begin: Begin) -> Session:
    return begin("two.xml", TEXT, (24, 16))


def test_a_number_that_moves_is_changed_at_its_time(studio: Session) -> None:
    place = (0, 1)
    keyframes.set_keys(studio.document, 0.0, {"sphere[2].radius": "1"})
    keyframes.set_keys(studio.document, 2.0, {"sphere[2].radius": "3"})
    studio.seek(1.0)
    tag = studio.document.find(place)
    assert tag and studio.at_time(tag).attributes["radius"] == "2"
    studio.set_number(place, "radius", 0, 2.5)
    assert keyframes.rows(studio.document)[0]["times"] == [0.0, 1.0, 2.0]
    assert studio.document.scene.root.children[1]["radius"] == 3.0
    assert studio.film and studio.film.at(1.0).root.children[1]["radius"] == 2.5
    studio.seek(None)
    studio.set_number(place, "radius", 0, 4.0)
    assert studio.document.scene.root.children[1]["radius"] == 4.0


def test_a_film_plays_to_its_end(studio: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=10.0)
    monkeypatch.setattr(keyframes, "time", SimpleNamespace(monotonic=lambda: clock.now))
    keyframes.key_view(studio.document, 0.0, CAMERA)
    keyframes.key_view(studio.document, 4.0, replace(CAMERA, eye=(0.0, 20.0, 3.0)))
    studio.seek(0.0)
    studio.player.play(4.0)
    for clock.now in 11.0, 12.0, 14.5:
        studio.advance()
    assert studio.player.seconds == 4.0 and not studio.player.is_playing
    wait_until(lambda: studio.live.aim.eye == (0.0, 20.0, 3.0))


def test_a_flight_becomes_the_film(studio: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(keyframes, "time", SimpleNamespace(monotonic=lambda: clock.now))
    studio.record()
    for step in range(31):
        clock.now = 0.1 * step
        studio.views.look(replace(CAMERA, eye=(20.0 - step / 10, 0.0, 3.0)))
        studio.advance()
    studio.record()
    eye = keyframes.keys_of(keyframes.track_of(studio.document, "camera.eye"))
    assert [seconds for seconds, _ in eye] == pytest.approx([0, 0.5, 1, 1.5, 2, 2.5, 3])
    assert eye[2][1] == "19.0 0.0 3.0" or eye[2][1] == "19 0 3"
    assert keyframes.duration(studio.document) == 3.0
    assert studio.document.undoes == 1


def test_what_is_changed_during_a_flight_is_seen(studio: Session) -> None:
    keyframes.key_view(studio.document, 0.0, CAMERA)
    keyframes.key_view(studio.document, 4.0, replace(CAMERA, eye=(0.0, 20.0, 3.0)))
    studio.seek(0.0)
    wait_until(lambda: studio.live.aim.eye == CAMERA.eye)
    film = studio.document.part("film")
    assert film
    studio.edit(studio.document.set_value, film.place, "exposure", "2")
    wait_until(lambda: studio.live.scene.view.film.exposure == 2)


def test_a_film_without_a_flight_leaves_the_camera_alone(studio: Session) -> None:
    keyframes.set_keys(studio.document, 0.0, {"sphere[2].radius": "1"})
    keyframes.set_keys(studio.document, 2.0, {"sphere[2].radius": "1"})
    studio.views.orbit(90, 0)
    turned = studio.live.aim
    studio.seek(1.0)
    wait_until(lambda: studio.live.scene.root.children[1]["radius"] == 1.0)
    assert studio.live.aim == turned


def test_a_film_is_made_and_made_again_where_it_changed(begin: Begin, tmp_path: Path) -> None:
    text = TEXT.replace('<film samples="1"/>', '<film width="16" height="12"/><animation duration="0.1s"/>')
    studio = begin("small.xml", text, (24, 16))

    def made() -> list[int]:
        """Times at which the frames were written."""
        studio.start("small.gif", {"samples": 1})
        wait_until(lambda: studio.job is not None and studio.job.is_done)
        assert studio.job and studio.job.result == "small.gif: 2 frames", studio.job
        return [path.stat().st_mtime_ns for path in sorted((tmp_path / "small.frames").glob("*.png"))]

    first = made()
    assert made() == first
    studio.set_number((0, 0), "radius", 0, 4.0)
    assert not set(made()) & set(first)
