"""The mesh of a scene as a studio shows it: its figures, and measures of its surface as colours."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.messages import format_count, significant
from ..formulas.material import PALETTES
from ..jobs.report import Result
from ..mesh import Mesh
from ..mesh.clusters import Clusters
from ..mesh.drawing import MeshDrawing
from ..mesh.fit import surface_error
from ..printing.walls import Samples
from ..slicing.printers import START
from ..work import Work

PALETTE = np.reshape(PALETTES["viridis"], (-1, 3))[:5]
"""Colours from the least to the greatest value, sRGB."""

QUICK = 150_000
"""About the triangles that are drawn while the camera moves."""

FARTHEST = 0.25
"""Greatest width of walls and gaps that are measured, longest sides."""

MOST = 0.95
"""Share of the vertices whose values the palette tells apart."""

PLATE = 0.05
"""Height above the lowest point up to which the object lies on the plate, mm."""

INSIDE = 0.5
"""Depth below the surface at which rays start, voxels: the samples are of the field, not of the mesh."""


@dataclass(frozen=True, eq=False)
class SceneSolid:
    """A mesh that was made of a scene."""

    result: Result
    known: dict[str, NDArray[np.float64]] = field(default_factory=dict)  # values of vertices, by measure
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)  # those of the first and last colour

    @cached_property
    def mesh(self) -> Mesh:
        """The mesh in scene units."""
        return Mesh(self.result.place.units(self.result.vertices), self.result.triangles)

    @cached_property
    def clusters(self) -> Clusters | None:
        """Clusters of its vertices for pictures that move; none of a mesh that is drawn quickly enough."""
        if len(self.mesh.triangles) <= QUICK:
            return None
        area = np.linalg.norm(self.mesh.normals, axis=1).sum() / 2
        return Clusters.within(self.mesh, math.sqrt(2 * area / QUICK))

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        """Unit normals of the vertices, [n, 3]."""
        triangles, normals = self.mesh.triangles, self.mesh.normals
        sums = np.stack(
            [
                sum(np.bincount(triangles[:, k], normals[:, axis], len(self.mesh.vertices)) for k in range(3))
                for axis in range(3)
            ],
            1,
        )
        unit: NDArray[np.float64] = sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-300)[:, None]
        return unit

    def measure(self, name: str, work: Work) -> None:
        """Measure the surface for its colours; `name` of `MEASURES`."""
        if name not in self.known:
            measure = MEASURES[name]
            values = measure.of(self, work)
            self.limits[name] = measure.limits or _limits(values, measure.signed)
            self.known[name] = values

    def coloured(self, name: str) -> Mesh:
        """The mesh in the colours of a measure that was taken."""
        return replace(self.mesh, colours=graded(self.known[name], self.limits[name]))

    def value(self, name: str, drawn: MeshDrawing, column: float, row: float) -> str:
        """What is at a point of its picture: the place in mm, and the measure, if it shows one."""
        spot = drawn.at(column, row)
        if spot is None:
            return ""
        x, y, z = self.result.place.mm(np.array([spot.point]))[0].tolist()
        text = f"{x:.2f}, {y:.2f}, {z:.2f} mm"
        if name not in self.known or spot.corners is None:
            return text
        value = float(self.known[name][list(spot.corners)] @ spot.weights)
        shown = f"{significant(value)} {MEASURES[name].unit}" if np.isfinite(value) else "none"
        return f"{text}   {name} {shown}"

    @property
    def figures(self) -> list[tuple[str, str]]:
        """Names and values of its figures."""
        report = self.result.report
        mesh, ml = report.mesh, report.mesh.volume_mm3 / 1000
        (x0, y0, z0), (x1, y1, z1) = mesh.bbox_mm
        return [
            ("size", " x ".join(significant(side) for side in (x1 - x0, y1 - y0, z1 - z0)) + " mm"),
            ("volume", f"{significant(ml)} ml"),
            ("mass", f"{significant(ml * START.density)} g of resin"),
            ("area", f"{significant(mesh.area_mm2 / 100)} cm2"),
            ("triangles", f"{mesh.triangles:,}"),
            ("bodies", format_count(mesh.components, "body", "bodies")),
            ("cavities", str(mesh.cavities)),
            ("voxel", f"{significant(report.voxel_mm)} mm"),
            ("made in", f"{report.seconds['total']:.1f} s"),
            ("checked", ", ".join(report.problems) or "closed, manifold, no self-intersections"),
        ]


def _limits(values: NDArray[np.float64], signed: bool) -> tuple[float, float]:
    """Values of the first and the last colour: a few of the greatest, and of the least, have the same."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 1.0
    low, high = np.quantile(known, (1 - MOST, MOST)).tolist()
    return low if signed else 0.0, max(high, low + 1e-9)


def thickness_at(of: SceneSolid, point: NDArray[np.float64], normal: NDArray[np.float64]) -> float:
    """Thickness below a point of the surface, mm; infinite if it is more than can be measured."""
    return float(_width(of, point[None], -normal[None], 1.0)[0])


