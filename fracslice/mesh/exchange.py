"""A mesh handed to others: files, trimesh, pyvista, and a look at it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from fracslice.errors import MeshError
from fracslice.extras import lacking

if TYPE_CHECKING:
    import trimesh

    from fracslice.mesh.model import Mesh

CLAY = "#efe3d0"


class Exchange:
    """What `Mesh` inherits to leave this library."""

    def export(self, path: str | Path, metadata: Mapping[str, str] | None = None) -> Path:
        """Write the mesh to a file, whole or not at all.

        Parameters
        ----------
        path : str or Path
            Its ending names the format: .stl, .3mf, .ply, .obj or .glb.
        metadata : mapping, optional
            Names and values that the format has room for, such as Title.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ExportError
            For an empty mesh, an unknown ending, or what the file system refuses.
        """
        from fracslice.export import write  # a method stands for the function of a layer above

        return write(cast("Mesh", self), path, metadata)

    def to_trimesh(self) -> trimesh.Trimesh:
        """The mesh as a `trimesh.Trimesh`, its vertices and triangles as they are."""
        import trimesh

        mesh = cast("Mesh", self)
        return trimesh.Trimesh(mesh.vertices.copy(), mesh.triangles.copy(), process=False)

    def to_pyvista(self) -> Any:
        """The mesh as a `pyvista.PolyData`, its vertices and triangles as they are.

        Raises
        ------
        MeshError
            If pyvista is not installed.
        """
        if reason := lacking("pyvista", "windows need"):
            raise MeshError(reason)
        import pyvista

        mesh = cast("Mesh", self)
        surface: Any = pyvista.PolyData
        return surface.from_regular_faces(mesh.vertices.copy(), mesh.triangles)

    def plot(self, **options: Any) -> Any:
        """Show the mesh: in a window, or below the cell of a notebook.

        Parameters
        ----------
        **options
            As of `pyvista.plot`, such as ``color`` or ``off_screen``.

        Returns
        -------
        object
            What pyvista returns.

        Raises
        ------
        MeshError
            If pyvista is not installed.
        """
        return self.to_pyvista().plot(**{"color": CLAY, "split_sharp_edges": True, **options})
