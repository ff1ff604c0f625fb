"""Closing lines of meshes and layers: amount, cost and time, and what to do next."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from fracslice.common.digits import counted, place, significant

if TYPE_CHECKING:
    import numpy as np

    from fracslice.export.jobs import SliceRun
    from fracslice.jobs.mesh_result import MeshResult
    from fracslice.slicing.layer_checks import PrintReport
    from fracslice.volume import Drain

DENSITIES = {"resin": 1.1, "pla": 1.24, "petg": 1.27, "abs": 1.04, "asa": 1.07, "tpu": 1.22}
"""Materials and their densities, g/ml; filaments as in PrusaResearch.ini of PrusaSlicer 2.5."""

OF_RESIN = {"cavities", "cups", "traps", "fit"}
"""Problems of liquid resin, and of the known printers, which are for resin."""

FLAT = 50.0
"""Mean cross-section per area on the plate from which an object does not stand flat, as in the checks."""

LISTED = 4
"""Maximum number of drain holes whose places are all named."""

SEALED = 1000
"""Volume of the solid per volume of sealed cavities above which they are not mentioned."""

CELLS, FINEST = 128, 256
"""Usual and maximum number of cells along the longest side in the search for cavities."""

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Closing:
    """Figures of an object that is ready to print. Lengths in mm.

    Attributes
    ----------
    volume, contact, height : float
        Volume, mm3, area on the plate, mm2, and height.
    material : str
        Name of the material.
    density : float
        g/ml.
    about : str
        Stands before a volume that is an estimate.
    layers : int or None
        Number of layers; None for a mesh.
    seconds, cost : float or None
        Time and price of the print; None if unknown.
    drains : sequence of Place
        Openings of drain holes inside the hollow.
    drain : float
        Diameter of the drain holes.
    cavities : int
        Sealed cavities.
    trapped : float
        Their volume, mm3.
    bodies : int
        Connected components.
    bridge : float
        Minimum diameter of struts.
    """

    volume: float
    contact: float
    height: float
    material: str
    density: float
    about: str = ""
    layers: int | None = None
    seconds: float | None = None
    cost: float | None = None
    drains: Sequence[Place] = ()
    drain: float = 0.0
    cavities: int = 0
    trapped: float = 0.0
    bodies: int = 1
    bridge: float = 0.0

    def lines(self) -> Iterator[str]:
        """Iterate over the lines, each with the option that mends what it names."""
        ml = self.volume / 1000
        amount = [
            f"{self.about}{millilitres(self.volume)}",
            f"{significant(ml * self.density)} g of {self.material} ({self.density:g} g/ml)",
        ]
        if self.layers is not None:
            amount.append(counted(self.layers, "layer"))
        if self.seconds is not None:
            amount.append(duration(self.seconds))
        if self.cost:
            amount.append(f"cost {self.cost:.2f}")
        yield ", ".join(amount)
        if self.drains:
            places = [place(at, 1) for at in self.drains]
            where = f"{' and '.join(places)} mm"
            if len(places) > LISTED:
                where = f"{places[0]} mm and at {len(places) - 1} other places"
            yield f"drain holes of {self.drain:g} mm leave the hollow at {where}"
        if self.cavities and self.trapped * SEALED > self.volume:
            sealed = "a sealed cavity" if self.cavities == 1 else f"{self.cavities} sealed cavities"
            mend = "--cavities fill, or --drain 3mm for a hollow"
            yield f"{millilitres(self.trapped)} trapped in {sealed}: {mend}"
        if self.bodies > 1:
            yield f"{self.bodies} loose bodies: --bridge {max(self.bridge, 1):.2g}mm, or --keep largest"
        if self.contact * FLAT < self.volume / self.height:
            from fracslice.printing.problems import flat_base

            plate = f"{significant(self.contact, 2)} mm2 on the plate"
            yield f"does not stand flat, {plate}: --base {flat_base(self.height)}"


def millilitres(volume: float) -> str:
    """Volume in millilitres, mm3 given; in mm3 below a hundredth of one."""
    return f"{significant(volume / 1000)} ml" if volume >= 10 else f"{significant(volume, 2)} mm3"


def duration(seconds: float) -> str:
    """Duration in hours and minutes, or in seconds."""
    minutes = round(seconds / 60)
    if seconds < 60:
        return f"{max(round(seconds), 1)} s"
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"


def of_mesh(result: MeshResult, material: str, price: float | None) -> Closing:
    """Closing figures of a mesh.

    Parameters
    ----------
    result : MeshResult
        The mesh.
    material : str
        A key of `DENSITIES`.
    price : float or None
        Price of a kilogram.
    """
    from fracslice.meshjob import JOINING  # imports the formulas, which --help does not need

    report = result.report
    mesh, grams = report.mesh, report.mesh.volume_mm3 / 1000 * DENSITIES[material]
    return Closing(
        volume=mesh.volume_mm3,
        contact=report.contact_mm2,
        height=mesh.bbox_mm[1][2] - mesh.bbox_mm[0][2],
        material=material,
        density=DENSITIES[material],
        cost=None if price is None else grams * price / 1000,
        drains=[tuple(p) for p in result.place.mm(starts(result.planned.drains)).tolist()],
        drain=2 * result.place.scale * max((d.radius for d in result.planned.drains), default=0.0),
        cavities=mesh.cavities,
        trapped=report.cavities_mm3,
        bodies=mesh.components,
        bridge=JOINING * report.voxel_mm,
    )


def of_material(report: PrintReport, material: str) -> PrintReport:
    """Report on layers of a key of `DENSITIES`: its weight, and of a filament no problem of resin."""
    problems = [p for p in report.problems if material == "resin" or p.kind not in OF_RESIN]
    return replace(report, weight_g=report.volume / 1000 * DENSITIES[material], problems=problems)


def of_layers(run: SliceRun, price: float | None) -> Closing:
    """Closing figures of layers. Areas of layers that another process made are interpolated.

    Parameters
    ----------
    run : SliceRun
        The layers, some of them sampled.
    price : float or None
        Price of a litre; that of the resin by default.
    """
    import numpy as np

    stack, resin = run.stack, run.resin
    known = sorted(run.slicer.areas)
    areas = np.interp(np.arange(run.layers), known, [run.slicer.areas[k] for k in known])
    volume = float(areas @ stack.heights)
    of = price if price is not None else resin.price if resin else None
    named = resin is not None and resin.name != "unknown"
    count, hollow = trapped(run)
    places = (starts(stack.drains) - stack.origin) * stack.scale
    return Closing(
        volume=volume,
        contact=float(areas[0]),
        height=float(stack.tops[-1]),
        material=resin.name if resin and named else "resin",
        density=resin.density if resin else DENSITIES["resin"],
        about="about " if len(known) < run.layers else "",
        layers=run.layers,
        seconds=resin.seconds(run.layers) if resin else None,
        cost=None if of is None else volume / 1e6 * of,
        drains=[tuple(p) for p in places.tolist()],
        drain=2 * stack.scale * max((d.radius for d in stack.drains), default=0.0),
        cavities=count,
        trapped=hollow,
    )


def starts(drains: Sequence[Drain]) -> np.ndarray:
    """Inner ends of drain holes, float64 [n, 3], scene units."""
    import numpy as np

    return np.array([drain.start for drain in drains], float).reshape(-1, 3)


def trapped(run: SliceRun) -> tuple[int, float]:
    """Number and volume, mm3, of the cavities of a stack."""
    from fracslice.printing.sealed import sealed

    stack = run.stack
    narrowest = min((2 * drain.radius for drain in stack.drains), default=math.inf)
    longest = max(stack.outer.size)
    cell = max(min(longest / CELLS, narrowest / 3), longest / FINEST)
    count, volume = sealed(stack.root, stack.outer, cell, run.work)
    return count, volume * stack.scale**3
