"""From bricks to a printable solid: extraction, solids, components and checks."""

from fracslice.mesh.model import Mesh

__all__ = ["Mesh"]
