"""Meshing of shapes and scenes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from ..common.messages import format_count
from ..jobs.mesh import make_mesh as make_mesh_job
from ..jobs.report import MeshResult
from ..mesh import Mesh
from ..records import MeshJob
from ..scene import Print
from ..work import Work
from .options import MeshKeywords, Source, as_scene, job_of, keywords, work_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..formulas.field import Field
    from ..jobs.report import Placement, Report
    from ..volume import Bricks


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Result(Mesh):
    """A mesh in mm, standing on z = 0, with its report.

    A mesh larger than memory is only in the file that was written; its vertices raise `TooLargeError`.

    Attributes
    ----------
    made : MeshResult
        Result of the mesh job.
    """

    made: MeshResult  # type: ignore[misc]

    def __init__(self, made: MeshResult) -> None:
        object.__setattr__(self, "made", made)

    def __reduce__(self) -> tuple[Any, ...]:
        return Result, (self.made,)

    def __repr__(self) -> str:
        if self.made.whole is not None:
            return super().__repr__()
        made = self.report.mesh
        counts = (
            f"{format_count(made.triangles, 'triangle')}, {format_count(made.vertices, 'vertex', 'vertices')}"
        )
        return f"<Result of {counts}, only in its file>"

    def _repr_png_(self) -> bytes | None:
        return None if self.made.whole is None else super()._repr_png_()

    @property
    def mesh(self) -> Mesh:
        """The mesh without its report."""
        return self.made.mesh

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
    def report(self) -> Report:
        """Settings, accuracy, problems, run time and memory of the mesh job."""
        return self.made.report

    @property
    def root(self) -> Field:
        """The field that was meshed."""
        return self.made.root

    @property
    def place(self) -> Placement:
        """Transform from scene coordinates to mesh coordinates."""
        return self.made.place

    @property
    def bricks(self) -> Bricks:
        """Samples of the field near the surface, in scene units, read-only; computed on first access."""
        bricks = self.made.bricks
        for array in (bricks.ijk, bricks.values, bricks.index):
            array.flags.writeable = False
        return bricks


@keywords(MeshJob, Print)
def make_mesh(
    shape: Source,
    job: MeshJob | None = None,
    work: Work | None = None,
    *,
    path: str | Path | None = None,
    **options: Unpack[MeshKeywords],
) -> Result:
    """Make a printable mesh of a shape.

    Lengths are numbers in mm, or text such as "0.5mm". Keywords set the fields of `MeshJob`, `Print` and
    `Work`, and override those of the records and of the scene.

    Parameters
    ----------
    shape : Node, Scene, str or path
        A shape such as ``sphere(0.5) - box()``, a scene, a scene file, or the name of a shipped scene or a
        formula.
    job : MeshJob, optional
        Settings of the mesh, as a record.
    work : Work, optional
        Threads, progress, cancellation, store and device, as a record.
    path : str or path, optional
        The file to write, in the format of its extension. An .stl file may be larger than memory: the mesh
        is then only in that file, and access to its vertices raises `TooLargeError`.
    {options}
    Returns
    -------
    Result
        The mesh in mm and its `report`. An unprintable mesh is returned, too; its report lists the problems.

    Raises
    ------
    SceneError
        For an invalid shape, name or value.
    VolumeError, MeshError
        For a field without a surface, or too large a job.
    ExportError
        For a file that cannot be written.
    TypeError
        For an unknown keyword.
    Cancelled
        When `cancel` is set.

    Examples
    --------
    >>> from fracslice import box, make_mesh, sphere
    >>> mesh = make_mesh(box((10, 10, 10)) - sphere(6), resolution=32)
    >>> mesh.is_watertight, mesh.size.round(3).tolist()
    (True, [10.0, 10.0, 10.0])
    >>> mesh.report.problems
    ()
    >>> make_mesh("menger-sponge", size="2cm", resolution=27).size.round(3).tolist()
    [20.0, 20.0, 20.0]
    """
    scene = as_scene(shape)
    given = job or MeshJob()
    edited = replace(scene, printing=given.edits(scene))
    return Result(make_mesh_job(scene, job_of(given, edited, options), work_of(options, work), path))
