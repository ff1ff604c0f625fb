"""What a job tells about its result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .mesh.check import MeshReport
    from .mesh.components import Removed
    from .mesh.refine import Refined
    from .mesh.simplify import Simplified


@dataclass(frozen=True)
class SurfaceError:
    """How far the mesh's vertices are from the true surface, in mm."""

    mean: float
    p99: float
    max: float

    @classmethod
    def of(cls, mm: NDArray[np.float64]) -> SurfaceError:
        """Of the distances that were measured."""
        return cls(float(mm.mean()), float(np.quantile(mm, 0.99)), float(mm.max()))


@dataclass(frozen=True)
class SurfaceToMesh:
    """How far points of the true surface, found without the mesh, are from the mesh, in mm."""

    mean: float
    max: float
    points: int

    @classmethod
    def of(cls, mm: NDArray[np.float64]) -> SurfaceToMesh:
        """Of the distances that were measured."""
        return cls(float(mm.mean()), float(mm.max()), len(mm))


@dataclass(frozen=True)
class Amount:
    """The volume of the object itself, by its field at random points, its standard error, and the volume that
    was made of it, bodies that were dropped included: mm3. off: what was made more, or, negative, less, as a
    share; 0 where that is not sure, or less than a hundredth.
    """

    object: float
    error: float
    made: float
    off: float


@dataclass(frozen=True)
class Report:
    """What was made, how good it is and what it took. seconds: of each stage, and in total. amount_mm3:
    whether that is all of it. notes: what the voxel was too large for, in words. depths: automatic ones.
    """

    scene: str
    scene_hash: str
    version: str
    size_mm: float
    voxel_mm: float
    mesh: MeshReport
    removed: Removed
    surface_error_mm: SurfaceError
    surface_to_mesh_mm: SurfaceToMesh
    evaluations: int
    bricks: int
    seconds: Mapping[str, float]
    peak_rss_mb: float
    amount_mm3: Amount | None = None
    refined: Refined | None = None
    simplified: Simplified | None = None
    notes: tuple[str, ...] = ()
    depths: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "seconds", MappingProxyType(dict(self.seconds)))

    @property
    def problems(self) -> tuple[str, ...]:
        """Why the mesh would not print as it is; empty if it would."""
        return self.mesh.problems

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON, the mesh's numbers beside the others."""
        own = {f.name: _plain(getattr(self, f.name)) for f in fields(self) if f.name != "mesh"}
        return {**own, **self.mesh.as_dict()}


def _plain(value: Any) -> Any:
    """A record or a mapping as a dictionary."""
    if isinstance(value, Mapping):
        return dict(value)
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value


def version() -> str:
    """The installed version of fracslice."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed

    try:
        return installed("fracslice")
    except PackageNotFoundError:
        return "not installed"
