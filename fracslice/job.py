"""The main job, from a scene to a printable mesh with the numbers that prove it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from . import surfaces
from .errors import SceneError, TooLargeError
from .finishing import Check, Finish, Placement
from .memory import peak_rss_mb
from .meshjob import MeshJob
from .report import Report, SurfaceError, SurfaceToMesh, version
from .scene import Print, Scene
from .work import Clock, Work

if TYPE_CHECKING:
    from .kernel import Field
    from .mesh import Mesh
    from .mesh.simplify import Simplified
    from .surfaces import Surface
    from .volume import Bricks, Plan

STL = ".stl"


@dataclass(frozen=True, eq=False)
class Result:
    """A mesh that was made, and what is told of it. place: the map from the scene to the mesh. planned: what
    was sampled. whole: the mesh, unless it is larger than memory and only in the file.
    """

    report: Report
    place: Placement
    planned: Plan
    whole: Mesh | None
    work: Work

    @property
    def mesh(self) -> Mesh:
        """The mesh in mm, standing on z = 0, coordinates as a file holds them.

        Raises `TooLargeError` for one that was written piece after piece.
        """
        if self.whole is None:
            raise TooLargeError("the mesh does not fit in memory; it is in the file that was written")
        return self.whole

    @property
    def root(self) -> Field:
        """The field that was meshed."""
        return self.planned.root

    @cached_property
    def bricks(self) -> Bricks:
        """Samples of the field where the mesh was made, scene units; taken when first asked for."""
        from .volume import sample_scene

        return sample_scene(self.planned, self.work)

    @property
    def bricks_mm(self) -> Bricks:
        """The samples in the mesh's space: position and values in mm."""
        scale, (x, y, z) = self.place.scale, self.bricks.origin
        dx, dy, dz = self.place.offset
        return replace(
            self.bricks,
            origin=(scale * x + dx, scale * y + dy, scale * z + dz),
            voxel=scale * self.bricks.voxel,
            values=self.bricks.values * np.float32(scale),
        )


def make_mesh(
    scene: Scene, what: MeshJob | None = None, work: Work | None = None, path: str | Path | None = None
) -> Result:
    """Sample, mesh, clean, scale and check a scene.

    Parameters
    ----------
    scene
        The scene to mesh.
    what, work
        What to make of it, and how.
    path
        The file to write, of the kind that its name ends in. An .stl file may be larger than memory: it is
        then made piece after piece, and its folder must have room for it twice.

    Returns
    -------
    Result
        The mesh and its report. A mesh that would not print as it is is returned all the same; its report
        says what is wrong.

    Raises
    ------
    SceneError, VolumeError, MeshError, ExportError, Cancelled
        For a scene or job that cannot be meshed or a file that cannot be written; nothing is left of a file
        that is not whole. `TooLargeError`, a `VolumeError`, for a mesh that needs more memory than there is.
    """
    job = _Job(scene, what or MeshJob(), Clock(work or Work()), None if path is None else Path(path))
    job.refuse()
    with job.aside() as aside:
        return job.result(*job.surface(aside))


@dataclass(frozen=True)
class _Sized:
    """A plan; mm per scene unit, if that is known; and what is left to choose among its bodies."""

    planned: Plan
    scale: float | None
    left: Print


