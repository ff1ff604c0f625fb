"""Flight that finds its path by itself, by the field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..fields.depth import resolve_depths
from ..fields.registry import Node
from ..rendering.setup import prepare
from ..scene.animation import Animation, Keyframes, Track
from ..scene.model import Scene
from ..scene.view import Camera

Points = NDArray[np.float64]

DIRECTIONS, TURNED = 256, 0.4
"""Directions that are tried at each step, and the part of the way to the best one that the camera turns."""

PACE, TRACED = 0.9, 10
"""Length of a step in distances to the surface, and steps along each direction that is tried."""

FAR, REACH = 6.0, 40.0
"""Greatest distance to the surface at the end of a good direction, and its greatest length, in clearances."""

LOOKS_DOWN, STAR = 0.8, np.vstack([np.eye(3), -np.eye(3)])
"""Part of the view that is towards the surface; steps to measure its direction."""

KEYS, SHARE = 2.0, 0.01
"""Keyframes per second; clearance of a scene without one, relative to the size of the object."""


def with_flight(scene: Scene, seconds: float, size: tuple[int, int]) -> Scene:
    """Return a scene with a flight.

    Parameters
    ----------
    scene : Scene
        Scene; its camera is the first one, and its `<animation clearance>` the clearance.
    seconds : float
        Duration of the flight.
    size : tuple of int
        Width and height of the picture, pixels.

    Returns
    -------
    Scene
        The scene with an animation, and tracks of the camera.

    Raises
    ------
    SceneError
        If the camera begins nearer to the surface than the clearance.
    """
    camera, known = prepare(scene.root, scene.view, size).camera, scene.animation
    least = (known and known.clearance) or SHARE * max(scene.root.bounds.box.size)
    count = max(int(seconds * KEYS) + 1, 2)
    tracks = [
        Track(of=f"camera.{name}", keys=_keys(points, seconds), curve=curve)
        for name, curve, points in zip(
            ("eye", "target"), ("path", "smooth"), flight(scene.root, camera, least, count), strict=True
        )
    ]
    others = tuple(track for track in scene.tracks if track.of not in ("camera.eye", "camera.target"))
    animation = replace(known or Animation(duration=seconds), duration=seconds, clearance=least)
    view = replace(scene.view, camera=camera)
    return replace(scene, view=view, animation=animation, tracks=(*others, *tracks))


def flight(root: Node, camera: Camera, least: float, steps: int) -> tuple[Points, Points]:
    """Find a path along the surface.

    At each step the camera turns a part of the way to the direction in which the field allows the longest way
    near the surface. A step is shorter than the distance to the surface less the clearance, and the field
    over its Lipschitz bound is a lower bound of this distance, so the clearance is guaranteed between points.

    `least` in scene units. Returns points, targets float64 (steps, 3).
    """
    known = resolve_depths(root, least / 2)
    kernel, bound = known.kernel("cpu", "float64"), known.bounds.lipschitz

    def distance(points: Points) -> Points:
        return np.asarray(kernel.points(*points.T)) / bound

    directions, eye, ahead = _directions(), np.array(camera.eye), np.array(camera.forward)
    points, targets = [], []
    for _ in range(steps):
        (here,) = distance(eye[None])
        if here < least:
            raise camera.fail(
                f"eye: expected a place {least:g} away from the surface, and it is {here:.3g} away"
            )
        best = directions[int(_worth(distance, eye, directions, ahead, least).argmax())]
        ahead = _unit((1 - TURNED) * ahead + TURNED * best)
        points.append(eye)
        slope = distance(eye + least * STAR)
        down = _unit(slope[3:] - slope[:3])
        targets.append(eye + max(here, FAR * least) * _unit(ahead + LOOKS_DOWN * down))
        eye = eye + min(PACE * here, here - least) * ahead
    return np.array(points), np.array(targets)


def _worth(
    distance: Callable[[Points], Points], eye: Points, directions: Points, ahead: Points, least: float
) -> Points:
    """Worth of directions: the free way, more ahead than aside, less for one that leads away."""
    free = np.zeros(len(directions))
    for _ in range(TRACED):
        there = distance(eye + free[:, None] * directions)
        free += np.maximum(there - least, 0.0)
    long = np.minimum(free / (REACH * least), 1.0)
    away = np.maximum(np.log(np.maximum(there, least) / (FAR * least)), 0.0)
    return np.asarray(long * (1 + directions @ ahead) / 2 - away)


def _directions() -> Points:
    """Unit vectors, evenly distributed: a Fibonacci lattice (Gonzalez 2010)."""
    k = np.arange(DIRECTIONS) + 0.5
    z, around = 1 - 2 * k / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * k
    return np.stack([np.sqrt(1 - z * z) * np.cos(around), np.sqrt(1 - z * z) * np.sin(around), z], axis=1)


def _unit(vector: Points) -> Points:
    return np.asarray(vector / np.linalg.norm(vector))


def _keys(points: Points, seconds: float) -> Keyframes:
    """Keyframes at equal times."""
    times = np.linspace(0.0, seconds, len(points)).tolist()
    return tuple(
        (time, " ".join(f"{x:.7g}" for x in point)) for time, point in zip(times, points, strict=True)
    )
