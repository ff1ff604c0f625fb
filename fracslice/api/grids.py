"""Shapes and scenes as OpenVDB files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from ..common.files import check_target
from ..common.parameters import AnyLength, Choice, validate_value
from ..errors import ExportError
from ..records import MeshJob
from ..version import APPLICATION
from ..volume import plan
from ..volume.level_sets import KINDS, save, solid_grid
from ..volume.sizing import sizing
from ..work import Work
from .options import Source, as_scene


def write_vdb(
    shape: Source,
    path: str | os.PathLike[str],
    *,
    kind: Literal["surface", "density"] = "surface",
    half: bool = False,
    size: AnyLength | None = None,
    voxel: AnyLength | None = None,
    resolution: float | None = None,
    metadata: Mapping[str, str] | None = None,
    work: Work | None = None,
) -> Path:
    """Write a shape to an OpenVDB file, as Blender and Houdini read it.

    The grid has the name of its kind, the class that OpenVDB has for it, a transform to mm, and the place of
    the shape itself. The same shape gives the same bytes.

    Parameters
    ----------
    shape : Node, Scene, mesh, str or path
        As for `make_mesh`.
    path : str or path
        The file, with the extension .vdb.
    kind : {"surface", "density"}
        Signed distances within three voxels of the surface, mm, negative inside: a level set. Or densities, 1
        inside, 0 outside and 1/2 at the surface, in the middle of a ramp of six voxels: a fog volume.
    half : bool
        Whether numbers have 16 bits in the file, with an error of up to 1/2048 of them.
    size, voxel : float or str, optional
        Longest side and voxel, mm, or text with a unit.
    resolution : float, optional
        Voxels along the longest side, instead of a voxel; by default 256.
    metadata : mapping of str to str, optional
        Names and texts for the grid.
    work : Work, optional
        Threads, progress, cancellation, store and device.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    SceneError, VolumeError
        For an invalid shape or value, or a shape without a surface.
    ExportError
        For another extension, or a file that cannot be written.
    Cancelled
        When the event of the work is set.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from fracslice import from_vdb, sphere, write_vdb
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write_vdb(sphere(10), pathlib.Path(folder) / "ball.vdb", resolution=64)
    ...     ball = from_vdb(path)
    ...     abs(float(ball.distance([0, 0, 12])) - 2) < 0.02
    True
    """
    validate_value("kind", kind, Choice(None, "", KINDS), ExportError)
    target, work = Path(path), work or Work()
    if target.suffix.lower() != ".vdb":
        raise ExportError(f"{path}: expected the extension .vdb")
    check_target(target)
    scene = as_scene(shape)
    job = MeshJob(size=size, voxel=voxel, resolution=resolution)
    sized = sizing(scene, job.size, work=work)
    planned = plan(scene.root, job.voxels(sized.longest), work)
    grid = solid_grid(planned, sized.scale(planned.box), kind, work)
    grid.half = half
    save(grid, target, {"creator": APPLICATION, **(metadata or {})})
    return target
