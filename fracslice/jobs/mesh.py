"""The mesh job: from a scene to a checked, printable mesh, which is written while it is checked, or to a 3MF
file that holds its formula.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..common.arrays import product
from ..common.memory import peak_rss_mb
from ..errors import EmptyError, MeshError, SceneError, SharedError, TooLargeError, VolumeError, keeping
from ..fields.box import Box
from ..fields.field import Field
from ..formulas import Node
from ..records import SAME, UP, MeshJob
from ..scene import Print, Scene
from ..version import __version__
from ..work import Work, ahead, in_background
from . import mesh_steps
from .colouring import Colouring, refuse_colours
from .mesh_steps import (
    Checks,
    Executor,
    Finish,
    Local,
    Sized,
    apply_edits,
    in_mm,
    plan_mesh,
    surface_distances,
)
from .report import Clock, Placement, Report, Result, SurfaceError, SurfaceToMesh

if TYPE_CHECKING:
    from ..common.arrays import Triangles
    from ..mesh import Mesh
    from ..mesh.simplify import Simplified
    from ..volume import Plan, SignBricks
    from ..volume.amount import Sizing
    from .mesh_steps import Surface
    from .shared import MeshRecipe


def make_mesh(
    scene: Scene, what: MeshJob | None = None, work: Work | None = None, path: str | Path | None = None
) -> Result:
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
    Result
        The mesh and its report. A mesh that is not printable is returned, too; its report lists the problems.

    Raises
    ------
    SceneError, VolumeError, MeshError, ExportError, Cancelled
        For a scene or job that cannot be meshed, or a file that cannot be written; no incomplete file is
        left. `TooLargeError`, a `VolumeError`, for a mesh that needs more memory than is available.
        `KeptError`, a `Cancelled`, if the file is written when the work is cancelled.
    """
    job = _Job(scene, what or MeshJob(), Clock(work or Work()), None if path is None else Path(path))
    job.refuse()
    return job.best()


def mesh_of_part(scene: Scene, whole: Plan, scale: float, root: Field, what: MeshJob, work: Work) -> Result:
    """Mesh of a part of an object.

    `whole`: the object, `root`: the part, both of `scale` mm per scene unit; `what`: voxel or resolution, and
    the bodies that are chosen in the mesh.
    """
    from ..volume import extent

    extents = extent(root, work)
    side = scale * max(extents.box.size)
    what = replace(what, size=side, scale=SAME, up=UP)
    planned = replace(
        whole,
        root=root,
        box=extents.box,
        outer=extents.outer,
        tips=extents.tips,
        voxel=side / what.voxels(side) / scale,
        drains=(),
        undrilled=None,
        supports=None,
    )
    return _Job(scene, what, Clock(work), None, Sized(planned, scale, what.edits(scene))).best()


PLUG = 24
"""Voxels along the longest side of a plug."""


def make_plugs(scene: Scene, whole: Result, clearance: float, work: Work | None = None) -> list[Mesh]:
    """Make plugs for the drain holes of a mesh: what was cut out there, less a clearance all around.

    Parameters
    ----------
    scene : Scene
        The scene of the mesh.
    whole : Result
        The mesh.
    clearance : float
        Gap around the plugs, mm.
    work : Work, optional
        Threads, progress and cancellation.

    Returns
    -------
    list of Mesh
        A plug for each hole, upright on its inner end, mm.

    Raises
    ------
    VolumeError
        If there is no hole, or the clearance leaves nothing.
    """
    from ..printing.drains import plugs

    planned, scale = whole.planned, whole.place.scale
    if not planned.drains:
        raise VolumeError("plugs: expected drain holes, by drain_at or hollow")
    made, left = [], Print(keep="largest", cavities="fill")
    for drain, root in plugs(planned, clearance / scale):
        chord = max(clearance, scale * drain.radius / 8) / 8
        what = MeshJob(resolution=PLUG, chord=chord, printing=left)
        plug = mesh_of_part(scene, planned, scale, root, what, work or Work())
        made.append(standing_on(plug.mesh, np.array(drain.end) - drain.start))
    return made


