"""Where liquid resin stays: sealed cavities, suction cups, resin traps, and drain holes that may close.

The limits are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..common.messages import format_count, significant
from ..records import Print
from ..slicing.feature_graph import Feature
from . import Check
from .layer_checks import LayersEvidence, PrintReport
from .problems import SUPPORTS, Problem
from .solid_checks import may_close

FILL = (("cavities", "fill"),)
"""Print setting that fills cavities."""

DRAIN = (("drain_at", "auto"),)
"""Print setting that drills holes where resin or air cannot get out."""


def _cavities(of: LayersEvidence) -> Iterator[Problem]:
    cavities = of.report.cavities
    if cavities:
        count, volume = len(cavities), sum(c.volume for c in cavities)
        sealed = format_count(count, "sealed cavity", "sealed cavities")
        text = f"{sealed} with {significant(volume)} mm3 of resin"
        yield Problem("cavities", text, mend=FILL, count=count, resin=volume, **of.where(cavities[0]))


def _hollows(
    kind: str, noun: str, hollows: Callable[[PrintReport], list[Feature]]
) -> Callable[[LayersEvidence], Iterator[Problem]]:
    """Look at hollows of a kind that are not sealed."""

    def find(of: LayersEvidence) -> Iterator[Problem]:
        remaining = of.report.unsealed(hollows(of.report))
        if not remaining:
            return
        largest = max(remaining, key=lambda h: h.area)
        volume = sum(h.volume for h in remaining)
        text = f"{format_count(len(remaining), noun)} with {significant(volume)} mm3 of resin"
        text += f", the largest {significant(largest.area)} mm2"
        advice = "--up"
        if kind == "cups" and all(hollow.layers[0] == 0 for hollow in remaining):
            advice += f", or {SUPPORTS}"  # off the plate, it is open upwards
        where = of.where(largest)
        yield Problem(kind, text, mend=DRAIN, advice=advice, count=len(remaining), resin=volume, **where)

    return find


def _narrow_drains(of: LayersEvidence) -> Iterator[Problem]:
    """Drain holes that may close while they are printed."""
    stack, least = of.stack, of.limits.hole
    narrow = [drain for drain in stack.drains if 2 * drain.radius * stack.scale < least]
    if narrow:
        x, y, z = (stack.scale * (np.array(narrow[0].start) - stack.origin)).tolist()
        text = may_close(len(narrow), "drain hole", 2 * narrow[0].radius * stack.scale, least)
        layer, mend = int(np.searchsorted(stack.tops, z)), (("drain", f"{Print().drain:g}mm"),)
        yield Problem("holes", text, layer, (x, y, z), mend, count=len(narrow))


CHECKS = (
    Check("cavities", "layers", _cavities, rank=40, weight=10, of_resin=True),
    Check("cups", "layers", _hollows("cups", "suction cup", lambda r: r.cups), 41, weight=10, of_resin=True),
    Check(
        "traps", "layers", _hollows("traps", "resin trap", lambda r: r.traps), 42, weight=10, of_resin=True
    ),
    Check("holes", "layers", _narrow_drains, rank=43, of_resin=True),
)
