"""Parameters of a mesh job."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .common.messages import significant
from .errors import SceneError
from .formulas.material import TRAPS
from .formulas.parameters import Choice, Number, Vector, attribute, validate
from .scene import Print, Scene
from .scene.lengths import AnyLength, AnyScale, Length, Percent

RESOLUTION = 256.0
"""Default number of voxels along the longest side, and the detail that automatic depths resolve."""

COLOURS = ("material", *TRAPS)
"""What the colours of vertices show."""

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


@dataclass(frozen=True)
class MeshJob:
    """Parameters of a mesh.

    Lengths are numbers in mm, or text with a unit, for example "0.5mm"; the fields hold mm.

    Attributes
    ----------
    size_mm : float, optional
        Longest side; by default that of the scene.
    voxel_mm : float, optional
        Voxel; excludes `resolution`.
    resolution : float, optional
        Voxels along the longest side; 256 by default.
    dust_mm3 : float, optional
        Bodies of less material are removed, mm3; by default those below 1e-5 of the whole.
    printing : Print, optional
        Changes that make the object printable; by default those of the scene.
    chord_mm : float, optional
        Refine smooth surfaces until no triangle is farther from them than this.
    simplify_mm : float, optional
        Simplify the mesh within this tolerance.
    up : tuple of float
        Direction of the scene that is up in the print.
    scale : tuple of float
        Compensation of shrinkage along x, y and z; one factor or percentage for all, or three.
    colour : str, optional
        Colours and scalars of the vertices: "material" for the materials of the scene, or a property of the
        orbit: "point", "axes", "planes", "sphere", "steps" or "direction".
    proved : bool
        Skip no space by a measured bound, only by a proof.

    Raises
    ------
    SceneError
        For invalid values.
    """

    size_mm: float | None = attribute(Length, None, "a length")
    voxel_mm: float | None = attribute(Length, None, "a length")
    resolution: float | None = attribute(
        Number, None, "voxels along the longest side", least=COARSEST, most=FINEST
    )
    dust_mm3: float | None = attribute(Number, None, "a volume", least=0)
    printing: Print | None = None
    chord_mm: float | None = attribute(Length, None, "a length")
    simplify_mm: float | None = attribute(Length, None, "a length")
    up: tuple[float, float, float] = attribute(Vector, (0.0, 0.0, 1.0), "a direction", nonzero=True)
    scale: tuple[float, float, float] = attribute(Percent, (1.0, 1.0, 1.0), "compensation of shrinkage")
    colour: str | None = attribute(Choice, None, "colours of vertices", COLOURS)
    proved: bool = False

    if TYPE_CHECKING:  # what it takes is more than what it holds

        def __init__(
            self,
            size_mm: AnyLength | None = None,
            voxel_mm: AnyLength | None = None,
            resolution: float | None = None,
            dust_mm3: float | None = None,
            printing: Print | None = None,
            chord_mm: AnyLength | None = None,
            simplify_mm: AnyLength | None = None,
            up: Sequence[float] = (0.0, 0.0, 1.0),
            scale: AnyScale = 1.0,
            colour: str | None = None,
            proved: bool = False,
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.voxel_mm is not None and self.resolution is not None:
            raise SceneError("voxel and resolution: expected one of them")
        validate(self, SceneError)

    def how(self, scene: Scene) -> Print:
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

    def dust(self, volume: float, crumb: float = 0.0) -> float:
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
        dust = max(DUST * volume, crumb) if self.dust_mm3 is None else self.dust_mm3
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
        if self.simplify_mm is not None and self.simplify_mm > (most := TOLERANCE * size):
            raise SceneError(
                f"simplify {self.simplify_mm:g}mm: expected at most {most:.4g}mm for an object of {size:g}mm"
            )
        if self.voxel_mm is None:
            return RESOLUTION if self.resolution is None else self.resolution
        if not COARSEST <= size / self.voxel_mm <= FINEST:
            low, high = size / FINEST, size / COARSEST
            raise SceneError(
                f"voxel {self.voxel_mm:g}mm: expected {low:.4g}mm to {high:.4g}mm for an object of {size:g}mm"
            )
        return size / self.voxel_mm