def make_apart(scene: Scene, what: MeshJob, work: Work | None = None) -> tuple[Result, Result]:
    """Make the mesh of an object, and that of its supports, which reach into it at their tips.

    Parameters
    ----------
    scene : Scene
        Scene to mesh.
    what : MeshJob
        Size, resolution and changes of the mesh, with supports.
    work : Work, optional
        Threads, progress and cancellation.

    Returns
    -------
    tuple of Result
        Of the object and of the supports, each standing on z = 0; `Result.place` says where they belong.

    Raises
    ------
    SceneError
        Without supports.
    VolumeError
        If the object needs none, and as `make_mesh`.
    """
    from ..volume import plan

    how, clock = what.edits(scene), Clock(work or Work())
    if how.supports == "none":
        raise SceneError("support_body: expected supports, such as medium")
    job = _Job(scene, what, clock, None)
    job.refuse()
    sized = plan_mesh(scene, what, job.size, clock)
    held, voxel = sized.planned.supports, sized.planned.voxel
    if held is None:
        raise VolumeError("support_body: the object needs no supports")
    results = []
    for root, supports, keep in (
        (held.carried, None, sized.left),
        (held.node, replace(held, box=None), Print()),
    ):
        planned = plan(root, max(root.bounds.box.size) / voxel, clock.work)
        planned = replace(planned, voxel=voxel, supports=supports)
        own = replace(what, printing=replace(how, supports="none", raft=0.0) if supports is None else Print())
        results.append(_Job(scene, own, clock, None, Sized(planned, sized.scale, keep)).made()[0])
    return results[0], results[1]


def standing_on(mesh: Mesh, up: np.ndarray) -> Mesh:
    """Mesh, turned so that a direction is up, centred on z = 0."""
    up = up / np.linalg.norm(up)
    right = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    right /= np.linalg.norm(right)
    turned = replace(mesh, vertices=product(mesh.vertices, np.stack([right, np.cross(up, right), up], 1)))
    (x0, y0, z0), (x1, y1, _) = turned.bounds.tolist()
    return turned.translated(np.array([-(x0 + x1) / 2, -(y0 + y1) / 2, -z0]))


def noted(result: Result, text: str) -> Result:
    """A result with one note more."""
    report = replace(result.report, notes=(text, *result.report.notes))
    return Result(report, result.place, result.planned, result.whole, result.work)


LATER = "cleaning", "checks", "tips"
"""Modules of meshes that follow contouring."""


def import_ahead() -> None:
    """Import modules of later stages, while native code samples and contours."""
    for module in ("export", *(f"mesh.{name}" for name in LATER)):
        import_module(f"fracslice.{module}")


OWN = "the triangles are those of the model; with a voxel or a resolution it is meshed anew"
"""Note on a scene that is nothing but a model."""
PIXEL = 0.2
"""Pixels by which the slope of the surface is measured for heights of layers, mm."""

THIN = "tetrahedra show what is thinner than a voxel; samples lose"
"""First part of the note on a mesh of tetrahedra."""

TRIES = 2
"""How many times a job that lost its object samples finer."""

RAISED = 1024
"""Greatest number of voxels along the longest side that a job chooses by itself: seconds, and a gigabyte."""


