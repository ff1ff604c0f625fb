"""fracslice check: printability of a model, or of the mesh or layers of a scene."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import click

from fracslice.common.messages import decimal, format_count, significant
from fracslice.formats import ENDINGS
from fracslice.records import PIXEL, MeshJob, Placed, Print, SliceJob

from .execution import (
    DENSITIES,
    BadInput,
    check_targets,
    figures,
    is_model,
    load_model,
    load_scene,
    of_material,
    refuse_options,
    sizes,
    summary,
)
from .options import (
    LENGTH,
    ClusterOptions,
    LayerOptions,
    MeshOptions,
    Name,
    argument,
    command,
    flag,
    kind_option,
    option,
    printer_option,
    write_page,
)

if TYPE_CHECKING:
    from fracslice.checks.layer_checks import PrintReport
    from fracslice.checks.problems import Limits, Problem
    from fracslice.fields.box import Triple
    from fracslice.fields.field import Field
    from fracslice.mesh import Mesh
    from fracslice.scene import Scene
    from fracslice.slicing import Stack
    from fracslice.slicing.printers import Printer
    from fracslice.volume.amount import Sizing
    from fracslice.work import Work

SHARED = {"cluster", "shard", "store"}
OF_MESHES = MeshJob.kinds().keys() - Placed.kinds().keys()
OF_SCENES = {*OF_MESHES, *SHARED, "settings"}

AXES = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)
"""Directions up that --fix tries."""

HOLES = "drain_at"
"""Print setting that --fix tries last."""

THINNEST = SliceJob().layer[0]
"""Least height of a layer, if --layer is not given, mm."""

ACROSS = 256
"""Layers of the longest side, if --layer is not given, unless they would be thinner than `THINNEST`; and most
layers of it in which --fix compares what it tries.
"""

MOST_SECONDS = 50.0
"""CPU seconds of all examinations with --fix that are in no finer layers than those of `ACROSS`."""

ASKED = 0.05
"""Interval between two looks at the CPU time, which is dear on some systems, seconds."""


class Deadline(threading.Event):
    """Cancellation by another event, or once the process has taken an amount of CPU time."""

    def __init__(self, other: threading.Event, until: float) -> None:
        super().__init__()
        self.other, self.until = other, until
        self._asked = -math.inf

    def is_set(self) -> bool:
        """True once either is so, or it was set itself; the CPU time is asked for at most every `ASKED`."""
        if super().is_set() or self.other.is_set():
            return True
        now = time.monotonic()
        if now - self._asked > ASKED:
            self._asked = now
            if time.process_time() > self.until:
                self.set()
        return super().is_set()


def limit(text: str) -> Any:
    """Declare a minimum thickness of 0.1 mm by default."""
    return option(LENGTH, f"Minimum thickness of {text}; 0.1mm by default.", default="0.1mm")


class CheckOptions(LayerOptions, MeshOptions, ClusterOptions):
    """Options of `check`."""

    source: str = argument("MODEL|SCENE")
    as_json: bool = flag("Print all figures as JSON.", "--json")
    without = MeshOptions.without | LayerOptions.without
    size: float | None
    up: Triple
    scale: Triple
    pixel: tuple[float, float] | None
    layer: Any = kind_option(
        SliceJob.kinds()["layer"],
        None,
        "Check layers of this height, and no mesh; 256 layers and a mesh by default",
    )
    machine: Printer | None = printer_option('The printer that the object must fit; "list" shows all.')
    picture: str | None = option(Name("FILE.png", ".png"), "Draw the worst layers.")
    show: bool = flag("Open a window on the mesh, with boxes around what was found in its layers.")
    fix: bool = flag("Try what would mend the problems, and keep what helps.")
    fixed: str | None = option(
        Name("FILE", *ENDINGS),
        "With --fix: write the mesh of what it made.",
        "-o",
        "--output",
    )
    material: str = option(
        click.Choice(list(DENSITIES)),
        "Resin by default. Filaments have no resin traps, suction cups and sealed cavities.",
        default="resin",
    )
    wall: float = limit("walls")
    floor: float = limit("floors and roofs")

    @property
    def beside(self) -> str:
        """File beside which pieces are kept by default."""
        return self.source

    @property
    def limits(self) -> Limits:
        """Minimum thicknesses of walls and floors."""
        from fracslice.checks.problems import Limits

        return Limits(wall=self.wall, floor=self.floor)


@command(CheckOptions, short_help="Say whether a model, or a scene's mesh or layers, would print.")
def check(given: CheckOptions) -> int:
    """Say whether a model file, or a scene, would print as it is.

    The mesh and its layers are checked; with --layer, the layers of a scene alone. Each problem comes with
    its layer, its place in mm from the middle of the object and above its lowest point, and the option that
    mends it. Exit status: 1 if it would not print, or only with supports.

    Examples
    --------
    fracslice check part.stl --printer sl1s
    fracslice check mandelbulb --size 60mm --layer 0.05mm --html summary.html
    fracslice check my.xml --layer 0.05mm --fix -o fixed.stl
    fracslice check vase.stl --layer 0.2mm --wall 0.4mm --material pla
    """
    if not given.fix:
        refuse_options({"fixed"}, "only with --fix")
    if given.show:
        need_window(given)
    if is_model(given.source):
        refuse_options(OF_SCENES, "only for scenes, and a model was given")
        checked = of_model
    elif given.layer is not None:
        refuse_options(OF_MESHES, "only for meshes, and --layer checks layers")
        checked = of_scene
    else:
        refuse_options(SHARED, "only with --layer")
        checked = of_mesh
    with given.working() as work:
        if given.orient:
            given = given.oriented(load_scene(given.source, given.settings), work)
        numbers, lines, problems = checked(given, work)
    import json

    click.echo(json.dumps(numbers, indent=2) if given.as_json else os.linesep.join(filter(None, lines)))
    return 1 if problems else 0


def need_window(given: CheckOptions) -> None:
    """Refuse a window where there is no mesh for it, or no screen, before a long examination."""
    from fracslice.viewer import need_screen

    if given.layer is not None and not is_model(given.source):
        refuse_options({"show"}, "only with a mesh, and --layer checks layers alone")
    need_screen()


Checked = tuple[dict[str, Any], list[str], "Sequence[Problem]"]
"""Figures, lines of text, and problems."""


def of_mesh(given: CheckOptions, work: Work) -> Checked:
    """Check the mesh of a scene, and its layers."""
    from fracslice.checks import problems_of
    from fracslice.checks.defects import MeshEvidence
    from fracslice.jobs.mesh import make_mesh
    from fracslice.volume.amount import sizing

    scene = load_scene(given.source, given.settings)
    made = make_mesh(scene, given.mesh_job(scene), work)
    report = made.report
    size = sizing(scene, given.size, given.scale, work)
    layered = in_layers(given, size.longest)
    faults = problems_of("mesh", MeshEvidence(report.mesh, report.problems, made.whole))
    how = given.printing(scene.printing)
    whole = Variant(scene.root, size, how, given.up, scene, faults, mesh=made.whole)
    layers, lines, problems = of_layers(whole, layered, work)
    return report.as_dict() | {"layers": layers}, [summary(given.source, report), *lines], problems


def in_layers(given: CheckOptions, size: float) -> CheckOptions:
    """Options with a layer height and a pixel for an object of this size, mm, where none were given."""
    height = max(size / ACROSS, THINNEST)
    pixel = None if given.machine else 2 * (max(height, PIXEL),)
    return given.but(layer=given.layer or (height, None), pixel=given.pixel or pixel)


def of_scene(given: CheckOptions, work: Work) -> Checked:
    """Check the layers of a scene."""
    from fracslice.volume.amount import sizing

    scene = load_scene(given.source, given.settings)
    size = sizing(scene, given.size, given.scale, work)
    return of_layers(Variant(scene.root, size, given.printing(scene.printing), given.up, scene), given, work)


def of_model(given: CheckOptions, work: Work) -> Checked:
    """Check the mesh of a model and, if it encloses a volume, its layers."""
    from fracslice.checks import problems_of
    from fracslice.checks.defects import MeshEvidence
    from fracslice.common.parameters import LONGEST
    from fracslice.errors import MeshError
    from fracslice.mesh.checks import check_mesh
    from fracslice.mesh.models import MeshField
    from fracslice.records import SAME, UP
    from fracslice.volume.amount import Sizing

    turned = place(load_model(given.source), given.up, SAME)
    length = longest(turned) or 1.0
    side = given.size or length
    if side > LONGEST:
        raise BadInput(f"{given.source}: {side:.3g} mm long, more than a kilometre: expected a model in mm")
    x, y, z = (factor * side / length for factor in given.scale)
    mesh = place(turned, UP, (x, y, z))
    try:
        report = check_mesh(mesh, threads=work.threads)
    except MeshError as error:
        raise BadInput(f"{given.source}: {error}") from error
    faults = problems_of("mesh", MeshEvidence(report, report.problems, mesh))
    line, numbers = f"{given.source}: {sizes(report)}", report.as_dict()
    if not report.watertight or report.misoriented_edges or not report.volume_mm3:
        lines = [f"{given.source}: {figures(report, [str(fault) for fault in faults])}"]
        if given.fixed:
            lines.append(f"{given.fixed}: not written; fracslice repair makes a solid of a model")
        return numbers, lines, faults
    size = longest(mesh)
    if size <= THINNEST and given.layer is None:
        raise BadInput(f"{given.source}: {size:.3g} mm long, less than a layer: expected a model in mm")
    layered = in_layers(given, size).but(up=UP)
    factor = size / side  # the mesh is compensated already: a size that is advised is before that
    sides = Sizing(side, 1 / factor, (factor,) * 3)
    field = MeshField(replace(mesh, vertices=mesh.vertices - mesh.bounds.mean(0)))
    turns = given.up == UP and x == y == z
    how = given.printing(Print())
    made = Variant(field, sides, how, given.up, faults=faults, mesh=mesh, turns=turns)
    layers, lines, problems = of_layers(made, layered, work)
    return numbers | {"layers": layers}, [line, *lines], problems


def place(mesh: Mesh, up: Triple, scale: Triple) -> Mesh:
    """Mesh turned and scaled."""
    from fracslice.common.arrays import product
    from fracslice.records import SAME, UP
    from fracslice.volume.amount import orientation

    if up == UP and scale == SAME:
        return mesh
    return replace(mesh, vertices=product(mesh.vertices, orientation(up, scale)))


def longest(mesh: Mesh) -> float:
    """Longest side of a mesh, mm."""
    return float((mesh.vertices.max(0) - mesh.vertices.min(0)).max())


@dataclass(frozen=True)
class Variant:
    """An object with other settings, and the options that change them."""

    root: Field
    size: Sizing
    how: Print
    up: Triple
    scene: Scene | None = None  # that it was read from; None for a model
    faults: Sequence[Problem] = ()  # problems of its mesh
    flags: tuple[str, ...] = ()
    mesh: Mesh | None = None  # its mesh, if there is one
    turns: bool = True  # whether --fix may try other directions up

    def changed(self, settings: dict[str, str]) -> Variant:
        """With other print settings, or another size."""
        size, values, kinds = self.size, dict(settings), type(self.how).kinds()
        if smaller := values.pop("size", None):
            size = replace(size, side=float(smaller[:-2]), unit=None)
        how = replace(self.how, **{name: kinds[name].read(text) for name, text in values.items()})
        return replace(self, size=size, how=how, flags=(*self.flags, *options_of(settings)))

    def turned(self, up: Triple) -> Variant:
        """With another direction up; a model is turned itself, as its mesh has fewer distances to find."""
        turned = replace(self, up=up, flags=(*self.flags, "--up " + " ".join(f"{c:g}" for c in up)))
        if self.scene:
            return turned
        from fracslice.mesh.models import MeshField
        from fracslice.records import SAME

        return replace(turned, root=MeshField(place(cast("MeshField", self.root).mesh, up, SAME)))


def options_of(settings: dict[str, str]) -> tuple[str, ...]:
    """Print settings as options."""
    from fracslice.checks.problems import as_option

    return tuple(as_option(name, text) for name, text in settings.items())


@dataclass(frozen=True)
class Attempt:
    """A variant of an object, and what its layers show."""

    variant: Variant
    numbers: dict[str, Any]
    text: str
    problems: Sequence[Problem]
    shown: tuple[Stack, PrintReport] | None
    seconds: float  # CPU time of the check

    @property
    def severity(self) -> tuple[int, float]:
        """See `fracslice.checks.problems.severity`."""
        from fracslice.checks.problems import severity

        return severity(self.problems)

    def mends(self, other: Attempt) -> bool:
        """See `fracslice.checks.problems.mends`."""
        from fracslice.checks.problems import mends

        return mends(self.problems, other.problems)


def of_layers(made: Variant, given: CheckOptions, work: Work) -> Checked:
    """Check the layers of an object; with --fix, try what mends its problems and keep what helps."""
    check_targets(given.source, given.picture, given.html, given.fixed)
    first = examine_layers(made, given, work)
    best, refused = mended_object(first, given, work) if given.fix and first.problems else (first, [])
    if best.shown and given.picture:
        draw(*best.shown, given.picture, work)
    if best.shown and given.html:
        drawn = views(made.mesh, given) if made.mesh is not None and best is first else []
        write_page(*best.shown, [figures_of(best.shown[1])], given.source, given.html, work, drawn)
    if first.shown and given.show and made.mesh is not None:
        open_window(made.mesh, *first.shown, given)
    if given.fixed:
        write_mesh(best.variant, given, work)
    lines = [f"{given.source}: {first.text}"]
    if not refused and best is first:
        return first.numbers, lines, first.problems
    flags = " ".join(best.variant.flags)
    lines += refused
    lines += [f"with {flags}: {best.text}"] if flags else []
    return {"before": first.numbers, "flags": flags, "after": best.numbers}, lines, best.problems


def views(mesh: Mesh, given: CheckOptions) -> list[bytes]:
    """Pictures of a mesh from above and from below, with what hangs in the air and what is thin."""
    from fracslice.mesh.checks import marked
    from fracslice.mesh.model import AXES, BELOW, thumbnail

    shown = marked(mesh, given.wall, given.threads)
    return [thumbnail(shown, axes) for axes in (AXES, BELOW)]


def open_window(mesh: Mesh, stack: Stack, report: PrintReport, given: CheckOptions) -> None:
    """Open a window on a mesh, with what was found in its layers."""
    import numpy as np

    from fracslice import viewer
    from fracslice.mesh.checks import marked

    found = viewer.Found(report.marks(stack.tops), stack.tops, np.array(report.areas))
    viewer.show(marked(mesh, given.wall, given.threads), found)


def mended_object(first: Attempt, given: CheckOptions, work: Work) -> tuple[Attempt, list[str]]:
    """The best of the object and its mended variants, and a line on each that was left out.

    All settings that the problems name are tried at once, then one by one; then other directions up; then
    holes for the resin, which an object should not have if it can do without. They are compared in coarse
    layers while there is time; the best is examined in those that were asked for.
    """
    from fracslice.checks.problems import mend_settings
    from fracslice.errors import Cancelled

    lines = list[str]()
    finest = first.variant.size.longest / ACROSS
    asked = given.slice_job(first.variant.how)
    coarse = finest > min(*asked.pixels, asked.layer[0])
    until = time.process_time() + MOST_SECONDS - (0 if coarse else first.seconds)
    limited = replace(work, cancel=Deadline(work.cancel, until))

    def tried(variant: Variant) -> Attempt | None:
        text = " ".join(variant.flags)
        work.progress(f"trying {text}", 0.0)
        try:
            limited.check()
            return examine_layers(variant, given, limited, finest)
        except Cancelled:
            work.check()
            lines.append(
                f"{f'with {text}' if text else 'in coarse layers'}: not finished within {MOST_SECONDS:g} s"
            )
            return None

    settings = mend_settings(first.problems)
    holes = {name: text for name, text in settings.items() if name == HOLES}
    settings.pop(HOLES, None)
    base = best = tried(first.variant) if coarse else first
    if not best:
        return first, lines
    choices = [settings] if settings else []
    choices += [{name: text} for name, text in settings.items()] if len(settings) > 1 else []
    for choice in choices:
        now = tried(best.variant.changed(choice))
        if now and now.mends(best):
            best = now
            if choice is settings:
                break
        elif now and (len(choice) == 1 or len(choices) == 1):
            lines.append(f"with {' '.join(options_of(choice))}: no better, left out")
    if best.variant.turns and any("--up" in problem.advice for problem in best.problems):
        turns = [tried(best.variant.turned(up)) for up in AXES if up != best.variant.up]
        helpful = [turned for turned in turns if turned and turned.mends(best)]
        lines += ["with other directions up: no better, left out"] * (any(turns) and not helpful)
        best = min([best, *helpful], key=lambda attempt: attempt.severity)
    if holes and HOLES in mend_settings(best.problems):
        now = tried(best.variant.changed(holes))
        lines += [f"with {' '.join(options_of(holes))}: no better, left out"] * bool(
            now and not now.mends(best)
        )
        best = now if now and now.mends(best) else best
    if best is base:
        return first, lines
    found = examine_layers(best.variant, given, work) if coarse else best
    if found.mends(first):
        return found, lines
    return first, [*lines, f"with {' '.join(best.variant.flags)}: no better, left out"]


def write_mesh(variant: Variant, given: CheckOptions, work: Work) -> None:
    """Write the mesh of a variant."""
    from fracslice.jobs.mesh import make_mesh

    scene = variant.scene or load_scene(given.source)
    size = variant.size.side if variant.size.unit is None else given.size
    job = replace(given.mesh_job(scene), size=size, printing=variant.how, up=variant.up)
    make_mesh(scene, job, work, given.fixed)


def examine_layers(variant: Variant, given: CheckOptions, work: Work, finest: float = 0.0) -> Attempt:
    """Check the layers of a variant of an object, in layers and pixels of at least `finest` mm."""
    from fracslice.checks.fitting import misfit
    from fracslice.checks.layer_checks import check_layers
    from fracslice.records import UP
    from fracslice.slicing import adapted, plan_stack

    begun, machine, size = time.process_time(), given.machine, variant.size
    side = None if size.unit else size.side
    job = replace(given.slice_job(variant.how), up=variant.up if variant.scene else UP, size=side)
    if finest:
        layer = tuple(step and max(step, finest) for step in job.layer)
        pixel = tuple(max(step, finest) for step in job.pixels)
        job = replace(job, layer=layer, pixel=pixel, printer=None)
    most = job.layer[1]
    stack = plan_stack(variant.root, job, work, size)
    if machine and (unfit := misfit(stack, machine)):
        numbers = {"size": stack.size, "fits": False, "problems": [str(unfit)]}
        spent = time.process_time() - begun
        return Attempt(variant, numbers, f"would not print: {unfit}", [unfit], None, spent)
    if work.cluster and variant.scene:
        stack, report = shared_check(variant.scene, job, given, work)
    else:
        stack = stack if most is None else adapted(stack, most, work)
        report = check_layers(stack, given.limits, machine, work)
    report = replace(report, problems=[*variant.faults, *report.problems])
    report, spent = of_material(report, given.material), time.process_time() - begun
    return Attempt(
        variant, report.as_dict(), describe_report(report), report.problems, (stack, report), spent
    )


def shared_check(scene: Scene, job: SliceJob, given: CheckOptions, work: Work) -> tuple[Stack, PrintReport]:
    """Check the layers of a scene by the pool of the work."""
    from fracslice.jobs.slice_checks import check_run
    from fracslice.jobs.slices import SliceRecipe
    from fracslice.scene.model import to_xml

    run = SliceRecipe(to_xml(scene), scene.name, job).run(work, scene)
    return run.stack, check_run(run, given.limits)


def draw(stack: Stack, report: PrintReport, path: str, work: Work) -> None:
    """Draw the worst layers."""
    from fracslice.common.files import replacing
    from fracslice.slicing.raster import worst_layers

    with replacing(path) as file:
        worst_layers(stack, report.worst, file, work)


def describe_report(report: PrintReport) -> str:
    """Summary of a print report: figures, its problems, thin features that layers may miss, narrow holes."""
    lines = (
        f"{figures_of(report)}, {verdict(report.problems)}",
        report.supports,
        report.solid.unseen,
        report.solid.holes,
    )
    return os.linesep.join(filter(None, lines))


def figures_of(report: PrintReport) -> str:
    """Layers, size, volume and weight of a print report."""
    size = " x ".join(map(decimal, report.size))
    ml, g = significant(report.volume / 1000), significant(report.weight_g)
    parts = f"{len(report.bodies)} bodies, " if len(report.bodies) > 1 else ""
    return f"{format_count(report.layers, 'layer')}, {size} mm, {parts}{ml} ml, {g} g"


def verdict(problems: Sequence[Problem]) -> str:
    """Verdict on printability, with a line for each problem."""
    from fracslice.checks.problems import verdict

    lines = [f"  {problem}" for problem in problems]
    return os.linesep.join([f"{verdict(problems)}{':' if lines else ''}", *lines])
