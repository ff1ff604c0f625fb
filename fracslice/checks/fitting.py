"""Whether an object fits its printer, or any, and whether samples and layers hold all of it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..common.messages import significant
from ..slicing.layers import Slicer, layers_amount
from ..slicing.printers import PRINTERS, Printer
from ..slicing.stack import Stack
from . import Check
from .layer_checks import LayersEvidence
from .problems import Problem


def misfit(stack: Stack, printer: Printer | None) -> Problem | None:
    """Compare the size of a planned stack with a printer, before any layer is sampled."""
    share = {
        p: min(most / mine for most, mine in zip(p.build_volume, stack.size, strict=True))
        for p in ([printer] if printer else PRINTERS.values())
    }
    nearest = max(share, key=lambda p: share[p])
    if share[nearest] >= 1 - 1e-6:
        return None
    mine, most = (" x ".join(significant(s, 4) for s in size) for size in (stack.size, nearest.build_volume))
    which = f"the {nearest.title}" if printer else f"any known printer, not even the {nearest.title}"
    size = math.floor(10 * share[nearest] * stack.side) / 10
    text = f"does not fit {which}: {mine} mm, and it has {most} mm"
    return Problem("fit", text, mend=(("size", f"{size:g}mm"),))


def _fit(of: LayersEvidence) -> Iterator[Problem]:
    if unfit := misfit(of.stack, of.printer):
        yield unfit


def _lost(of: LayersEvidence) -> Iterator[Problem]:
    slicer = Slicer(of.stack, of.work)
    slicer.areas.update(enumerate(of.report.areas))
    problems = layers_amount(slicer, of.work).problems
    if not (problems or of.report.bodies or of.report.specks):
        problems = ("no layer has a pixel that is half inside: all of it is thinner",)
    for text in problems:
        yield Problem("lost", text)


CHECKS = (
    Check("fit", "layers", _fit, rank=10, weight=1000, of_resin=True),  # the known printers are for resin
    Check("lost", "layers", _lost, rank=5),
)