@dataclass(frozen=True)
class _Job:
    """Stages of a job."""

    scene: Scene
    what: MeshJob
    clock: Clock
    path: Path | None
    given: Sized | None = None  # the field, if it is not that of the scene
    split: bool = False  # whether tetrahedra are split until they show what is thinner than a voxel

    @cached_property
    def size(self) -> Sizing:
        """Size of the object."""
        from ..volume.amount import sizing

        return sizing(self.scene, self.what.size, self.what.scale, self.clock.work)

    def best(self) -> Result:
        """Result; of tetrahedra, or else of finer samples, where samples as asked for lose the object."""
        try:
            first, finer = self.made()
        except EmptyError:
            if (split := self.split_up()) is None:
                raise
            return noted(split, f"{THIN} all of it")
        report = first.report
        if report.lost and (split := self.split_up()) is not None:
            share = report.missing_volume_share
            part = f"{share:.1%} of the object's volume" if share > 0 else "an element of the scene"
            return noted(split, f"{THIN} {part}")
        result = first
        with suppress(TooLargeError):  # what was made is returned, and says what it lacks
            for _ in range(TRIES):
                if finer is None:
                    break
                result, finer = finer.made()
        if result is first:
            return result
        voxels = f"voxel {result.report.voxel_mm:.3g} mm instead of {report.voxel_mm:.3g} mm"
        return noted(result, f"{voxels}: {', '.join(report.lost)}")

    def split_up(self) -> Result | None:
        """Result of tetrahedra that are split until they show what is thinner than a voxel.

        None if it would not print, or the field is that of a fractal, whose detail has no end.
        """
        root = self.scene.root if self.given is None else self.given.planned.root
        if root.bounds.exterior_only or self.clock.work.cluster is not None:
            return None
        with suppress(TooLargeError, EmptyError, MeshError):
            result, _ = replace(self, split=True).made()
            return None if result.report.problems else result
        return None

    def made(self) -> tuple[Result, _Job | None]:
        """Result, and the job of finer samples that has the object if this one lost it; None if there is no
        need, or it would be too large.
        """
        with self.aside() as aside, in_background(import_ahead, self.clock.work.threads):
            result, cure = self.result(*self.surface(aside))
        voxels = cure * self.what.voxels(self.size.longest)
        if cure == 1 or voxels > RAISED or self.clock.work.cluster is not None:
            return result, None
        given = self.given
        if given is not None:
            planned = replace(given.planned, voxel=given.planned.voxel / cure)
            given = replace(given, planned=planned)
        return result, replace(self, what=replace(self.what, voxel=None, resolution=voxels), given=given)

    def refuse(self) -> None:
        """Raise the errors of invalid arguments before any work is done."""
        self.what.voxels(self.size.longest)
        refuse_colours(self.what, self.path)
        if self.path is not None:
            from ..common.files import check_target

            check_target(self.path)
            for name in ("heights", "paint_supports"):
                if getattr(self.what, name) and self.path.suffix.lower() != ".3mf":
                    raise SceneError(f"{name}: expected a file that holds them, .3mf")
        if self.what.colour is not None and self.clock.work.cluster is not None:
            raise SceneError(f"colour {self.what.colour}: expected no cluster and no shard")
        for name in ("heights", "paint_supports"):
            if getattr(self.what, name) and self.clock.work.cluster is not None:
                raise SceneError(f"{name}: expected no cluster and no shard")

    @contextmanager
    def aside(self) -> Iterator[Callable[[], Path] | None]:
        """Yield a function that makes a folder for pieces beside the file; None if the format does not
        support pieces.
        """
        if self.path is None or self.path.suffix.lower() != ".stl":
            yield None
            return
        from ..common.files import check_target, temporary_folder

        beside = check_target(self.path).parent
        with ExitStack() as stack:
            yield lambda: stack.enter_context(temporary_folder(beside))

    def needing_all(self) -> Iterator[str]:
        """Changes that need a mesh in one piece, with their values."""
        for name, length in (("chord", self.what.chord), ("simplify", self.what.simplify)):
            if length is not None:
                yield f"{name} {length:g}mm"
        if self.what.faces is not None:
            yield f"faces {self.what.faces}"

    def sampled(self) -> tuple[Sized, SignBricks, bool]:
        """Field, its samples, and the choice of bodies that is left to the mesh; true if the field chose.

        Samples of walls thinner than a voxel do not tell bodies from crumbs: the field then chooses.
        """
        sized = self.given or plan_mesh(self.scene, self.what, self.size, self.clock)
        how = self.what.edits(self.scene)
        with in_mm(self.size):
            signs = self.signs(sized.planned, False)
        thin = how.sorts and mesh_steps.has_thin_walls(signs)
        if again := thin and how.whole:
            sized = apply_edits(sized.planned, self.scene, self.what, self.size, self.clock)
            signs = self.signs(sized.planned, True)
            thin = mesh_steps.has_thin_walls(signs)
        return replace(sized, left=replace(sized.left, keep="all")) if thin else sized, signs, again

    def recipe(self, again: bool) -> MeshRecipe:
        """Recipe of the field, for other processes; `again` if the field chose the bodies."""
        from ..scene.model import to_xml
        from .shared import MeshRecipe

        return MeshRecipe(to_xml(self.scene), self.scene.name, self.what, again)

    def signs(self, planned: Plan, again: bool) -> SignBricks:
        """Samples, by the pool of the work if there is one; a GPU samples here."""
        work = self.clock.work
        if work.cluster is None or work.device != "cpu":
            return mesh_steps.sample_surface(planned, self.clock)
        from .shared import by_pool

        job, evaluate = by_pool(self.recipe(again), planned, work.cluster, work)
        signs = mesh_steps.sample_surface(planned, self.clock, evaluate)
        work.cluster.finished(job)
        return signs

    def surface(self, aside: Callable[[], Path] | None) -> tuple[Sized, Surface, Executor]:
        """Surface, in one piece if it fits in memory; the choice of bodies that is left; and what makes the
        steps that follow.
        """
        from ..mesh.cleaning import HALO
        from ..mesh.contouring import layers
        from ..mesh.shells import Pieces
        from .mesh_steps import Local, Sampled

        work = self.clock.work
        if self.split:
            sized = self.given or plan_mesh(self.scene, self.what, self.size, self.clock)
            return sized, mesh_steps.split_surface(sized.planned, self.clock), Local(work)
        sized, signs, again = self.sampled()
        planned = sized.planned
        of, halo, executor = Sampled(planned, signs, work.threads), HALO * planned.voxel, Local(work)
        if (own := self.own_triangles(planned)) is not None:
            return sized, mesh_steps.surface_of_triangles(of, own, self.clock), executor
        if (pool := work.cluster) is not None:
            if not any(self.needing_all()):
                from .shared import StoredPieces, share_samples

                shared, cuts = share_samples(self.recipe(again), planned, signs, pool, work)
                stored = StoredPieces(pool.pieces, shared.job, halo)
                return sized, mesh_steps.surface_of(of, cuts, stored, shared, self.clock), shared
            if not pool.first:
                raise SharedError("the samples are made; shard 1 makes the mesh of them and writes the file")
        most, voxel = len(signs), self.size.longest / self.what.voxels(self.size.longest)
        try:
            mesh_steps.refuse_what_does_not_fit(signs, voxel)
        except TooLargeError as error:
            for change in self.needing_all():
                raise SceneError(f"{change} needs the whole mesh: {error}") from None
            if aside is None:
                raise TooLargeError(f"{error}, and an .stl file is written piece after piece") from None
            most = mesh_steps.BRICKS
        pieces = Pieces(aside() if aside and most < len(signs) else None, halo)
        return sized, mesh_steps.surface_of(of, layers(signs, most), pieces, executor, self.clock), executor

    def own_triangles(self, planned: Plan) -> Triangles | None:
        """Triangles of a scene that is nothing but a model, unless a resolution is asked for, scene units."""
        asked = self.what.voxel, self.what.resolution, self.what.chord, self.what.colour
        if planned.root.tree is None or any(value is not None for value in asked):
            return None
        return planned.root.tree.triangles()

    def result(self, sized: Sized, surface: Surface, executor: Executor) -> tuple[Result, int]:
        """Finished mesh and report, and the refinement of the samples that does not lose the object."""
        from ..fields.depth import shallower
        from ..mesh.shells import touching_note
        from ..mesh.subgrid import outside_share
        from ..printing.walls import thickness_note
        from ..volume.amount import lost_size, mesh_amount
        from .mesh_steps import choose_bodies

        what, clock, scale, refined = self.what, self.clock, sized.scale, None
        planned, signs, thin = surface.planned, surface.signs, surface.thin
        if what.chord is not None:
            surface, done = mesh_steps.refine_surface(surface, what.chord / scale, clock)
            refined = done.scaled(scale)
        with clock("finishing"):
            how = what.edits(self.scene)
            finish, chosen = choose_bodies(
                surface, sized.left, what.dust_limit, scale, how.thickness, executor
            )
        whole = how.bodies is None
        lacks = partial(outside_share, surface.pieces.mesh(0)) if surface.split else None
        measure = partial(mesh_amount, planned, chosen.volume, scale, whole, clock.work, lacks)
        with in_background(measure, clock.work.threads) as measured:
            made = Writing(self.scene, what, clock, self.path).made(surface, finish, executor)
            written = nullcontext() if self.path is None else keeping(f"{self.path} is written")
            with written, clock("checking"):
                complete = measured()
        fell = f"{thin}; expected a smaller voxel, or a thickness of {3 * scale * planned.voxel:.2g} mm"
        mesh = finish.report(made.checks.tally, chosen.misplaced)
        low, high = mesh.bbox_mm
        whole_box = (planned.supports and planned.supports.box) or planned.box
        sides = [scale * side for side in whole_box.size], np.subtract(high, low).tolist(), chosen.size
        lost, shorter = lost_size("the mesh is", *sides, spacing=[scale * planned.voxel] * 3)
        near = made.checks.near_bodies
        settings = shallower(planned.root.tree, planned.voxel) if near and planned.root.tree else ()
        report = Report(
            scene=self.scene.name,
            scene_hash=self.scene.hash,
            version=__version__,
            size_mm=self.size.longest,
            voxel_mm=planned.voxel * scale,
            mesh=mesh,
            removed=chosen.removed,
            surface_error_mm=SurfaceError.of(scale * np.concatenate(made.checks.errors)),
            surface_to_mesh_mm=SurfaceToMesh.of(scale * made.back),
            evaluations=signs.evaluations,
            proved=signs.proved,
            measured=() if what.proved else planned.root.bounds.measured,
            bricks=len(signs),
            seconds=clock.seconds,
            peak_rss_mb=peak_rss_mb(),
            amount_mm3=complete.amount,
            refined=refined,
            simplified=made.simplified,
            notes=(
                *planned.notes,
                *([OWN] if surface.own else ()),
                *([str(planned.supports)] if planned.supports else ()),
                *thickness_note(made.checks.thin, how, planned.voxel * scale),
                *shorter,
                *([fell] if thin and not near else ()),
                *(refined.notes if refined else ()),
                *touching_note(near, planned.voxel * scale, settings, complete.notes),
            ),
            depths=planned.depths,
            contact_mm2=float(f"{made.checks.contact:.9g}"),  # sums over pieces differ in the last digit
            loose_bodies=chosen.loose,
            cavities_mm3=float(f"{chosen.cavities + 0.0:.9g}"),
            lost_mm=lost,
            missing_volume_share=round(
                complete.amount.missing, 9
            ),  # sums over pieces differ in the last digit
            lost=complete.problems,
        )
        return Result(report, finish.place, planned, made.whole, clock.work), complete.cure


