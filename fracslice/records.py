"""Records of what a job makes: the options of meshes, layers and pictures, and the edits for printing.

An option is a field here and nowhere else: commands, Python signatures, the schema and the documentation are
made from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias, get_args

from .common.messages import significant
from .common.parameters import (
    AnyLength,
    AnyScale,
    Choice,
    Colours,
    Count,
    Duration,
    Flag,
    Given,
    Heights,
    Holes,
    Length,
    Listed,
    Number,
    Pair,
    Percent,
    Pixels,
    Record,
    Shift,
    Sides,
    Triple,
    Vector,
    attribute,
    described,
    of_kind,
    picture_size,
    record,
    validate,
)
from .errors import RenderError, SceneError, SliceError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .scene import Scene
    from .scene.view import View
    from .slicing.printers import Printer

RESOLUTION = 256.0
"""Default number of voxels along the longest side, and the detail that automatic depths resolve."""

Colour: TypeAlias = Literal["material", "point", "axes", "planes", "sphere", "steps", "direction"]
"""What the colours of vertices show: the materials of the scene, or a property of the orbit."""

Palette: TypeAlias = Literal["viridis", "plasma", "inferno", "magma", "cividis", "twilight"]
"""Palettes by name."""

MOST_FILAMENTS = 16
"""Most filaments that slicers tell apart in painted triangles."""
DrainPlaces: TypeAlias = "str | Sequence[Sequence[float]]"
"""Places of drain holes."""

COARSEST, FINEST = 8, 16384
"""Limits of the voxels along the longest side."""

TOLERANCE = 0.25
"""Maximum tolerance of simplification, relative to the longest side."""

DUST = 1e-5
"""Default maximum volume of dust, relative to the whole object: crumbs at the rim of a fractal of finite
depth. No strut is built to dust either.
"""

JOINING = 3
"""Diameter of struts and minimum thickness of walls that join bodies at any position in the grid, voxels."""

PIECES = 0.05
"""Minimum fraction of the material in bodies thinner than a voxel for a note on thin walls."""

PIXEL = 0.05
"""Default width and height of a pixel, mm."""

SECTIONS = 1, 2, 4, 8
"""Numbers of sections of a layer."""

UP: Triple = (0.0, 0.0, 1.0)
SAME: Triple = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Part(Record):
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
        validate(self, self.fail)
        self.validate()

    def validate(self) -> None:
        """Raise `SceneError` for values that are invalid in combination."""

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
class Print(Part):
    """Changes that make the object printable, applied in this order.

    Lengths are those of the finished object, in mm. The size of the solid is measured on the connected
    components that are kept, before anything is cut off or added.
    """

    element = "print"
    cavities: Literal["keep", "fill"] = attribute(
        Choice, "keep", "sealed cavities stay or are filled", ("keep", "fill")
    )
    keep: int | Literal["all", "largest"] = attribute(
        Count,
        "all",
        "all bodies stay, or the largest, or this number of the largest",
        1,
        1_000_000,
        ("all", "largest"),
    )
    bridge: Given[AnyLength, float] = attribute(
        Length, 0.0, "loose bodies are joined where they are nearest, by struts this thick", zero=True
    )
    gap: Given[AnyLength, float] = attribute(Length, 0.0, "gaps up to this width are closed", zero=True)
    thickness: Given[AnyLength, float] = attribute(
        Length, 0.0, "thinner walls are thickened to this", zero=True
    )
    hollow: Given[AnyLength, float] = attribute(
        Length, 0.0, "the object is hollowed out, leaving walls this thick", zero=True
    )
    drain: Given[AnyLength, float] = attribute(
        Length, 3.0, "diameter of the holes that let the resin out of the hollow", zero=True
    )
    drain_at: Given[DrainPlaces, Literal["auto"] | tuple[tuple[float, ...], ...]] = attribute(
        Holes,
        (),
        "holes at places, mm, or where resin or air cannot get out (auto); by default two for each hollow",
    )
    base: Given[AnyLength, float] = attribute(
        Length, 0.0, "height that is cut off at the bottom, to stand flat", zero=True
    )
    raft: Given[AnyLength, float] = attribute(
        Length, 0.0, "the object stands on a plate of this height", zero=True
    )
    supports: Literal["none", "light", "medium", "heavy"] = attribute(
        Choice,
        "none",
        "the object is lifted, and pillars with tips that break off carry its islands and overhangs",
        ("none", "light", "medium", "heavy"),
    )

    def validate(self) -> None:
        """Raise `SceneError` for `keep` combined with `bridge`."""
        if self.bodies == 1 and self.bridge:
            raise self.fail("keep and bridge: expected one of them; where one body stays, none is loose")

    @property
    def bodies(self) -> int | None:
        """Number of bodies that stay at most, the largest ones; None for all."""
        if isinstance(self.keep, int):
            return self.keep
        return 1 if self.keep == "largest" else None

    @property
    def sorts(self) -> bool:
        """True if connected components or cavities may be removed."""
        return self.bodies is not None or self.cavities == "fill"

    @property
    def whole(self) -> bool:
        """True if connected components and cavities are only kept or removed as a whole."""
        made = self.bridge, self.gap, self.thickness, self.hollow, self.base, self.raft, self.drain_at
        return self.supports == "none" and not any(made)


@record
class Placed(Record):
    """Size and orientation of the object in a print."""

    size: Given[AnyLength | None, float | None] = attribute(
        Length,
        None,
        "the longest side, such as 80mm, 8cm or 3.1in; by default the scene's, or a millimetre for each "
        "unit of a shape",
    )
    up: Given[Sequence[float], Triple] = attribute(
        Vector, UP, "the object's direction that is up in the print", nonzero=True
    )
    scale: Given[AnyScale, Triple] = attribute(
        Percent, SAME, "compensation of shrinkage: 102%, or 102%,102%,101% along x, y and z"
    )


@record
class MeshJob(Placed):
    """Parameters of a mesh.

    Lengths are numbers in mm, or text with a unit, for example "0.5mm"; the fields hold mm.

    Raises
    ------
    SceneError
        For invalid values.
    """

    voxel: Given[AnyLength | None, float | None] = attribute(Length, None, "size of a voxel, such as 0.25mm")
    resolution: float | None = attribute(
        Number,
        None,
        "voxels along the longest side, instead of a voxel; by default 256",
        least=COARSEST,
        most=FINEST,
    )
    chord: Given[AnyLength | None, float | None] = attribute(
        Length, None, "triangles farther than this from a smooth surface are split, such as 0.001mm"
    )
    simplify: Given[AnyLength | None, float | None] = attribute(
        Length, None, "triangles are removed within this tolerance, such as 0.02mm"
    )
    faces: int | None = attribute(
        Count,
        None,
        "triangles are removed until this many are left, within the smallest tolerance for that",
        least=4,
        most=1 << 31,
    )
    dust: float | None = attribute(
        Number,
        None,
        "bodies of less volume are dropped; by default below 1e-5 of the whole, and at least half a voxel",
        least=0,
        unit="mm3",
    )
    colour: Colour | None = attribute(
        Choice,
        None,
        "colours and scalars of the vertices of a .ply, .glb or .3mf file: those of the materials, or a "
        "property of the orbit",
        get_args(Colour),
    )
    palette: str | Sequence[str] | None = attribute(
        Colours,
        None,
        "palette that a property of the orbit is shown in, by name or as its colours; viridis by default",
        words=get_args(Palette),
    )
    filaments: int | str | Sequence[str] | None = attribute(
        Colours,
        None,
        "filaments that a coloured mesh is printed with: how many, or their colours; in .3mf files, "
        "triangles are painted for slicers",
        most=MOST_FILAMENTS,
        counted=True,
    )
    bodies: bool = attribute(
        Flag, False, "in place of painted triangles, an .3mf file has a body for each filament"
    )
    heights: Given[AnyLength | Sequence[AnyLength | None] | None, tuple[float, float | None] | None] = (
        attribute(
            Heights,
            None,
            "heights of layers for slicers in an .3mf file, such as 0.1mm..0.3mm: thick where the surface is "
            "steep",
        )
    )
    paint_supports: bool = attribute(
        Flag,
        False,
        "in an .3mf file, triangles are painted at which slicers shall put supports: islands, flat overhangs",
    )
    proved: bool = attribute(
        Flag, False, "space is skipped by proofs only, not by the measured bounds of fractals"
    )
    printing: Print | None = described(
        None, "changes that make the object printable; by default those of the scene"
    )

    def __post_init__(self) -> None:
        if self.voxel is not None and self.resolution is not None:
            raise SceneError("voxel and resolution: expected one of them")
        if self.simplify is not None and self.faces is not None:
            raise SceneError("simplify and faces: expected one of them")
        validate(self, SceneError)
        if self.palette is not None and self.colour in (None, "material"):
            raise SceneError("palette: expected a property of the orbit as the colour, such as point")
        if self.filaments is not None and self.colour is None:
            raise SceneError("filaments: expected a colour, too, such as material or point")
        if self.bodies and self.filaments is None:
            raise SceneError("bodies: expected filaments, too, such as 4")
        if self.heights is not None and self.heights[1] is None:
            raise SceneError("heights: expected a range, such as 0.1mm..0.3mm")
        if self.paint_supports and self.colour is not None and self.filaments is None:
            raise SceneError("paint_supports and a colour: expected filaments, too")
        if self.paint_supports and self.bodies:
            raise SceneError("paint_supports and bodies: expected one of them")

    def edits(self, scene: Scene) -> Print:
        """Changes for printing.

        Parameters
        ----------
        scene : Scene
            Scene to mesh.

        Returns
        -------
        Print
            Those of the job, or else of the scene.
        """
        return scene.printing if self.printing is None else self.printing

    def dust_limit(self, volume: float, crumb: float = 0.0) -> float:
        """Volume below which a body is removed.

        Parameters
        ----------
        volume : float
            Volume of the object, mm3.
        crumb : float, optional
            Volume of the largest crumb, which is dust by default, mm3.

        Returns
        -------
        float
            Limit, mm3.

        Raises
        ------
        SceneError
            If the limit exceeds the volume of the object.
        """
        dust = max(DUST * volume, crumb) if self.dust is None else self.dust
        if dust > volume:
            most = significant(volume)
            raise SceneError(
                f"dust {significant(dust)} mm3: expected at most the object's volume, {most} mm3"
            )
        return dust

    def voxels(self, size: float) -> float:
        """Voxels along the longest side.

        Parameters
        ----------
        size : float
            Longest side, mm.

        Returns
        -------
        float
            Voxels.

        Raises
        ------
        SceneError
            If the voxel is too coarse or too fine for the size, or the tolerance of simplification too large.
        """
        if self.simplify is not None and self.simplify > (most := TOLERANCE * size):
            raise SceneError(
                f"simplify {self.simplify:g}mm: expected at most {most:.4g}mm for an object of {size:g}mm"
            )
        if self.voxel is None:
            return RESOLUTION if self.resolution is None else self.resolution
        if not COARSEST <= size / self.voxel <= FINEST:
            low, high = size / FINEST, size / COARSEST
            raise SceneError(
                f"voxel {self.voxel:g}mm: expected {low:.4g}mm to {high:.4g}mm for an object of {size:g}mm"
            )
        return size / self.voxel


@record
class PartsJob(Record):
    """Parameters of an object in parts.

    Raises
    ------
    SceneError
        For invalid values.
    """

    bed: Given[Sequence[AnyLength] | str | None, Triple | None] = attribute(
        Sides, None, "make parts that fit a printer of this size, such as 220x220x250mm"
    )
    parts: Given[Sequence[int] | str | None, tuple[int, int, int] | str | None] = attribute(
        Pixels,
        None,
        "parts along x, y and z, or auto: as few as fit the bed",
        sign="x",
        names=("parts along x", "y", "z"),
        example="2x1x1",
        letters="auto|NxNxN",
        least=1,
        most=64,
        words=("auto",),
    )
    clearance: Given[AnyLength, float] = attribute(
        Length, 0.15, "gap around the pegs that join parts, and around plugs", zero=True
    )
    plugs: bool = attribute(Flag, False, "makes a plug for each drain hole, too")
    support_body: bool = attribute(
        Flag, False, "supports are a body of their own in an .3mf file, or a file of their own"
    )

    def __post_init__(self) -> None:
        validate(self, SceneError)
        if self.parts == "auto" and self.bed is None:
            raise SceneError("parts auto: expected a bed, too, such as 220x220x250mm")
        if self.plugs and (self.parts or self.bed):
            raise SceneError("plugs and parts: expected one of them")
        if self.support_body and (self.plugs or self.parts or self.bed):
            raise SceneError("support_body and plugs or parts: expected one of them")

    def side(self, axis: int) -> float:
        """Longest part along an axis, mm.

        Parameters
        ----------
        axis : int
            0 to 2.

        Returns
        -------
        float
            Side of the bed, or infinity.
        """
        return math.inf if self.bed is None else self.bed[axis]


@record
class RasterOptions(Record):
    """What a printer's screen shows of a layer."""

    printer: Printer | None = described(
        None, "the printer whose screen is shown; None shows the object alone"
    )
    compensation: Given[AnyLength, float] = attribute(
        Shift, 0.0, "all outlines move outwards by this, or inwards if it is negative; at most 1mm"
    )
    elephant_foot: Given[AnyLength, float] = attribute(
        Length,
        0.0,
        "outlines of the bottom layers move inwards by this, those of transition layers by less; at most 1mm",
        zero=True,
    )
    gamma: float = attribute(Number, 1.0, "gamma of grey levels", above=0, most=10)
    mirror: bool | None = described(None, "mirrors along x; None as the printer needs it")
    levels: int = attribute(
        Count, 255, "anti-aliasing: grey levels above black, 1 for black and white", least=1, most=255
    )
    blur: int = attribute(Count, 0, "radius of the blur of outlines, in pixels", least=0, most=16)

    def __post_init__(self) -> None:
        validate(self, SliceError)
        for name, length in (("compensation", self.compensation), ("elephant_foot", self.elephant_foot)):
            if not abs(length) <= 1:
                raise SliceError(f"{name} {length:g} mm: expected at most 1 mm")


