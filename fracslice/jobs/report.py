"""Report and result of a mesh job: placement in print space, times, figures."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import quantile
from ..common.messages import format_count
from ..errors import TooLargeError
from ..mesh import Mesh
from ..work import Work

if TYPE_CHECKING:
    from ..fields.field import Field
    from ..mesh.checks import MeshReport
    from ..mesh.model import Removed
    from ..mesh.refine import Refined
    from ..mesh.simplify import Simplified
    from ..volume import Bricks, Plan
    from ..volume.amount import Amount


@dataclass(frozen=True)
class SurfaceError:
    """Distances of the mesh's vertices from the true surface."""

    mean: float  # mean, 99th percentile and maximum, mm
    p99: float
    max: float

    @classmethod
    def of(cls, mm: NDArray[np.float64]) -> SurfaceError:
        """Summarise distances.

        `mm`: distances, mm.
        """
        return cls(float(mm.mean()), quantile(mm, 0.99), float(mm.max()))


@dataclass(frozen=True)
class SurfaceToMesh:
    """Distances from points on the true surface, located without the mesh, to the mesh."""

    mean: float  # mean and maximum, mm
    max: float
    points: int  # number of points

    @classmethod
    def of(cls, mm: NDArray[np.float64]) -> SurfaceToMesh:
        """Summarise distances.

        `mm`: distances, mm.
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
    loose_bodies : int
        Bodies that do not stand on the plate; those that do are parts.
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
    loose_bodies: int = 0
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


@dataclass(frozen=True)
class Placement:
    """Map from the scene to print space: ``mm = scale * scene units + offset``."""

    scale: float  # mm per scene unit
    offset: tuple[float, float, float]  # translation, mm

    def mm(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points from the scene to print space.

        `points`: float64 (n, 3), scene units. Returns float64 (n, 3), mm.
        """
        placed: NDArray[np.float64] = points * self.scale + np.array(self.offset)
        return placed

    def units(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points from print space to the scene.

        `points`: float64 (n, 3), mm. Returns float64 (n, 3), scene units.
        """
        axes = np.ascontiguousarray(points.T)  # three long rows: NumPy is slow on many short ones
        scene: NDArray[np.float64] = ((axes - np.array(self.offset)[:, None]) / self.scale).T
        return scene


SHOWN = np.array([(239, 227, 208), (60, 130, 200)], np.uint8)
"""Colours of an object and of its supports."""


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Result(Mesh):
    """A mesh in mm, standing on z = 0, quantised to float32, with its report.

    A mesh larger than memory is only in the file that was written; its vertices raise `TooLargeError`.

    Attributes
    ----------
    report : Report
        Settings, accuracy, problems, run time and memory of the job.
    place : Placement
        Map from the scene to the mesh.
    planned : Plan
        The field that was sampled.
    whole : Mesh or None
        The mesh without its report; None if it is only in the file.
    work : Work
        Threads, progress and cancellation of the job.
    """

    report: Report  # type: ignore[misc]
    place: Placement  # type: ignore[misc]
    planned: Plan  # type: ignore[misc]
    whole: Mesh | None  # type: ignore[misc]
    work: Work  # type: ignore[misc]

    def __init__(
        self, report: Report, place: Placement, planned: Plan, whole: Mesh | None, work: Work | None = None
    ) -> None:
        values = {
            "report": report,
            "place": place,
            "planned": planned,
            "whole": whole,
            "work": work or Work(),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy all but the threads and callbacks of the job."""
        return Result, (self.report, self.place, self.planned, self.whole)

    def __repr__(self) -> str:
        if self.whole is not None:
            return super().__repr__()
        made = self.report.mesh
        vertices = format_count(made.vertices, "vertex", "vertices")
        return f"<Result of {format_count(made.triangles, 'triangle')}, {vertices}, only in its file>"

    def _repr_png_(self) -> bytes | None:
        return None if self.whole is None else super()._repr_png_()

    @property
    def mesh(self) -> Mesh:
        """The mesh without its report."""
        if self.whole is None:
            raise TooLargeError("the mesh does not fit in memory; it is in the file that was written")
        return self.whole

    @property
    def shown(self) -> Mesh:
        """The mesh as it is drawn: supports have another colour than an object without colours."""
        mesh, supports = self.mesh, self.planned.supports
        if supports is None or mesh.colours is not None:
            return mesh
        away = supports.distances(self.place.units(mesh.vertices))
        return replace(mesh, colours=SHOWN[(away < self.planned.voxel / 8).astype(int)])

    @property  # type: ignore[misc]
    def vertices(self) -> NDArray[np.float64]:
        """Vertices, float64 [n, 3], mm."""
        return self.mesh.vertices

    @property  # type: ignore[misc]
    def colours(self) -> NDArray[np.uint8] | None:
        """Colours of the vertices, sRGB, uint8 [n, 3]; None without `colour`."""
        return self.mesh.colours

    @property  # type: ignore[misc]
    def scalars(self) -> Mapping[str, NDArray[np.float32]]:
        """Named numbers of the vertices, float32 [n]."""
        return self.mesh.scalars

    @property  # type: ignore[misc]
    def triangles(self) -> NDArray[np.int32]:
        """Triangles, int32 [m, 3], counter-clockwise seen from outside."""
        return self.mesh.triangles

    @property
    def root(self) -> Field:
        """The field that was meshed."""
        return self.planned.root

    @cached_property
    def bricks(self) -> Bricks:
        """Samples of the field near the surface, in scene units, read-only; computed on first access."""
        from ..volume import sample_scene

        bricks = sample_scene(self.planned, self.work)
        for array in (bricks.ijk, bricks.values, bricks.index):
            array.flags.writeable = False
        return bricks

    @property
    def bricks_mm(self) -> Bricks:
        """Samples in print space: positions and values in mm."""
        scale, (x, y, z) = self.place.scale, self.bricks.origin
        dx, dy, dz = self.place.offset
        return replace(
            self.bricks,
            origin=(scale * x + dx, scale * y + dy, scale * z + dz),
            voxel=scale * self.bricks.voxel,
            values=self.bricks.values * np.float32(scale),
        )


@dataclass(frozen=True)
class Clock:
    """Stage timer of a job: reports progress, checks for cancellation between stages and measures time."""

    work: Work  # execution settings
    # wall-clock time per stage, and "total", in seconds. Stages may overlap
    seconds: dict[str, float] = field(default_factory=lambda: {"total": 0.0})
    begun: float = field(default_factory=time.perf_counter)  # time of the start, s

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Time a stage; a repeated stage adds up."""
        self.work.check()
        self.work.progress(stage, 0.0)
        started = time.perf_counter()
        yield
        ended = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + ended - started
        self.seconds["total"] = ended - self.begun
        self.work.progress(stage, 1.0)