def _width(
    of: SceneSolid, points: NDArray[np.float64], directions: NDArray[np.float64], towards: float
) -> NDArray[np.float64]:
    """Way through the solid, or what is empty if `towards` is -1, from points of the surface, [n], mm."""
    bricks, mesh = of.result.bricks, of.mesh
    limit = FARTHEST * float((mesh.vertices.max(0) - mesh.vertices.min(0)).max())
    step = INSIDE * bricks.voxel
    start = np.ascontiguousarray(points + step * directions)
    width = Samples(bricks).native.through(start, directions, limit, towards)
    return np.where(width < limit, of.result.place.scale * (width + step), np.inf)


def _widths(gaps: bool) -> Callable[[SceneSolid, Work], NDArray[np.float64]]:
    """Width of the wall below the surface, or of the gap above it; infinite where it is none, mm."""

    def measured(of: SceneSolid, _: Work) -> NDArray[np.float64]:
        towards = -1.0 if gaps else 1.0
        return _width(of, of.mesh.vertices, -towards * of.normals, towards)

    return measured


def _overhang(of: SceneSolid, _: Work) -> NDArray[np.float64]:
    """How far the surface leans over, 90 where it is a flat ceiling, degrees; 0 on the plate."""
    height = of.result.vertices[:, 2]
    down = np.degrees(np.arcsin(np.clip(-of.normals[:, 2], 0, 1)))
    return np.where(height - height.min() > PLATE, down, 0.0)


def _curvature(of: SceneSolid, _: Work) -> NDArray[np.float64]:
    """Mean curvature, positive where the surface bulges, 1/mm, by cotangents (Meyer 2003)."""
    vertices, triangles = of.result.vertices, of.result.triangles
    pull, area = np.zeros_like(vertices), np.zeros(len(vertices))
    twice = np.maximum(np.linalg.norm(of.result.mesh.normals, axis=1), 1e-30)
    for k in range(3):
        i, j, apex = (triangles[:, (k + step) % 3] for step in range(3))
        to_i, to_j, edge = (
            vertices[i] - vertices[apex],
            vertices[j] - vertices[apex],
            vertices[i] - vertices[j],
        )
        cotangent = (to_i * to_j).sum(1) / twice
        for axis in range(3):
            weighted = cotangent * edge[:, axis]
            pull[:, axis] += np.bincount(i, weighted, len(vertices)) - np.bincount(j, weighted, len(vertices))
        area += np.bincount(apex, twice / 6, len(vertices))
    mean: NDArray[np.float64] = (pull * of.normals).sum(1) / np.maximum(4 * area, 1e-30)
    return mean


def _error(of: SceneSolid, work: Work) -> NDArray[np.float64]:
    """Distance of the middles of the triangles around a vertex from the field, the farthest of them, um."""
    planned, place, triangles = of.result.planned, of.result.place, of.mesh.triangles
    middles = of.mesh.corners.mean(1)
    off = 1000 * place.scale * surface_error(planned.root, middles, planned.voxel, work)
    farthest = np.zeros(len(of.mesh.vertices))
    for k in range(3):
        np.maximum.at(farthest, triangles[:, k], off)
    return farthest


@dataclass(frozen=True)
class SurfaceMeasure:
    """A measure of a surface."""

    unit: str
    of: Callable[[SceneSolid, Work], NDArray[np.float64]]
    signed: bool = False  # whether colours begin below 0
    limits: tuple[float, float] | None = None  # values of the first and the last colour; by default its own


MEASURES = {
    "thickness": SurfaceMeasure("mm", _widths(False)),
    "gap": SurfaceMeasure("mm", _widths(True)),
    "overhang": SurfaceMeasure("degrees", _overhang, limits=(0.0, 90.0)),
    "curvature": SurfaceMeasure("1/mm", _curvature, signed=True),
    "error": SurfaceMeasure("um", _error),
}


def legend(solid: SceneSolid, name: str) -> dict[str, Any]:
    """Legend of a measure that was taken: its colours for a page, its limits and unit."""
    return legend_of(name, solid.limits[name], MEASURES[name].unit)


def graded(values: NDArray[np.float64], limits: tuple[float, float]) -> NDArray[np.uint8]:
    """Colours of values between two limits, sRGB [n, 3]."""
    low, high = limits
    share = np.clip((values - low) / max(high - low, 1e-30), 0, 1) * (len(PALETTE) - 1)
    stops = np.arange(len(PALETTE))
    colours = np.stack([np.interp(share, stops, PALETTE[:, k]) for k in range(3)], 1)
    return (255 * colours + 0.5).astype(np.uint8)


def legend_of(name: str, limits: tuple[float, float], unit: str) -> dict[str, Any]:
    """Legend of values between two limits: the colours of `graded` for a page, limits and unit."""
    stops = ", ".join("#" + "".join(f"{round(255 * c):02x}" for c in colour) for colour in PALETTE)
    return {
        "name": name,
        "colours": f"linear-gradient(to right, {stops})",
        "low": significant(limits[0]),
        "high": significant(limits[1]),
        "unit": unit,
    }
