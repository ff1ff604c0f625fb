"""fracslice check: printability of a model, or of the mesh or layers of a scene."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from .inputs import check_targets, is_model, load_model, load_scene, refuse_options
from .layers import (
    LAYER,
    PIXEL_MM,
    as_high_as_wanted,
    ending,
    heights,
    html_option,
    pixel_of,
    printer_option,
    write_page,
)
from .options import (
    NAME,
    job_of,
    job_options,
    length,
    print_options,
    printing_of,
    run_options,
    source_argument,
)
from .summary import figures, summary
from .working import working

if TYPE_CHECKING:
    from fracslice.kernel import Field
    from fracslice.mesh import Mesh
    from fracslice.printing.limits import Limits
    from fracslice.scene import Print
    from fracslice.slicing import Stack
    from fracslice.slicing.checks import PrintReport
    from fracslice.volume.sizing import Sizing
    from fracslice.work import Work

OF_LAYERS = {"pixel", "machine", "picture", "html", "fix"}
OF_MESHES = {"voxel", "resolution", "dust", "chord", "simplify"}
OF_SCENES = {*OF_MESHES, "settings", "size"}

ACROSS = 256
"""Layers of a model's longest side, if --layer is not given, unless they would be thinner than `LAYER`."""


def limit(name: str, text: str) -> Callable[..., Any]:
    """Decorator that adds a minimum thickness of 0.1 mm by default."""
    text = f"Minimum thickness of {text}; 0.1mm by default."
    return click.option(f"--{name}", callback=length, default="0.1mm", metavar="LENGTH", help=text)


@click.command(short_help="Say whether a model, or a scene's mesh or layers, would print.")
@source_argument("MODEL|SCENE")
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
@click.option("--layer", callback=heights, metavar="LENGTH[..LENGTH]", help="Check layers of this height.")
@click.option(
    "--pixel",
    callback=length,
    metavar="LENGTH",
    help="With layers: pixel size; the printer's by default, or 0.05mm.",
)
@printer_option('With layers: the printer it has to fit; "list" shows all.')
@click.option(
    "--picture",
    type=NAME,
    callback=ending(".png"),
    metavar="FILE.png",
    help="With layers: draw the worst layers.",
)
@html_option
@click.option("--fix", is_flag=True, help="With layers: mend what can be mended, and check again.")
@limit("wall", "walls")
@limit("floor", "floors and roofs")
@print_options
@job_options
@run_options
@click.pass_context
def check(
    context: click.Context, /, source: str, as_json: bool, threads: int, quiet: bool, **options: Any
) -> int:
    """Say whether a model file, or the mesh or the layers of a scene, would print as it is.

    The layers of a model are always checked, those of a scene with --layer. Each problem comes with its
    layer, its place in mm from the middle of the object and above its lowest point, and the option that mends
    it. Exit status: 1 if it would not print.
    """
    numbers: dict[str, Any]
    if is_model(source):
        refuse_options(context, OF_SCENES, "only for scenes, and a model was given")
        with working(threads, quiet) as work:
            numbers, lines, problems = of_model(source, options, work)
    elif options["layer"] is not None:
        refuse_options(context, OF_MESHES, "only for meshes, and --layer checks layers")
        scene = load_scene(source, options["settings"])
        with working(threads, quiet) as work:
            from fracslice.volume.sizing import sizing

            size = sizing(scene, options["size"], options["scale"], work)
            how = printing_of(scene, options)
            numbers, lines, problems = of_layers(source, scene.root, size, how, options, work)
    else:
        refuse_options(context, OF_LAYERS, "only with --layer")
        with working(threads, quiet) as work:
            numbers, lines, problems = of_mesh(source, options, work)
    import json

    click.echo(json.dumps(numbers, indent=2) if as_json else os.linesep.join(filter(None, lines)))
    return 1 if problems else 0


Checked = tuple[dict[str, Any], list[str], Sequence[object]]
"""Figures, lines of text, and problems."""


def of_mesh(source: str, options: dict[str, Any], work: Work) -> Checked:
    """Check the mesh of a scene."""
    from fracslice.jobs.mesh import make_mesh
    from fracslice.printing.checks import check_solid

    scene = load_scene(source, options["settings"])
    result = make_mesh(scene, job_of(scene, **options), work)
    solid = check_solid(result.root, result.bricks, result.place.scale, limits_of(options), work)
    problems = (*result.report.problems, *solid.thin)
    hint = "" if problems else "; --layer looks at islands, cups, traps, overhangs and necks, too"
    numbers = result.report.as_dict() | {"solid": solid.as_dict()}
    return numbers, [summary(source, result.report), solid.unseen, verdict(problems) + hint], problems


