"""Printability checks of layers, and the problems that they find."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..common.messages import format_count, significant
from ..printing.problems import SUPPORTS, Limits, Problem, flat_base
from ..printing.solid_checks import FILL, SolidReport, check_object, loose, may_close
from ..printing.widths import Widths, widths_of
from ..scene import Print
from ..work import Work
from .feature_graph import Feature, Graph, Neck, Overhang, farthest, unsupported_pixels, weakest
from .layers import Layer, Slicer
from .printers import PRINTERS, Printer
from .runs import LayerComponents, layer_components
from .stack import Stack
from .thickness import widths


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


def problems_of(report: PrintReport, stack: Stack, limits: Limits) -> list[Problem]:
    """Problems that a report shows, except for the size."""

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
        text = f"{format_count(len(report.islands), 'island')} in the air, the first from layer {first} on"
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
        count, volume = len(report.cavities), sum(c.volume for c in report.cavities)
        sealed = format_count(count, "sealed cavity", "sealed cavities")
        text = f"{sealed} with {significant(volume)} mm3 of resin"
        place = where(report.cavities[0])
        problems.append(Problem("cavities", text, mend=FILL, count=count, resin=volume, **place))
    for kind, noun, hollows in (("cups", "suction cup", report.cups), ("traps", "resin trap", report.traps)):
        remaining = [hollow for hollow in hollows if hollow not in report.cavities]
        if remaining:
            largest = max(remaining, key=lambda h: h.area)
            volume = sum(h.volume for h in remaining)
            text = f"{format_count(len(remaining), noun)} with {significant(volume)} mm3 of resin"
            text += f", the largest {significant(largest.area)} mm2"
            advice, count = "--up, or a drain hole", len(remaining)
            if kind == "cups" and all(hollow.layers[0] == 0 for hollow in remaining):
                advice += f", or {SUPPORTS}"  # off the plate, it is open upwards
            place = where(largest)
            problems.append(Problem(kind, text, advice=advice, count=count, resin=volume, **place))
    return [*problems, *_narrow_drains(stack, limits), *report.solid.thin]


def _narrow_drains(stack: Stack, limits: Limits) -> Iterator[Problem]:
    """Problem of drain holes that may close while they are printed."""
    narrow = [drain for drain in stack.drains if 2 * drain.radius * stack.scale < limits.hole]
    if narrow:
        x, y, z = (stack.scale * (np.array(narrow[0].start) - stack.origin)).tolist()
        text = may_close(len(narrow), "drain hole", 2 * narrow[0].radius * stack.scale, limits.hole)
        layer, mend = int(np.searchsorted(stack.tops, z)), (("drain", f"{Print().drain:g}mm"),)
        yield Problem("holes", text, layer, (x, y, z), mend, count=len(narrow))


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


THICKNESS_LAYERS = 24
"""Layers, evenly spaced over the height, in which walls and gaps are measured."""

SPECK = 8
"""Area in pixels; smaller islands and bodies are indistinguishable from noise."""

WORST = 6
"""Maximum number of layers in `PrintReport.worst`."""


@dataclass(frozen=True)
class PrintReport:
    """Report on all layers. Lengths in mm, areas in mm^2, volumes in mm^3; lists have the largest first."""

    layers: int  # number of layers
    pixels: tuple[int, int]  # pixels along x and y
    size: tuple[float, float, float]  # size of the object
    fits: bool | None  # true if the object fits the printer; None without a printer
    areas: list[float]  # area of each layer
    volume: float  # volume of the solid, and weight in grams
    weight_g: float
    bodies: list[Feature]  # connected components, and components with nothing below them, without specks
    islands: list[Feature]
    specks: int  # number of islands and bodies below the limit
    overhang_area: float  # total over all layers, and maximum in a layer
    largest_overhang: float
    cups: list[Feature]  # suction cups, resin traps and sealed cavities
    traps: list[Feature]
    cavities: list[Feature]
    walls: Widths | None  # widths in layers
    gaps: Widths | None
    overhang: Overhang | None  # the farthest flat overhang beyond the limits
    neck: Neck | None  # the cross-section that is smallest for what it carries
    worst: list[int]  # layers with the most overhang or the largest islands
    solid: SolidReport  # report on the solid, measured in space instead of in layers
    problems: list[Problem] = field(default_factory=list)  # the problems

    def as_dict(self) -> dict[str, Any]:
        """The report as plain JSON types."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class LayerFindings:
    """Results of one layer."""

    solid: LayerComponents  # components
    empty: LayerComponents
    area: float  # area, mm^2
    walls: np.ndarray | None  # widths; None in a layer that is not measured
    gaps: np.ndarray | None


def findings_of(slicer: Slicer, layers: range) -> Iterator[LayerFindings]:
    """Examine some layers, each by itself."""
    stack = slicer.stack
    chosen = set(np.linspace(0, len(stack.z) - 1, THICKNESS_LAYERS).astype(int).tolist())

    def make(layer: Layer) -> LayerFindings:
        runs = layer.runs
        measured = widths(runs, stack.pixel) if layer.index in chosen else (None, None)
        return LayerFindings(*layer_components(runs), layer.area, *measured)

    return slicer.map(make, layers)


