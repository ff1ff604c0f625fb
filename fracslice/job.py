"""The main job, from a scene to a printable mesh with the numbers that prove it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .errors import SceneError, TooLargeError, VolumeError
from .formulas import Box
from .formulas.parameters import Number, validate
from .memory import available_bytes, peak_rss_mb
from .report import Report, SurfaceError, SurfaceToMesh, version
from .scene import Print, Scene
from .scene.lengths import Length
from .work import Clock, Work

if TYPE_CHECKING:
    from .kernel import Field
    from .mesh import Mesh
    from .mesh.certificate import Certificate
    from .mesh.components import Removed
    from .volume import Bricks, Plan

RESOLUTION = 256.0
COARSEST, FINEST = 8, 16384
"""Voxels along the longest side."""

ALWAYS_FITS = 256
BYTES_A_BRICK = 60_000
"""Peak memory for each brick of samples, its triangles in all their stages included; measured."""

DUST = 1e-5
"""The share of the whole below which a body is dust, as it comes off the rim of a fractal of finite depth."""


@dataclass(frozen=True)
class MeshJob:
    """What to make of a scene. Lengths are numbers of mm, or text such as "0.5mm"; the fields hold mm.

    size_mm: the longest side, if not what the scene says. voxel_mm or resolution (voxels along the longest
    side): how fine; 256 along the longest side if neither is given. dust_mm3: bodies with less material are
    dropped; if not given, those under 1e-5 of the whole. printing: what makes it printable, if not what the
    scene says. chord_mm: more triangles where a smooth surface is farther than this from them. simplify_mm:
    fewer triangles, nowhere farther than this from all of them. Raises `SceneError` for values that cannot
    be.
    """

    size_mm: float | None = None
    voxel_mm: float | None = None
    resolution: float | None = None
    dust_mm3: float | None = None
    printing: Print | None = None
    chord_mm: float | None = None
    simplify_mm: float | None = None

    def __post_init__(self) -> None:
        if self.voxel_mm is not None and self.resolution is not None:
            raise SceneError("voxel and resolution: expected one of them")
        validate(self, _KINDS, SceneError)

    def size(self, scene: Scene) -> float:
        """The longest side in mm."""
        return scene.size_mm if self.size_mm is None else self.size_mm

    def how(self, scene: Scene) -> Print:
        """What makes it printable."""
        return scene.printing if self.printing is None else self.printing

    def dust(self, volume: float) -> float:
        """The volume below which a body of an object of `volume` is dropped, mm3."""
        dust = DUST * volume if self.dust_mm3 is None else self.dust_mm3
        if dust > volume:
            raise SceneError(f"dust {dust:.4g}mm3: expected at most the object's volume, {volume:.4g}mm3")
        return dust

    def voxels(self, scene: Scene) -> float:
        """How many voxels the longest side has."""
        if self.voxel_mm is None:
            return RESOLUTION if self.resolution is None else self.resolution
        size = self.size(scene)
        if not COARSEST <= size / self.voxel_mm <= FINEST:
            low, high = size / FINEST, size / COARSEST
            raise SceneError(
                f"voxel {self.voxel_mm:g}mm: expected {low:.4g}mm to {high:.4g}mm for an object of {size:g}mm"
            )
        return size / self.voxel_mm


_KINDS = {
    **dict.fromkeys(("size_mm", "voxel_mm", "chord_mm", "simplify_mm"), Length(None, "a length")),
    "resolution": Number(None, "voxels along the longest side", least=COARSEST, most=FINEST),
    "dust_mm3": Number(None, "a volume", least=0),
}


@dataclass(frozen=True)
class Placement:
    """Where the scene is in print space: ``mm = scale * scene units + offset``."""

    scale: float
    offset: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Result:
    """mesh: in mm, standing on z = 0, coordinates as a file holds them. bricks: its samples, in scene units.
    root: the field that they are samples of. place: the map from there to the mesh."""

    mesh: Mesh
    report: Report
    bricks: Bricks
    root: Field
    place: Placement

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


def make_mesh(scene: Scene, what: MeshJob | None = None, work: Work | None = None) -> Result:
    """Samples, meshes, cleans, scales and checks a scene.

    Raises `SceneError`, `VolumeError`, `MeshError` or `Cancelled`. A mesh that would not print as it is is
    returned all the same; its report says what is wrong.
    """
    what, work = what or MeshJob(), work or Work()
    voxels, clock = what.voxels(scene), Clock(work)
    from .mesh.certificate import Certificate
    from .mesh.check import check_quantised
    from .mesh.missed import surface_to_mesh
    from .mesh.refine import refine
    from .mesh.simplify import simplify
    from .shown import mesh_amount
    from .volume import plan
    from .volume.accuracy import surface_error

    how = what.how(scene)
    with clock("planning"):
        refuse_what_does_not_fit(scene, voxels, what.size(scene), work)
        planned, scale = plan(scene.root, voxels, work), None
    left = how  # to do on the mesh
    if not how.whole:
        with clock("changing"):
            planned, scale, left = _changed(planned, what, how, what.size(scene), work)
    bricks, raw, certificate, pieces = _surface(planned, clock)
    if how.whole and how.sorts and pieces:  # what is one body only the field tells
        with clock("changing"):
            planned, scale, left = _changed(planned, what, how, what.size(scene), work)
        bricks, raw, certificate, pieces = _surface(planned, clock)
    refined = None
    if what.chord_mm is not None:
        with clock("refining"):
            unit = 1 / (scale or what.size(scene) / max(planned.box.size))
            raw, done = refine(planned.root, raw, what.chord_mm * unit, planned.voxel, work)
            certificate = Certificate.none(len(raw.triangles))
            refined = done.scaled(1 / unit)
    with clock("finishing"):
        left = replace(left, keep="all") if pieces else left
        mesh, proved, removed, place = _finished(
            planned, raw, certificate, what, left, what.size(scene), scale, work
        )
        made = mesh.measured(work.threads)[1] + removed.bodies_mm3 - removed.filled_mm3
    simplified = None
    if what.simplify_mm is not None:
        with clock("simplifying"):
            mesh, simplified = simplify(mesh, what.simplify_mm, work)
            proved = np.zeros(len(mesh.triangles), bool)
    with clock("checking"):
        checked = check_quantised(mesh, proved, work.threads)
        points = (mesh.vertices - np.array(place.offset)) / place.scale
        error = place.scale * surface_error(planned.root, points, planned.voxel, work)
        back = surface_to_mesh(planned, lambda: [raw], place.scale, work)
        amount, off = mesh_amount(planned, made, place.scale, work)
    report = Report(
        scene=scene.name,
        scene_hash=scene.hash,
        version=version(),
        size_mm=what.size(scene),
        voxel_mm=bricks.voxel * place.scale,
        mesh=checked,
        removed=removed,
        surface_error_mm=SurfaceError.of(error),
        surface_to_mesh_mm=SurfaceToMesh.of(back),
        evaluations=bricks.evaluations,
        bricks=len(bricks),
        seconds=clock.seconds,
        peak_rss_mb=peak_rss_mb(),
        amount_mm3=amount,
        refined=refined,
        simplified=simplified,
        notes=(
            *planned.notes,
            *_thinner(pieces, bricks.voxel * place.scale),
            *(refined.notes if refined else ()),
            *off,
        ),
        depths=planned.depths,
    )
    return Result(mesh, report, bricks, planned.root, place)


def _surface(planned: Plan, clock: Clock) -> tuple[Bricks, Mesh, Certificate, str]:
    """The samples of a planned scene, their mesh, in scene units, what is known of it, and what of it fell to
    pieces.
    """
    from .mesh.certificate import Certificate
    from .mesh.components import in_pieces
    from .mesh.extract import contour
    from .mesh.tips import with_tips
    from .volume import sample_scene

    with clock("sampling"):
        bricks = sample_scene(planned, clock.work)
    with clock("meshing"):
        mesh = contour(planned.root, bricks, clock.work)
        mesh, new = with_tips(planned.root, mesh, planned.voxel, clock.work)
        certificate = replace(Certificate.of(bricks, len(new)), holds=~new)
        return bricks, mesh, certificate, in_pieces(mesh, planned.voxel, clock.work.threads)


def _changed(planned: Plan, what: MeshJob, how: Print, size: float, work: Work) -> tuple[Plan, float, Print]:
    """The plan of what is changed in the field to be printable, mm per scene unit, and what is left to do on
    the mesh.
    """
    from .printing import printable

    # Of walls thinner than a voxel a mesh has crumbs only: bodies are chosen in the field where it tells.
    left = how if planned.root.bounds.exterior_only else replace(how, keep="all")
    size_of = partial(_box_of_mesh, what=what, how=left, size=size, work=work)
    return *printable(planned, size, how, work, size_of), left


def refuse_what_does_not_fit(scene: Scene, voxels: float, size: float, work: Work) -> None:
    """Raises `TooLargeError`, naming a voxel that fits, if the mesh would take more memory than there is.

    The number of bricks grows like a power of the resolution, about the surface's dimension; two coarse
    samplings show it. Coarse jobs are not looked at: they always fit.
    """
    if voxels <= ALWAYS_FITS:
        return
    few, many = (_bricks(scene, n, work) for n in (ALWAYS_FITS / 4, ALWAYS_FITS / 2))
    dimension = min(max(math.log2(max(many, 1) / max(few, 1)), 2.0), 3.0)
    needed = many * (2 * voxels / ALWAYS_FITS) ** dimension * BYTES_A_BRICK
    free = available_bytes()
    if needed > free:
        fits = size / voxels * (needed / free) ** (1 / dimension)
        raise TooLargeError(
            f"a voxel of {size / voxels:.3g}mm needs about {needed / 1e9:.1f} GB of memory, "
            f"and {free / 1e9:.1f} GB are free; a voxel of {fits * 1.02:.3g}mm fits"
        )


def _bricks(scene: Scene, resolution: float, work: Work) -> int:
    """How many bricks a scene has at a coarse resolution: none where all of it falls between samples."""
    from .volume import plan, sample_scene

    planned = plan(scene.root, resolution, work)
    try:
        return len(sample_scene(planned, work))
    except VolumeError:
        return 0


def _thinner(pieces: str, voxel: float) -> tuple[str, ...]:
    """What walls came to that are thinner than a voxel, mm, and what would hold them."""
    return (f"{pieces}; expected a smaller voxel, or a thickness of {2 * voxel:.2g} mm",) if pieces else ()


def _finished(
    planned: Plan,
    raw: Mesh,
    certificate: Certificate,
    what: MeshJob,
    how: Print,
    size: float,
    scale: float | None,
    work: Work,
) -> tuple[Mesh, NDArray[np.bool_], Removed, Placement]:
    """The mesh that is wanted, in mm on the bed, as a file will hold it, and which of its triangles are
    proved not to intersect. scale: mm per scene unit; without one, what stays is made to be of that size.
    """
    from .mesh.clean import cleaned
    from .mesh.solid import place_on_bed

    rough = scale or size / max(planned.box.size)
    kept, stays, removed = _kept(raw.scaled(rough), what, how, work)
    box = _box_of_kept(planned, raw, kept, rough, work)
    exact = scale or size / max(box.size)
    mesh = kept.scaled(exact / rough)
    known = certificate.selected(stays).scaled(rough).scaled(exact / rough)
    placed, known = place_on_bed(mesh, (exact * box.centre[0], exact * box.centre[1]), known)
    x, y, z = (placed.bounds[0] - mesh.bounds[0]).tolist()
    made = cleaned(placed, known, threads=work.threads)
    return made.mesh, made.proved, removed, Placement(exact, (x, y, z))


def _kept(mesh: Mesh, what: MeshJob, how: Print, work: Work) -> tuple[Mesh, NDArray[np.bool_], Removed]:
    """The bodies of a mesh in mm that are wanted, and which triangles these are."""
    from .mesh.components import choose, shells

    cavities = how.cavities if how.whole else "keep"  # a hollow is one, too
    found, dust = shells(mesh, work.threads), what.dust(mesh.measured(work.threads)[1])
    staying, removed = choose(found, keep=how.keep, dust_mm3=dust, cavities=cavities)
    stays = staying[found.labels]
    return mesh.selected(stays, work.threads), stays, removed


def _box_of_mesh(planned: Plan, what: MeshJob, how: Print, size: float, work: Work) -> Box:
    """The box of what would stay in the mesh of a planned scene, scene units."""
    from .mesh.components import in_pieces
    from .mesh.extract import contour
    from .volume import sample_scene

    raw = contour(planned.root, sample_scene(planned, work), work)
    how = replace(how, keep="all") if in_pieces(raw, planned.voxel, work.threads) else how
    rough = size / max(planned.box.size)
    kept, *_ = _kept(raw.scaled(rough), what, how, work)
    return _box_of_kept(planned, raw, kept, rough, work)


def _box_of_kept(planned: Plan, raw: Mesh, kept: Mesh, scale: float, work: Work) -> Box:
    """kept: of `raw`, `scale` times as large."""
    from .volume.rest import box_of_the_rest, outermost

    tips = partial(outermost, kept.vertices / scale)
    return box_of_the_rest(planned, scale * raw.bounds, kept.bounds, tips, work)
