"""fracslice slice and "fracslice check --layer": writing and checking the layers of a print."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .inputs import check_targets, load_scene
from .options import (
    NAME,
    NUMBER,
    length,
    print_options,
    printing_of,
    quiet_option,
    set_option,
    source_argument,
    threads_option,
)
from .working import working

if TYPE_CHECKING:
    from fracslice.printing.checks import Limits
    from fracslice.scene import Scene
    from fracslice.slicing import SliceJob, Stack
    from fracslice.slicing.checks import PrintReport
    from fracslice.slicing.printers import Printer
    from fracslice.work import Work

LAYER, PIXEL_MM = "0.05mm", 0.05


def shift(_: click.Context, __: click.Parameter, text: str) -> float:
    """Parse a length, zero or negative ones included, into mm."""
    from fracslice.scene.lengths import Shift

    try:
        return Shift(0.0, "").read(text)
    except ValueError as error:
        raise click.BadParameter(f"{text!r}: expected {error}") from None


def heights(
    context: click.Context, option: click.Parameter, text: str | None
) -> tuple[float, float | None] | None:
    """Parse a layer height into mm, or the minimum and maximum of adaptive layers."""
    if text is None:
        return None
    low, _, high = text.partition("..")
    least = length(context, option, low)
    assert least is not None
    return least, length(context, option, high) if ".." in text else None


def printer(context: click.Context, _: click.Parameter, name: str | None) -> Printer | None:
    """Look up a printer by name; "list" prints all printers and ends the command."""
    from fracslice.slicing import printers

    if name != "list":
        return None if name is None else printers.printer(name)
    for p in printers.PRINTERS.values():
        volume = " x ".join(f"{r:g}" for r in p.build_volume)
        click.echo(f"{p.name:20} {p.title:30} {p.pixels[0]} x {p.pixels[1]}, {volume} mm")
    context.exit()


def printer_option(text: str) -> Callable[..., Any]:
    """Decorator that adds --printer, parsed before missing options are reported. text: its help."""
    return click.option("--printer", "machine", callback=printer, is_eager=True, metavar="NAME", help=text)


@click.command("slice")
@source_argument("SCENE")
@click.option(
    "-o",
    "--output",
    type=NAME,
    required=True,
    metavar="OUT",
    help="An .sl1, .3mf, .svg, .cli or .json file, or a folder of PNG pictures.",
)
@click.option(
    "--format",
    "form",
    metavar="NAME",
    help="png, sl1, 3mf, svg, slic3r, cli, cli-binary or json; by default, what the ending of OUT says.",
)
@click.option(
    "--size",
    callback=length,
    metavar="LENGTH",
    help="The longest side, such as 80mm; the scene's by default.",
)
@click.option(
    "--layer",
    callback=heights,
    default=LAYER,
    metavar="LENGTH[..LENGTH]",
    help="Layer height, 0.05mm by default; or a range, 0.05mm..0.2mm: thick where the surface is steep.",
)
@click.option(
    "--pixel", callback=length, metavar="LENGTH", help="Pixel size; the printer's by default, or 0.05mm."
)
@printer_option('The printer whose screen the layers are for; "list" shows all.')
@click.option(
    "--up",
    nargs=3,
    type=NUMBER,
    metavar="X Y Z",
    help="The scene's direction that is up; 0 0 1 by default.",
)
@click.option(
    "--compensation",
    callback=shift,
    default="0",
    metavar="LENGTH",
    help="Move all outlines outwards by this, or inwards if it is negative; at most 1mm, 0 by default.",
)
@click.option("--gamma", type=NUMBER, default=1.0, metavar="N", help="Gamma of grey levels; 1 by default.")
@click.option(
    "--mirror/--no-mirror", default=None, help="Mirror along x; as the printer needs it by default."
)
@click.option(
    "--exposure",
    nargs=2,
    type=NUMBER,
    default=(8.0, 35.0),
    metavar="S S",
    help="Exposure in an .sl1 file: seconds of each layer and of the first; 8 35 by default.",
)
@click.option(
    "--preview",
    type=NAME,
    metavar="FILE",
    help="Write a contact sheet (.png) or an animation (.webp) of the layers.",
)
@print_options
@set_option
@threads_option
@quiet_option
def slice_(
    source: str,
    output: str,
    form: str | None,
    settings: tuple[str, ...],
    threads: int,
    quiet: bool,
    **options: Any,
) -> int:
    """Cut SCENE into the layers of a print, straight from its field.

    An interrupted job resumes when it is started again.
    """
    from fracslice.export.jobs import SliceRun
    from fracslice.export.slices import slice_format, write_slices
    from fracslice.shown import layers_amount
    from fracslice.slicing import plan_stack
    from fracslice.slicing.raster import Screen
    from fracslice.stackmesh import stack_mesh

    if slice_format(output, form) == "sl1":
        refuse_what_no_sl1_says(output, options)
    preview = options["preview"]
    if preview and Path(preview).suffix.lower() not in (".png", ".webp"):
        raise click.UsageError(f"{preview}: expected a file name that ends in .png or .webp")
    check_targets(source, None if Path(output).is_dir() else output, preview)
    scene = load_scene(source, settings)
    with working(threads, quiet) as work:
        what = job(scene, options)
        stack = as_high_as_wanted(plan_stack(scene.root, what, work), options, work)
        how = (options[name] for name in ("machine", "compensation", "gamma", "mirror"))
        screen = Screen(stack, *how)
        about = {"Title": scene.name, "scene_hash": scene.hash}
        mesh = partial(stack_mesh, scene, what, work)
        write_slices(SliceRun(stack, screen, work, tuple(options["exposure"]), about, mesh), output, form)
        if preview:
            write_preview(stack, preview, work)
        off = () if quiet else layers_amount(stack, work)[1]
    if not quiet:
        size = " x ".join(f"{s:.2f}" for s in stack.size)
        rows, columns = screen.shape
        click.echo(f"{output}: {len(stack.z)} layers of {columns} x {rows} pixels, {size} mm")
        for note in stack.notes + off:
            click.echo(note)
    return 0


def refuse_what_no_sl1_says(output: str, options: dict[str, Any]) -> None:
    """Raise a usage error for options that an SL1 archive does not allow.

    This is checked before print preparation, which may take minutes.
    """
    if options["machine"] is None:
        raise click.UsageError(f'{output}: an SL1 archive needs --printer, such as sl1s; "list" shows all')
    if options["layer"][1] is not None:
        raise click.UsageError(f"{output}: an SL1 archive has layers of one height, not a range")


def job(scene: Scene, options: dict[str, Any]) -> SliceJob:
    """Slice job with the given options."""
    from fracslice.slicing import SliceJob

    pixel, machine = options["pixel"], options["machine"]
    if pixel is not None and machine is not None:
        raise click.UsageError("--pixel and --printer: expected one of them")
    given = (pixel, pixel) if pixel else machine.pixel if machine else (PIXEL_MM, PIXEL_MM)
    up = tuple(options.get("up") or (0.0, 0.0, 1.0))
    size = options["size"] or scene.size_mm
    return SliceJob(size, options["layer"][0], given, up, printing_of(scene, options))


def stack_of(scene: Scene, options: dict[str, Any], work: Work) -> Stack:
    """Plan layers of one height for the object after print preparation."""
    from fracslice.slicing import plan_stack

    return plan_stack(scene.root, job(scene, options), work)


def as_high_as_wanted(stack: Stack, options: dict[str, Any], work: Work) -> Stack:
    """Adaptive layers if a range of heights is given; otherwise the stack itself."""
    from fracslice.slicing import adapted

    most = options["layer"][1]
    return stack if most is None else adapted(stack, most, work)


def write_preview(stack: Stack, path: str, work: Work) -> None:
    """Write a contact sheet (.png) or an animation (.webp) of the layers."""
    from fracslice.export import replacing
    from fracslice.slicing.preview import animation, contact_sheet

    with replacing(path) as file:
        (contact_sheet if path.lower().endswith(".png") else animation)(stack, file, work)


def check_print(
    source: str, settings: tuple[str, ...], as_json: bool, threads: int, quiet: bool, **options: Any
) -> int:
    """Check the layers of a scene, print the result and return the exit status."""
    from fracslice.export import replacing
    from fracslice.slicing.checks import check_layers, misfit
    from fracslice.slicing.preview import worst_layers

    if options["picture"] and Path(options["picture"]).suffix.lower() != ".png":
        raise click.UsageError(f"{options['picture']}: expected a file name that ends in .png")
    check_targets(source, options["picture"])
    scene = load_scene(source, settings)
    with working(threads, quiet) as work:
        stack, machine = stack_of(scene, options, work), options["machine"]
        if machine and (unfit := misfit(stack, machine)):
            early = {"size": stack.size, "fits": False, "problems": [unfit]}
            click.echo(json.dumps(early, indent=2) if as_json else f"{source}: would not print: {unfit}")
            return 1
        stack = as_high_as_wanted(stack, options, work)
        report = check_layers(stack, limits_of(options), machine, work)
        if options["picture"]:
            with replacing(options["picture"]) as file:
                worst_layers(stack, report.worst, file, work)
    click.echo(json.dumps(report.as_dict(), indent=2) if as_json else told(source, report))
    return 1 if report.problems else 0


def limits_of(options: dict[str, Any]) -> Limits:
    """Minimum thicknesses of walls and floors."""
    from fracslice.printing.checks import Limits

    return Limits(wall=options["wall"], floor=options["floor"])


def told(source: str, report: PrintReport) -> str:
    """Summary of a print report: figures, a line for each problem, and thin features that layers may miss."""
    size = " x ".join(f"{s:.2f}" for s in report.size)
    first = (
        f"{source}: {report.layers} layers, {size} mm, {report.volume / 1000:.3g} ml, {report.weight_g:.3g} g"
    )
    said = f"{first}, {verdict(report.problems)}"
    return os.linesep.join(filter(None, [said, report.solid.unseen]))


def verdict(problems: Sequence[str]) -> str:
    """Verdict on printability, with a line for each problem."""
    return os.linesep.join(["would not print:", *(f"  {p}" for p in problems)]) if problems else "would print"
