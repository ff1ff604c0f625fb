"""What is wrong with the mesh of a scene: nothing, whatever its numbers."""

from __future__ import annotations

from dataclasses import dataclass

from fracslice import MeshJob, make_mesh
from fracslice.errors import FracsliceError
from fracslice.formulas import Node
from fracslice.mesh.model import to_manifold
from fracslice.scene import scene
from fracslice.work import Work


@dataclass(frozen=True)
class Outcome:
    """faults: why the mesh is not a printable solid. repaired: violations of bounds that the audit or the
    closure rule found. refused: the one line that reported why there is no mesh.
    """

    faults: tuple[str, ...] = ()
    repaired: int = 0
    refused: str = ""


def outcome(root: Node, resolution: float, threads: int = 1) -> Outcome:
    """Makes the mesh of a scene and has it checked by our own exact check and by manifold3d."""
    try:
        result = make_mesh(scene(root, size="50mm"), MeshJob(resolution=resolution), Work(threads=threads))
    except FracsliceError as error:
        return Outcome(refused=str(error))
    report, actual = result.report.mesh, list(result.report.mesh.problems)
    for name in ("watertight", "manifold", "oriented"):
        if not getattr(report, name):
            actual.append(f"not {name}")
    status = to_manifold(result.mesh).status().name
    if status != "NoError":
        actual.append(f"manifold3d: {status}")
    return Outcome(tuple(actual), result.bricks.repaired)
