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
from .finishing import Checks, Finish, surface_distances
from .mesh_steps import Executor, Local
from .report import Clock

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..mesh.simplify import Simplified
    from .surfaces import Surface


class Made(NamedTuple):
    """A finished mesh."""

    whole: Mesh | None  # the mesh, if in one piece
    simplified: Simplified | None  # its simplification, if any
    checks: Checks
    back: np.ndarray  # distances from points of the surface, scene units


@dataclass(frozen=True)
class Writing:
    """Last stages of a mesh job."""

    scene: Scene  # scene of the mesh
    what: MeshJob  # the job
    clock: Clock  # threads, progress, cancellation and timing
    path: Path | None  # file to write

    def made(self, surface: Surface, finish: Finish, executor: Executor) -> Made:
        """Finish, write and check a mesh."""
        checks = Checks()
        with self.clock("checking"):
            back = surface_distances(surface, executor, self.clock.work)
        if isinstance(executor, Local):
            return Made(*self._written(finish, checks), checks, back)
        from .shared import Shared
        from .shared_writing import write_shared

        assert isinstance(executor, Shared)
        mesh = write_shared(finish, checks, executor, self.path, metadata(self.scene))
        return Made(mesh, None, checks, back)

    def _written(self, finish: Finish, checks: Checks) -> tuple[Mesh | None, Simplified | None]:
        """Write the file while it is checked, by threads of this process. Returns the mesh, if in one piece,
        and the result of its simplification, if any.
        """
        from ..common.files import flushing, replacing
        from ..formats import mesh_format
        from ..formats.stl import write_pieces
        from ..mesh.cleaning import Finished
        from ..mesh.tips import tips_last

        finished, simplified, mesh = finish.each(self.clock), None, None
        if self.what.simplify is not None:
            from ..mesh.simplify import simplify

            ((piece, near),) = finished
            with self.clock("simplifying"):
                mesh, simplified = simplify(piece.mesh, self.what.simplify, self.clock.work)
            finished = iter([(Finished.whole(mesh), near)])
        meshes = ahead(finish.passing(finished, checks, self.clock))
        if several := len(finish.pieces) > 1:
            meshes = tips_last(meshes, finish.tips)
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
            if self.path.suffix.lower() == ".stl":
                write_pieces(timed(), file, about, self.clock.work)
            else:
                for whole in timed():
                    mesh_format(self.path.suffix.lower()).write(whole, file, about, self.clock.work)
        return None if several else mesh, simplified

    def _painted(self, meshes: Iterator[Mesh], finish: Finish) -> Iterator[Mesh]:
        """Colour the vertices. Edits that are no formulas have the colour of the object there."""
        from ..rendering.painting import paint

        assert self.what.colour is not None
        field: Any = finish.of.planned.root
        while field.tree is None:
            field = field.root
        for mesh in meshes:
            with self.clock("colouring"):
                points = finish.place.units(mesh.vertices)
                done = paint(field.tree, points, self.what.colour, self.clock.work)
            yield replace(mesh, colours=done.colours, scalars=done.scalars)


def metadata(scene: Scene) -> dict[str, str]:
    """Metadata of files made from a scene."""
    from ..version import APPLICATION

    return {"Application": APPLICATION, "Title": scene.name, "scene_hash": scene.hash}
