"""Animation of a scene: the records behind `<animation>` and `<track>`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ..common.parameters import NUMBER, REQUIRED, Choice, Count, Number, Parameter, attribute, finite
from ..records import Part

LONGEST = 1e5
"""Longest time, seconds."""
_SECONDS = re.compile(rf"\s*({NUMBER})\s*s?\s*")


@dataclass(frozen=True)
class Seconds(Parameter):
    """Parameter kind of a time: a number of seconds, with or without the unit."""

    @property
    def expects(self) -> str:
        """Description of the accepted values."""
        return f"a time in seconds such as 2.5s, from 0 to {LONGEST:g}"

    def read(self, text: str) -> float:
        """Parse text with an optional unit; see `Parameter.read`."""
        match = _SECONDS.fullmatch(text)
        return self.check(float(match[1]) if match else None)

    def check(self, value: Any) -> float:
        """Validate a number of seconds; see `Parameter.check`."""
        number = self.read(value) if isinstance(value, str) else finite(value)
        if number is None or not 0 <= number <= LONGEST:
            raise ValueError(self.expects)
        return number

    def text(self, value: float) -> str:
        """Format a time in seconds; see `Parameter.text`."""
        return f"{value!r}s".replace(".0s", "s")


Keyframes = tuple[tuple[float, str], ...]


@dataclass(frozen=True)
class Keys(Parameter):
    """Parameter kind of keyframes: pairs of a time and the text of a value."""

    @property
    def expects(self) -> str:
        """Description of the accepted values."""
        return "times and values, such as 0s: 1 0 0; 2.5s: 0 1 0, in the order of time"

    def read(self, text: str) -> Keyframes:
        """Parse keyframes separated by semicolons; see `Parameter.read`."""
        pairs = [item.partition(":") for item in text.split(";") if item.strip()]
        return self.check([(time, value) for time, _, value in pairs])

    def check(self, value: Any) -> Keyframes:
        """Validate keyframes; see `Parameter.check`."""
        try:
            keys = tuple((Seconds(0.0, "").check(time), " ".join(text.split())) for time, text in value)
        except (TypeError, ValueError, AttributeError):
            raise ValueError(self.expects) from None
        if not keys or any(a >= b for (a, _), (b, _) in pairwise(keys)) or not all(text for _, text in keys):
            raise ValueError(self.expects)
        return keys

    def text(self, value: Keyframes) -> str:
        """Format keyframes; see `Parameter.text`."""
        return "; ".join(f"{Seconds(0.0, '').text(time)}: {text}" for time, text in value)


@dataclass(frozen=True)
class AttributePath(Parameter):
    """Parameter kind of an attribute of an element: ELEMENT.ATTRIBUTE or ELEMENT[NUMBER].ATTRIBUTE."""

    @property
    def expects(self) -> str:
        """Description of the accepted values."""
        return "ELEMENT.ATTRIBUTE, such as camera.eye or box[2].round"

    def check(self, value: Any) -> str:
        """Validate the name of an attribute; see `Parameter.check`."""
        if not isinstance(value, str) or not re.fullmatch(r"\w+(\[\d+\])?\.\w+", value):
            raise ValueError(self.expects)
        return value


@dataclass(frozen=True, kw_only=True)
class Animation(Part):
    """Film of the scene: its length and its frames. Each `<track>` moves one attribute.

    Without tracks, every frame is the same. Pictures, meshes and layers use the values of the elements
    themselves, unless a time is given.
    """

    element = "animation"
    duration: float = attribute(Seconds, REQUIRED, "length of the film")
    fps: float = attribute(Number, 24.0, "frames per second", least=0.1, most=240)
    shutter: float = attribute(
        Number,
        0.0,
        "fraction of a frame's time for which the shutter is open: 0.5 is a film's",
        least=0,
        most=1,
    )
    times: int = attribute(Count, 8, "times within the open shutter that a frame averages", least=1, most=256)
    clearance: float = attribute(
        Number, 0.0, "least distance of the camera to the surface, in scene units: it is moved away", least=0
    )
    noise: str = attribute(
        Choice, "moving", "whether the pattern of the noise changes from frame to frame", ("moving", "fixed")
    )


CURVES = ("auto", "smooth", "linear", "log", "step", "path", "zoom", "rotation")


@dataclass(frozen=True, kw_only=True)
class Track(Part):
    """One attribute of one element over the time of the `<animation>`; repeatable.

    Before the first and after the last keyframe, the value stays. Between keyframes, a smooth curve does not
    overshoot, log has equal ratios in equal times, and step no values between. For an eye, path is a curve in
    space at a pace without jumps, and zoom leads around the target, by angle and by the logarithm of the
    distance. Rotation is for the rotation of a transform. By default the curve suits the attribute.
    """

    element = "track"
    many = True
    of: str = attribute(AttributePath, REQUIRED, "the attribute to move")
    keys: Keyframes = attribute(Keys, REQUIRED, "keyframes: the value at each time")
    curve: str = attribute(Choice, "auto", "curve between keyframes", CURVES)
    ease: str = attribute(
        Choice, "none", "ends at which the motion begins or ends at rest", ("none", "in", "out", "both")
    )