def check_layers(
    stack: Stack,
    limits: Limits | None = None,
    printer: Printer | None = None,
    work: Work | None = None,
    findings: Iterator[LayerFindings] | None = None,
) -> PrintReport:
    """Check a planned stack, layer by layer, in memory that grows with the number of components only."""
    limits, work = limits or Limits(), work or Work()
    finest, origin = max(stack.pixel), stack.origin
    solid = check_object(stack.root, stack.outer, stack.scale, limits, work, finest, origin, stack.drains)
    return _Collector(stack, limits, printer, solid).report(
        findings or findings_of(Slicer(stack, work), range(len(stack.z)))
    )


@dataclass(eq=False)
class _Collector:
    """Combines the results of all layers into a report."""

    stack: Stack
    limits: Limits
    printer: Printer | None
    solid: SolidReport

    def report(self, findings: Iterator[LayerFindings]) -> PrintReport:
        """The report of findings in the order of the layers."""
        stack, solid, empty = self.stack, Graph(), Graph()
        square = stack.pixel[0] * stack.pixel[1]
        areas, overhangs, walls, gaps = list[float](), [], [np.empty((0, 2))], [np.empty((0, 2))]
        limits, far = self.limits, list[Overhang]()
        for k, now in enumerate(findings):
            below = solid.last
            reach = max(float(stack.heights[k]) / min(stack.pixel), 1.0)
            above = now.solid.runs
            bare = above.none if below is None else unsupported_pixels(below.runs, above, reach)
            overhangs.append(square * float((bare.end - bare.begin).sum()))
            if len(bare.begin):
                worst = farthest(above, bare, k, stack.pixel, limits.overhang, limits.span)
                far.extend([worst] if worst else [])
            solid.add(now.solid)
            empty.add(now.empty)
            areas.append(now.area)
            if now.walls is not None and now.gaps is not None:
                walls.append(now.walls)
                gaps.append(now.gaps)
        volume = sum(area * height for area, height in zip(areas, stack.heights.tolist(), strict=True))
        unfit = misfit(stack, self.printer)
        overhang = np.array(overhangs)
        islands = self.groups(solid, solid.islands())
        bodies = self.groups(solid, np.ones(solid.count, bool))
        cups = [c for c in self.shut(empty, False) if self.height(c) >= self.limits.deep]
        traps = self.shut(empty, True)
        speck = max(limits.speck, SPECK * square)
        real = [i for i in islands if i.area >= speck]
        kept = [b for b in bodies if b.area >= speck]
        report = PrintReport(
            layers=len(stack.z),
            pixels=stack.shape[::-1],
            size=stack.size,
            fits=not unfit if self.printer else None,
            areas=areas,
            volume=volume,
            weight_g=volume * self.limits.density / 1000,
            bodies=kept,
            islands=real,
            specks=len(islands) - len(real) + len(bodies) - len(kept),
            overhang_area=float(overhang.sum()),
            largest_overhang=float(overhang.max(initial=0)),
            cups=cups,
            traps=traps,
            cavities=[c for c in self.groups(empty, empty.sealed()) if c.area >= limits.cup],
            walls=widths_of(*np.concatenate(walls).T),
            gaps=widths_of(*np.concatenate(gaps).T),
            overhang=max(far, key=lambda o: o.reach, default=None),
            neck=weakest(solid, stack.pixel, stack.shape, limits.heavy, speck),
            worst=_worst(overhang, real, far),
            solid=self.solid,
        )
        report.problems.extend([*([unfit] if unfit else []), *problems_of(report, stack, self.limits)])
        return report

    def groups(self, graph: Graph, chosen: np.ndarray) -> list[Feature]:
        """Chosen nodes as connected groups."""
        return graph.groups(chosen, self.stack.heights, self.stack.pixel, self.stack.shape)

    def shut(self, hollows: Graph, backwards: bool) -> list[Feature]:
        """Large groups of shut nodes, see `Graph.shut`."""
        return [p for p in self.groups(hollows, hollows.shut(backwards)) if p.area >= self.limits.cup]

    def height(self, part: Feature) -> float:
        """Height of a group, mm."""
        first, last = part.layers
        return float(self.stack.heights[first : last + 1].sum())


def _worst(overhang: np.ndarray, islands: list[Feature], far: list[Overhang]) -> list[int]:
    """Layers in which the largest islands begin, then those with the farthest and the most overhang."""
    first = [i.layers[0] for i in sorted(islands, key=lambda i: -i.area)[: WORST // 2]]
    most = [int(k) for k in np.argsort(-overhang, kind="stable")[:WORST] if overhang[k] > 0]
    reach = [o.layer for o in sorted(far, key=lambda o: -o.reach)]
    return sorted(list(dict.fromkeys([*first, *reach, *most]))[:WORST])
