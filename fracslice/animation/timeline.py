"""Scene at a time: the values of all tracks, and a camera that keeps its distance to the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import SceneError
from ..formulas.parameters import Number, Vector
from ..scene.animation import Animation, Track
from ..scene.model import Scene
from ..scene.overrides import kind_of
from .clearance import kept_clear
from .motion_curves import CURVES, eased

AUTOMATIC = {"camera.eye": "path", "transform.rotate": "rotation"}
"""Curves of attributes that are not plain numbers."""


@dataclass(frozen=True)
class Timeline:
    """A scene over time.

    Attributes
    ----------
    scene : Scene
        Scene with an `<animation>`.

    Raises
    ------
    SceneError
        If the scene has no animation, or a track does not fit it.
    """

    scene: Scene

    def __post_init__(self) -> None:
        self.at(0.0)

    @cached_property
    def animation(self) -> Animation:
        """The scene's animation."""
        if self.scene.animation is None:
            raise SceneError(
                f"{self.scene.name}: expected an <animation> in the scene; animate --fly TIME makes one"
            )
        return self.scene.animation

    @cached_property
    def _tracks(self) -> dict[str, tuple[Track, Callable[[float], Any]]]:
        """Track and curve of each attribute that moves."""
        tracks: dict[str, tuple[Track, Callable[[float], Any]]] = {}
        for track in self.scene.tracks:
            if track.of in tracks:
                raise track.fail(f"of={track.of!r}: has a track already")
            tracks[track.of] = track, self._curve(track)
        return tracks

    def _curve(self, track: Track) -> Callable[[float], Any]:
        """Value of a track over time."""
        kind = kind_of(self.scene, track.of, track.fail)
        times = [time for time, _ in track.keys]
        try:
            values = [kind.read(text) for _, text in track.keys]
        except ValueError as error:
            raise track.fail(f"keys of {track.of}: expected {error}") from None
        name = track.curve if track.curve != "auto" else _automatic(track.of, kind)
        if name == "step" or len(times) == 1:
            return lambda time: values[max(int(np.searchsorted(times, time, side="right")) - 1, 0)]
        _check_curve(track, name, kind, values)
        table = np.array(values, float).reshape(len(times), -1)
        origin = self._target if name == "zoom" else lambda _: np.zeros(table.shape[1])
        try:
            curve = CURVES[name](np.array(times), table - [origin(time) for time in times])
        except ValueError as error:
            raise track.fail(f"keys of {track.of}: expected {error}") from None

        def value(time: float) -> Any:
            numbers = curve(eased(times, track.ease, time)) + origin(time)
            return kind.check(numbers.tolist() if isinstance(kind, Vector) else float(numbers[0]))

        return value

    @cached_property
    def _target(self) -> Callable[[float], np.ndarray]:
        """Target of the camera over time."""
        for track in self.scene.tracks:
            if track.of == "camera.target":
                curve = self._curve(track)
                return lambda time: np.array(curve(time))
        target = np.array(self.scene.view.camera.target if self.scene.view.camera else (0.0, 0.0, 0.0))
        return lambda _: target

    def at(self, seconds: float) -> Scene:
        """Return the scene at a time, without its animation.

        Parameters
        ----------
        seconds : float
            Time, seconds.

        Returns
        -------
        Scene
            The scene.

        Raises
        ------
        SceneError
            If a value is invalid at this time, or the camera cannot keep its clearance.
        """
        least = self.animation.clearance
        scene = replace(self.scene, animation=None, tracks=())
        camera: dict[str, Any] = {}
        for of, (track, curve) in self._tracks.items():
            try:
                value = curve(seconds)
                element, _, attribute = of.rpartition(".")
                if element == "camera":
                    camera[attribute] = value
                else:
                    scene = scene.with_values([f"{of}={kind_of(scene, of, track.fail).text(value)}"])
            except (SceneError, ValueError) as error:
                raise track.fail(f"at {seconds:g}s: {error}") from None
        seen = scene.view.camera
        if camera and seen is None:
            raise SceneError(f"{scene.name}: expected a <camera>, which a track moves")
        if seen is None:
            return scene
        seen = replace(seen, **camera)  # at once: an eye may pass where the target was
        if least:
            try:
                seen = kept_clear(scene.root, seen, least)
            except SceneError as error:
                raise self.animation.fail(f"at {seconds:g}s: {error}") from None
        return replace(scene, view=replace(scene.view, camera=seen))


def _automatic(of: str, kind: Any) -> str:
    """Curve of an attribute whose track leaves the choice."""
    if not isinstance(kind, (Number, Vector)) or getattr(kind, "whole", False):
        return "step"
    element, _, attribute = of.rpartition(".")
    return AUTOMATIC.get(f"{element.partition('[')[0]}.{attribute}", "smooth")


def _check_curve(track: Track, name: str, kind: Any, values: list[Any]) -> None:
    """Raise `SceneError` for a curve that does not suit the attribute."""
    if not isinstance(kind, (Number, Vector)) or len({np.size(value) for value in values}) > 1:
        raise track.fail(f"curve={name!r}: expected step, or keys of as many numbers each")
    if name == "zoom" and track.of != "camera.eye":
        raise track.fail("curve='zoom': expected of='camera.eye'")
    size = {"path": 3, "rotation": 4}.get(name, np.size(values[0]))
    if np.size(values[0]) != size:
        raise track.fail(f"curve={name!r}: expected keys of {size} numbers each")
