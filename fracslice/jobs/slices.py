"""Slice jobs: the recipe of a run, and its mesh and pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from ..export.layers import FORMATS
from ..export.slice_run import EPOCH, Encode, SliceRun
from ..formulas import Node
from ..records import COARSEST, RESOLUTION, MeshJob
from ..scene import Scene
from ..scene.reader import reads
from ..scene.view import Film, View
from ..slicing import SliceJob, Stack, plan_layers
from ..slicing.printers import Resin
from ..slicing.raster import Screen
from ..volume.amount import orient_field, sizing
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
    def upright(self) -> Node:
        return cast(Node, orient_field(self.scene.root, self.job.up, work=self.work))

    def mesh(self) -> Mesh:
        """Mesh of the object, simplified to the printer's resolution.

        Returns `Mesh` in mm.
        """
        from .mesh import make_mesh  # of 3MF files only

        job, pixel = self.job, self.job.pixels
        longest = sizing(self.scene, job.size, job.scale, self.work).longest
        voxel = max(*pixel, longest / RESOLUTION)
        what = MeshJob(
            size=job.size,
            voxel=min(voxel, longest / COARSEST),
            printing=job.printing,
            simplify=min(pixel) / 4,
            up=job.up,
            scale=job.scale,
        )
        return make_mesh(self.scene, what, self.work).mesh

    def picture(self) -> NDArray[np.uint8]:
        """Render the scene as it stands on the printer, without its print preparation.

        Returns uint8 [height, width, 3].
        """
        return rendered(self.upright, self.work)


def rendered(root: Node, work: Work) -> NDArray[np.uint8]:
    """Picture of an object for a print file, uint8 [height, width, 3]."""
    from ..rendering import Renderer  # of printers' files only, while other threads slice

    width, height = SIZE
    film = Film(width=width, height=height, samples=SAMPLES)
    *_, last = Renderer(root, View(film=film), work=work, device="cpu").passes(SAMPLES)
    return np.asarray(last.shown)


@dataclass(frozen=True)
class SliceRecipe:
    """A scene and all settings of its slicing: enough for any process to plan and encode the same layers."""

    scene: str  # XML and name of the scene
    name: str
    job: SliceJob  # size, layers and pixels
    form: str = "png"  # name of the format
    resin: Resin | None = None  # as for `SliceRun`
    created: datetime = EPOCH

    def read(self) -> Scene:
        """Read the scene."""
        return reads(self.scene, self.name, files_outside=True)

    def plan(self, scene: Scene, work: Work) -> Stack:
        """Plan the layers of the scene."""
        return plan_layers(scene.root, self.job, work, sizing(scene, self.job.size, self.job.scale, work))

    def run(self, work: Work, scene: Scene | None = None) -> SliceRun:
        """Plan the layers; see `Recipe.run`."""
        scene, job = scene or self.read(), self.job
        stack = self.plan(scene, work)
        about = {"Title": self.name, "scene_hash": scene.hash}
        model = StackModel(scene, job, replace(work, cluster=None))
        files = about, model.mesh, model.picture, self.created
        return SliceRun(
            stack, Screen.of(stack, job, self.resin), work, self.resin, *files, job.sections, self
        )

    def encoder(self, run: SliceRun) -> Encode:
        """Return the function that encodes the layers of a run in this format; see `Recipe.encoder`."""
        return FORMATS[self.form].encoder(run)
