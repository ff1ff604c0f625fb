"""Execution of a command: threads, progress bar and orderly cancellation by Ctrl-C; its inputs, outputs and
summary.
"""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from fracslice.common.messages import decimal, duration, format_count, place, significant
from fracslice.errors import Cancelled, FracsliceError, KeptError, MeshError, SceneError
from fracslice.formats import ENDINGS, SOLIDS
from fracslice.records import JOINING

if TYPE_CHECKING:
    import numpy as np

    from fracslice.checks.layer_checks import PrintReport
    from fracslice.export.slice_run import SliceRun
    from fracslice.jobs.report import Report, Result
    from fracslice.mesh import Mesh
    from fracslice.mesh.checks import MeshReport
    from fracslice.scene import Scene
    from fracslice.slicing import Stack
    from fracslice.volume import Drain
    from fracslice.work import Work


Progress = Callable[[str, float], None]

NOTHING = "nothing was written"
"""What most commands leave when they are stopped."""


class StoppedError(FracsliceError):
    """A signal stopped the work."""

    def __init__(self, number: int, kept: str) -> None:
        super().__init__(f"stopped; {kept}")
        self.status = 128 + number


@contextmanager
def working(how: int | Work, quiet: bool, kept: str = NOTHING) -> Iterator[Work]:
    """Work that shows its progress on a terminal and is cancelled by SIGINT and SIGTERM."""
    from fracslice.work import Work

    like = Work(how) if isinstance(how, int) else how
    with _bar(quiet) as progress, _cancelled_by_signals(kept) as cancel:
        yield replace(like, progress=progress, cancel=cancel)


@contextmanager
def _bar(quiet: bool) -> Iterator[Progress]:
    """Progress bar on stderr; without a terminal, a function that does nothing."""
    if quiet or not sys.stderr.isatty():
        yield lambda stage, done: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>10}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks = {}
        preparing = bar.add_task("preparing", total=None)  # the first run of a scene compiles for a second

        def progress(stage: str, done: float) -> None:
            bar.update(preparing, visible=False)
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=1.0)
            bar.update(tasks[stage], completed=done)

        yield progress


@contextmanager
def _cancelled_by_signals(kept: str) -> Iterator[threading.Event]:
    """Event set by the first SIGINT or SIGTERM; the second one raises KeyboardInterrupt at once."""
    cancel = threading.Event()
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        cancel.set()
        if len(received) > 1:
            raise KeyboardInterrupt

    try:
        with _handled_by(stop):
            yield cancel
    except KeptError as error:
        raise StoppedError(received[0] if received else signal.SIGINT, str(error)) from None
    except Cancelled:
        raise StoppedError(received[0] if received else signal.SIGINT, kept) from None


@contextmanager
def stopped_at_once() -> Iterator[None]:
    """Let the first SIGINT or SIGTERM end what is done within, which looks at no cancellation."""
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    try:
        with _handled_by(stop):
            yield
    except BaseException:
        if not received:
            raise
    if received:  # also where a parser went on after the exception
        raise StoppedError(received[0], NOTHING)


