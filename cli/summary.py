"""Text summaries of meshes and reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fracslice.common.digits import counted, decimal

if TYPE_CHECKING:
    from fracslice.jobs.report import Report
    from fracslice.mesh.mesh_report import MeshReport


def summary(path: str, report: Report) -> str:
    """Summary of a mesh job: figures, notes and accuracy."""
    error, back, fewer = report.surface_error_mm, report.surface_to_mesh_mm, ""
    if report.simplified is not None:
        done = report.simplified
        off = max(done.bound_mm, done.back_mm)
        fewer = f"simplified from {done.from_triangles:,} triangles, at most {off:.3g} mm off\n"
    notes = "".join(f"{note}\n" for note in report.notes)
    return (
        f"{path}: {figures(report.mesh, report.problems)}\n{notes}"
        f"{fewer}vertices {error.mean * 1000:.2g} um from the surface (99 %: {error.p99 * 1000:.2g} um), "
        f"the surface {back.mean:.2g} mm from the mesh (at most {back.max:.2g} mm), "
        f"voxel {report.voxel_mm:.3g} mm, {report.seconds['total']:.1f} s, {report.peak_rss_mb:.0f} MB"
    )


def figures(mesh: MeshReport, problems: Sequence[str] | None = None) -> str:
    """Figures and printability of a mesh, in one line; by default, the problems are the mesh's own."""
    problems = mesh.problems if problems is None else problems
    verdict = f"would not print: {', '.join(problems)}" if problems else "watertight, manifold"
    return f"{sizes(mesh)}, {verdict}"


def sizes(mesh: MeshReport) -> str:
    """Triangles, size, volume and bodies of a mesh, in one line."""
    (x0, y0, z0), (x1, y1, z1) = mesh.bbox_mm
    size = " x ".join(map(decimal, (x1 - x0, y1 - y0, z1 - z0))) + " mm"
    triangles, bodies = counted(mesh.triangles, "triangle"), counted(mesh.components, "body", "bodies")
    volume = mesh.volume_mm3
    amount = f"{decimal(volume / 1000)} cm3" if volume >= 1000 else f"{decimal(volume)} mm3"
    return f"{triangles}, {size}, {amount}, {bodies}"
