"""A light at the camera, whose strength is that at the point that the camera looks at."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from . import Kind, Point, Unit
from .lamp import sharp_lamp

if TYPE_CHECKING:
    from ..view import Light


def unit(light: Light, eye: Point, far: float) -> Unit:
    return sharp_lamp, {"position": eye}


def scale(eye: Point, target: Point) -> float:
    return math.dist(eye, target) ** 2


KIND = Kind("at the camera", unit, is_soft=lambda light: False, is_blocked=False, scale=scale)
