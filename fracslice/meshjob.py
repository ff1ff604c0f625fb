"""What to make of a scene as a mesh."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import SceneError
from .formulas.parameters import Number, validate
from .scene import Print, Scene
from .scene.lengths import Length

RESOLUTION = 256.0
COARSEST, FINEST = 8, 16384
"""Voxels along the longest side."""

DUST = 1e-5
"""The share of the whole below which a body is dust, as it comes off the rim of a fractal of finite depth."""


@dataclass(frozen=True)
class MeshJob:
    """What to make of a scene. Lengths are numbers of mm, or text such as "0.5mm"; the fields hold mm.

    size_mm: the longest side, if not what the scene says. voxel_mm or resolution (voxels along the longest
    side): how fine; 256 along the longest side if neither is given. dust_mm3: bodies with less material are
    dropped; if not given, those under 1e-5 of the whole. printing: what makes it printable, if not what the
    scene says. chord_mm: more triangles where a smooth surface is farther than this from them. simplify_mm:
    fewer triangles, nowhere farther than this from all of them. Raises `SceneError` for values that cannot
    be.
    """

    size_mm: float | None = None
    voxel_mm: float | None = None
    resolution: float | None = None
    dust_mm3: float | None = None
    printing: Print | None = None
    chord_mm: float | None = None
    simplify_mm: float | None = None

    def __post_init__(self) -> None:
        if self.voxel_mm is not None and self.resolution is not None:
            raise SceneError("voxel and resolution: expected one of them")
        validate(self, _KINDS, SceneError)

    def size(self, scene: Scene) -> float:
        """The longest side in mm."""
        return scene.size_mm if self.size_mm is None else self.size_mm

    def how(self, scene: Scene) -> Print:
        """What makes it printable."""
        return scene.printing if self.printing is None else self.printing

    def dust(self, volume: float) -> float:
        """The volume below which a body of an object of `volume` is dropped, mm3."""
        dust = DUST * volume if self.dust_mm3 is None else self.dust_mm3
        if dust > volume:
            raise SceneError(f"dust {dust:.4g}mm3: expected at most the object's volume, {volume:.4g}mm3")
        return dust

    def voxels(self, scene: Scene) -> float:
        """Voxels along the longest side."""
        if self.voxel_mm is None:
            return RESOLUTION if self.resolution is None else self.resolution
        size = self.size(scene)
        if not COARSEST <= size / self.voxel_mm <= FINEST:
            low, high = size / FINEST, size / COARSEST
            raise SceneError(
                f"voxel {self.voxel_mm:g}mm: expected {low:.4g}mm to {high:.4g}mm for an object of {size:g}mm"
            )
        return size / self.voxel_mm


_KINDS = {
    **dict.fromkeys(("size_mm", "voxel_mm", "chord_mm", "simplify_mm"), Length(None, "a length")),
    "resolution": Number(None, "voxels along the longest side", least=COARSEST, most=FINEST),
    "dust_mm3": Number(None, "a volume", least=0),
}
