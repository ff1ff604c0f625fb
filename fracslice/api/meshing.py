"""Signed distances and meshes of shapes and scenes."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.parameters import AUTO
from ..errors import SceneError
from ..formulas import Node
from ..jobs.mesh import make_mesh as make_mesh_job
from ..jobs.report import Result
from ..records import MeshJob
from ..scene import Print
from ..volume import with_depths
from ..work import Work, chunks
from .options import MeshKeywords, Source, as_scene, job_of, keywords, work_of


def distance(shape: Node, points: ArrayLike) -> NDArray[np.floating]:
    """See `Node.distance`."""
    array = _points(points)
    kernel = _with_depths(shape).kernel("cpu", "float32" if array.dtype == np.float32 else "float64")
    flat, values = array.reshape(-1, 3), np.empty(array.size // 3, array.dtype)

    def evaluate(part: slice) -> None:
        values[part] = kernel.points(*flat[part].T)

    Work().map(evaluate, chunks(len(flat), kernel.batch))
    return values.reshape(array.shape[:-1])


def _points(points: ArrayLike) -> NDArray[np.floating]:
    """Points as an array of float32 or float64, [..., 3]. Raises `SceneError` for any other shape or type."""
    try:
        array = np.asarray(points)
        array = array if array.dtype == np.float32 else array.astype(np.float64, casting="same_kind")
    except (TypeError, ValueError):
        raise SceneError("points: expected numbers, an array [..., 3]") from None
    if array.ndim == 0 or array.shape[-1] != 3:
        raise SceneError(f"points: expected an array [..., 3], found one of shape {list(array.shape)}")
    return array


@lru_cache(maxsize=32)
def _with_depths(shape: Node) -> Node:
    """The shape with automatic iterations replaced by numbers. Raises `SceneError` if it is unbounded."""
    known = with_depths(shape)
    for node in known.solids():
        if AUTO in (value for value in node.values.values() if isinstance(value, str)):
            raise node.fail("iterations: expected a number where the shape has no end")
    return known


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
