"""Everything that a slice run is made from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from . import slicing
from .export.jobs import SliceRun
from .scene.reader import reads
from .slicing.printers import Printer
from .slicing.raster import Screen
from .work import Work


@dataclass(frozen=True)
class SliceRecipe:
    """A scene and all settings of its slicing: enough for any process to plan the same layers.

    Attributes
    ----------
    scene, name : str
        XML and name of the scene.
    job : SliceJob
        Size, layers and pixels.
    most : float or None
        Greatest layer height of adaptive layers, mm.
    printer : Printer or None
        Printer whose screen the layers are for.
    compensation, gamma, mirror
        As for `Screen`.
    exposure : tuple of float
        As for `SliceRun`.
    """

    scene: str
    name: str
    job: slicing.SliceJob
    most: float | None = None
    printer: Printer | None = None
    compensation: float = 0.0
    gamma: float = 1.0
    mirror: bool | None = None
    exposure: tuple[float, float] = (8.0, 35.0)

    def run(self, work: Work) -> SliceRun:
        """Plan the layers.

        Parameters
        ----------
        work : Work
            Threads, progress and cancellation.

        Returns
        -------
        SliceRun

        Raises
        ------
        SceneError, SliceError, VolumeError, ExportError, Cancelled
            For a scene or settings that cannot be sliced.
        """
        from .stackmesh import stack_mesh

        scene = reads(self.scene, self.name)
        stack = slicing.plan_stack(scene.root, self.job, work)
        if self.most is not None:
            stack = slicing.adapted(stack, self.most, work)
        screen = Screen(stack, self.printer, self.compensation, self.gamma, self.mirror)
        about = {"Title": self.name, "scene_hash": scene.hash}
        mesh = partial(stack_mesh, scene, self.job, work)
        return SliceRun(stack, screen, work, self.exposure, about, mesh, self)
