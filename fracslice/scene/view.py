"""View of a scene: the records behind `<camera>`, `<film>`, `<light>`, `<fog>` and `<shading>`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ..formulas.parameters import Choice, Count, File, Number, Vector
from ..formulas.records import attribute
from .camera import Camera as Camera
from .camera import Triple
from .element import Part

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
        "far away, near, all around, a picture of the surroundings, or at the camera",
        ("sun", "lamp", "sky", "environment", "camera"),
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
        return self.kind in ("sky", "environment")

    def validate(self) -> None:
        """Raise `SceneError` unless an environment, and nothing else, has a file."""
        if (self.kind == "environment") != bool(self.file):
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

        Raises
        ------
        SceneError
            If an element that is not repeatable occurs twice.
        """
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
