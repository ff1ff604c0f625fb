"""Finished meshes: written to a file while they are checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..records import MeshJob
from ..scene import Scene
from ..work import ahead
from .finishing import Check, Finish
from .report import Clock

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..mesh.checks import MeshReport
    from ..mesh.simplify import Simplified
    from .surfaces import Surface

STL = ".stl"


class Made(NamedTuple):
    """The mesh, if in one piece; its simplification, if any; its checks; and distances between its vertices,
    or points of the surface, and the other, scene units; area on the plate, mm2.
    """

    whole: Mesh | None
    simplified: Simplified | None
    report: MeshReport
    errors: np.ndarray
    back: np.ndarray
    contact: float


@dataclass(frozen=True)
class Writing:
    """Last stages of a mesh job."""

    scene: Scene  # scene of the mesh
    what: MeshJob  # the job
    clock: Clock  # threads, progress, cancellation and timing
    path: Path | None  # file to write

    def made(self, surface: Surface, finish: Finish) -> Made:
        """Finish, write and check a mesh."""
        return self._joined(surface, finish) or self._alone(surface, finish)

    def _alone(self, surface: Surface, finish: Finish) -> Made:
        """Write the file while it is checked, by threads of this process."""
        from ..mesh.checks import surface_to_mesh

        planned, work = surface.planned, self.clock.work
        with self.clock("checking"):
            back = surface_to_mesh(planned, surface.pieces.meshes, 1.0, work)
        check = Check(finish, len(surface.signs))
        whole, simplified = self._written(finish, check, finish.tips)
        return Made(whole, simplified, check.mesh, check.errors, back, check.contact)

    def _joined(self, surface: Surface, finish: Finish) -> Made | None:
        """Write the file from the pieces of a pool; None for a surface that was made here."""
        if self.clock.work.cluster is None:
            return None
        from .shared_files import write_shared
        from .shared_mesh import SharedSurface

        if not isinstance(surface, SharedSurface):
            return None
        check, mesh = write_shared(surface, finish, self.path, metadata(self.scene))
        for near in check.near:
            finish.near.include(near)
        errors = np.concatenate(check.off)
        return Made(mesh, None, finish.report(check.tally), errors, check.back, check.contact)

    def _written(
        self, finish: Finish, check: Check, tips: np.ndarray
    ) -> tuple[Mesh | None, Simplified | None]:
        """Write the file while it is checked. Returns the mesh, if in one piece, and the result of its
        simplification, if any.
        """
        from ..export import FORMATS, flushing, replacing
        from ..export.stl import write_pieces
        from ..mesh.cleaning import Finished
        from ..mesh.tips import tips_last

        finished, simplified, mesh = finish.finished(), None, None
        if self.what.simplify is not None:
            from ..mesh.simplify import simplify

            (piece,) = finished
            with self.clock("simplifying"):
                mesh, simplified = simplify(piece.mesh, self.what.simplify, self.clock.work)
            finished = iter([Finished.whole(mesh)])
        meshes = ahead(check.passing(finished))
        if several := len(finish.pieces) > 1:
            meshes = tips_last(meshes, tips)
        if self.what.colour is not None:
            meshes = self._painted(meshes, finish)
        if self.path is None:
            (mesh,) = meshes
            return mesh, simplified

        def timed() -> Iterator[Mesh]:
            nonlocal mesh
            for mesh in meshes:
                with self.clock("writing"):  # the consumer writes during the yield
                    yield mesh

        about = metadata(self.scene)
        with replacing(self.path) as file, flushing(file):
            if self.path.suffix.lower() == STL:
                write_pieces(timed(), file, about, self.clock.work)
            else:
                for whole in timed():
                    FORMATS[self.path.suffix.lower()](whole, file, about, self.clock.work)
        return None if several else mesh, simplified

    def _painted(self, meshes: Iterator[Mesh], finish: Finish) -> Iterator[Mesh]:
        """Colour the vertices. Edits that are no formulas have the colour of the object there."""
        from ..rendering.painting import paint

        assert self.what.colour is not None
        field: Any = finish.planned.root
        while field.tree is None:
            field = field.root
        for mesh in meshes:
            with self.clock("colouring"):
                points = finish.place.units(mesh.vertices)
                done = paint(field.tree, points, self.what.colour, self.clock.work)
            yield replace(mesh, colours=done.colours, scalars=done.scalars)


def metadata(scene: Scene) -> dict[str, str]:
    """Metadata of files made from a scene."""
    from ..export import application

    return {"Application": application(), "Title": scene.name, "scene_hash": scene.hash}
