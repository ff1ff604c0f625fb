"""Steering input of a camera that flies near a surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..scene.view import Camera

BOLD = 0.5
"""Maximum fraction of the distance to the surface per step."""
TURN = 60.0
"""Rate of turning and rolling by keys, degrees per second."""


@dataclass(frozen=True)
class CameraInput:
    """Steering input of the camera.

    Attributes
    ----------
    forward, right, up : float
        Direction of flight, -1 to 1 each.
    yaw, pitch, roll : float
        Rotation to the right, up and clockwise, -1 to 1 each.
    pace : float
        Speed, in distances to the surface per second.
    """

    forward: float = 0.0
    right: float = 0.0
    up: float = 0.0
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    pace: float = 1.0

    def flown(self, camera: Camera, distance: float, seconds: float) -> Camera:
        """Move and turn a camera for some time.

        Speed is proportional to the distance of the surface, so the camera never reaches it.

        Parameters
        ----------
        camera : Camera
            Camera to move.
        distance : float
            Distance to the surface, scene units.
        seconds : float
            Duration of the flight.
        """
        direction = self.forward, self.right, self.up
        if any(direction):
            length = distance * min(self.pace * seconds, BOLD) / max(1.0, math.hypot(*direction))
            camera = camera.moved(*(length * axis for axis in direction))
        if self.yaw or self.pitch:
            camera = camera.turned(TURN * seconds * self.yaw, TURN * seconds * self.pitch)
        return camera.rolled(TURN * seconds * self.roll) if self.roll else camera
