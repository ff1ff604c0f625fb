"""What holds an object: loose bodies, islands, overhangs and necks.

Guides of makers of resin printers advise supports for flat cantilevers over 1 mm (Addema, "Recommendations -
SLA"; EnvisionTEC, "Self-Supporting Features") and keep bridges under 21 mm (Addema): beyond, surfaces
suffer. Prints fail later; the limit of cantilevers, 5 mm, is ours, as is that of necks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..common.messages import format_count, significant
from ..slicing.feature_graph import Neck
from . import Check
from .layer_checks import LayersEvidence
from .problems import SUPPORTS, Problem, flat_base

BRIDGE = (("bridge", "1mm"),)
"""Print setting that joins bodies."""

SUPPORTED = (("supports", "medium"),)
"""Print setting that adds supports."""

FILLED = (("cavities", "fill"),)
"""Print setting that fills cavities, in which supports are not, as they could not be taken out."""


def _held(of: LayersEvidence) -> tuple[tuple[str, str], ...]:
    """Print setting that holds what hangs in the air."""
    return FILLED if of.stack.supports else SUPPORTED


def _bodies(of: LayersEvidence) -> Iterator[Problem]:
    bodies = of.report.bodies
    lowest = min((body.layers[0] for body in bodies), default=0)  # several on the plate are as many parts
    if hanging := [body for body in bodies if body.layers[0] > lowest]:
        text, where = format_count(len(hanging), "loose body", "loose bodies"), of.where(hanging[0])
        yield Problem("bodies", text, mend=BRIDGE, advice="--keep largest", count=len(hanging), **where)


def _islands(of: LayersEvidence) -> Iterator[Problem]:
    islands = of.report.islands
    if islands:
        largest = max(islands, key=lambda i: i.area)
        first = min(i.layers[0] for i in islands)
        text = f"{format_count(len(islands), 'island')} in the air, the first from layer {first} on"
        text += f", the largest of {significant(largest.area)} mm2"
        yield Problem("islands", text, mend=_held(of), count=len(islands), **of.where(largest))


def _overhangs(of: LayersEvidence) -> Iterator[Problem]:
    if far := of.report.overhang:
        text = f"a flat overhang reaches {far.reach:.3g} mm, {significant(far.area)} mm2 of it too far"
        at = (*far.at, of.bottom(far.layer))
        yield Problem("overhangs", text, far.layer, at, _held(of), advice="--up")


def _necks(of: LayersEvidence) -> Iterator[Problem]:
    if of.report.neck and of.report.neck.ratio > of.limits.neck:
        yield _narrow_neck(of.report.neck, of)


def _narrow_neck(neck: Neck, of: LayersEvidence) -> Problem:
    """Problem of a cross-section that is too small for what it carries."""
    at = (*neck.at, of.bottom(neck.layer))
    if neck.layer == 0:
        text = f"it stands on {significant(neck.area, 2)} mm2 and is {significant(neck.carried)} mm2 wide"
        base = flat_base(of.stack.size[2])
        return Problem("necks", text, 0, at, mend=(("base", base),), advice=f"--raft 1mm, or {SUPPORTS}")
    text = f"{significant(neck.carried)} mm2 hang on {significant(neck.area, 2)} mm2"
    width = 1.2 * math.sqrt(4 / math.pi * neck.carried / of.limits.neck)
    return Problem("necks", text, neck.layer, at, mend=(("thickness", f"{width:.2g}mm"),), advice=SUPPORTS)


CHECKS = (
    Check("bodies", "layers", _bodies, rank=20, weight=100),
    Check("islands", "layers", _islands, rank=30),
    Check("overhangs", "layers", _overhangs, rank=31),
    Check("necks", "layers", _necks, rank=32),
)
