"""Problems of a stack of layers, with their places and what mends them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ..common.digits import counted, significant
from ..printing.problems import SUPPORTS, Problem, flat_base
from ..printing.solid_checks import FILL, loose
from .feature_graph import Feature
from .printers import PRINTERS, Printer
from .stack import Stack

if TYPE_CHECKING:
    from ..printing.limits import Limits
    from .layer_checks import PrintReport
    from .necks import Neck


def misfit(stack: Stack, printer: Printer | None) -> Problem | None:
    """Compare the size of a planned stack with a printer, before any layer is sampled.

    Parameters
    ----------
    stack : Stack
        The planned layers.
    printer : Printer or None
        The printer; None for all known ones.

    Returns
    -------
    Problem or None
        None if the stack fits the printer, or any of the known ones.
    """
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


def problems_of(report: PrintReport, stack: Stack, limits: Limits) -> list[Problem]:
    """Problems that a report shows, except for the size.

    Parameters
    ----------
    report : PrintReport
        The report.
    stack : Stack
        The layers that it is of.
    limits : Limits
        Limits of the checks.
    """

    def where(feature: Feature) -> dict[str, Any]:
        layer = feature.layers[0]
        return {"layer": layer, "at": (*feature.at, _bottom(stack, layer))}

    problems = []
    lowest = min(
        (body.layers[0] for body in report.bodies), default=0
    )  # several on the plate are as many parts
    if hanging := [body for body in report.bodies if body.layers[0] > lowest]:
        problems.append(loose(len(hanging), **where(hanging[0])))
    if report.islands:
        largest = max(report.islands, key=lambda i: i.area)
        first = min(i.layers[0] for i in report.islands)
        text = f"{counted(len(report.islands), 'island')} in the air, the first from layer {first} on"
        text += f", the largest of {significant(largest.area)} mm2"
        problems.append(
            Problem("islands", text, advice=SUPPORTS, count=len(report.islands), **where(largest))
        )
    if report.overhang:
        far = report.overhang
        text = f"a flat overhang reaches {far.reach:.3g} mm, {significant(far.area)} mm2 of it too far"
        at = (*far.at, _bottom(stack, far.layer))
        problems.append(Problem("overhangs", text, far.layer, at, advice=f"--up, or {SUPPORTS}"))
    if report.neck and report.neck.ratio > limits.neck:
        problems.append(_narrow_neck(report.neck, stack, limits))
    if report.cavities:
        sealed = counted(len(report.cavities), "sealed cavity", "sealed cavities")
        text = f"{sealed} with {significant(sum(c.volume for c in report.cavities))} mm3 of resin"
        problems.append(
            Problem("cavities", text, mend=FILL, count=len(report.cavities), **where(report.cavities[0]))
        )
    for kind, noun, hollows in (("cups", "suction cup", report.cups), ("traps", "resin trap", report.traps)):
        remaining = [hollow for hollow in hollows if hollow not in report.cavities]
        if remaining:
            largest = max(remaining, key=lambda h: h.area)
            volume = significant(sum(h.volume for h in remaining))
            text = f"{counted(len(remaining), noun)} with {volume} mm3 of resin"
            text += f", the largest {significant(largest.area)} mm2"
            advice, count = "--up, or a drain hole", len(remaining)
            problems.append(Problem(kind, text, advice=advice, count=count, **where(largest)))
    return [*problems, *report.solid.thin]


def _narrow_neck(neck: Neck, stack: Stack, limits: Limits) -> Problem:
    """Problem of a cross-section that is too small for what it carries."""
    at = (*neck.at, _bottom(stack, neck.layer))
    if neck.layer == 0:
        text = f"it stands on {significant(neck.area, 2)} mm2 and is {significant(neck.carried)} mm2 wide"
        base = flat_base(stack.size[2])
        return Problem("necks", text, 0, at, mend=(("base", base),), advice=f"--raft 1mm, or {SUPPORTS}")
    text = f"{significant(neck.carried)} mm2 hang on {significant(neck.area, 2)} mm2"
    width = 1.2 * math.sqrt(4 / math.pi * neck.carried / limits.neck)
    return Problem("necks", text, neck.layer, at, mend=(("thickness", f"{width:.2g}mm"),), advice=SUPPORTS)


def _bottom(stack: Stack, layer: int) -> float:
    """Lower face of a layer, mm."""
    return float(stack.tops[layer] - stack.heights[layer])