@dataclass(frozen=True)
class Implicit:
    """A file that holds a formula."""

    path: Path  # the file
    operations: int  # operations of the formula
    root: Node  # the field that was written
    place: Placement  # map from the scene to the file
    box: Box  # bounds of the object, mm
    notes: tuple[str, ...]  # details that the voxel is too large to resolve


def make_implicit(
    scene: Scene, what: MeshJob | None = None, path: str | Path = "", work: Work | None = None
) -> Implicit:
    """Write the formula of a scene as 3MF with the volumetric and implicit extensions.

    `what`: the size, and the voxel that automatic depths follow from.
    """
    from ..common.files import check_target
    from ..export.implicit import operations, write_implicit
    from ..volume.amount import sizing

    what, clock = what or MeshJob(), Clock(work or Work())
    _refuse(what.edits(scene))
    check_target(path)
    size = sizing(scene, what.size, what.scale, clock.work)
    made = plan_mesh(scene, what, size, clock)
    plan = made.planned
    assert plan.root.tree is not None
    (x, y, _), scale = plan.box.centre, made.scale
    place = Placement(scale, (-scale * x, -scale * y, -scale * plan.box.lo[2]))
    box, outer = (Box.around(map(tuple, place.mm(np.array([b.lo, b.hi])))) for b in (plan.box, plan.outer))
    listed = operations(plan.root.tree, place.scale, place.offset)
    about = metadata(scene)
    file = write_implicit(listed, outer, plan.voxel * scale, path, about)
    return Implicit(file, len(listed), plan.root.tree, place, box, plan.notes)


