"""Completeness of a mesh or stack of layers: its size and volume against those of the field."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..common.messages import decimal
from ..fields.box import Triple
from ..formulas import Box, Node
from ..work import Work
from . import Lattice, Plan
from .amount import FINER, MARGIN, SCATTERED, SURE, amount, finer, lost_share, scattered

if TYPE_CHECKING:
    from ..fields.field import Field

Grid = tuple[Triple, Triple, Callable[[float], str]]
"""Origin and spacing of the samples, scene units, and a function that names samples of a fraction of the
spacing.
"""

LOST = 0.05
"""Share of an object's volume without which it is no success."""

RAISED = 2, 4
"""Refinements of the samples that a job tries by itself."""


@dataclass(frozen=True)
class Amount:
    """Volumes of the object and of its mesh or layers, mm3."""

    object: float  # volume of the object, estimated from its field at random points
    error: float  # standard error of that estimate
    made: float  # volume of the mesh or the layers
    off: float  # relative difference if it is significant, else 0

    @property
    def missing(self) -> float:
        """Share of the object's volume that is missing; 0 if that is not significant."""
        return -min(self.off, 0.0) + 0.0

    @property
    def lost(self) -> bool:
        """True if more than `LOST` of the object is missing, whatever the error of its estimate."""
        return self.missing > 0 and self.missing - SURE * self.error / self.object > LOST


class Completeness(NamedTuple):
    """What of an object is not in its mesh or layers."""

    amount: Amount  # both volumes
    notes: tuple[str, ...] = ()  # volume that is missing or too much, as text
    # the same where the object is lost: more than `LOST` of it, or a whole element of the scene
    problems: tuple[str, ...] = ()
    # refinement of the samples after which it is probably not lost, of `RAISED`; 1 if there is no need or
    # none suffices
    cure: int = 1


def lost_size(
    name: str, box: Sequence[float], made: Sequence[float], whole: Sequence[float], spacing: Sequence[float]
) -> tuple[Triple, tuple[str, ...]]:
    """Compare the size of a mesh or layers with that of the object.

    `box`, `made`, `whole` (with the bodies that were removed), `spacing` in mm. Returns the length that is
    missing along each axis, mm, and a note on it if it is more than a sample.
    """
    x, y, z = lost = [max(of - own, 0.0) for of, own in zip(box, made, strict=True)]
    samples = [mm / step for mm, step in zip(lost, spacing, strict=True)]
    axis = samples.index(max(samples))
    if samples[axis] <= 1:
        return (x, y, z), ()
    removed = whole[axis] - made[axis] > lost[axis] / 2
    reason = "bodies that were removed" if removed else "tips or walls finer than the samples"
    along = f"{name} {decimal(made[axis])} mm of {decimal(box[axis])} mm along {'xyz'[axis]}"
    return (x, y, z), (f"{along}: {reason} reach farther",)


def mesh_amount(planned: Plan, made: float, scale: float, whole: bool, work: Work) -> Completeness:
    """Compare the volume of a mesh with that of its field.

    `made` in mm3; `scale`: mm per scene unit.
    """
    lattice = Lattice.around(planned.outer, planned.voxel)

    def sampling(voxel: float) -> str:
        return f"a voxel of {voxel * planned.voxel * scale:.2g} mm"

    spacing = planned.voxel, planned.voxel, planned.voxel
    grid = lattice.origin, spacing, sampling
    return compare_volumes(planned.root, [planned.outer], made, scale, grid, whole, work)


def compare_volumes(
    root: Field, boxes: list[Box], made: float, scale: float, grid: Grid, whole: bool, work: Work
) -> Completeness:
    """Compare the volume of the field in boxes, scene units, with `made`, mm3; with `whole`, look for the
    elements of the scene, too.
    """
    true, (origin, spacing, name) = amount(root, boxes, work), grid
    off, unit = true.off(made / scale**3), scale**3
    compared = Amount(true.volume * unit, true.error * unit, made, off)

    def missed(points: np.ndarray, times: float = 1.0) -> float:
        return lost_share(root, points, origin, spacing, times, work)

    def would(times: int | None) -> str:
        return (
            f"{name(1 / times)} would show it" if times else f"{name(1 / FINER[-1])} would not show it either"
        )

    notes, problems, cures = list[str](), list[str](), [1]
    for part, points, share in scattered(root, true, origin, spacing, work) if whole else ():
        times = next((t for t in FINER if missed(points, t / MARGIN) < SCATTERED), None)
        element = f"<{part.formula.name}>{of(part)}"
        problems.append(f"{share:.0%} of {element} is finer than the samples and missing: {would(times)}")
        cures.append(next((t for t in RAISED if missed(points, t) < SCATTERED), 0))
    if off > 0:
        notes.append(f"{off:.1%} more volume than the object has: the samples are too coarse for it")
    if off < 0:
        text = f"{-off:.1%} of the object's volume is finer than the samples and missing"
        (problems if compared.lost else notes).append(
            f"{text}: {would(finer(root, true, off, origin, spacing, work))}"
        )
    if compared.lost:
        points = true.some()
        most = LOST * missed(points) / -off
        cures.append(next((t for t in RAISED if missed(points, t) < most), 0))
    return Completeness(compared, tuple(notes), tuple(problems), max(cures) if all(cures) else 1)


def of(part: Node) -> str:
    """Where an element was read, if it was."""
    return f" of {part.place}" if part.place else ""