@contextmanager
def _handled_by(stop: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Handle SIGINT and SIGTERM within."""
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class BadInput(click.ClickException):
    """The input of a command cannot be used."""

    exit_code = 2


def scene_path(source: str) -> Path:
    """Path of a scene file, or of the shipped scene of that name if there is no such file.

    Raises `BadInput` for a model file.
    """
    from fracslice.scene import library

    if is_model(source) and Path(source).is_file():
        raise BadInput(f"{source}: expected a scene, found a model")
    return library.file_of(source)


def load_scene(source: str, settings: Iterable[str] = ()) -> Scene:
    """Read the scene of a command, or that of a model file, and apply the values of --set."""
    with stopped_at_once():
        return _scene(source).with_values(settings)


def _scene(source: str) -> Scene:
    """Scene of a file or a name; of a model or a grid the scene of that alone, in mm."""
    from fracslice.scene import read

    if formula := SOLIDS.get(Path(source).suffix.lower()):
        from fracslice.formulas import get
        from fracslice.scene import scene

        try:
            solid = get(formula)(source, place="as is", units="mm")
            return scene(solid, unit=1.0, name=Path(source).stem)
        except SceneError as error:
            raise BadInput(f"{source}: {error.__cause__ or error}") from error
    outside = click.get_current_context().params.get("allow_files_outside", False)
    return read(scene_path(source), files_outside=outside)


def refuse_moved(scene: Scene, settings: Iterable[str]) -> None:
    """Raise `BadInput` for a setting of an attribute that a track moves: it would have no effect."""
    moved = {"".join(track.of.split()) for track in scene.tracks}
    for setting in settings:
        if "".join(setting.partition("=")[0].split()) in moved:
            raise BadInput(f"{setting}: a <track> moves it; expected another attribute, or other keys")


def is_model(source: str) -> bool:
    """True if the file name has the extension of a model."""
    return Path(source).suffix.lower() in ENDINGS


def load_model(source: str, coloured: bool = False) -> Mesh:
    """Read the mesh of a model file. Raises `BadInput` if it cannot be read.

    `coloured`: with colours, not welded.
    """
    from fracslice.mesh.models import read_coloured, read_mesh

    try:
        with stopped_at_once():
            return read_coloured(source) if coloured else read_mesh(source)
    except MeshError as error:
        raise BadInput(str(error)) from error


def refuse_options(names: Container[str], why: str) -> None:
    """Raise a usage error for a given option that has no effect here."""
    context = click.get_current_context()
    for option in context.command.params:
        name = str(option.name)
        given = context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE
        if given and name in names:
            raise click.UsageError(f"{option.opts[-1]}: {why}")


def check_targets(source: str, *targets: str | None) -> None:
    """Check output files before any work is done.

    Raises an error for a file that cannot be written, or that would replace the scene or another output.
    """
    from fracslice.common.files import check_target

    taken = {os.path.realpath(source)}
    for target in targets:
        if target is None:
            continue
        if os.path.realpath(target) in taken:
            raise click.UsageError(f"{target}: expected another file; this one is named twice")
        taken.add(os.path.realpath(target))
        check_target(target)


def check_folder(folder: Path) -> None:
    """Check before any work is done that a folder can be made or written to."""
    from fracslice.common.files import check_target

    if folder.exists() and not folder.is_dir():
        raise click.UsageError(f"{folder}: expected a folder")
    check_target(folder / "a file" if folder.is_dir() else folder)


DENSITIES = {"resin": 1.1, "pla": 1.24, "petg": 1.27, "abs": 1.04, "asa": 1.07, "tpu": 1.22}
"""Materials and their densities, g/ml; filaments as in PrusaResearch.ini of PrusaSlicer 2.5."""

FLAT = 50.0
"""Mean cross-section per area on the plate from which an object does not stand flat, as in the checks."""

LISTED = 4
"""Maximum number of drain holes whose places are all named."""

SEALED = 1000
"""Volume of the solid per volume of sealed cavities above which they are not mentioned."""

CELLS, FINEST = 128, 256
"""Usual and maximum number of cells along the longest side in the search for cavities."""

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Closing:
    """Figures of an object that is ready to print. Lengths in mm."""

    volume: float  # volume, mm3, area on the plate, mm2, and height
    contact: float
    height: float
    material: str  # name of the material
    density: float  # g/ml
    about: str = ""  # stands before a volume that is an estimate
    layers: int | None = None  # number of layers; None for a mesh
    seconds: float | None = None  # time and price of the print; None if unknown
    cost: float | None = None
    drains: Sequence[Place] = ()  # openings of drain holes inside the hollow
    drain: float = 0.0  # diameter of the drain holes
    cavities: int = 0  # sealed cavities
    trapped: float = 0.0  # their volume, mm3
    loose: int = 0  # bodies that do not stand on the plate
    bridge: float = 0.0  # minimum diameter of struts

    @property
    def amount(self) -> str:
        """Volume, weight, time and cost."""
        ml = self.volume / 1000
        amount = [
            f"{self.about}{millilitres(self.volume)}",
            f"{significant(ml * self.density)} g of {self.material} ({self.density:g} g/ml)",
        ]
        if self.layers is not None:
            amount.append(format_count(self.layers, "layer"))
        if self.seconds is not None:
            amount.append(duration(self.seconds))
        if self.cost:
            amount.append(f"cost {self.cost:.2f}")
        return ", ".join(amount)

    def lines(self) -> Iterator[str]:
        """Iterate over the lines, each with the option that mends what it names."""
        yield self.amount
        if self.drains:
            places = [place(at, 1) for at in self.drains]
            where = f"{' and '.join(places)} mm"
            if len(places) > LISTED:
                where = f"{places[0]} mm and at {len(places) - 1} other places"
            yield f"drain holes of {self.drain:g} mm leave the hollow at {where}"
        if self.cavities and self.trapped * SEALED > self.volume:
            sealed = "a sealed cavity" if self.cavities == 1 else f"{self.cavities} sealed cavities"
            mend = "--cavities fill, or --drain 3mm for a hollow"
            yield f"{millilitres(self.trapped)} trapped in {sealed}: {mend}"
        if self.loose:
            bodies = format_count(self.loose, "loose body", "loose bodies")
            yield f"{bodies}: --bridge {max(self.bridge, 1):.2g}mm, or --keep largest"
        if self.contact * FLAT < self.volume / self.height:
            from fracslice.checks.problems import flat_base

            plate = f"{significant(self.contact, 2)} mm2 on the plate"
            yield f"does not stand flat, {plate}: --base {flat_base(self.height)}"


def millilitres(volume: float) -> str:
    """Volume in millilitres, mm3 given; in mm3 below a hundredth of one."""
    return f"{significant(volume / 1000)} ml" if volume >= 10 else f"{significant(volume, 2)} mm3"


def of_mesh(result: Result, material: str, price: float | None) -> Closing:
    """Closing figures of a mesh."""
    report = result.report
    mesh, grams = report.mesh, report.mesh.volume_mm3 / 1000 * DENSITIES[material]
    return Closing(
        volume=mesh.volume_mm3,
        contact=report.contact_mm2,
        height=mesh.bbox_mm[1][2] - mesh.bbox_mm[0][2],
        material=material,
        density=DENSITIES[material],
        cost=None if price is None else grams * price / 1000,
        drains=[tuple(p) for p in result.place.mm(starts(result.planned.drains)).tolist()],
        drain=2 * result.place.scale * max((d.radius for d in result.planned.drains), default=0.0),
        cavities=mesh.cavities,
        trapped=report.cavities_mm3,
        loose=report.loose_bodies,
        bridge=JOINING * report.voxel_mm,
    )


def total(parts: Iterable[Closing]) -> str:
    """Amount of all meshes of a file."""
    first, *others = parts
    volume = sum((part.volume for part in others), first.volume)
    cost = None if first.cost is None else first.cost * volume / first.volume
    return replace(first, volume=volume, cost=cost).amount


def of_material(report: PrintReport, material: str) -> PrintReport:
    """Report on layers of a key of `DENSITIES`: its weight, and of a filament no problem of resin."""
    from fracslice.checks import checks

    of_resin = {check.kind for check in checks() if check.of_resin and material != "resin"}
    problems = [problem for problem in report.problems if problem.kind not in of_resin]
    return replace(report, weight_g=report.volume / 1000 * DENSITIES[material], problems=problems)


def of_layers(run: SliceRun, price: float | None) -> Closing:
    """Closing figures of layers. Areas of layers that another process made are interpolated."""
    import numpy as np

    stack, resin = run.stack, run.resin
    known = sorted(run.slicer.areas)
    areas = np.interp(np.arange(run.layers), known, [run.slicer.areas[k] for k in known])
    volume = float(areas @ stack.heights)
    of = price if price is not None else resin.price if resin else None
    named = resin is not None and resin.name != "unknown"
    count, hollow = trapped_volume(run)
    places = (starts(stack.drains) - stack.origin) * stack.scale
    return Closing(
        volume=volume,
        contact=float(areas[0]),
        height=float(stack.tops[-1]),
        material=resin.name if resin and named else "resin",
        density=resin.density if resin else DENSITIES["resin"],
        about="about " if len(known) < run.layers else "",
        layers=run.layers,
        seconds=resin.seconds(areas) if resin else None,
        cost=None if of is None else volume / 1e6 * of,
        drains=[tuple(p) for p in places.tolist()],
        drain=2 * stack.scale * max((d.radius for d in stack.drains), default=0.0),
        cavities=count,
        trapped=hollow,
    )


def starts(drains: Sequence[Drain]) -> np.ndarray:
    """Inner ends of drain holes, float64 [n, 3], scene units."""
    import numpy as np

    return np.array([drain.start for drain in drains], float).reshape(-1, 3)


def trapped_volume(run: SliceRun) -> tuple[int, float]:
    """Number and volume, mm3, of the cavities of a stack, or of all parts of a plate."""
    if not run.stack.parts:
        return _trapped(run.stack, run.work)
    alone = {id(part.stack): part.stack for part in run.stack.parts}
    known = {k: _trapped(stack, run.work) for k, stack in alone.items()}
    counts, volumes = zip(*(known[id(part.stack)] for part in run.stack.parts), strict=True)
    return sum(counts), sum(volumes)


def _trapped(stack: Stack, work: Work) -> tuple[int, float]:
    """Number and volume, mm3, of the cavities of one object."""
    from fracslice.volume.amount import count_sealed

    narrowest = min((2 * drain.radius for drain in stack.drains), default=math.inf)
    longest = max(stack.outer.size)
    cell = max(min(longest / CELLS, narrowest / 3), longest / FINEST)
    count, volume = count_sealed(stack.object, stack.outer, cell, work)
    return count, volume * stack.scale**3


def summary(path: str, report: Report) -> str:
    """Summary of a mesh job: figures, notes and accuracy."""
    error, back, fewer = report.surface_error_mm, report.surface_to_mesh_mm, ""
    if report.simplified is not None:
        done = report.simplified
        off = max(done.bound_mm, done.back_mm)
        fewer = f"simplified from {done.from_triangles:,} triangles, at most {off:.3g} mm off\n"
    notes = "".join(f"{note}\n" for note in report.notes)
    return (
        f"{path}: {figures(report.mesh, report.problems)}\n{notes}"
        f"{fewer}vertices {error.mean * 1000:.2g} um from the surface (99 %: {error.p99 * 1000:.2g} um), "
        f"the surface {back.mean:.2g} mm from the mesh (at most {back.max:.2g} mm), "
        f"voxel {report.voxel_mm:.3g} mm, {report.seconds['total']:.1f} s, {report.peak_rss_mb:.0f} MB"
    )


def figures(mesh: MeshReport, problems: Sequence[str] | None = None) -> str:
    """Figures and printability of a mesh, in one line; by default, the problems are the mesh's own."""
    problems = mesh.problems if problems is None else problems
    verdict = f"would not print: {', '.join(problems)}" if problems else "watertight, manifold"
    return f"{sizes(mesh)}, {verdict}"


def sizes(mesh: MeshReport) -> str:
    """Triangles, size, volume and bodies of a mesh, in one line."""
    (x0, y0, z0), (x1, y1, z1) = mesh.bbox_mm
    size = " x ".join(map(decimal, (x1 - x0, y1 - y0, z1 - z0))) + " mm"
    triangles, bodies = (
        format_count(mesh.triangles, "triangle"),
        format_count(mesh.components, "body", "bodies"),
    )
    volume = mesh.volume_mm3
    amount = f"{decimal(volume / 1000)} cm3" if volume >= 1000 else f"{decimal(volume)} mm3"
    return f"{triangles}, {size}, {amount}, {bodies}"