def _refuse(how: Print) -> None:
    """Raise an error for a change that needs samples of the field."""
    names = ["bridge", "gap", "thickness", "hollow"]
    changes = [name for name in names if getattr(how, name)]
    changes += [name for name in ("keep", "cavities") if getattr(how, name) not in ("all", "keep")]
    changes += ["supports"] if how.supports != "none" else []
    if changes:
        raise SceneError(f"{changes[0]}: needs samples of the field; expected a mesh, or formulas alone")


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
        from .shared import Shared, write_shared

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
        tolerance, count = self.what.simplify, self.what.faces
        if tolerance is not None or count is not None:
            from ..mesh.simplify import simplify, simplify_to

            ((piece, near),) = finished
            with self.clock("simplifying"):
                mesh, simplified = (
                    simplify_to(piece.mesh, count, self.clock.work)
                    if tolerance is None
                    else simplify(piece.mesh, tolerance, self.clock.work)
                )
            finished = iter([(Finished.whole(mesh), near)])
        meshes = ahead(finish.passing(finished, checks, self.clock))
        if several := len(finish.pieces) > 1:
            meshes = tips_last(meshes, finish.tips)
        if self.what.colour is not None:
            meshes = self._painted(meshes, finish)
        if self.what.paint_supports:
            from ..mesh.checks import overhanging

            meshes = (replace(mesh, supported=overhanging(mesh)) for mesh in meshes)
        if self.what.heights is not None:
            meshes = (replace(mesh, tops=self._tops()) for mesh in meshes)
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

    def _tops(self) -> np.ndarray:
        """Upper faces of the layers that are advised to slicers, mm."""
        from ..records import SliceJob
        from ..slicing import adapted, plan_stack
        from ..volume.amount import sizing

        what, work = self.what, self.clock.work
        assert what.heights is not None and what.heights[1] is not None
        with self.clock("slicing"):
            size = sizing(self.scene, what.size, what.scale, work)
            how = what.edits(self.scene)
            job = SliceJob(layer=what.heights[0], printing=how, pixel=PIXEL, up=what.up, scale=what.scale)
            stack = plan_stack(self.scene.root, job, work, size)
            return adapted(stack, what.heights[1], work).tops

    def _painted(self, meshes: Iterator[Mesh], finish: Finish) -> Iterator[Mesh]:
        """Colour the meshes."""
        colouring = Colouring(finish.of.planned.root, self.what, self.clock.work)
        for mesh in meshes:
            with self.clock("colouring"):
                made = colouring.whole(mesh, finish.place)
            yield made


def metadata(scene: Scene) -> dict[str, str]:
    """Metadata of files made from a scene."""
    from ..version import APPLICATION

    return {"Application": APPLICATION, "Title": scene.name, "scene_hash": scene.hash}
