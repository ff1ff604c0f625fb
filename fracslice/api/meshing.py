"""Meshing of shapes and scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack

from ..common.messages import format_count
from ..jobs.mesh import make_mesh as make_mesh_job
from ..jobs.report import MeshResult
from ..mesh import Mesh
from ..meshjob import MeshJob
from ..scene import parse_length
from ..scene.lengths import AnyLength, AnyScale
from ..work import Work
from .options import Options, Source, as_scene, keywords, print_of, work_of

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


@keywords
def make_mesh(
    shape: Source,
    what: MeshJob | None = None,
    work: Work | None = None,
    *,
    size: AnyLength | None = None,
    up: Sequence[float] | None = None,
    scale: AnyScale | None = None,
    resolution: float | None = None,
    voxel: AnyLength | None = None,
    chord: AnyLength | None = None,
    simplify: AnyLength | None = None,
    dust: float | None = None,
    colour: Literal["material", "point", "axes", "planes", "sphere", "steps", "direction"] | None = None,
    proved: bool | None = None,
    path: str | Path | None = None,
    **options: Unpack[Options],
) -> Result:
    """Make a printable mesh of a shape.

    Lengths are numbers in mm, or text such as "0.5mm". Keywords set the fields of `MeshJob`, `Print` and
    `Work`, and override those of the records and of the scene.

    Parameters
    ----------
    shape : Node, Scene, str or path
        A shape such as ``sphere(0.5) - box()``, a scene, a scene file, or the name of a shipped scene or a
        formula.
    what : MeshJob, optional
        Settings of the mesh, as a record.
    work : Work, optional
        Threads, progress, cancellation, store and device, as a record.
    size : float or str, optional
        Longest side. A scene has its own; for a shape the default is one millimetre per scene unit.
    up : three numbers, optional
        Direction of the shape that is up in the print.
    scale : float, str or three factors, optional
        Compensation of shrinkage: 1.02, "102%", or "102%,102%,101%" along x, y and z.
    resolution : float, optional
        Voxels along the longest side; 256 if neither this nor `voxel` is given.
    voxel : float or str, optional
        Voxel size.
    chord : float or str, optional
        Split triangles farther than this from the surface.
    simplify : float or str, optional
        Remove triangles within this tolerance.
    dust : float, optional
        Drop connected components of less volume, mm3; 1e-5 of the whole by default.
    colour : str, optional
        Colours and scalars of the vertices: those of the scene's materials, or a property of the orbit.
    proved : bool, optional
        Skip no space by a measured bound, only by a proof.
    path : str or path, optional
        The file to write, in the format of its extension. An .stl file may be larger than memory: the mesh
        is then only in that file, and access to its vertices raises `TooLargeError`.
    cavities, keep, bridge, gap, thickness, hollow, drain, base, raft : optional
        Print preparation: the fields of `Print`.
    threads : int, optional
        Number of threads; one for each core by default.
    progress : callable, optional
        Called repeatedly as ``progress(stage, share)`` with the completed share from 0 to 1.
    cancel : threading.Event, optional
        Setting it stops the work with `Cancelled`.
    device : {"cpu", "cuda", "auto"}, optional
        Device that samples the field.

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
    lengths = {"size": size, "voxel": voxel, "chord": chord, "simplify": simplify}
    given: dict[str, Any] = {
        f"{name}_mm": parse_length(value, name) for name, value in lengths.items() if value is not None
    }
    others = {
        "resolution": resolution,
        "dust_mm3": dust,
        "up": up,
        "scale": scale,
        "colour": colour,
        "proved": proved,
    }
    given |= {name: value for name, value in others.items() if value is not None}
    job, how = replace(what or MeshJob(), **given), work_of(options, work)
    scene = as_scene(shape)
    printing = print_of(replace(scene, printing=job.how(scene)), options)
    return Result(make_mesh_job(scene, replace(job, printing=printing), how, path))
