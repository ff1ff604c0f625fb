"""Export of a mesh: files, trimesh, pyvista and plots."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..common.extras import lacking
from ..errors import MeshError
from ..providers import provider

if TYPE_CHECKING:
    import trimesh

    from .model import Mesh

CLAY = "#efe3d0"


class Exchange:
    """Export methods of `Mesh`."""

    def _repr_png_(self) -> bytes | None:
        """Picture in a notebook; None for an empty mesh."""
        from .thumbnail import thumbnail

        mesh = cast("Mesh", self)
        return thumbnail(mesh) if len(mesh.triangles) else None

    def export(self, path: str | Path, metadata: Mapping[str, str] | None = None) -> Path:
        """Write the mesh to a file atomically.

        Parameters
        ----------
        path : str or Path
            File; the extension selects the format: .stl, .3mf, .ply, .obj or .glb.
        metadata : mapping, optional
            Names and values, as far as the format supports them, for example Title.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ExportError
            For an empty mesh, an unknown extension, or a file that cannot be written.
        """
        written: Path = provider("files").write(self, path, metadata)
        return written

    def to_trimesh(self) -> trimesh.Trimesh:
        """Copy of the mesh as a `trimesh.Trimesh`, unprocessed.

        Returns
        -------
        trimesh.Trimesh
            The same vertices and triangles; colours and, as vertex attributes, scalars.
        """
        import trimesh

        mesh = cast("Mesh", self)
        return trimesh.Trimesh(
            mesh.vertices.copy(),
            mesh.triangles.copy(),
            process=False,
            vertex_colors=None if mesh.colours is None else mesh.colours.copy(),
            vertex_attributes={name: values.copy() for name, values in mesh.scalars.items()},
        )

    def to_pyvista(self) -> Any:
        """Copy of the mesh as a `pyvista.PolyData`.

        Returns
        -------
        pyvista.PolyData
            The same vertices and triangles; scalars and, as "RGB", colours are point data.

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
        made = surface.from_regular_faces(mesh.vertices.copy(), mesh.triangles)
        for name, values in mesh.scalars.items():
            made.point_data[name] = values
        if mesh.colours is not None:
            made.point_data["RGB"] = mesh.colours
        return made

    def plot(self, **options: Any) -> Any:
        """Show the mesh in a window, or in the output of a notebook cell.

        Parameters
        ----------
        **options
            Options of `pyvista.plot`, for example ``color`` or ``off_screen``.

        Returns
        -------
        object
            Result of `pyvista.plot`.

        Raises
        ------
        MeshError
            If pyvista is not installed.
        """
        mesh = cast("Mesh", self)
        usual = {"color": CLAY} if mesh.colours is None else {"scalars": "RGB", "rgb": True}
        return self.to_pyvista().plot(**{**usual, "split_sharp_edges": True, **options})
