"""The view of a scene, and its animation: the records behind `<camera>`, `<film>`, `<light>`, `<fog>`,
`<shading>`, `<animation>` and `<track>`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ..common.parameters import (
    NUMBER,
    REQUIRED,
    Choice,
    Count,
    File,
    Number,
    Parameter,
    Vector,
    alternatives,
    attribute,
    finite,
    validate_value,
)
from ..fields.box import Box
from ..records import Part
from .lights import KINDS

if TYPE_CHECKING:
    import numpy as np


Triple = tuple[float, float, float]
FILLED = 0.95
"""Fraction of the picture that the object fills with an automatic camera."""
SHIFT = Vector((0.0, 0.0, 0.0), "distances forwards, to the right and up")
TURN = Vector((0.0, 0.0), "degrees to the right and up", sizes=(2,))


@dataclass(frozen=True, kw_only=True)
class Camera(Part):
    """Position, direction and lens of the camera; without one, the whole object is in view.

    The projection is a perspective; orthographic, by parallel rays, with the plane of the target as in
    perspective; a fisheye, whose equal angles are equal lengths from the middle; or equirectangular, all
    around, 360 by 180 degrees. With two eyes, the left eye's picture is in the left half, the right eye's in
    the right half.
    """

    element = "camera"
    kind: str = attribute(
        Choice,
        "perspective",
        "projection of the scene to the picture",
        ("perspective", "orthographic", "fisheye", "equirectangular"),
    )
    eye: Triple = attribute(Vector, (2.2, -2.0, 1.4), "where the camera is, in scene units")
    target: Triple = attribute(Vector, (0.0, 0.0, 0.0), "the point in the middle of the picture")
    up: Triple = attribute(Vector, (0.0, 0.0, 1.0), "the direction that is up in the picture", nonzero=True)
    fov: float = attribute(
        Number,
        40.0,
        "the angle between the picture's upper and lower edge, in degrees: below 179, or up to 360 of a "
        "fisheye",
        above=0,
        most=360,
    )
    aperture: float = attribute(
        Number, 0.0, "radius of the lens, in scene units: a larger one blurs more; 0: all is sharp", least=0
    )
    focus: float | None = attribute(
        Number, None, "distance that is in focus; without it, that of the target", above=0
    )
    stereo: float = attribute(Number, 0.0, "distance between two eyes, in scene units; 0: one eye", least=0)

    clip: float = attribute(
        Number,
        0.0,
        "distance from the eye of a plane in front of which all is cut away, in scene units; 0: none",
        least=0,
    )

    def validate(self) -> None:
        """Raise `SceneError` if `eye`, `target` and `up` do not define a view, or an effect is not of the
        kind.
        """
        if self.kind in ("perspective", "orthographic") and self.fov >= 179:
            raise self.fail(f"fov={self.fov:g}: expected a number < 179; a fisheye sees more")
        if self.aperture and self.kind != "perspective":
            raise self.fail(f"aperture={self.aperture:g}: expected kind='perspective'")
        if self.stereo and (self.aperture or self.kind not in ("perspective", "equirectangular")):
            kinds = "kind='perspective' without an aperture, or 'equirectangular'"
            raise self.fail(f"stereo={self.stereo:g}: expected {kinds}")
        if not 0 < math.dist(self.eye, self.target) < math.inf:
            raise self.fail("eye and target: expected two different points")
        if math.hypot(*_cross(self.forward, _unit(self.up))) < 1e-6:
            raise self.fail("up: expected a direction other than the one the camera looks in")

    @classmethod
    def around(cls, box: Box, points: np.ndarray | None = None, aspect: float = 1.0) -> Camera:
        """Return a camera with a box or points in view.

        Parameters
        ----------
        box : Box
            Finite box; the camera looks at its centre.
        points : ndarray of float64, shape (3, n), optional
            Points to have in view, scene units; the corners of the box by default.
        aspect : float
            Width of the picture divided by its height.

        Returns
        -------
        Camera
            The camera.
        """
        import numpy as np  # not needed for help texts

        away = _unit((2.2, -2.0, 1.4))
        draft = cls(eye=_along(box.centre, away, max(box.size)), target=box.centre)
        x, y, z = np.array(box.corners).T if points is None else points
        x, y, z = (a - c for a, c in zip((x, y, z), box.centre, strict=True))
        near, across, up = (x * a + y * b + z * c for a, b, c in (away, draft.right, draft.above))
        reach = np.maximum(abs(across) / aspect, abs(up)) / (FILLED * math.tan(math.radians(draft.fov / 2)))
        return replace(draft, eye=_along(box.centre, away, float((near + reach).max())))

    @property
    def forward(self) -> Triple:
        """Unit viewing direction."""
        return _unit(_minus(self.target, self.eye))

    @property
    def right(self) -> Triple:
        """Unit direction to the right of the picture."""
        return _unit(_cross(self.forward, self.up))

    @property
    def above(self) -> Triple:
        """Unit direction to the top of the picture, orthogonal to `forward`."""
        return _cross(self.right, self.forward)

    def moved(self, forward: float = 0.0, right: float = 0.0, up: float = 0.0) -> Camera:
        """Return the camera translated along its own axes.

        Parameters
        ----------
        forward, right, up : float
            Distances, scene units.

        Returns
        -------
        Camera
            The moved camera, with the same viewing direction.

        Raises
        ------
        SceneError
            If a distance is invalid.
        """
        by = validate_value("moved", (forward, right, up), SHIFT, self.fail)
        shift = tuple(_dot(by, axes) for axes in zip(self.forward, self.right, self.above, strict=True))
        return replace(self, eye=_plus(self.eye, shift), target=_plus(self.target, shift))

    def turned(self, yaw: float = 0.0, pitch: float = 0.0) -> Camera:
        """Return the camera turned in place; it never turns over the zenith.

        Parameters
        ----------
        yaw, pitch : float
            Angles to the right and up, degrees.

        Returns
        -------
        Camera
            The turned camera.

        Raises
        ------
        SceneError
            If an angle is invalid.
        """
        yaw, pitch = validate_value("turned", (yaw, pitch), TURN, self.fail)
        ahead = math.asin(max(-1.0, min(1.0, _dot(self.forward, _unit(self.up)))))
        rise = max(-1.55, min(1.55, ahead + math.radians(pitch))) - ahead
        level = _turn(self.forward, self.right, rise)
        turned = _turn(level, _unit(self.up), -math.radians(yaw))
        return replace(self, target=_along(self.eye, turned, math.dist(self.eye, self.target)))

    def rolled(self, degrees: float) -> Camera:
        """Return the camera rolled about its viewing direction; `up` becomes orthogonal to it.

        Parameters
        ----------
        degrees : float
            Angle, degrees; positive clockwise, so that the picture turns counter-clockwise.

        Returns
        -------
        Camera
            The rolled camera.

        Raises
        ------
        SceneError
            If the angle is invalid.
        """
        degrees = validate_value("degrees", degrees, Number(0.0, "an angle"), self.fail)
        return replace(self, up=_turn(self.above, self.forward, math.radians(degrees)))

    def orbited(self, degrees: float) -> Camera:
        """Return the camera rotated around the target, about `up`.

        Parameters
        ----------
        degrees : float
            Angle, degrees.

        Returns
        -------
        Camera
            The rotated camera.

        Raises
        ------
        SceneError
            If the angle is invalid.
        """
        degrees = validate_value("degrees", degrees, Number(0.0, "an angle"), self.fail)
        arm = _turn(_minus(self.eye, self.target), _unit(self.up), math.radians(degrees))
        return replace(self, eye=_plus(self.target, arm))


def _minus(a: Triple, b: Triple) -> Triple:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _plus(a: Triple, b: tuple[float, ...]) -> Triple:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _along(a: Triple, direction: Triple, by: float) -> Triple:
    return a[0] + by * direction[0], a[1] + by * direction[1], a[2] + by * direction[2]


def _dot(a: Triple, b: Triple) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(a: Triple) -> Triple:
    length = math.hypot(*a)
    return a[0] / length, a[1] / length, a[2] / length


def _turn(a: Triple, axis: Triple, angle: float) -> Triple:
    """Rodrigues' rotation about a unit axis."""
    c, s, cross, along = math.cos(angle), math.sin(angle), _cross(axis, a), _dot(axis, a)
    x, y, z = (c * p + s * q + (1 - c) * along * r for p, q, r in zip(a, cross, axis, strict=True))
    return x, y, z


WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Film(Part):
    """Size, sampling and tone mapping of the picture."""

    element = "film"
    width: int = attribute(Count, 1280, "pixels across", least=1, most=32768)
    height: int = attribute(Count, 720, "pixels down", least=1, most=32768)
    samples: int = attribute(Count, 64, "maximum number of samples of a pixel", least=1, most=1_000_000)
    tone: str = attribute(Choice, "filmic", "tone mapping of bright light", ("filmic", "reinhard", "none"))
    exposure: float = attribute(Number, 0.0, "exposure in stops; positive is brighter", least=-20, most=20)
    bloom: float = attribute(
        Number, 0.0, "the part of bright light that spreads in the lens", least=0, most=1
    )
    background: Triple = attribute(
        Vector, (0.08, 0.08, 0.12), "displayed colour behind the object, without a sky", least=0, most=1
    )
    alpha: str = attribute(
        Choice, "no", "whether the background and the sky are transparent, by an alpha channel", ("no", "yes")
    )

    @property
    def transparent(self) -> bool:
        """True if the picture has an alpha channel."""
        return self.alpha == "yes"


@dataclass(frozen=True, kw_only=True)
class Light(Part):
    """Light source, repeatable; by default a sun and a sky, in a scene without end a light at the camera."""

    element = "light"
    many = True
    kind: str = attribute(
        Choice,
        "sun",
        alternatives(*(kind.doc for kind in KINDS.values())),
        tuple(KINDS),
    )
    position: Triple = attribute(
        Vector, (-1.0, -2.0, 3.0), "where a lamp is, or the direction in which the sun stands", nonzero=True
    )
    colour: Triple = attribute(Vector, WHITE, "red, green and blue; of a sky, at its zenith", least=0, most=1)
    horizon: Triple = attribute(Vector, WHITE, "of a sky, its colour at the horizon", least=0, most=1)
    ground: Triple = attribute(Vector, (0.3, 0.28, 0.26), "of a sky, its colour from below", least=0, most=1)
    strength: float = attribute(
        Number,
        1.0,
        "multiplies the colour; of a lamp at distance 1, of a light at the camera at its target",
        least=0,
        most=1e6,
    )
    size: float = attribute(
        Number,
        0.0,
        "of a lamp its radius, of a sun the angle in degrees it fills: above zero, shadows are soft",
        least=0,
        most=90,
    )
    shadows: str = attribute(Choice, "yes", "whether objects cast shadows in it", ("yes", "no"))
    file: str | None = attribute(
        File,
        None,
        "of an environment, its picture, such as .hdr: longitude across, latitude down, +y in the middle",
    )
    rotation: float = attribute(
        Number, 0.0, "of an environment, its turn about the z axis in degrees", least=-360, most=360
    )

    @property
    def surrounds(self) -> bool:
        """True if rays that miss the scene show it."""
        return KINDS[self.kind].surrounds

    @property
    def is_picture(self) -> bool:
        """True if its light is that of a file."""
        return KINDS[self.kind].is_picture

    def validate(self) -> None:
        """Raise `SceneError` unless an environment, and nothing else, has a file."""
        if self.is_picture != bool(self.file):
            wanted = "is only for an environment" if self.file else "expected a picture of the surroundings"
            raise self.fail(f'file="{self.file or ""}": {wanted}')


