"""Report of a mesh job."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..common.quantiles import quantile

if TYPE_CHECKING:
    from ..mesh.components import Removed
    from ..mesh.mesh_report import MeshReport
    from ..mesh.refine import Refined
    from ..mesh.simplify import Simplified
    from .completeness import Amount


@dataclass(frozen=True)
class SurfaceError:
    """Distances of the mesh's vertices from the true surface.

    Attributes
    ----------
    mean, p99, max : float
        Mean, 99th percentile and maximum, mm.
    """

    mean: float
    p99: float
    max: float

    @classmethod
    def of(cls, mm: NDArray[np.float64]) -> SurfaceError:
        """Summarise distances.

        Parameters
        ----------
        mm : ndarray of float64
            Distances, mm.

        Returns
        -------
        SurfaceError
            Summary.
        """
        return cls(float(mm.mean()), quantile(mm, 0.99), float(mm.max()))


@dataclass(frozen=True)
class SurfaceToMesh:
    """Distances from points on the true surface, located without the mesh, to the mesh.

    Attributes
    ----------
    mean, max : float
        Mean and maximum, mm.
    points : int
        Number of points.
    """

    mean: float
    max: float
    points: int

    @classmethod
    def of(cls, mm: NDArray[np.float64]) -> SurfaceToMesh:
        """Summarise distances.

        Parameters
        ----------
        mm : ndarray of float64
            Distances, mm.

        Returns
        -------
        SurfaceToMesh
            Summary.
        """
        return cls(float(mm.mean()), float(mm.max()), len(mm))


@dataclass(frozen=True)
class Report:
    """Report of a mesh job: the mesh, its accuracy and the costs.

    Attributes
    ----------
    scene, scene_hash : str
        Name and hash of the scene.
    version : str
        Version of fracslice.
    size_mm, voxel_mm : float
        Longest side and voxel, mm.
    mesh : MeshReport
        Measures and defects of the mesh.
    removed : Removed
        Removed bodies and cavities.
    surface_error_mm : SurfaceError
        Distances of vertices from the true surface.
    surface_to_mesh_mm : SurfaceToMesh
        Distances from the true surface to the mesh.
    evaluations : int
        Field evaluations for sampling.
    bricks : int
        Bricks of samples.
    seconds : mapping
        Seconds of each stage, and in total.
    peak_rss_mb : float
        Peak memory of the process, MB.
    amount_mm3 : Amount, optional
        Volume of the object against that of the mesh.
    refined : Refined, optional
        Result of the refinement.
    simplified : Simplified, optional
        Result of the simplification.
    notes : tuple of str
        Features that the voxel is too large for.
    depths : tuple of str
        Automatic depths of fractals.
    contact_mm2 : float
        Area on the plate, mm2.
    cavities_mm3 : float
        Volume of sealed cavities, mm3.
    proved : float, optional
        Share of the space without samples whose sign is proved; the rest relies on a measured bound.
    measured : tuple of str
        Formulas by whose measured bound space was skipped.
    lost_mm : tuple of float
        Length along x, y and z by which the mesh is shorter than the object, mm.
    missing_volume_share : float
        Share of the object's volume that the mesh lacks; 0 if that is not significant.
    lost : tuple of str
        What makes the mesh another object: more than 5 % of the volume, or an element, that is missing.
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
    contact_mm2: float = 0.0
    cavities_mm3: float = 0.0
    proved: float | None = None
    measured: tuple[str, ...] = ()
    lost_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    missing_volume_share: float = 0.0
    lost: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "seconds", MappingProxyType(dict(self.seconds)))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the fields, as mapping proxies are not."""
        values = (getattr(self, field.name) for field in fields(self))
        return Report, tuple(dict(value) if isinstance(value, Mapping) else value for value in values)

    def __repr__(self) -> str:
        verdict = f"would not print: {', '.join(self.problems)}" if self.problems else "watertight, manifold"
        return f"<Report of {self.scene}: {self.size_mm:g} mm, voxel {self.voxel_mm:.3g} mm, {verdict}>"

    @property
    def problems(self) -> tuple[str, ...]:
        """Defects that make the mesh unprintable, and what is lost, tuple of str; empty if there are none."""
        return (*self.mesh.problems, *self.lost)

    def as_dict(self) -> dict[str, Any]:
        """Report as plain JSON; the fields of the mesh are merged with the others.

        Returns
        -------
        dict
            All fields.
        """
        own = {f.name: _plain(getattr(self, f.name)) for f in fields(self) if f.name != "mesh"}
        verdict = {"printable": not self.problems, "problems": list(self.problems)}
        return {**own, **self.mesh.as_dict(), **verdict}


def _plain(value: Any) -> Any:
    """Convert a dataclass or mapping to a dictionary."""
    if isinstance(value, Mapping):
        return dict(value)
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value
