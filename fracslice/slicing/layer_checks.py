"""Printability checks of layers: islands, overhangs, cups, traps, cavities, bodies, thin walls and gaps, fit,
volume and weight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..printing.limits import Limits
from ..printing.problems import Problem
from ..printing.solid_checks import SolidReport, check_object
from ..printing.widths import Widths, widths_of
from ..work import Work
from .feature_graph import Feature, Graph
from .layer_problems import misfit, problems_of
from .layers import Layer, Slicer
from .necks import Neck, weakest
from .overhangs import Overhang, farthest, unsupported
from .printers import Printer
from .runs import LayerComponents, layer_components
from .stack import Stack
from .thickness import widths

THICKNESS_LAYERS = 24
"""Layers, evenly spaced over the height, in which walls and gaps are measured."""

SPECK = 8
"""Area in pixels; smaller islands and bodies are indistinguishable from noise."""

WORST = 6
"""Maximum number of layers in `PrintReport.worst`."""


@dataclass(frozen=True)
class PrintReport:
    """Report on all layers. Lengths in mm, areas in mm^2, volumes in mm^3; lists have the largest first.

    Attributes
    ----------
    layers : int
        Number of layers.
    pixels : tuple of int
        Pixels along x and y.
    size : tuple of float
        Size of the object.
    fits : bool or None
        True if the object fits the printer; None without a printer.
    areas : list of float
        Area of each layer.
    volume, weight_g : float
        Volume of the solid, and weight in grams.
    bodies, islands : list of Feature
        Connected components, and components with nothing below them, without specks.
    specks : int
        Number of islands and bodies below the limit.
    overhang_area, largest_overhang : float
        Total over all layers, and maximum in a layer.
    cups, traps, cavities : list of Feature
        Suction cups, resin traps and sealed cavities.
    walls, gaps : Widths or None
        Widths in layers.
    overhang : Overhang or None
        The farthest flat overhang beyond the limits.
    neck : Neck or None
        The cross-section that is smallest for what it carries.
    worst : list of int
        Layers with the most overhang or the largest islands.
    solid : SolidReport
        Report on the solid, measured in space instead of in layers.
    problems : list of Problem
        The problems.
    """

    layers: int
    pixels: tuple[int, int]
    size: tuple[float, float, float]
    fits: bool | None
    areas: list[float]
    volume: float
    weight_g: float
    bodies: list[Feature]
    islands: list[Feature]
    specks: int
    overhang_area: float
    largest_overhang: float
    cups: list[Feature]
    traps: list[Feature]
    cavities: list[Feature]
    walls: Widths | None
    gaps: Widths | None
    overhang: Overhang | None
    neck: Neck | None
    worst: list[int]
    solid: SolidReport
    problems: list[Problem] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """The report as plain JSON types.

        Returns
        -------
        dict
            Keyed by attribute name.
        """
        return asdict(self)


@dataclass(frozen=True, eq=False)
class LayerFindings:
    """Results of one layer.

    Attributes
    ----------
    solid, empty : LayerComponents
        Components.
    area : float
        Area, mm^2.
    walls, gaps : ndarray or None
        Widths; None in a layer that is not measured.
    """

    solid: LayerComponents
    empty: LayerComponents
    area: float
    walls: np.ndarray | None
    gaps: np.ndarray | None


def findings_of(slicer: Slicer, layers: range) -> Iterator[LayerFindings]:
    """Examine some layers, each by itself.

    Parameters
    ----------
    slicer : Slicer
        Slicer of the stack.
    layers : range
        Their numbers.

    Returns
    -------
    iterator of LayerFindings
        Results of the layers, in order.
    """
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
    """Check a planned stack, layer by layer, in memory that grows with the number of components only.

    Parameters
    ----------
    stack : Stack
        The planned layers.
    limits : Limits, optional
        Limits of the checks.
    printer : Printer, optional
        Printer that the object is to fit.
    work : Work, optional
        Threads, progress and cancellation.
    findings : iterator of LayerFindings, optional
        Results of all layers, in order; they are made here by default.

    Raises
    ------
    SliceError
        If a layer cannot be sampled.
    VolumeError
        If the solid cannot be sampled.
    Cancelled
        When the work is cancelled.
    """
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
            bare = above.none if below is None else unsupported(below.runs, above, reach)
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
