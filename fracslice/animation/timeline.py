"""Scene at a time: the values of all tracks, by the kind of motion, and a camera that keeps its distance
to the surface.

Smooth curves are monotone cubics (Fritsch and Carlson 1980; slopes of Fritsch and Butland 1984), which do not
overshoot, except near a slope that a track gives. Rotations are cubic splines of rotation vectors (Park and
Ravani 1997). A path is a cubic spline through the points, over their centripetal parameters (Lee 1989),
travelled by arc length.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..common.messages import format_count
from ..common.parameters import Number, Vector
from ..errors import SceneError
from ..fields.depth import resolve_depths
from ..fields.registry import Node
from ..fields.varying import Varying
from ..rendering.setup import prepare
from ..scene.layout import kind_of
from ..scene.model import Scene
from ..scene.view import Animation, Camera, Keyframes, Track

STEPS = 256
"""Most steps away from the surface."""
MARGIN = 1.01
"""Factor on a step, so that the distance is reached."""


def kept_clear(root: Node, camera: Camera, least: float) -> Camera:
    """Move a camera away from the surface until it is far enough.

    Newton steps lead the eye along the gradient. It is measured over the clearance, so that it leads out of
    narrower holes. The field over its Lipschitz bound is a lower bound of the distance, so the clearance is
    guaranteed.

    `least` in scene units.
    """
    known = resolve_depths(root, least / 2)
    kernel, bound = known.kernel("cpu", "float64"), known.bounds.lipschitz
    eye, offsets = np.array(camera.eye), least * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
    for _ in range(STEPS):
        f = kernel.points(*(eye + offsets).T)
        missing = least - f[0] / bound
        if missing <= 0:
            return camera if np.array_equal(eye, camera.eye) else replace(camera, eye=tuple(eye.tolist()))
        gradient = (f[1:4] - f[4:]) / (2 * least)
        steepness = float(np.linalg.norm(gradient))
        if not steepness > 0:
            break
        eye = eye + MARGIN * min(missing * bound / steepness, least) * gradient / steepness
    raise camera.fail(f"eye: expected a place {least:g} away from the surface, and none was reached")


Values = NDArray[np.float64]
Curve = Callable[[float], Values]
Ease = Literal["none", "in", "out", "both"]
FINE = 256
"""Points per segment of a path at which its arc length is measured."""


def smooth(times: Values, values: Values) -> Curve:
    """Return the monotone cubic through the keyframes.

    `times`: float64 (n,); `values`: float64 (n, d).
    """
    from scipy.interpolate import PchipInterpolator

    curve: Curve = PchipInterpolator(times, values)
    return curve


def bent(times: Values, values: Values, slopes: Mapping[int, Values]) -> Curve:
    """Return the smooth curve with other slopes at some keyframes, by their numbers; as in `smooth`."""
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    own = PchipInterpolator(times, values).derivative()(times)
    for number, slope in slopes.items():
        own[number] = slope
    curve: Curve = CubicHermiteSpline(times, values, own)
    return curve


def linear(times: Values, values: Values) -> Curve:
    """Return the polygon through the keyframes; parameters as in `smooth`."""
    return lambda time: np.array([np.interp(time, times, column) for column in values.T])


def logarithmic(times: Values, values: Values) -> Curve:
    """Return the curve of positive values whose logarithm is smooth; parameters as in `smooth`."""
    if not (values > 0).all():
        raise ValueError("values above zero")
    inner = smooth(times, np.log(values))
    return lambda time: np.exp(inner(time))


def path(times: Values, values: Values) -> Curve:
    """Return a curve in space whose pace has no jumps; parameters as in `smooth`."""
    from scipy.interpolate import CubicSpline, PchipInterpolator

    gaps = np.sqrt(np.linalg.norm(np.diff(values, axis=0), axis=1))
    if not gaps.all():  # a rest: a spline needs distinct points
        return smooth(times, values)
    knots = np.concatenate([[0.0], np.cumsum(gaps)])
    spline = CubicSpline(knots, values)
    pieces = [np.linspace(a, b, FINE, endpoint=False) for a, b in pairwise(knots)]
    fine = np.concatenate([*pieces, knots[-1:]])
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(spline(fine), axis=0), axis=1))])
    travelled, place = PchipInterpolator(times, lengths[::FINE]), PchipInterpolator(lengths, fine)
    return lambda time: np.asarray(spline(place(travelled(time))))


def rotation(times: Values, values: Values) -> Curve:
    """Return the rotation through keyframes of an axis and an angle in degrees; parameters as in `smooth`.

    About a common axis, the angle is smooth, over any number of turns; between other rotations, the way is
    the shortest.
    """
    from scipy.spatial.transform import Rotation, RotationSpline

    axes = values[:, :3] / np.linalg.norm(values[:, :3], axis=1, keepdims=True)
    if np.allclose(axes, axes[0]):
        angle = smooth(times, values[:, 3:])
        return lambda time: np.append(axes[0], angle(time))
    spline = RotationSpline(times, Rotation.from_rotvec(axes * np.radians(values[:, 3:])))

    def rotated(time: float) -> Values:
        vector = spline(time).as_rotvec()
        angle = float(np.linalg.norm(vector))
        return np.append(vector / angle if angle else axes[0], np.degrees(angle))

    return rotated


def zoom(times: Values, values: Values) -> Curve:
    """Return the curve of vectors whose direction and logarithm of length are smooth; as in `smooth`."""
    lengths = np.linalg.norm(values, axis=1, keepdims=True)
    if not lengths.all():
        raise ValueError("points other than the target")
    direction, length = smooth(times, values / lengths), logarithmic(times, lengths)

    def vector(time: float) -> Values:
        towards = direction(time)
        return towards / np.linalg.norm(towards) * length(time)

    return vector


CURVES: dict[str, Callable[[Values, Values], Curve]] = {
    "smooth": smooth,
    "linear": linear,
    "log": logarithmic,
    "path": path,
    "rotation": rotation,
    "zoom": zoom,
}


def ease_time(times: Sequence[float], ease: str, time: float) -> float:
    """Return the time at which a curve is read so that it begins or ends at rest.

    Only the first and the last segment change; keyframes keep their times, and the pace is continuous.

    `time` in seconds. Returns a value in seconds.
    """
    time = min(max(time, times[0]), times[-1])
    if len(times) < 2 or ease == "none":
        return time
    first, last = times[1] - times[0], times[-1] - times[-2]
    if ease == "both" and len(times) == 2:
        part = (time - times[0]) / first
        return times[0] + first * part * part * (3 - 2 * part)
    if ease != "out" and time < times[1]:
        part = (time - times[0]) / first
        return times[0] + first * part * part * (2 - part)
    if ease != "in" and time > times[-2]:
        part = (times[-1] - time) / last
        return times[-1] - last * part * part * (2 - part)
    return time


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
        name = _curve_name(track, kind)
        if name == "step" or len(times) == 1:
            return lambda time: values[max(int(np.searchsorted(times, time, side="right")) - 1, 0)]
        _check_curve(track, name, kind, values)
        table = np.array(values, float).reshape(len(times), -1)
        origin = self._target if name == "zoom" else lambda _: np.zeros(table.shape[1])
        try:
            if track.slopes:
                curve = bent(np.array(times), table, _slopes(track, name, table))
            else:
                curve = CURVES[name](np.array(times), table - [origin(time) for time in times])
        except ValueError as error:
            raise track.fail(f"keys of {track.of}: expected {error}") from None

        def value(time: float) -> Any:
            numbers = curve(ease_time(times, track.ease, time)) + origin(time)
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

    def value(self, of: str, seconds: float) -> str:
        """Return the value of an attribute that moves, as a scene's text has it.

        Parameters
        ----------
        of : str
            Attribute of a track.
        seconds : float
            Time, seconds.

        Returns
        -------
        str
            The value.

        Raises
        ------
        SceneError
            If the attribute has no track.
        """
        track, curve = self._track(of)
        return str(kind_of(self.scene, of, track.fail).text(curve(seconds)))

    def numbers(self, of: str, seconds: float) -> list[float]:
        """Return the numbers of an attribute that moves; none of one that is no number.

        Parameters
        ----------
        of : str
            Attribute of a track.
        seconds : float
            Time, seconds.

        Returns
        -------
        list of float
            Its value, or its coordinates.

        Raises
        ------
        SceneError
            If the attribute has no track.
        """
        value = self._track(of)[1](seconds)
        try:
            return [float(number) for number in np.atleast_1d(value)]
        except ValueError:
            return []

    def curve_of(self, of: str) -> str:
        """Return the name of the curve of an attribute that moves, of `CURVES`, or step.

        Parameters
        ----------
        of : str
            Attribute of a track.

        Returns
        -------
        str
            The name.

        Raises
        ------
        SceneError
            If the attribute has no track.
        """
        track = self._track(of)[0]
        return _curve_name(track, kind_of(self.scene, of, track.fail))

    def _track(self, of: str) -> tuple[Track, Callable[[float], Any]]:
        if of not in self._tracks:
            raise SceneError(f"of={of!r}: expected the attribute of a track")
        return self._tracks[of]

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
                element, _, attribute = of.rpartition(".")
                if element == "camera":
                    camera[attribute] = curve(seconds)
                else:
                    scene = scene.with_values([f"{of}={self.value(of, seconds)}"])
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


def _curve_name(track: Track, kind: Any) -> str:
    """Curve of a track; one that suits the attribute where the track leaves the choice."""
    if track.curve != "auto":
        return track.curve
    if not isinstance(kind, (Number, Vector)) or getattr(kind, "whole", False):
        return "step"
    element, _, attribute = track.of.rpartition(".")
    return AUTOMATIC.get(f"{element.partition('[')[0]}.{attribute}", "smooth")


def _slopes(track: Track, curve: str, values: Values) -> dict[int, Values]:
    """Slopes that a track gives, by the numbers of their keyframes."""
    if curve != "smooth":
        raise track.fail(f"slopes: expected curve='smooth', and it is {curve!r}")
    numbers = {time: number for number, (time, _) in enumerate(track.keys)}
    slopes: dict[int, Values] = {}
    for time, text in track.slopes or ():
        try:
            slope = np.array([float(word) for word in text.split()])
        except ValueError:
            slope = np.empty(0)
        if time not in numbers or slope.shape != values.shape[1:] or not np.isfinite(slope).all():
            expected = f"{format_count(values.shape[1], 'number')} at the time of a keyframe"
            raise track.fail(f"slopes={text!r} at {time:g}s: expected {expected}")
        slopes[numbers[time]] = slope
    return slopes


def _check_curve(track: Track, name: str, kind: Any, values: list[Any]) -> None:
    """Raise `SceneError` for a curve that does not suit the attribute."""
    words = not isinstance(kind, (Number, Vector)) or any(isinstance(value, Varying) for value in values)
    if words or len({np.size(value) for value in values}) > 1:
        raise track.fail(f"curve={name!r}: expected step, or keys of as many numbers each")
    if name == "zoom" and track.of != "camera.eye":
        raise track.fail("curve='zoom': expected of='camera.eye'")
    size = {"path": 3, "rotation": 4}.get(name, np.size(values[0]))
    if np.size(values[0]) != size:
        raise track.fail(f"curve={name!r}: expected keys of {size} numbers each")


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
