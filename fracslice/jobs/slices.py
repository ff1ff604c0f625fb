"""Slice jobs: the recipe of a run, and its mesh and pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from .. import slicing
from ..export.layer_files import FORMATS
from ..export.layer_tasks import Encode
from ..export.resins import Resin
from ..export.slice_run import EPOCH, SliceRun
from ..formulas import Node
from ..meshjob import COARSEST, RESOLUTION, MeshJob
from ..scene import Scene
from ..scene.reader import reads
from ..scene.view import Film, View
from ..slicing import SliceJob
from ..slicing.printers import Printer
from ..slicing.raster import Screen
from ..volume.sizing import orient_field
from ..work import Work

if TYPE_CHECKING:
    from ..mesh import Mesh

SIZE, SAMPLES = (400, 240), 4
"""Width and height of pictures, half of the largest preview of a format, and samples per pixel. One of full
size with two samples takes two and a half times as long, and has more noise.
"""


@dataclass(frozen=True)
class StackModel:
    """The object of a slice job."""

    scene: Scene  # the scene
    job: SliceJob  # the slice job
    work: Work  # threads, progress and cancellation

    @cached_property
    def _upright(self) -> Node:
        return cast(Node, orient_field(self.scene.root, self.job.up, work=self.work))

    def mesh(self) -> Mesh:
        """Mesh of the object, simplified to the printer's resolution.

        Returns `Mesh` in mm.
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

        Returns uint8 [height, width, 3].
        """
        from ..rendering import Renderer  # of printers' files only, while other threads slice

        width, height = SIZE
        film = Film(width=width, height=height, samples=SAMPLES)
        renderer = Renderer(self._upright, View(film=film), work=self.work, device="cpu")
        *_, last = renderer.passes(SAMPLES)
        return np.asarray(last.shown)


@dataclass(frozen=True)
class SliceRecipe:
    """A scene and all settings of its slicing: enough for any process to plan and encode the same layers."""

    scene: str  # XML and name of the scene
    name: str
    job: slicing.SliceJob  # size, layers and pixels
    most: float | None = None  # greatest layer height of adaptive layers, mm
    form: str = "png"  # name of the format
    printer: Printer | None = None  # printer whose screen the layers are for
    compensation: float = 0.0  # as for `Screen`
    gamma: float = 1.0
    mirror: bool | None = None
    resin: Resin | None = None  # as for `SliceRun`
    created: datetime = EPOCH
    sections: int = 1
    levels: int = 255
    blur: int = 0

    def run(self, work: Work, scene: Scene | None = None) -> SliceRun:
        """Plan the layers; see `Recipe.run`."""
        scene = scene or reads(self.scene, self.name)
        stack = slicing.plan_stack(scene.root, self.job, work)
        if self.most is not None:
            stack = slicing.adapted(stack, self.most, work)
        screen = Screen(
            stack, self.printer, self.compensation, self.gamma, self.mirror, self.levels, self.blur
        )
        about = {"Title": self.name, "scene_hash": scene.hash}
        model = StackModel(scene, self.job, replace(work, cluster=None))
        files = about, model.mesh, model.picture, self.created
        return SliceRun(stack, screen, work, self.resin, *files, self.sections, self)

    def encoder(self, run: SliceRun) -> Encode:
        """Return the function that encodes the layers of a run in this format; see `Recipe.encoder`."""
        return FORMATS[self.form].encoder(run)