@dataclass(frozen=True, kw_only=True)
class Fog(Part):
    """Haze that hides distant surfaces; it does not cover the sky."""

    element = "fog"
    colour: Triple | None = attribute(
        Vector, None, "red, green and blue; without it, those of the sky behind", least=0, most=1
    )
    density: float = attribute(
        Number, 0.1, "of light, exp(-density distance) comes through", least=0, most=1e6
    )
    height: float | None = attribute(
        Number, None, "height over which it thins to 1/e; without it, fog is the same everywhere", above=0
    )
    level: float = attribute(Number, 0.0, "height z at which it has its density")
    scatter: float = attribute(
        Number,
        0.0,
        "how much light of suns and lamps it scatters to the eye, where surfaces do not shadow it",
        least=0,
        most=1,
    )


@dataclass(frozen=True, kw_only=True)
class Shading(Part):
    """Display mode and surface effects.

    Beside the lit scene, a picture shows the unit normal, the coordinates, the colour without light, the
    position in a palette (trap), the distance along the view (depth) or from the eye, both in scene units, or
    the steps of the ray.
    """

    element = "shading"
    mode: str = attribute(
        Choice,
        "light",
        "quantity that the picture shows",
        ("light", "normal", "position", "albedo", "trap", "depth", "distance", "steps"),
    )
    ambient: float = attribute(Number, 0.0, "light that is everywhere", least=0, most=100)
    occlusion: float = attribute(Number, 0.0, "how much occlusion darkens ambient light", least=0, most=4)
    reach: float = attribute(Number, 0.2, "distance at which surfaces occlude, in scene units", above=0)
    paths: str = attribute(
        Choice, "no", "whether surfaces light each other, and glowing ones the others", ("no", "yes")
    )
    bounces: int = attribute(Count, 4, "maximum number of reflections and refractions of a ray", most=16)


@dataclass(frozen=True)
class View:
    """Complete view of a scene. Omitted parts are None or empty, and chosen for the scene."""

    camera: Camera | None = None  # the camera
    film: Film = Film()  # size, sampling and tone mapping
    lights: tuple[Light, ...] = ()  # light sources
    fog: Fog | None = None  # fog
    shading: Shading = Shading()  # display mode and surface effects

    @classmethod
    def of(cls, parts: Iterable[Part]) -> View:
        """Build a view from its elements."""
        elements: dict[str, Any] = {}
        for part in parts:
            name = "lights" if isinstance(part, Light) else part.element
            if not part.many and name in elements:
                raise part.fail("may only stand once in a scene")
            elements[name] = (*elements.get(name, ()), part) if part.many else part
        return cls(**elements)

    @property
    def parts(self) -> tuple[Part, ...]:
        """Elements of the view, without film and shading of default values."""
        single = [
            part
            for part in (self.camera, self.film, self.fog, self.shading)
            if part not in (None, Film(), Shading())
        ]
        return (*single, *self.lights)


PARTS: tuple[type[Part], ...] = (Camera, Film, Light, Fog, Shading)


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
    slopes: Keyframes | None = attribute(
        Keys, None, "slopes of a smooth curve at some of its keyframes, per second, such as 2.5s: 0.4"
    )
