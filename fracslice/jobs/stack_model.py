"""Mesh and pictures of the object of a slice job, for files that contain them beside its layers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from ..formulas import Node
from ..meshjob import COARSEST, RESOLUTION, MeshJob
from ..scene import Scene
from ..scene.view import Film, View
from ..slicing import SliceJob
from ..volume.sizing import oriented
from ..work import Work

if TYPE_CHECKING:
    from ..mesh import Mesh

SIZE, SAMPLES = (400, 240), 4
"""Width and height of pictures, half of the largest preview of a format, and samples per pixel. One of full
size with two samples takes two and a half times as long, and has more noise.
"""


@dataclass(frozen=True)
class StackModel:
    """The object of a slice job.

    Attributes
    ----------
    scene : Scene
        The scene.
    job : SliceJob
        The slice job.
    work : Work
        Threads, progress and cancellation.
    """

    scene: Scene
    job: SliceJob
    work: Work

    @cached_property
    def _upright(self) -> Node:
        return cast(Node, oriented(self.scene.root, self.job.up, work=self.work))

    def mesh(self) -> Mesh:
        """Mesh of the object, simplified to the printer's resolution.

        Returns
        -------
        Mesh
            mm, standing on z = 0, centred. The voxel is a pixel, but at least 1/256 of the longest side; the
            mesh is simplified within a quarter of a pixel.
        """
        from .mesh import make_mesh  # of 3MF files only

        job = self.job
        longest = job.sizing.longest
        voxel = max(*job.pixel, longest / RESOLUTION)
        what = MeshJob(
            voxel_mm=min(voxel, longest / COARSEST),
            printing=job.printing,
            simplify_mm=min(job.pixel) / 4,
            up=job.up,
            scale=job.scale,
        )
        scene = replace(self.scene, size_mm=None if job.unit else job.size, unit_mm=job.unit)
        return make_mesh(scene, what, self.work).mesh

    def picture(self) -> NDArray[np.uint8]:
        """Render the scene as it stands on the printer, without its print preparation.

        Returns
        -------
        uint8 [height, width, 3]
            sRGB, half as large as the largest preview of a format.
        """
        from ..rendering import Renderer  # of printers' files only, while other threads slice

        width, height = SIZE
        film = Film(width=width, height=height, samples=SAMPLES)
        renderer = Renderer(self._upright, View(film=film), work=self.work, device="cpu")
        *_, last = renderer.passes(SAMPLES)
        return np.asarray(last.shown)
