"""Everything that a slice run is made from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime

from .. import slicing
from ..export.jobs import EPOCH, SliceRun
from ..export.layer_files import FORMATS
from ..export.ranges import Encode
from ..export.resins import Resin
from ..scene import Scene
from ..scene.reader import reads
from ..slicing.printers import Printer
from ..slicing.raster import Screen
from ..work import Work
from .stack_model import StackModel


@dataclass(frozen=True)
class SliceRecipe:
    """A scene and all settings of its slicing: enough for any process to plan and encode the same layers.

    Attributes
    ----------
    scene, name : str
        XML and name of the scene.
    job : SliceJob
        Size, layers and pixels.
    most : float or None
        Greatest layer height of adaptive layers, mm.
    form : str
        Name of the format.
    printer : Printer or None
        Printer whose screen the layers are for.
    compensation, gamma, mirror, levels, blur
        As for `Screen`.
    resin, created, sections
        As for `SliceRun`.
    """

    scene: str
    name: str
    job: slicing.SliceJob
    most: float | None = None
    form: str = "png"
    printer: Printer | None = None
    compensation: float = 0.0
    gamma: float = 1.0
    mirror: bool | None = None
    resin: Resin | None = None
    created: datetime = EPOCH
    sections: int = 1
    levels: int = 255
    blur: int = 0

    def run(self, work: Work, scene: Scene | None = None) -> SliceRun:
        """Plan the layers; see `Recipe.run`.

        Parameters
        ----------
        scene : Scene, optional
            The same scene as it was read: its errors name places in its file.
        """
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
