"""Flights that find their path by themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice import read
from fracslice.animation import Timeline, with_flight
from fracslice.animation.timeline import flight
from fracslice.errors import SceneError
from fracslice.formulas import mandelbulb, sphere
from fracslice.scene import scene
from fracslice.scene.view import Camera, View

pytestmark = pytest.mark.once

LEAST = 0.05


def test_a_path_keeps_its_clearance_and_stays_near_the_surface() -> None:
    """A sphere: distances are exact."""
    points, targets = flight(sphere(radius=1.0), Camera(eye=(0.0, -3.0, 0.2)), LEAST, 60)
    fine = np.linspace(points[:-1], points[1:], 9).reshape(-1, 3)
    away = np.linalg.norm(fine, axis=1) - 1
    assert away.min() >= LEAST * (1 - 1e-9)
    assert (np.linalg.norm(points[20:], axis=1) - 1).max() < 20 * LEAST
    assert np.linalg.norm(np.diff(points[20:], axis=0), axis=1).sum() > 10 * LEAST  # it flies on
    assert (np.linalg.norm(targets - points, axis=1) > LEAST).all()


def test_every_frame_of_a_flight_keeps_the_clearance() -> None:
    view = View(camera=Camera(eye=(0.0, -2.2, 0.6)))
    made = with_flight(replace(scene(mandelbulb(iterations=5), size="20mm"), view=view), 6.0, (32, 18))
    known, timeline = made.root, Timeline(made)
    least = made.animation.clearance
    eyes = np.array([timeline.at(time).view.camera.eye for time in np.linspace(0.0, 6.0, 49)])
    distance = known.kernel("cpu", "float64").points(*eyes.T) / known.bounds.lipschitz
    assert distance.min() >= least
    assert np.ptp(eyes, axis=0).max() > 0.5


def test_a_flight_that_begins_too_near_is_refused() -> None:
    with pytest.raises(
        SceneError, match=r"eye: expected a place 0\.05 away from the surface, and it is 0\.01"
    ):
        flight(sphere(radius=1.0), Camera(eye=(0.0, -1.01, 0.0)), LEAST, 3)


def test_a_flight_is_a_scene_file(tmp_path: Path) -> None:
    (tmp_path / "ball.xml").write_text('<scene version="1"><solid size="20mm"><sphere/></solid></scene>')
    given = ["animate", str(tmp_path / "ball.xml"), "--fly", "2s", "--size", "8x6", "-q"]
    assert run([*given, "-o", str(tmp_path / "flight.xml")]) == 0
    made = read(tmp_path / "flight.xml")
    assert made.animation.duration == 2.0
    assert {track.of for track in made.tracks} == {"camera.eye", "camera.target"}
    assert len(made.tracks[0].keys) == 5
    assert run([*given, "--fps", "1", "--samples", "1", "-o", str(tmp_path / "film")]) == 0
    assert len(list((tmp_path / "film").glob("*.png"))) == 2
