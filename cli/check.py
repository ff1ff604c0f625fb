"""fracslice check: printability of a model, or of the mesh or layers of a scene."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import click

from fracslice.common.messages import decimal, format_count, significant
from fracslice.records import PIXEL, MeshJob, Placed, Print, SliceJob

from .inputs import BadInput, check_targets, is_model, load_model, load_scene, refuse_options
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
from .summary import DENSITIES, figures, of_material, sizes, summary

if TYPE_CHECKING:
    from fracslice.formulas.box import Triple
    from fracslice.kernel import Field
    from fracslice.mesh import Mesh
    from fracslice.printing.problems import Limits
    from fracslice.scene import Scene
    from fracslice.slicing import Stack
    from fracslice.slicing.layer_checks import PrintReport
    from fracslice.slicing.printers import Printer
    from fracslice.volume.sizing import Sizing
    from fracslice.work import Work

SHARED = {"cluster", "shard", "store"}
OF_LAYERS = {*SHARED, "pixel", "machine", "picture", "html", "fix", "material"}
OF_MESHES = MeshJob.kinds().keys() - Placed.kinds().keys()
OF_SCENES = {*OF_MESHES, *SHARED, "settings"}

AXES = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)
"""Directions up that --fix tries."""

ACROSS = 256
"""Layers of a model's longest side, if --layer is not given, unless they would be thinner than `LAYER`."""


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
    layer: Any = kind_option(SliceJob.kinds()["layer"], None, "Check layers of this height")
    machine: Printer | None = printer_option(
        'With layers: the printer that the object must fit; "list" shows all.'
    )
    picture: str | None = option(Name("FILE.png", ".png"), "With layers: draw the worst layers.")
    fix: bool = flag("With layers: try what would mend the problems, and keep what helps.")
    material: str = option(
        click.Choice(list(DENSITIES)),
        "With layers: resin by default. Filaments have no resin traps, suction cups and sealed cavities.",
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
        from fracslice.printing.problems import Limits

        return Limits(wall=self.wall, floor=self.floor)


@command(CheckOptions, short_help="Say whether a model, or a scene's mesh or layers, would print.")
def check(given: CheckOptions) -> int:
    """Say whether a model file, or the mesh or the layers of a scene, would print as it is.

    The layers of a model are always checked, those of a scene with --layer. Each problem comes with its
    layer, its place in mm from the middle of the object and above its lowest point, and the option that mends
    it. Exit status: 1 if it would not print, or only with supports.

    Examples
    --------
    fracslice check part.stl --printer sl1s
    fracslice check mandelbulb --size 60mm --layer 0.05mm --html summary.html
    fracslice check my.xml --layer 0.05mm --fix
    fracslice check vase.stl --layer 0.2mm --wall 0.4mm --material pla
    """
    if is_model(given.source):
        refuse_options(OF_SCENES, "only for scenes, and a model was given")
        checked = of_model
    elif given.layer is not None:
        refuse_options(OF_MESHES, "only for meshes, and --layer checks layers")
        checked = of_scene
    else:
        refuse_options(OF_LAYERS, "only with --layer")
        checked = of_mesh
    with given.working() as work:
        numbers, lines, problems = checked(given, work)
    import json

    click.echo(json.dumps(numbers, indent=2) if given.as_json else os.linesep.join(filter(None, lines)))
    return 1 if problems else 0


Checked = tuple[dict[str, Any], list[str], Sequence[object]]
"""Figures, lines of text, and problems."""


def of_mesh(given: CheckOptions, work: Work) -> Checked:
    """Check the mesh of a scene."""
    from fracslice.jobs.mesh import make_mesh
    from fracslice.printing.solid_checks import check_solid

    scene = load_scene(given.source, given.settings)
    result = make_mesh(scene, given.mesh_job(scene), work)
    solid = check_solid(result.root, result.bricks, result.place.scale, given.limits, work)
    problems = (*result.report.problems, *solid.thin)
    hint = "" if problems else "; --layer looks at islands, cups, traps, overhangs and necks, too"
    numbers = result.report.as_dict() | {"solid": solid.as_dict()}
    return numbers, [summary(given.source, result.report), solid.unseen, verdict(problems) + hint], problems


def of_scene(given: CheckOptions, work: Work) -> Checked:
    """Check the layers of a scene."""
    from fracslice.volume.sizing import sizing

    scene = load_scene(given.source, given.settings)
    size = sizing(scene, given.size, given.scale, work)
    return of_layers(scene, size, given.printing(scene.printing), given, work)


def of_model(given: CheckOptions, work: Work) -> Checked:
    """Check the mesh of a model and, if it encloses a volume, its layers."""
    from fracslice.common.parameters import LONGEST
    from fracslice.errors import EmptyError, MeshError
    from fracslice.mesh.checks import check_mesh
    from fracslice.mesh.field import MeshField
    from fracslice.records import SAME, UP
    from fracslice.volume.sizing import Sizing

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
    line, numbers = f"{given.source}: {figures(report)}", report.as_dict()
    if not report.problems:
        line = f"{given.source}: {sizes(report)}"
    if not report.watertight or report.misoriented_edges or not report.volume_mm3:
        return numbers, [line], report.problems
    size, thinnest = longest(mesh), SliceJob().layer[0]
    if size <= thinnest and given.layer is None:
        raise BadInput(f"{given.source}: {size:.3g} mm long, less than a layer: expected a model in mm")
    height = max(size / ACROSS, thinnest)
    layered = given.but(
        layer=given.layer or (height, None),
        pixel=given.pixel or (None if given.machine else 2 * (max(height, PIXEL),)),
        up=UP,
    )
    factor = size / side  # the mesh is compensated already: a size that is advised is before that
    sides = Sizing(side, 1 / factor, (factor,) * 3)
    field = MeshField(replace(mesh, vertices=mesh.vertices - mesh.bounds.mean(0)))
    try:
        layers, lines, problems = of_layers(field, sides, given.printing(Print()), layered, work)
    except EmptyError:
        pixel = max(layered.slice_job(Print()).pixels)
        finest = f"layer of {layered.layer[0]:.3g} mm has a pixel of {pixel:.3g} mm"
        nothing = f"no {finest} inside: all of it is thinner"
        return numbers, [line, verdict([nothing])], (*report.problems, nothing)
    return numbers | {"layers": layers}, [line, *lines], (*report.problems, *problems)


def place(mesh: Mesh, up: Triple, scale: Triple) -> Mesh:
    """Mesh turned and scaled."""
    from fracslice.formulas.algebra import product
    from fracslice.records import SAME, UP
    from fracslice.volume.sizing import orientation

    if up == UP and scale == SAME:
        return mesh
    return replace(mesh, vertices=product(mesh.vertices, orientation(up, scale)))


def longest(mesh: Mesh) -> float:
    """Longest side of a mesh, mm."""
    return float((mesh.vertices.max(0) - mesh.vertices.min(0)).max())


@dataclass(frozen=True)
class Attempt:
    """An object with some settings, and what its layers show."""

    flags: tuple[str, ...]
    size: Sizing
    how: Print
    up: Triple
    numbers: dict[str, Any]
    text: str
    problems: Sequence[Any]
    shown: tuple[Stack, PrintReport] | None

    @property
    def severity(self) -> tuple[int, float]:
        """See `fracslice.printing.problems.severity`."""
        from fracslice.printing.problems import severity

        return severity(self.problems)


def of_layers(of: Scene | Field, size: Sizing, how: Print, given: CheckOptions, work: Work) -> Checked:
    """Check the layers of an object; with --fix, try what mends its problems and keep what helps."""
    check_targets(given.source, given.picture, given.html)
    first = examine_layers(of, size, how, given.up, (), given, work)
    best, refused = mended_object(of, first, given, work) if given.fix else (first, [])
    if best.shown and given.picture:
        draw(*best.shown, given.picture, work)
    if best.shown and given.html:
        write_page(*best.shown, [figures_of(best.shown[1])], given.source, given.html, work)
    lines = [f"{given.source}: {first.text}"]
    if not refused and best is first:
        return first.numbers, lines, first.problems
    flags = " ".join(best.flags)
    lines += [f"with {text}: no better, left out" for text in refused]
    lines += [f"with {flags}: {best.text}"] if flags else []
    return {"before": first.numbers, "flags": flags, "after": best.numbers}, lines, best.problems


def mended_object(
    of: Scene | Field, first: Attempt, given: CheckOptions, work: Work
) -> tuple[Attempt, list[str]]:
    """The best of the object and its mended forms, and the settings that made it no better.

    All settings that the problems name are tried at once, then one by one; then other directions up.
    """
    from fracslice.printing.problems import mend_settings

    def tried(of_best: Attempt, settings: dict[str, str], up: Triple) -> Attempt:
        size, values = of_best.size, dict(settings)
        if smaller := values.pop("size", None):
            size = replace(size, side=float(smaller[:-2]), unit=None)
        kinds = type(of_best.how).kinds()
        how = replace(of_best.how, **{name: kinds[name].read(text) for name, text in values.items()})
        turned = () if up == of_best.up else ("--up " + " ".join(f"{c:g}" for c in up),)
        flags = (*of_best.flags, *(f"--{name} {text}" for name, text in settings.items()), *turned)
        return examine_layers(of, size, how, up, flags, given, work)

    settings, best, refused = mend_settings(first.problems), first, list[str]()
    choices = [settings] if settings else []
    if len(settings) > 1:
        choices += [{name: text} for name, text in settings.items()]
    for choice in choices:
        now = tried(best, choice, best.up)
        if now.severity < best.severity:
            best = now
            if choice is settings:
                break
        elif len(choice) == 1 or len(choices) == 1:
            refused.append(" ".join(f"--{name} {text}" for name, text in choice.items()))
    if hasattr(of, "root") and any("--up" in problem.advice for problem in best.problems):
        turns = [tried(best, {}, up) for up in AXES if up != best.up]
        best = min([best, *turns], key=lambda attempt: attempt.severity)
    return best, refused


def examine_layers(
    of: Scene | Field,
    size: Sizing,
    how: Print,
    up: Triple,
    flags: tuple[str, ...],
    given: CheckOptions,
    work: Work,
) -> Attempt:
    """Check the layers of an object once."""
    from fracslice.jobs.completeness import layers_amount
    from fracslice.printing.problems import Problem
    from fracslice.scene import Scene
    from fracslice.slicing import Slicer, adapted, plan_stack
    from fracslice.slicing.layer_checks import check_layers, misfit

    machine, most = given.machine, given.layer[1]
    side = None if size.unit else size.side
    job = replace(given.slice_job(how), up=up, size=side)
    root = of.root if isinstance(of, Scene) else of
    stack, settings = plan_stack(root, job, work, size), (flags, size, how, up)
    if machine and (unfit := misfit(stack, machine)):
        numbers = {"size": stack.size, "fits": False, "problems": [str(unfit)]}
        return Attempt(*settings, numbers, f"would not print: {unfit}", [unfit], None)
    if work.cluster and isinstance(of, Scene):
        stack, report = shared_check(of, job, given, work)
    else:
        stack = stack if most is None else adapted(stack, most, work)
        report = check_layers(stack, given.limits, machine, work)
    if lost := layers_amount(Slicer(stack, work), work).problems:
        report = replace(report, problems=[*(Problem("lost", text) for text in lost), *report.problems])
    report = of_material(report, given.material)
    return Attempt(*settings, report.as_dict(), describe_report(report), report.problems, (stack, report))


def shared_check(scene: Scene, job: SliceJob, given: CheckOptions, work: Work) -> tuple[Stack, PrintReport]:
    """Check the layers of a scene by the pool of the work."""
    from fracslice.jobs.slice_checks import check_run
    from fracslice.jobs.slices import SliceRecipe
    from fracslice.scene.writer import to_xml

    run = SliceRecipe(to_xml(scene), scene.name, job).run(work, scene)
    return run.stack, check_run(run, given.limits)


def draw(stack: Stack, report: PrintReport, path: str, work: Work) -> None:
    """Draw the worst layers."""
    from fracslice.export import replacing
    from fracslice.slicing.preview import worst_layers

    with replacing(path) as file:
        worst_layers(stack, report.worst, file, work)


def describe_report(report: PrintReport) -> str:
    """Summary of a print report: figures, a line for each problem, and thin features that layers may miss."""
    lines = f"{figures_of(report)}, {verdict(report.problems)}", report.solid.unseen
    return os.linesep.join(filter(None, lines))


def figures_of(report: PrintReport) -> str:
    """Layers, size, volume and weight of a print report."""
    size = " x ".join(map(decimal, report.size))
    ml, g = significant(report.volume / 1000), significant(report.weight_g)
    parts = f"{len(report.bodies)} bodies, " if len(report.bodies) > 1 else ""
    return f"{format_count(report.layers, 'layer')}, {size} mm, {parts}{ml} ml, {g} g"


def verdict(problems: Sequence[object]) -> str:
    """Verdict on printability, with a line for each problem."""
    from fracslice.printing.problems import verdict

    lines = [f"  {problem}" for problem in problems]
    return os.linesep.join([f"{verdict(problems)}{':' if lines else ''}", *lines])