def of_model(source: str, options: dict[str, Any], work: Work) -> Checked:
    """Check the mesh of a model and, if it is closed, its layers."""
    from fracslice.mesh.check import check_mesh
    from fracslice.mesh.field import MeshField
    from fracslice.scene import Print
    from fracslice.volume.sizing import UP, Sizing

    mesh = placed(load_model(source), options)
    report = check_mesh(mesh, threads=work.threads)
    line, numbers = f"{source}: {figures(report)}", report.as_dict()
    if not report.watertight:
        return numbers, [line], report.problems
    size = longest(mesh)
    height = max(size / ACROSS, float(LAYER[:-2]))
    options = options | {
        "layer": options["layer"] or (height, None),
        "pixel": options["pixel"] or (None if options["machine"] else max(height, PIXEL_MM)),
    }
    given = {name: value for name, value in options.items() if name in Print.kinds() and value is not None}
    options = options | {"up": UP}
    how = Sizing(size, 1.0), Print(**given)
    layers, lines, problems = of_layers(source, MeshField(mesh), *how, options, work)
    return numbers | {"layers": layers}, [line, *lines], (*report.problems, *problems)


def placed(mesh: Mesh, options: dict[str, Any]) -> Mesh:
    """Mesh turned and scaled as the options say."""
    from fracslice.formulas.algebra import product
    from fracslice.volume.sizing import SAME, UP, orientation

    if options["up"] == UP and options["scale"] == SAME:
        return mesh
    return replace(mesh, vertices=product(mesh.vertices, orientation(options["up"], options["scale"])))


def longest(mesh: Mesh) -> float:
    """Longest side of a mesh, mm."""
    return float((mesh.vertices.max(0) - mesh.vertices.min(0)).max())


def of_layers(
    source: str, root: Field, size: Sizing, how: Print, options: dict[str, Any], work: Work
) -> Checked:
    """Check the layers of an object; with --fix, mend it and check it again."""
    from fracslice.printing.problems import mended
    from fracslice.scene import Print

    check_targets(source, options["picture"], options["html"])
    numbers, lines, problems = examined(source, root, size, how, options, work)
    settings = mended(problems) if options["fix"] else {}
    if not settings:
        return numbers, lines, problems
    flags = " ".join(f"--{name} {value}" for name, value in settings.items())
    if smaller := settings.pop("size", None):
        size = replace(size, side=float(smaller[:-2]) / max(size.factors), unit=None)
    values = {name: Print.kinds()[name].read(text) for name, text in settings.items()}
    after, again, left = examined(f"with {flags}", root, size, replace(how, **values), options, work)
    return {"before": numbers, "flags": flags, "after": after}, [*lines, *again], left


def examined(
    name: str, root: Field, size: Sizing, how: Print, options: dict[str, Any], work: Work
) -> tuple[dict[str, Any], list[str], list[Any]]:
    """Check the layers of an object once."""
    from fracslice.slicing import SliceJob, plan_stack
    from fracslice.slicing.checks import check_layers
    from fracslice.slicing.problems import misfit

    machine, pixel = options["machine"], pixel_of(options)
    sides = size.side, options["layer"][0], pixel, options["up"], how, size.factors, size.unit
    stack = plan_stack(root, SliceJob(*sides), work)
    if machine and (unfit := misfit(stack, machine)):
        return (
            {"size": stack.size, "fits": False, "problems": [str(unfit)]},
            [f"{name}: would not print: {unfit}"],
            [unfit],
        )
    stack = as_high_as_wanted(stack, options, work)
    report = check_layers(stack, limits_of(options), machine, work)
    if options["picture"]:
        draw(stack, report, options["picture"], work)
    if options["html"]:
        write_page(stack, report, [figures_of(report)], name, options["html"], work)
    return report.as_dict(), described(name, report), report.problems


def draw(stack: Stack, report: PrintReport, path: str, work: Work) -> None:
    """Draw the worst layers."""
    from fracslice.export import replacing
    from fracslice.slicing.preview import worst_layers

    with replacing(path) as file:
        worst_layers(stack, report.worst, file, work)


def limits_of(options: dict[str, Any]) -> Limits:
    """Minimum thicknesses of walls and floors."""
    from fracslice.printing.limits import Limits

    return Limits(wall=options["wall"], floor=options["floor"])


def described(name: str, report: PrintReport) -> list[str]:
    """Summary of a print report: figures, a line for each problem, and thin features that layers may miss."""
    return [f"{name}: {figures_of(report)}, {verdict(report.problems)}", report.solid.unseen]


def figures_of(report: PrintReport) -> str:
    """Layers, size, volume and weight of a print report."""
    size = " x ".join(f"{s:.2f}" for s in report.size)
    return f"{report.layers} layers, {size} mm, {report.volume / 1000:.3g} ml, {report.weight_g:.3g} g"


def verdict(problems: Sequence[object]) -> str:
    """Verdict on printability, with a line for each problem."""
    return os.linesep.join(["would not print:", *(f"  {p}" for p in problems)]) if problems else "would print"
