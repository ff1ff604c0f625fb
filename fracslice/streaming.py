"""A mesh that is larger than memory: sampled, meshed, cleaned, checked and written piece after piece.

Twice over the surface. First its pieces are made and laid aside in a folder beside the target, while their
shells are added up; then, the whole's size and its dust being known, they are brought to size and written.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .errors import SceneError
from .export.files import check_target, replacing
from .export.stl import write_pieces
from .job import MeshJob
from .memory import peak_rss_mb
from .report import Report, SurfaceError, SurfaceToMesh, version
from .scene import Print, Scene
from .work import Clock, Work

if TYPE_CHECKING:
    from .mesh import Mesh
    from .mesh.certificate import Certificate
    from .mesh.check import MeshReport
    from .mesh.extract import Piece
    from .mesh.survey import WholeShells
    from .volume import Plan

BRICKS = 1 << 13
"""In a piece: half a gigabyte at most, in all its stages."""

MOST_ERRORS = 1 << 22
"""How many vertices are measured, evenly spread over the surface."""


def stream_mesh(
    scene: Scene,
    path: str | Path,
    what: MeshJob | None = None,
    work: Work | None = None,
    metadata: Mapping[str, str] | None = None,
) -> Report:
    """Makes what `make_mesh` makes and writes it to the STL file `path`; memory is that of a piece.

    Nothing is left of an STL that is not whole. The folder of `path` must have room for it twice. Raises
    `SceneError`, `VolumeError`, `MeshError`, `ExportError` or `Cancelled`, and `SceneError` for a base to be
    cut: that needs the whole mesh.
    """
    what, work = what or MeshJob(), work or Work()
    how = what.how(scene)
    if not how.whole:
        raise how.fail("cannot change a mesh that does not fit in memory, other than by keep and cavities")
    for name, length in (("chord", what.chord_mm), ("simplify", what.simplify_mm)):
        if length is not None:
            raise SceneError(f"{name} {length:g}mm: needs the whole mesh, which does not fit in memory")
    from .export import application
    from .mesh.certificate import Certificate
    from .mesh.extract import contour_pieces
    from .mesh.missed import surface_to_mesh
    from .mesh.survey import Survey
    from .shown import mesh_amount
    from .volume import plan, sample_scene_signs

    folder, clock, survey = check_target(path).parent, Clock(work), Survey()
    with clock("planning"):
        planned = plan(scene.root, what.voxels(scene), work)
    with clock("sampling"):
        signs = sample_scene_signs(planned, work)
    with tempfile.TemporaryDirectory(prefix=".fracslice-", dir=folder) as aside:
        pieces = Pieces(Path(aside))
        with clock("meshing"):
            for piece in contour_pieces(planned.root, signs, work, BRICKS):
                pieces.add(piece, survey.add(piece))
                work.progress("meshing", min((piece.end - planned.outer.lo[0]) / planned.outer.size[0], 1.0))
        with clock("finishing"), replacing(path) as file:
            what, grid = replace(what, printing=how), Certificate.of(signs, 0)
            finish = _Finish(planned, pieces, survey.shells(), grid, what, what.size(scene), work)
            known = {"Application": application()} | dict(metadata or {})
            back = surface_to_mesh(planned, finish.surface, finish.scale, work)
            write_pieces(finish.meshes(MOST_ERRORS / (40 * len(signs))), file, known)
        mesh, removed = finish.checked(), finish.removed
        made = mesh.volume_mm3 + removed.bodies_mm3 - removed.filled_mm3
        amount, off = mesh_amount(planned, made, finish.scale, work)
    return Report(
        scene=scene.name,
        scene_hash=scene.hash,
        version=version(),
        size_mm=what.size(scene),
        voxel_mm=finish.voxel,
        mesh=mesh,
        removed=removed,
        surface_error_mm=SurfaceError.of(finish.scale * np.concatenate(finish.errors)),
        surface_to_mesh_mm=SurfaceToMesh.of(back),
        evaluations=signs.evaluations,
        bricks=len(signs),
        seconds=clock.seconds,
        peak_rss_mb=peak_rss_mb(),
        amount_mm3=amount,
        notes=planned.notes + off,
        depths=planned.depths,
    )


@dataclass
class Pieces:
    """Pieces of a mesh in files of a folder, with the label of each triangle."""

    folder: Path
    ends: list[float] = field(default_factory=list)

    def add(self, piece: Piece, labels: np.ndarray) -> None:
        path = self.folder / f"{len(self.ends)}.npz"
        np.savez(path, vertices=piece.mesh.vertices, triangles=piece.mesh.triangles, labels=labels)
        self.ends.append(piece.end)

    def __iter__(self) -> Iterator[tuple[Mesh, np.ndarray]]:
        from .mesh import Mesh

        for number in range(len(self.ends)):
            with np.load(self.folder / f"{number}.npz") as arrays:
                yield Mesh(arrays["vertices"], arrays["triangles"]), arrays["labels"]


class _Finish:
    """The second time over the surface: what stays of it, where it is to be, what it is like."""

    def __init__(
        self,
        planned: Plan,
        pieces: Pieces,
        whole: WholeShells,
        grid: Certificate,
        what: MeshJob,
        size: float,
        work: Work,
    ) -> None:
        from .mesh.components import choose
        from .mesh.window import Window
        from .volume.rest import box_of_the_rest

        self.planned, self.pieces, self.whole, self.work = planned, pieces, whole, work
        unit = (size / max(planned.box.size)) ** 3
        dust = what.dust(float(whole.volumes.sum()) * unit)
        shells, self.misplaced = whole.nested(pieces)
        sized = replace(shells, volumes=shells.volumes * unit)
        how = what.printing or Print()
        self.stays, self.removed = choose(sized, keep=how.keep, dust_mm3=dust, cavities=how.cavities)
        bounds = np.stack([whole.low.min(axis=0), whole.high.max(axis=0)])
        rest = np.stack([whole.low[self.stays].min(axis=0), whole.high[self.stays].max(axis=0)])
        box = box_of_the_rest(planned, bounds, rest, self.tips, work)
        self.scale = size / max(box.size)
        self.offset = -self.scale * np.array([*box.centre[:2], rest[0, 2]])
        self.voxel = planned.voxel * self.scale
        self.grid = grid.scaled(self.scale).translated(self.offset)
        self.window = Window(self.voxel, work.threads)
        self.errors: list[np.ndarray] = []

    def meshes(self, share: float) -> Iterator[Mesh]:
        """The finished triangles, piece after piece, in mm; errors are kept of a share of their vertices."""
        last, stride = len(self.pieces.ends) - 1, max(1, round(1 / share))
        for number, (mesh, labels) in enumerate(self.pieces):
            self.work.check()
            self.work.progress("finishing", number / len(self.pieces.ends))
            kept = mesh.selected(self.staying(labels)).scaled(self.scale).translated(self.offset)
            end = self.scale * self.pieces.ends[number] + float(self.offset[0])
            known = replace(self.grid, holds=np.ones(len(kept.triangles), bool))
            done = self.window.add(kept, end if number < last else np.inf, known)
            self._measure(done.vertices[::stride])
            yield done

    def surface(self) -> Iterator[Mesh]:
        """All of it, scene units."""
        return (mesh for mesh, _ in self.pieces)

    def tips(self) -> np.ndarray:
        """The outermost vertices of what stays, of each piece."""
        from .volume.rest import outermost

        kept = (mesh.vertices[mesh.triangles[self.staying(labels)]] for mesh, labels in self.pieces)
        return np.concatenate([outermost(part.reshape(-1, 3)) for part in kept if len(part)])

    def staying(self, labels: np.ndarray) -> np.ndarray:
        """Which triangles with these labels stay, bool."""
        found: np.ndarray = self.stays[self.whole.of_label[labels]]
        return found

    def _measure(self, vertices: np.ndarray) -> None:
        from .volume.accuracy import surface_error

        points = (vertices - self.offset) / self.scale
        self.errors.append(surface_error(self.planned.root, points, self.planned.voxel, self.work))

    def checked(self) -> MeshReport:
        hollow = self.whole.volumes < 0
        bodies, cavities = int((self.stays & ~hollow).sum()), int((self.stays & hollow).sum())
        return self.window.report(bodies, cavities, self.misplaced)
