"""The mesh job: from a scene to a checked, printable mesh."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np

from . import surfaces
from .checking import Check
from .clock import Clock
from .errors import SceneError, SharedError, TooLargeError
from .finishing import Finish
from .memory import peak_rss_mb
from .meshjob import MeshJob
from .meshresult import MeshResult
from .planning import Sized, edited, planned
from .report import Report, SurfaceError, SurfaceToMesh
from .scene import Scene
from .version import __version__
from .work import Work, ahead

if TYPE_CHECKING:
    from .mesh import Mesh
    from .mesh.check import MeshReport
    from .mesh.simplify import Simplified
    from .meshrecipe import MeshRecipe
    from .surfaces import Surface
    from .volume import Plan, SignBricks
    from .volume.sizing import Sizing

STL = ".stl"
COLOURED = (".ply", ".glb", ".3mf")
"""Formats that hold colours of vertices."""


def make_mesh(
    scene: Scene, what: MeshJob | None = None, work: Work | None = None, path: str | Path | None = None
) -> MeshResult:
    """Sample, mesh, clean, scale and check a scene.

    Parameters
    ----------
    scene : Scene
        Scene to mesh.
    what : MeshJob, optional
        Size, resolution and changes of the mesh.
    work : Work, optional
        Threads, progress and cancellation.
    path : str or Path, optional
        File to write; the extension selects the format. An .stl file may be larger than memory: it is then
        written in pieces, and its folder needs twice its size of free space.

    Returns
    -------
    MeshResult
        The mesh and its report. A mesh that is not printable is returned, too; its report lists the problems.

    Raises
    ------
    SceneError, VolumeError, MeshError, ExportError, Cancelled
        For a scene or job that cannot be meshed, or a file that cannot be written; no incomplete file is
        left. `TooLargeError`, a `VolumeError`, for a mesh that needs more memory than is available.
    """
    job = _Job(scene, what or MeshJob(), Clock(work or Work()), None if path is None else Path(path))
    job.refuse()
    with job.aside() as aside:
        return job.result(*job.surface(aside))


class _Made(NamedTuple):
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
class _Job:
    """Stages of a job."""

    scene: Scene
    what: MeshJob
    clock: Clock
    path: Path | None

    @cached_property
    def size(self) -> Sizing:
        """Size of the object."""
        from .volume.sizing import sizing

        return sizing(self.scene, self.what.size_mm, self.what.scale, self.clock.work)

    def refuse(self) -> None:
        """Raise the errors of invalid arguments before any work is done."""
        self.what.voxels(self.size.longest)
        if self.path is not None:
            from .export import check_format, check_target

            ending = check_format(self.path)
            check_target(self.path)
            if self.what.colour is not None and ending not in COLOURED:
                raise SceneError(f"colour: expected a file that holds colours: {', '.join(COLOURED)}")
        if self.what.colour is not None and self.clock.work.cluster is not None:
            raise SceneError(f"colour {self.what.colour}: expected no cluster and no shard")

    @contextmanager
    def aside(self) -> Iterator[Callable[[], Path] | None]:
        """Yield a function that makes a folder for pieces beside the file; None if the format does not
        support pieces.
        """
        if self.path is None or self.path.suffix.lower() != STL:
            yield None
            return
        from .export import check_target

        beside = check_target(self.path).parent
        with ExitStack() as stack:
            yield lambda: Path(
                stack.enter_context(tempfile.TemporaryDirectory(prefix=".fracslice-", dir=beside))
            )

    def needing_all(self) -> Iterator[tuple[str, float]]:
        """Names and lengths of changes that need a mesh in one piece."""
        for name, length in (("chord", self.what.chord_mm), ("simplify", self.what.simplify_mm)):
            if length is not None:
                yield name, length

    def sampled(self) -> tuple[Sized, SignBricks, bool]:
        """Field, its samples, and the choice of bodies that is left to the mesh; true if the field chose.

        Samples of walls thinner than a voxel do not tell bodies from crumbs: the field then chooses.
        """
        sized, how = planned(self.scene, self.what, self.size, self.clock), self.what.how(self.scene)
        signs = self.signs(sized.planned, False)
        thin = how.sorts and surfaces.has_thin_walls(signs)
        if again := thin and how.whole:
            sized = edited(sized.planned, self.scene, self.what, self.size, self.clock)
            signs = self.signs(sized.planned, True)
            thin = surfaces.has_thin_walls(signs)
        return replace(sized, left=replace(sized.left, keep="all")) if thin else sized, signs, again

    def recipe(self, again: bool) -> MeshRecipe:
        """Recipe of the field, for other processes; `again` if the field chose the bodies."""
        from .meshrecipe import MeshRecipe
        from .scene.writer import to_xml

        return MeshRecipe(to_xml(self.scene), self.scene.name, self.what, again)

    def signs(self, planned: Plan, again: bool) -> SignBricks:
        """Samples, by the pool of the work if there is one; a GPU samples here."""
        work = self.clock.work
        if work.cluster is None or work.device != "cpu":
            return surfaces.sampled(planned, self.clock)
        from .meshsampling import by_pool

        job, evaluate = by_pool(self.recipe(again), planned, work.cluster, work)
        signs = surfaces.sampled(planned, self.clock, evaluate)
        work.cluster.finished(job)
        return signs

    def surface(self, aside: Callable[[], Path] | None) -> tuple[Sized, Surface]:
        """Surface, in one piece if it fits in memory, and the choice of bodies that is left."""
        sized, signs, again = self.sampled()
        if (pool := self.clock.work.cluster) is not None:
            if not any(self.needing_all()):
                from .sharedmesh import shared_surface

                return sized, shared_surface(self.recipe(again), sized.planned, signs, pool, self.clock)
            if not pool.first:
                raise SharedError("the samples are made; shard 1 makes the mesh of them and writes the file")
        most, voxel = len(signs), self.size.longest / self.what.voxels(self.size.longest)
        try:
            surfaces.refuse_what_does_not_fit(signs, voxel)
        except TooLargeError as error:
            for name, length in self.needing_all():
                raise SceneError(f"{name} {length:g}mm needs the whole mesh: {error}") from None
            if aside is None:
                raise TooLargeError(f"{error}, and an .stl file is written piece after piece") from None
            most = surfaces.BRICKS
        folder = aside() if aside and most < len(signs) else None
        return sized, surfaces.surface_of(sized.planned, signs, most, folder, self.clock)

    def result(self, sized: Sized, surface: Surface) -> MeshResult:
        """Finished mesh and report."""
        from .mesh.touching import touching_note
        from .shown import mesh_amount

        what, clock, size, refined = self.what, self.clock, self.size, None
        planned, signs, thin = surface.planned, surface.signs, surface.thin
        if what.chord_mm is not None:
            unit = sized.scale or size.scale(planned.box)
            surface, done = surfaces.refined(surface, what.chord_mm / unit, clock)
            refined = done.scaled(unit)
        with clock("finishing"):
            finish = Finish(surface, sized.left, what.dust, size, sized.scale, clock)
        scale = finish.place.scale
        made = self.joined(surface, finish) or self.alone(surface, finish)
        with clock("checking"):
            amount, off = mesh_amount(planned, finish.volume, scale, clock.work)
        fell = f"{thin}; expected a smaller voxel, or a thickness of {2 * scale * planned.voxel:.2g} mm"
        report = Report(
            scene=self.scene.name,
            scene_hash=self.scene.hash,
            version=__version__,
            size_mm=size.longest,
            voxel_mm=planned.voxel * scale,
            mesh=made.report,
            removed=finish.removed,
            surface_error_mm=SurfaceError.of(scale * made.errors),
            surface_to_mesh_mm=SurfaceToMesh.of(scale * made.back),
            evaluations=signs.evaluations,
            proved=signs.proved,
            bricks=len(signs),
            seconds=clock.seconds,
            peak_rss_mb=peak_rss_mb(),
            amount_mm3=amount,
            refined=refined,
            simplified=made.simplified,
            notes=(
                *planned.notes,
                *([fell] if thin else ()),
                *(refined.notes if refined else ()),
                *touching_note(finish.near.count, planned.voxel * scale),
                *off,
            ),
            depths=planned.depths,
            contact_mm2=float(f"{made.contact:.9g}"),  # sums over pieces differ in the last digit
            cavities_mm3=float(f"{finish.cavities:.9g}"),
        )
        return MeshResult(report, finish.place, planned, made.whole, clock.work)

    def alone(self, surface: Surface, finish: Finish) -> _Made:
        """Write the file while it is checked, by threads of this process."""
        from .mesh.missed import surface_to_mesh

        planned, work = surface.planned, self.clock.work
        with self.clock("checking"):
            back = surface_to_mesh(planned, surface.pieces.meshes, 1.0, work)
        check = Check(finish, len(surface.signs))
        whole, simplified = self.written(finish, check, finish.place.mm(surface.tips))
        return _Made(whole, simplified, check.mesh, check.errors, back, check.contact)

    def joined(self, surface: Surface, finish: Finish) -> _Made | None:
        """Write the file from the pieces of a pool; None for a surface that was made here."""
        if self.clock.work.cluster is None:
            return None
        from .export import FORMATS
        from .export.stl import concatenate
        from .sharedmesh import SharedSurface, finished, whole

        if not isinstance(surface, SharedSurface):
            return None
        check, blocks = finished(surface, finish)
        ending = STL if self.path is None else self.path.suffix.lower()
        mesh = None
        if not self.path or ending != STL:
            mesh = whole(blocks)
            finish.count_near()
        if self.path:
            with self.file(self.path) as (file, about):
                if mesh is None:
                    concatenate(blocks, file, about)
                else:
                    FORMATS[ending](mesh, file, about)
        check.end()
        errors = np.concatenate(check.off)
        return _Made(mesh, None, finish.report(check.tally), errors, check.back, check.contact)

    @contextmanager
    def file(self, path: Path) -> Iterator[tuple[BinaryIO, dict[str, str]]]:
        """Open the file, and return what it says about itself."""
        from .export import application, flushing, replacing

        with replacing(path) as file, flushing(file):
            yield file, {"Application": application()} | metadata(self.scene)

    def written(
        self, finish: Finish, check: Check, tips: np.ndarray
    ) -> tuple[Mesh | None, Simplified | None]:
        """Write the file while it is checked. Returns the mesh, if in one piece, and the result of its
        simplification, if any.
        """
        from .export import FORMATS
        from .export.stl import write_pieces
        from .mesh.halo import Finished
        from .mesh.tip_triangles import tips_last

        finished, simplified, mesh = finish.finished(), None, None
        if self.what.simplify_mm is not None:
            from .mesh.simplify import simplify

            (piece,) = finished
            with self.clock("simplifying"):
                mesh, simplified = simplify(piece.mesh, self.what.simplify_mm, self.clock.work)
            finished = iter([Finished.whole(mesh)])
        meshes = ahead(check.passing(finished))
        if several := len(finish.pieces) > 1:
            meshes = tips_last(meshes, tips)
        if self.what.colour is not None:
            meshes = self.painted(meshes, finish)
        if self.path is None:
            (mesh,) = meshes
            return mesh, simplified

        def timed() -> Iterator[Mesh]:
            nonlocal mesh
            for mesh in meshes:
                with self.clock("writing"):  # the consumer writes during the yield
                    yield mesh

        with self.file(self.path) as (file, about):
            if self.path.suffix.lower() == STL:
                write_pieces(timed(), file, about)
            else:
                for whole in timed():
                    FORMATS[self.path.suffix.lower()](whole, file, about)
        return None if several else mesh, simplified

    def painted(self, meshes: Iterator[Mesh], finish: Finish) -> Iterator[Mesh]:
        """Colour the vertices. Edits that are no formulas have the colour of the object there."""
        from .rendering.painting import paint

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
    """Metadata of files made from a scene.

    Parameters
    ----------
    scene : Scene
        The scene.

    Returns
    -------
    dict
        Title and hash.
    """
    return {"Title": scene.name, "scene_hash": scene.hash}