@record
class SliceJob(Placed, RasterOptions):
    """Parameters of the layers of a print.

    Lengths are numbers of mm, or text such as "0.05mm"; the attributes hold mm.

    Raises
    ------
    SceneError, SliceError
        For an invalid value.
    """

    layer: Given[AnyLength | Sequence[AnyLength | None], tuple[float, float | None]] = attribute(
        Heights,
        (0.05, None),
        "height of a layer; or a range, 0.05mm..0.2mm: thick where the surface is steep",
    )
    pixel: Given[AnyLength | Sequence[AnyLength] | None, tuple[float, float] | None] = attribute(
        Pair, None, "size of a pixel, or its width and height; by default the printer's, or 0.05mm"
    )
    sections: int = attribute(
        Listed,
        1,
        "sections per layer, for grey from z: the share of the layer's height that is inside",
        SECTIONS,
    )
    printing: Print = described(Print(), "changes that make the object printable")

    def __post_init__(self) -> None:
        if self.pixel is not None and self.printer is not None:
            raise SliceError("pixel and printer: expected one of them")
        validate(self, SceneError)
        super().__post_init__()

    @property
    def pixels(self) -> tuple[float, float]:
        """Width and height of a pixel, mm."""
        return self.pixel or (self.printer.pixel if self.printer else (PIXEL, PIXEL))


