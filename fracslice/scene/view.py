# ruff: noqa: RUF009 -- `described` makes a field, as dataclasses.field does
"""View of a scene: the records behind `<camera>`, `<film>`, `<light>`, `<fog>` and `<shading>`.

Every field carries a parameter kind that reads, validates, writes and documents it, as in formulas.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import SceneError
from ..formulas.box import Box
from ..formulas.parameters import Choice, Count, Number, Vector, validate, validated

if TYPE_CHECKING:
    import numpy as np

Triple = tuple[float, float, float]
WHITE = (1.0, 1.0, 1.0)
FILLED = 0.95
"""Fraction of the picture that the object fills with an automatic camera."""
SHIFT = Vector((0.0, 0.0, 0.0), "so much forwards, to the right and up")
TURN = Vector((0.0, 0.0), "degrees to the right and up", sizes=(2,))


def described(kind: Any) -> Any:
    """Return a dataclass field with a parameter kind.

    Parameters
    ----------
    kind : Parameter
        Parameter kind; its default is the field's.

    Returns
    -------
    Any
        The field.
    """
    return field(default=kind.default, metadata={"kind": kind})


@dataclass(frozen=True, kw_only=True)
class Part:
    """Base of the records of a scene file.

    Attributes
    ----------
    element : str
        Element name.
    many : bool
        True if the element may be repeated.
    place : str or None
        Position in the file, "file:line".

    Raises
    ------
    SceneError
        If a value is invalid.
    """

    element: ClassVar[str]
    many: ClassVar[bool] = False
    place: str | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        validate(self, self.kinds(), self.fail)
        self.validate()

    def validate(self) -> None:
        """Raise `SceneError` for values that are invalid in combination."""

    @classmethod
    def kinds(cls) -> dict[str, Any]:
        """Return the parameter kinds.

        Returns
        -------
        dict of str to Parameter
            Kinds by field name.
        """
        return {f.name: f.metadata["kind"] for f in fields(cls) if "kind" in f.metadata}

    def fail(self, message: str) -> SceneError:
        """Return the error to raise about this element.

        Parameters
        ----------
        message : str
            The message.

        Returns
        -------
        SceneError
            The error.
        """
        return SceneError(f"{self.place + ': ' if self.place else ''}<{self.element}> {message}")


@dataclass(frozen=True, kw_only=True)
class Camera(Part):
    """Position, direction and lens of the camera; without one, the whole object is in view."""

    element = "camera"
    kind: str = described(
        Choice(
            "perspective",
            "perspective; orthographic: parallel rays, the plane of the target as in perspective; "
            "fisheye: equal angles are equal lengths from the middle; "
            "equirectangular: all around, 360 by 180 degrees",
            ("perspective", "orthographic", "fisheye", "equirectangular"),
        )
    )
    eye: Triple = described(Vector((2.2, -2.0, 1.4), "where the camera is, in scene units"))
    target: Triple = described(Vector((0.0, 0.0, 0.0), "the point in the middle of the picture"))
    up: Triple = described(Vector((0.0, 0.0, 1.0), "the direction that is up in the picture", nonzero=True))
    fov: float = described(
        Number(
            40.0,
            "the angle between the picture's upper and lower edge, in degrees: below 179, or up to 360 of a "
            "fisheye",
            above=0,
            most=360,
        )
    )
    aperture: float = described(
        Number(
            0.0, "radius of the lens, in scene units: what is out of focus blurs; 0: all is sharp", least=0
        )
    )
    focus: float | None = described(
        Number(None, "distance of what is sharp; without it, that of the target", above=0)
    )

    stereo: float = described(
        Number(
            0.0,
            "distance between two eyes, in scene units: above zero, the left eye's picture is in the left "
            "half, the right eye's in the right one",
            least=0,
        )
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
        by = validated("moved", (forward, right, up), SHIFT, self.fail)
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
        yaw, pitch = validated("turned", (yaw, pitch), TURN, self.fail)
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
        degrees = validated("degrees", degrees, Number(0.0, "an angle"), self.fail)
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
        degrees = validated("degrees", degrees, Number(0.0, "an angle"), self.fail)
        arm = _turn(_minus(self.eye, self.target), _unit(self.up), math.radians(degrees))
        return replace(self, eye=_plus(self.target, arm))


@dataclass(frozen=True, kw_only=True)
class Film(Part):
    """Size, sampling and tone mapping of the picture."""

    element = "film"
    width: int = described(Count(1280, "pixels across", least=1, most=32768))
    height: int = described(Count(720, "pixels down", least=1, most=32768))
    samples: int = described(Count(64, "the most samples that a pixel gets", least=1, most=1_000_000))
    tone: str = described(
        Choice("filmic", "how bright light is brought into range", ("filmic", "reinhard", "none"))
    )
    exposure: float = described(Number(0.0, "brighter by so many stops", least=-20, most=20))
    bloom: float = described(
        Number(0.0, "the part of bright light that spreads in the lens", least=0, most=1)
    )
    background: Triple = described(
        Vector((0.08, 0.08, 0.12), "colour where nothing is, without a sky", least=0, most=1)
    )


@dataclass(frozen=True, kw_only=True)
class Light(Part):
    """Light source, repeatable; without any, the scene has a sun and a sky."""

    element = "light"
    many = True
    kind: str = described(Choice("sun", "far away, near, or all around", ("sun", "lamp", "sky")))
    position: Triple = described(
        Vector((-1.0, -2.0, 3.0), "where a lamp is, or the direction in which the sun stands", nonzero=True)
    )
    colour: Triple = described(Vector(WHITE, "red, green and blue; of a sky, at its zenith", least=0, most=1))
    horizon: Triple = described(Vector(WHITE, "of a sky, its colour at the horizon", least=0, most=1))
    ground: Triple = described(Vector((0.3, 0.28, 0.26), "of a sky, its colour from below", least=0, most=1))
    strength: float = described(
        Number(1.0, "multiplies the colour; of a lamp, at distance 1", least=0, most=1e6)
    )
    size: float = described(
        Number(
            0.0,
            "of a lamp its radius, of a sun the angle in degrees it fills: above zero, shadows are soft",
            least=0,
            most=90,
        )
    )
    shadows: str = described(Choice("yes", "whether it is blocked by what is in its way", ("yes", "no")))


@dataclass(frozen=True, kw_only=True)
class Fog(Part):
    """Haze that hides distant surfaces."""

    element = "fog"
    colour: Triple = described(Vector((0.7, 0.75, 0.8), "red, green and blue", least=0, most=1))
    density: float = described(
        Number(0.1, "of light, exp(-density distance) comes through", least=0, most=1e6)
    )


@dataclass(frozen=True, kw_only=True)
class Shading(Part):
    """Display mode and surface effects."""

    element = "shading"
    mode: str = described(
        Choice(
            "light",
            "light: lit by the lights; normal: its direction; depth: how far along the view; "
            "distance: how far from the eye; steps: how many steps the ray took, the more the darker",
            ("light", "normal", "depth", "distance", "steps"),
        )
    )
    ambient: float = described(Number(0.0, "light that is everywhere", least=0, most=100))
    occlusion: float = described(Number(0.0, "how much narrow places darken ambient light", least=0, most=4))
    reach: float = described(Number(0.2, "how far occlusion looks, in scene units", above=0))
    bounces: int = described(Count(4, "how often a ray is reflected or refracted at most", most=16))


@dataclass(frozen=True)
class View:
    """Complete view of a scene. Omitted parts are None or empty, and chosen for the scene.

    Attributes
    ----------
    camera : Camera or None
        The camera.
    film : Film
        Size, sampling and tone mapping.
    lights : tuple of Light
        Light sources.
    fog : Fog or None
        Fog.
    shading : Shading
        Display mode and surface effects.
    """

    camera: Camera | None = None
    film: Film = Film()
    lights: tuple[Light, ...] = ()
    fog: Fog | None = None
    shading: Shading = Shading()

    @classmethod
    def of(cls, parts: Iterable[Part]) -> View:
        """Build a view from its elements.

        Parameters
        ----------
        parts : iterable of Part
            Elements of a scene file.

        Returns
        -------
        View
            The view.

        Raises
        ------
        SceneError
            If an element that is not repeatable occurs twice.
        """
        found: dict[str, Any] = {}
        for part in parts:
            name = "lights" if isinstance(part, Light) else part.element
            if not part.many and name in found:
                raise part.fail("may only stand once in a scene")
            found[name] = (*found.get(name, ()), part) if part.many else part
        return cls(**found)

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