@dataclass(frozen=True)
class _Job:
    """The stages of a job."""

    scene: Scene
    what: MeshJob
    clock: Clock
    path: Path | None

    def refuse(self) -> None:
        """Raise an error for what cannot be done, before any of it is."""
        self.what.voxels(self.scene)
        if self.path is not None:
            from .export import check_format, check_target

            check_format(self.path)
            check_target(self.path)

    @contextmanager
    def aside(self) -> Iterator[Callable[[], Path] | None]:
        """Yields what makes a folder for pieces beside the file, or None where the file takes no pieces."""
        if self.path is None or self.path.suffix.lower() != STL:
            yield None
            return
        from .export import check_target

        beside = check_target(self.path).parent
        with ExitStack() as stack:
            yield lambda: Path(
                stack.enter_context(tempfile.TemporaryDirectory(prefix=".fracslice-", dir=beside))
            )

    def planned(self) -> _Sized:
        """The field to be meshed, edited if it is to be."""
        from .volume import plan

        how = self.what.how(self.scene)
        with self.clock("planning"):
            planned = plan(self.scene.root, self.what.voxels(self.scene), self.clock.work)
        return _Sized(planned, None, how) if how.whole else self.edited(planned)

    def edited(self, planned: Plan) -> _Sized:
        """The field with all edits that make it printable."""
        from .printing import printable

        how = self.what.how(self.scene)
        with self.clock("changing"):
            made, scale = printable(planned, self.what.size(self.scene), how, self.clock.work)
        # Of walls thinner than a voxel a mesh has crumbs only: bodies are chosen in the field where it tells.
        keep = how.keep if planned.root.bounds.exterior_only else "all"
        # A hollow is a cavity, too.
        return _Sized(made, scale, Print(keep=keep, cavities=how.cavities if how.whole else "keep"))

    def surface(self, aside: Callable[[], Path] | None) -> tuple[_Sized, Surface, str]:
        """The surface of what stays; and a note on walls that are thinner than a voxel."""
        sized = self.planned()
        surface = self.meshed(sized, aside)
        thin, how = surface.thin, self.what.how(self.scene)
        if thin and how.whole and how.sorts:  # what is one body only the field tells
            sized = self.edited(sized.planned)
            surface = self.meshed(sized, aside)
            thin = surface.thin
        return replace(sized, left=replace(sized.left, keep="all")) if thin else sized, surface, thin

    def meshed(self, sized: _Sized, aside: Callable[[], Path] | None) -> Surface:
        """The surface, in one piece if it fits in memory."""
        signs = surfaces.sampled(sized.planned, self.clock)
        most, voxel = len(signs), self.what.size(self.scene) / self.what.voxels(self.scene)
        try:
            surfaces.refuse_what_does_not_fit(signs, voxel)
        except TooLargeError as error:
            for name, length in (("chord", self.what.chord_mm), ("simplify", self.what.simplify_mm)):
                if length is not None:
                    raise SceneError(f"{name} {length:g}mm needs the whole mesh: {error}") from None
            if aside is None:
                raise TooLargeError(f"{error}, and an .stl file is written piece after piece") from None
            most = surfaces.BRICKS
        folder = aside() if aside and most < len(signs) else None
        return surfaces.made(sized.planned, signs, most, folder, self.clock)

    def result(self, sized: _Sized, surface: Surface, thin: str) -> Result:
        """The finished mesh, and what is told of it."""
        from .mesh.missed import surface_to_mesh
        from .shown import mesh_amount

        what, clock, size, refined = self.what, self.clock, self.what.size(self.scene), None
        planned, signs = surface.planned, surface.signs
        if what.chord_mm is not None:
            unit = sized.scale or size / max(planned.box.size)
            surface, done = surfaces.refined(surface, what.chord_mm / unit, clock)
            refined = done.scaled(unit)
        with clock("finishing"):
            finish = Finish(surface, sized.left, what.dust, size, sized.scale, clock)
        scale = finish.place.scale
        with clock("checking"):
            back = surface_to_mesh(planned, surface.pieces.meshes, scale, clock.work)
        check = Check(finish, len(signs))
        whole, simplified = self.written(finish, check, finish.place.mm(surface.tips))
        with clock("checking"):
            amount, off = mesh_amount(planned, finish.volume, scale, clock.work)
        fell = f"{thin}; expected a smaller voxel, or a thickness of {2 * scale * planned.voxel:.2g} mm"
        report = Report(
            scene=self.scene.name,
            scene_hash=self.scene.hash,
            version=version(),
            size_mm=size,
            voxel_mm=planned.voxel * scale,
            mesh=check.mesh,
            removed=finish.removed,
            surface_error_mm=SurfaceError.of(check.errors),
            surface_to_mesh_mm=SurfaceToMesh.of(back),
            evaluations=signs.evaluations,
            bricks=len(signs),
            seconds=clock.seconds,
            peak_rss_mb=peak_rss_mb(),
            amount_mm3=amount,
            refined=refined,
            simplified=simplified,
            notes=(*planned.notes, *([fell] if thin else ()), *(refined.notes if refined else ()), *off),
            depths=planned.depths,
        )
        return Result(report, finish.place, planned, whole, clock.work)

    def written(
        self, finish: Finish, check: Check, tips: np.ndarray
    ) -> tuple[Mesh | None, Simplified | None]:
        """The mesh, if it is one piece, and what was done to have fewer triangles; the file is written."""
        from .export import write

        finished, simplified = finish.finished(), None
        if len(finish.pieces) > 1:
            self.streamed(check.passing(finished), tips)
            return None, None
        if self.what.simplify_mm is not None:
            from .mesh.simplify import simplify
            from .mesh.window import Finished

            (piece,) = finished
            with self.clock("simplifying"):
                mesh, simplified = simplify(piece.mesh, self.what.simplify_mm, self.clock.work)
            finished = iter([Finished.whole(mesh)])
        (mesh,) = check.passing(finished)
        if self.path is not None:
            with self.clock("writing"):
                write(mesh, self.path, metadata(self.scene))
        return mesh, simplified

    def streamed(self, meshes: Iterator[Mesh], tips: np.ndarray) -> None:
        """Write an STL piece after piece."""
        from .export import application, replacing
        from .export.stl import write_pieces
        from .mesh.window import tips_last

        def timed() -> Iterator[Mesh]:
            for mesh in tips_last(meshes, tips) if len(tips) else meshes:
                with self.clock("writing"):  # what is done between pieces
                    yield mesh

        assert self.path is not None
        with replacing(self.path) as file:
            write_pieces(timed(), file, {"Application": application()} | metadata(self.scene))


def metadata(scene: Scene) -> dict[str, str]:
    """What files say of the scene that they were made of."""
    return {"Title": scene.name, "scene_hash": scene.hash}