@record
class RenderJob(Record):
    """Parameters of a picture.

    Raises
    ------
    RenderError
        For an invalid value.
    """

    size: Given[Sequence[int] | str | None, tuple[int, int] | None] = of_kind(
        picture_size(None, "pixels across and down; by default the scene's")
    )
    samples: int | None = attribute(
        Count, None, "maximum number of samples per pixel; by default the scene's", least=1, most=1_000_000
    )
    crop: Given[Sequence[int] | str | None, tuple[int, int, int, int] | None] = attribute(
        Pixels,
        None,
        "only this part: left, top, width and height in pixels. Its pixels are those of the whole picture, "
        "except in modes depth, distance and position, which show the range of the part",
    )
    seed: int = attribute(Count, 0, "seed of the random samples", least=0, most=2**31 - 1)
    time: Given[float | str | None, float | None] = attribute(
        Duration, None, "time after which rendering stops, denoising included, such as 10s, 2min or 1h"
    )
    denoise: bool = attribute(Flag, False, "removes the noise that is left")
    layers: bool = attribute(Flag, False, "adds depth, normal, position, albedo and samples to an .exr file")
    bits: int = attribute(Listed, 8, "bits per channel of a .png file", (8, 16))

    def __post_init__(self) -> None:
        validate(self, RenderError)

    def film(self, view: View) -> tuple[int, int]:
        """Pixels across and down of a picture of a view.

        Parameters
        ----------
        view : View
            View of the scene.

        Returns
        -------
        tuple of int
            Those of the job, or else of the view's film.
        """
        return self.size or (view.film.width, view.film.height)

    def most(self, view: View) -> int:
        """Maximum number of samples per pixel of a picture of a view.

        Parameters
        ----------
        view : View
            View of the scene.

        Returns
        -------
        int
            That of the job, or else of the view's film.
        """
        return self.samples or view.film.samples
