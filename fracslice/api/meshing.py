"""Meshing of shapes and scenes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Unpack

from ..jobs.mesh import make_mesh as make_mesh_job
from ..jobs.report import Result
from ..records import MeshJob
from ..scene import Print
from ..work import Work
from .options import MeshKeywords, Source, as_scene, job_of, keywords, work_of


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
    return make_mesh_job(scene, job_of(given, edited, options), work_of(options, work), path)
