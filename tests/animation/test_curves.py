"""Curves through keyframes, against what they promise."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fracslice.animation.timeline import CURVES, ease_time

pytestmark = pytest.mark.once

TIMES = np.array([0.0, 1.0, 1.5, 4.0])
FINE = np.linspace(0, 4, 2001)


def sampled(name: str, keys: object) -> np.ndarray:
    curve = CURVES[name](TIMES, np.array(keys, float))
    for time, value in zip(TIMES, np.array(keys, float), strict=True):
        assert curve(time) == pytest.approx(value, abs=1e-9), "through every keyframe"
    return np.array([curve(time) for time in FINE])


@pytest.mark.parametrize("name", ["smooth", "linear"])
def test_numbers_do_not_overshoot(name: str) -> None:
    values = sampled(name, [[0], [1], [1], [-2]])[:, 0]
    assert values.max() <= 1 and values.min() >= -2
    assert (np.diff(values)[FINE[:-1] > 1.5] <= 0).all() and (np.diff(values)[FINE[:-1] < 1] >= 0).all()


def test_a_logarithmic_zoom_has_equal_ratios_in_equal_times() -> None:
    values = sampled("log", [[1], [1e-1], [10**-1.5], [1e-4]])[:, 0]
    assert np.log10(values) == pytest.approx(-FINE, abs=1e-9)
    with pytest.raises(ValueError, match="above zero"):
        sampled("log", [[1], [0], [1], [1]])


def test_a_path_is_a_smooth_curve_at_a_pace_without_jumps() -> None:
    angle = np.array([0, 0.4, 1.0, 2.0])
    values = sampled("path", np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]))
    assert np.linalg.norm(values, axis=1) == pytest.approx(1, abs=0.02), "nearly the circle"
    pace = np.linalg.norm(np.diff(values, axis=0), axis=1)
    assert abs(np.diff(pace)).max() < 0.02 * pace.max(), "no jump of the pace"
    assert np.array_equal(sampled("path", [[1, 1, 1]] * 4), np.ones((2001, 3))), "a rest"


def test_rotations_take_the_shortest_way_and_turns_about_one_axis_are_all_made() -> None:
    turns = sampled("rotation", [[0, 0, 1, 0], [0, 0, 1, 360], [0, 0, 1, 540], [0, 0, 1, 720]])
    assert (np.diff(turns[:, 3]) >= 0).all()
    keys = [[0, 0, 1, 30], [0, 1, 0, 80], [1, 1, 0, 120], [0, 1, 1, 60]]
    curve = CURVES["rotation"](TIMES, np.array(keys, float))

    def turned(value: np.ndarray) -> Rotation:
        return Rotation.from_rotvec(value[:3] / np.linalg.norm(value[:3]) * np.radians(value[3]))

    for time, key in zip(TIMES, keys, strict=True):
        assert (turned(curve(time)).inv() * turned(np.array(key, float))).magnitude() < 1e-9
    steps = [(turned(curve(a)).inv() * turned(curve(b))).magnitude() for a, b in pairwise(FINE)]
    assert max(steps) < 0.02 and max(abs(np.diff(steps))) < 1e-3


def test_a_zoom_turns_and_approaches_by_the_logarithm() -> None:
    keys = np.array([[1, 0, 0], [0, 0.1, 0], [0, 0, 0.01], [0, 0, 1e-6]], float)
    lengths = np.linalg.norm(sampled("zoom", keys), axis=1)
    assert (np.diff(lengths) < 0).all()
    assert abs(np.diff(np.log(lengths))).max() < 0.02


@pytest.mark.parametrize("ease", ["none", "in", "out", "both"])
@pytest.mark.parametrize("times", [(0.0, 4.0), (0.0, 1.0, 1.5, 4.0)])
def test_easing_rests_at_its_ends_and_keeps_the_keyframes(ease: str, times: tuple[float, ...]) -> None:
    for time in times:
        assert ease_time(times, ease, time) == time
    assert (ease_time(times, ease, -1), ease_time(times, ease, 9)) == (0, 4)
    values = np.array([ease_time(times, ease, time) for time in FINE])
    pace = np.diff(values) / np.diff(FINE)
    assert (pace >= 0).all() and abs(np.diff(pace)).max() < 0.02, "no jump of the pace"
    assert (pace[0] < 0.01) == (ease in ("in", "both")) and (pace[-1] < 0.01) == (ease in ("out", "both"))
