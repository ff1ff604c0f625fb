"""Checks of all layers of an object."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ..printing.walls import Widths, widths_of
from ..slicing.feature_graph import (
    MARKS,
    Feature,
    FeatureBox,
    Graph,
    LayerComponents,
    Neck,
    Overhang,
    farthest,
    layer_components,
    unsupported_pixels,
    weakest,
    widths,
)
from ..slicing.layers import Layer, Slicer
from ..slicing.printers import Printer
from ..slicing.stack import Stack
from ..work import Work
from . import checks_of, problems_of
from .problems import Limits, Problem
from .solid_checks import SolidReport, check_object

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
    supports: str = ""  # a line on the supports, if there are any

    def as_dict(self) -> dict[str, Any]:
        """The report as plain JSON types."""
        return asdict(self)

    def unsealed(self, hollows: list[Feature]) -> list[Feature]:
        """Those of some hollows that are no sealed cavities."""
        return [hollow for hollow in hollows if hollow not in self.cavities]

    def marks(self, tops: np.ndarray) -> list[FeatureBox]:
        """Boxes around islands and what is empty. `tops`: upper faces of the layers, mm, float64 [l]."""
        cups, traps = self.unsealed(self.cups), self.unsealed(self.traps)
        kinds = zip(MARKS, (self.islands, cups, traps, self.cavities), strict=True)
        return [FeatureBox.around(kind, feature, tops) for kind, features in kinds for feature in features]


@dataclass(frozen=True, eq=False)
class LayerFindings:
    """Results of one layer."""

    solid: LayerComponents  # components
    empty: LayerComponents
    area: float  # area, mm^2
    walls: np.ndarray | None  # widths; None in a layer that is not measured
    gaps: np.ndarray | None
    measured: dict[str, float]  # what checks measure, by their kind


@dataclass(frozen=True, eq=False)
class LayersEvidence:
    """What is known of all layers."""

    stack: Stack
    report: PrintReport  # all but its problems
    printer: Printer | None
    limits: Limits
    work: Work
    measured: dict[str, list[float]]  # what checks measure of each layer, by their kind

    def where(self, feature: Feature) -> dict[str, Any]:
        """Layer and place of a feature, as a `Problem` has them."""
        layer = feature.layers[0]
        return {"layer": layer, "at": (*feature.at, self.bottom(layer))}

    def bottom(self, layer: int) -> float:
        """Lower face of a layer, mm."""
        return float(self.stack.tops[layer] - self.stack.heights[layer])


def findings_of(slicer: Slicer, layers: range) -> Iterator[LayerFindings]:
    """Examine some layers, each by itself."""
    stack = slicer.stack
    measures = {check.kind: check.measure for check in checks_of("layers") if check.measure}
    chosen = set(np.linspace(0, len(stack.z) - 1, THICKNESS_LAYERS).astype(int).tolist())

    def make(layer: Layer) -> LayerFindings:
        runs = layer.runs
        walls, gaps = widths(runs, stack.pixel) if layer.index in chosen else (None, None)
        numbers = {kind: float(measure(layer)) for kind, measure in measures.items()}
        return LayerFindings(*layer_components(runs), layer.area, walls, gaps, numbers)

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
    return _Collector(stack, limits, printer, solid, work).report(
        findings or findings_of(Slicer(stack, work), range(len(stack.z)))
    )


@dataclass(eq=False)
class _Collector:
    """Combines the results of all layers into a report."""

    stack: Stack
    limits: Limits
    printer: Printer | None
    solid: SolidReport
    work: Work

    def report(self, findings: Iterator[LayerFindings]) -> PrintReport:
        """The report of findings in the order of the layers."""
        stack, solid, empty = self.stack, Graph(), Graph()
        square = stack.pixel[0] * stack.pixel[1]
        areas, overhangs, walls, gaps = list[float](), [], [np.empty((0, 2))], [np.empty((0, 2))]
        limits, far, measured = self.limits, list[Overhang](), dict[str, list[float]]()
        lower = None  # two layers below
        for k, now in enumerate(findings):
            below = solid.last
            reach = max(float(stack.heights[k]) / min(stack.pixel), 1.0)
            above = now.solid.runs
            bare = above.none if below is None else unsupported_pixels(below.runs, above, reach)
            overhangs.append(square * float((bare.end - bare.begin).sum()))
            if lower is not None:  # the light that binds layers closes a slit of one layer; filament sags
                bare = unsupported_pixels(lower.runs, bare, reach)
            if len(bare.begin):
                worst = farthest(above, bare, k, stack.pixel, limits.overhang, limits.span)
                far.extend([worst] if worst else [])
            lower = below
            solid.add(now.solid)
            empty.add(now.empty)
            areas.append(now.area)
            for kind, number in now.measured.items():
                measured.setdefault(kind, []).append(number)
            if now.walls is not None and now.gaps is not None:
                walls.append(now.walls)
                gaps.append(now.gaps)
        volume = sum(area * height for area, height in zip(areas, stack.heights.tolist(), strict=True))
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
            fits=None,
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
            supports=str(stack.supports or ""),
        )
        evidence = LayersEvidence(stack, report, self.printer, self.limits, self.work, measured)
        problems = [*problems_of("layers", evidence), *self.solid.problems]
        fits = all(problem.kind != "fit" for problem in problems) if self.printer else None
        return replace(report, fits=fits, problems=problems)

    def groups(self, graph: Graph, chosen: np.ndarray) -> list[Feature]:
        """Chosen nodes as connected groups."""
        return graph.groups(chosen, self.stack.heights, self.stack.pixel, self.stack.shape)

    def shut(self, hollows: Graph, backwards: bool) -> list[Feature]:
        """Large groups of shut nodes, see `Graph.shut`."""
        found = self.groups(hollows, hollows.shut(backwards))
        return [p for p in found if p.area >= self.limits.cup and p.volume >= self.limits.drop]

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
