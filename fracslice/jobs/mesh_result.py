"""Result of a mesh job: the mesh, its report and the samples that it was made from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import TooLargeError
from ..work import Work
from .placement import Placement
from .report import Report

if TYPE_CHECKING:
    from ..kernel import Field
    from ..mesh import Mesh
    from ..volume import Bricks, Plan


@dataclass(frozen=True, eq=False)
class MeshResult:
    """Result of `make_mesh`.

    Attributes
    ----------
    report : Report
        Measures, checks and costs.
    place : Placement
        Map from the scene to the mesh.
    planned : Plan
        Sampled field.
    whole : Mesh or None
        The mesh; None if it is larger than memory and only in the file.
    work : Work
        Threads, progress and cancellation of the job.
    """

    report: Report
    place: Placement
    planned: Plan
    whole: Mesh | None
    work: Work = field(default_factory=Work)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy all but the threads and callbacks of the job."""
        return MeshResult, (self.report, self.place, self.planned, self.whole)

    def instead_of(self, coarse: MeshResult) -> MeshResult:
        """The result with a note that it was made in place of a coarser one, and why.

        Parameters
        ----------
        coarse : MeshResult
            The result that lost the object.
        """
        report, asked = self.report, coarse.report
        text = f"voxel {report.voxel_mm:.3g} mm instead of {asked.voxel_mm:.3g} mm: {', '.join(asked.lost)}"
        return replace(self, report=replace(report, notes=(text, *report.notes)))

    @property
    def mesh(self) -> Mesh:
        """The mesh in mm, standing on z = 0, quantised to float32.

        Raises
        ------
        TooLargeError
            If the mesh was written in pieces.
        """
        if self.whole is None:
            raise TooLargeError("the mesh does not fit in memory; it is in the file that was written")
        return self.whole

    @property
    def root(self) -> Field:
        """Field that was meshed."""
        return self.planned.root

    @cached_property
    def bricks(self) -> Bricks:
        """Samples of the field around the surface, scene units; computed on first access."""
        from ..volume import sample_scene

        return sample_scene(self.planned, self.work)

    @property
    def bricks_mm(self) -> Bricks:
        """Samples in print space: positions and values in mm."""
        scale, (x, y, z) = self.place.scale, self.bricks.origin
        dx, dy, dz = self.place.offset
        return replace(
            self.bricks,
            origin=(scale * x + dx, scale * y + dy, scale * z + dz),
            voxel=scale * self.bricks.voxel,
            values=self.bricks.values * np.float32(scale),
        )
