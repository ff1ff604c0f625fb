"""Slice runs: a planned stack, and what its files hold besides layers."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..common.cache import key, program
from ..errors import SliceError
from ..expr.host import toolchain
from ..records import SECTIONS
from ..slicing import Slicer, Stack
from ..slicing.layers import MeanSlicer
from ..slicing.raster import Screen
from ..work import Work
from .layer_tasks import Recipe
from .resins import Resin

if TYPE_CHECKING:
    from ..mesh.model import Mesh

EPOCH = datetime(1980, 1, 1, tzinfo=UTC)
"""Date of files by default, so that equal jobs give equal bytes."""


@dataclass(frozen=True, eq=False)
class SliceRun:
    """A planned stack with all that its files contain besides layers."""

    stack: Stack  # the planned layers
    screen: Screen  # conversion of layers to pictures
    work: Work = field(default_factory=Work)  # threads, progress and cancellation
    resin: Resin | None = None  # exposure and motion; print files need them
    # names and values for the files, "scene_hash" among them
    metadata: dict[str, str] = field(default_factory=dict)
    # makes the mesh of the object for 3MF files, mm, standing on z = 0 and centred as the layers are
    mesh: Callable[[], Mesh] | None = None
    # renders the object for print files: uint8 [height, width, 3], sRGB
    picture: Callable[[], NDArray[np.uint8]] | None = None
    created: datetime = EPOCH  # date in print files, UTC
    sections: int = 1  # sections per layer; the grey level of a pixel is the mean of their coverages
    recipe: Recipe | None = None  # plans the same run in another process; a cluster needs it

    def __post_init__(self) -> None:
        if self.sections not in SECTIONS:
            raise SliceError(f"sections={self.sections}: expected one of {', '.join(map(str, SECTIONS))}")

    @cached_property
    def slicer(self) -> Slicer:
        """Slicer of the stack."""
        return self.slicer_with(self.work)

    def slicer_with(self, work: Work) -> Slicer:
        """Slicer of the stack with other threads."""
        return Slicer(self.stack, work) if self.sections == 1 else MeanSlicer(self.stack, work, self.sections)

    @property
    def layers(self) -> int:
        """Number of layers."""
        return len(self.stack.z)

    def key(self, form: str) -> str:
        """Key of everything that determines the bytes of encoded layers."""
        stack = [getattr(self.stack, f.name) for f in fields(self.stack) if f.name != "root"]
        screen = [getattr(self.screen, f.name) for f in fields(self.screen) if f.name != "stack"]
        field = self.stack.root.key
        return key(
            *(program(), toolchain(), form, field, *stack, *screen),
            *(self.resin, self.sections, sorted(self.metadata.items())),
        )

    def describe(self, name: str = "") -> bytes:
        """Manifest of the layers, as JSON."""
        stack, screen = self.stack, self.screen
        manifest = {
            "application": "fracslice",
            "metadata": self.metadata,
            "size_mm": stack.size,
            "pixel_mm": stack.pixel,
            "pixels": screen.shape[::-1],
            "printer": screen.printer.name if screen.printer else None,
            "gamma": screen.gamma,
            "grey_levels": screen.levels,
            "blur_pixels": screen.blur,
            "compensation_mm": screen.compensation,
            "mirror": screen.mirrored,
            "layers": [
                {"file": f"{name}{i:05d}.png", "top_mm": round(float(z), 6)} for i, z in enumerate(stack.tops)
            ],
        }
        return json.dumps(manifest, indent=1).encode()
