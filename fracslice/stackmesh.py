"""Mesh of the object of a slice job, for files that contain both."""

from __future__ import annotations

from dataclasses import replace

from .job import make_mesh
from .mesh import Mesh
from .meshjob import COARSEST, RESOLUTION, MeshJob
from .scene import Scene
from .slicing import SliceJob
from .slicing.stack import turned
from .work import Work


def stack_mesh(scene: Scene, job: SliceJob, work: Work) -> Mesh:
    """Mesh of the object that a slice job makes, simplified to the printer's resolution.

    Parameters
    ----------
    scene : Scene
        The scene.
    job : SliceJob
        The slice job.
    work : Work
        Threads, progress and cancellation.

    Returns
    -------
    Mesh
        mm, standing on z = 0, centred. The voxel is a pixel, but at least 1/256 of the longest side; the mesh
        is simplified within a quarter of a pixel.
    """
    root = turned(scene.root, job.up, work).tree
    assert root is not None  # as that of a scene
    upright = replace(scene, root=root)
    voxel = max(*job.pixel, job.size / RESOLUTION)
    what = MeshJob(
        size_mm=job.size,
        voxel_mm=min(voxel, job.size / COARSEST),
        printing=job.printing,
        simplify_mm=min(job.pixel) / 4,
    )
    return make_mesh(upright, what, work).mesh
