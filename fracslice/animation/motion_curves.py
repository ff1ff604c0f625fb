"""Curves through keyframes, by the kind of motion.

Smooth curves are monotone cubics (Fritsch and Carlson 1980; slopes of Fritsch and Butland 1984), which do not
overshoot. Rotations are cubic splines of rotation vectors (Park and Ravani 1997). A path is a cubic spline
through the points, over their centripetal parameters (Lee 1989), travelled by arc length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]
Curve = Callable[[float], Values]
Ease = Literal["none", "in", "out", "both"]
FINE = 256
"""Points per segment of a path at which its arc length is measured."""


def smooth(times: Values, values: Values) -> Curve:
    """Return the monotone cubic through the keyframes.

    Parameters
    ----------
    times : ndarray of float64, shape (n,)
        Increasing times, at least two.
    values : ndarray of float64, shape (n, d)
        Value at each time.

    Returns
    -------
    callable
        Value at a time.
    """
    from scipy.interpolate import PchipInterpolator

    curve: Curve = PchipInterpolator(times, values)
    return curve


def linear(times: Values, values: Values) -> Curve:
    """Return the polygon through the keyframes; parameters as in `smooth`."""
    return lambda time: np.array([np.interp(time, times, column) for column in values.T])


def logarithmic(times: Values, values: Values) -> Curve:
    """Return the curve of positive values whose logarithm is smooth; parameters as in `smooth`.

    Raises
    ------
    ValueError
        If a value is not positive.
    """
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
    """Return the curve of vectors whose direction and logarithm of length are smooth; as in `smooth`.

    Raises
    ------
    ValueError
        If a vector is zero.
    """
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


def eased(times: Sequence[float], ease: str, time: float) -> float:
    """Return the time at which a curve is read so that it begins or ends at rest.

    Only the first and the last segment change; keyframes keep their times, and the pace is continuous.

    Parameters
    ----------
    times : sequence of float
        Times of the keyframes.
    ease : {"none", "in", "out", "both"}
        Ends at rest.
    time : float
        Time, seconds.

    Returns
    -------
    float
        Time within the keyframes, seconds.
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
