"""Bookmarks, what lies between them, and what is worth a look."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from fracslice.errors import SceneError
from fracslice.formulas import Node, box, mandelbulb, menger, sphere, transform, union
from fracslice.scene import read
from fracslice.studio.bookmarks import between, is_worth_a_look
from fracslice.studio.session import Session
from tests.waiting import wait_until

from .conftest import Begin

pytestmark = pytest.mark.once

TEXT = """<scene version="1">
  <solid unit="1mm">
    <sphere radius="5"/>  <!-- kept -->
  </solid>
  <film samples="1"/>
</scene>
"""
BALL = (0, 0)


@pytest.fixture
def studio(begin: Begin) -> Session:
    return begin("ball.xml", TEXT, (24, 16))


def test_a_bookmark_is_a_scene_that_is_returned_to(studio: Session, tmp_path: Path) -> None:
    seen = studio.live.camera
    studio.bookmark()
    assert studio.bookmarks.names == ["001"]
    kept = read(tmp_path / "ball.bookmarks" / "001.xml")
    assert kept.root == sphere(radius=5.0) and kept.view.camera
    assert kept.view.camera.eye == pytest.approx(seen.eye)
    assert studio.bookmarks.picture("001").startswith(b"\xff\xd8")
    studio.set_number(BALL, "radius", 0, 3)
    studio.views.orbit(60, 0)
    wait_until(lambda: studio.shown.camera == studio.live.aim and studio.live.aim.eye != seen.eye)
    studio.go_to("001")
    assert studio.document.scene.root == sphere(radius=5.0)
    wait_until(lambda: studio.shown.camera.eye == pytest.approx(seen.eye))
    studio.bookmarks.remove("001")
    assert not (tmp_path / "ball.bookmarks").exists()
    studio.go_to("001")
    assert "expected one of the bookmarks (none)" in studio.message


def test_numbers_are_mixed_in_the_text(studio: Session) -> None:
    studio.bookmark()
    studio.set_number(BALL, "radius", 0, 3)
    first = replace(studio.document.scene, view=replace(studio.document.scene.view, camera=studio.live.aim))
    before = studio.document.undoes
    for share in 0.25, 0.5:
        studio.mix(first, "001", share)
    assert studio.document.scene.root == sphere(radius=4.0)
    assert "<!-- kept -->" in studio.document.text and studio.document.undoes == before + 1
    studio.edit(studio.document.wrap, BALL, "shell")
    studio.mix(studio.document.scene, "001", 0.5)
    assert "same elements" in studio.message


def test_what_is_no_number_is_that_of_the_nearer() -> None:
    first = union(menger(level=1), transform(box(size=(1, 1, 1)), translate=(0, 0, 0)), smooth=0.1)
    last = union(menger(level=4), transform(box(size=(3, 1, 1)), translate=(2, 0, 0)), smooth=0.3)
    made = between(first, last, 0.4)
    assert made["smooth"] == pytest.approx(0.18)
    assert made.children[0]["level"] == 2
    assert made.children[1]["translate"] == pytest.approx((0.8, 0, 0))
    assert made.children[1].children[0]["size"] == pytest.approx((1.8, 1, 1))
    with pytest.raises(SceneError):
        between(first, sphere(), 0.5)


@pytest.mark.parametrize(
    ("root", "worth"),
    [
        (sphere(), False),
        (box(size=(1, 1, 1)), False),
        (menger(level=2), True),
        (mandelbulb(iterations=4), True),
        (union(sphere(radius=0.2), transform(sphere(radius=0.2), translate=(1, 0, 0))), True),
    ],
)
def test_a_ball_and_a_block_are_no_surprise(root: Node, worth: bool) -> None:
    assert is_worth_a_look(root) == worth


def test_a_surprise_is_opened(studio: Session) -> None:
    studio.surprise()
    assert studio.document.path.stem != "ball" and not studio.document.problem
    assert is_worth_a_look(studio.document.scene.root)
