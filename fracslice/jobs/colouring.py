"""Colours of finished meshes: of their vertices, and of the filaments that they are printed with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..common.messages import lacking
from ..errors import SceneError
from ..formats import ENDINGS, check_format, mesh_format

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from ..fields.field import Field
    from ..mesh import Mesh
    from ..mesh.filaments import Colours
    from ..records import MeshJob
    from ..rendering.materials import Paint
    from ..work import Work
    from .report import Placement


def refuse_colours(what: MeshJob, path: str | Path | None) -> None:
    """Raise SceneError for colours that the file of a mesh does not hold, and bodies that cannot be made."""
    if what.bodies and (reason := lacking("manifold3d", "bodies of filaments need")):
        raise SceneError(reason)
    if path is None:
        return
    ending = check_format(path)
    if what.colour is not None and not mesh_format(ending).has_colours:
        coloured = ", ".join(name for name in ENDINGS if mesh_format(name).has_colours)
        raise SceneError(f"colour: expected a file that holds colours: {coloured}")
    if what.bodies and ending != ".3mf":
        raise SceneError("bodies: expected a file that holds them, .3mf")


@dataclass(frozen=True)
class Colouring:
    """The colours of an object; what print edits made has the colour of the object there."""

    root: Field
    what: MeshJob
    work: Work

    def paint(self, points: np.ndarray) -> Paint:
        """Colours at points, scene units."""
        from ..rendering.materials import paint

        root, what = self.root, self.what
        while root.tree is None:
            root = root.root  # type: ignore[attr-defined]
        assert what.colour is not None
        return paint(root.tree, points, what.colour, self.work, what.palette)

    def at(self, place: Placement) -> Callable[[np.ndarray], Colours]:
        """Function of the colours at points of a mesh, mm, which lies at a place."""
        return lambda points: self.paint(place.units(points)).colours

    def coloured(self, mesh: Mesh, place: Placement) -> Mesh:
        """A mesh with colours and scalars of its vertices."""
        done = self.paint(place.units(mesh.vertices))
        return replace(mesh, colours=done.colours, scalars=done.scalars)

    def printed(self, mesh: Mesh, place: Placement, filaments: Colours) -> Mesh:
        """A coloured mesh of filaments."""
        from ..mesh.filaments import with_filaments

        return with_filaments(mesh, filaments, self.at(place), self.what.bodies, self.work)

    def whole(self, mesh: Mesh, place: Placement) -> Mesh:
        """A mesh with the colours that are wanted, of the filaments that suit it."""
        from ..mesh.filaments import chosen_filaments

        made = self.coloured(mesh, place)
        if self.what.filaments is None:
            return made
        return self.printed(made, place, chosen_filaments(made, self.what.filaments, self.at(place)))
