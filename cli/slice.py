"""fracslice slice: writing the layers of a print."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fracslice.common.messages import decimal, format_count
from fracslice.errors import keeping
from fracslice.records import RasterOptions

from .execution import check_targets, load_scene, of_layers, refuse_options
from .options import (
    AMOUNT,
    LENGTH,
    NUMBER,
    ClusterOptions,
    LayerOptions,
    Name,
    Whole,
    argument,
    command,
    option,
    output,
    printer_option,
    write_page,
)
from .sweeps import families

if TYPE_CHECKING:
    from fracslice.export.slice_run import SliceRun
    from fracslice.jobs.slices import SliceRecipe
    from fracslice.scene import Scene
    from fracslice.slicing import Stack
    from fracslice.slicing.printers import Printer, Resin
    from fracslice.volume.amount import Completeness
    from fracslice.work import Work

DATE = "SOURCE_DATE_EPOCH"
OF_PICTURES = {*RasterOptions.kinds(), "mirror", "sections"}


def listed_resin(context: click.Context, _: click.Parameter, name: str | None) -> str | None:
    """Return the name of a resin; "list" prints those of the printer, or all, and ends the command."""
    if name != "list":
        return name
    from fracslice.slicing.printers import resin_names

    machine = context.params.get("machine")
    for known in resin_names(machine):
        click.echo(known)
    if machine and not resin_names(machine):
        click.echo(f"no resin is known for {machine.title}: expected a .toml or .ini file, or --exposure")
    context.exit()


class LayerFileOptions(ClusterOptions, LayerOptions):
    """Options of files of layers."""

    without = frozenset()

    output: str = output(
        "OUT",
        "A printer's file (.sl1, .goo, .ctb, .cbddlp, .pwmx, .nanodlp, ...), an .svg, .3mf, .cli or .json "
        "file, or a folder of PNG pictures.",
    )
    form: str | None = option(
        str,
        "png, sl1, goo, ctb, cbddlp, pwmx, pwsz, cxdlpv4, nanodlp, 3mf, svg, slic3r, cli, cli-binary "
        "or json; by default, that of the extension of OUT.",
        "--format",
        metavar="NAME",
    )
    layer: tuple[float, float | None]
    machine: Printer | None = printer_option(
        'The printer whose screen the layers are for, or a .toml file of it; "list" shows all.'
    )
    mirror: bool | None = option(
        None, "Mirror along x; as the printer needs it by default.", "--mirror/--no-mirror", default=None
    )
    exposure: tuple[float, float] | None = option(
        NUMBER,
        "Exposure in a printer's file: seconds of each layer and of a bottom layer; the resin's by default.",
        metavar="S S",
        nargs=2,
    )
    resin: str | None = option(
        Name("NAME|FILE"),
        'A resin such as "Siraya Tech Fast Grey", or a file of its settings: .toml, or .ini of PrusaSlicer; '
        '"list" shows all.',
        callback=listed_resin,
    )
    preview: str | None = option(
        Name("FILE", ".png", ".webp"), "Write a contact sheet (.png) or an animation (.webp) of the layers."
    )
    address: str | None = option(
        str,
        "Upload the file: prusalink://HOST or sdcp://HOST. Nothing is started.",
        "--send",
        metavar="ADDRESS",
    )
    price: float | None = option(AMOUNT, "Price of a litre of resin; the resin's by default.")


COPIES = option(Whole(1, 1000), "How often each part stands on the plate; once by default.", default=1)
SPACING = option(LENGTH, "Distance between the parts of a plate; 2mm by default.", default="2mm")


class SliceOptions(LayerFileOptions):
    """Options of `slice`."""

    source: str = argument("SCENE|MODEL")
    copies: int = COPIES
    spacing: float = SPACING


@command(SliceOptions, "slice")
@families("output", "preview", "html")
def slice_(given: SliceOptions) -> int:
    """Cut SCENE into the layers of a print, straight from its field.

    fracslice check says whether the object needs --supports. An interrupted job
    resumes when it is started again. Exit status: 1 if layers and pixels are too coarse for the object;
    the file is written.

    Examples
    --------
    fracslice slice menger-tower -o tower.sl1 --size 60mm --printer sl1s
    fracslice slice mandelbulb -o bulb.goo --printer mars-5 --exposure 2.5 30 --hollow 2mm
    fracslice slice my.xml -o layers --pixel 0.05mm --preview sheet.png
    fracslice slice my.xml -o six.goo --printer mars-5 --size 30mm --copies 6
    """

    def planned(kind: str, resin: Resin | None) -> Callable[[Work], SliceRun]:
        scene = load_scene(given.source, given.settings)

        def run(work: Work) -> SliceRun:
            made = recipe(given.oriented(scene, work), scene, kind, resin)
            if given.copies == 1:
                return made.run(work, scene)
            from fracslice.jobs.plates import PlateRecipe

            return PlateRecipe((made,) * given.copies, given.spacing).run(work)

        return run

    if given.copies == 1:
        refuse_options({"spacing"}, "only for several parts: --copies, or fracslice plate")
    return write_layers(given, [given.source], planned)


def write_layers(
    given: LayerFileOptions,
    sources: Sequence[str],
    planned: Callable[[str, Resin | None], Callable[[Work], SliceRun]],
) -> int:
    """Write layers, what describes them, and a summary.

    planned: reads the scenes for a format and a resin, and returns the function that plans the layers.
    """
    from fracslice.export.layers import PICTURES, PRINTS, slice_format, write_slices
    from fracslice.export.resuming import KEPT
    from fracslice.slicing.layers import layers_amount

    output = given.output
    kind, resin = slice_format(output, given.form), resin_of(given)
    if kind not in PICTURES:
        refuse_options(OF_PICTURES, f"only for pictures, and {kind} files have contours")
    if kind in PRINTS:
        refuse_what_no_print_has(given, kind, resin)
    if given.address is not None:
        refuse_to_send(output, kind, given.address)
    for source in sources:
        check_targets(source, None if Path(output).is_dir() else output, given.preview, given.html)
    plan = planned(kind, resin)
    last: list[str] = []
    with given.working(KEPT) as work:
        run = plan(work)
        write_slices(run, output, given.form)
        with keeping(f"{output} is written"):
            if given.preview:
                write_preview(run.stack, given.preview, work)
            sent = upload(output, given.address, work)
            complete = layers_amount(run.slicer, work)
            if not given.quiet or given.html:
                last = list(of_layers(run, given.price).lines())
            if given.html:
                from fracslice.jobs.slice_checks import check_run

                write_page(run.stack, check_run(run), last, output, given.html, work)
    if not given.quiet:
        lines = describe_layers(run, output, complete)
        click.echo(os.linesep.join([*lines, *last, *([sent] if sent else [])]))
    return 1 if complete.problems else 0


def recipe(given: LayerFileOptions, scene: Scene, kind: str, resin: Resin | None) -> SliceRecipe:
    """Scene and settings of the layers."""
    from fracslice.jobs.slices import SliceRecipe
    from fracslice.scene.model import to_xml

    job = replace(given.slice_job(given.printing(scene.printing)), mirror=given.mirror)
    return SliceRecipe(to_xml(scene), scene.name, job, kind, resin, creation_date())


def describe_layers(run: SliceRun, output: str, complete: Completeness) -> list[str]:
    """Lines on the layers, with notes of the stack, on missing volume, exposure and the printer's file."""
    from fracslice.export.layers import PRINTS, printers_file, slice_format

    stack, screen = run.stack, run.screen
    size = " x ".join(map(decimal, stack.size))
    rows, columns = screen.shape
    parts = f"{format_count(len(stack.parts), 'part')}, " if stack.parts else ""
    first = f"{output}: {parts}{format_count(len(stack.z), 'layer')} of {columns} x {rows} pixels, {size} mm"
    other = printers_file(screen.printer, output) if screen.printer else ""
    lost = [f"would not print: {', '.join(complete.problems)}"] if complete.problems else []
    exposed = exposure_lines(run) if slice_format(output) in PRINTS else []
    held = [str(stack.supports)] if stack.supports else []
    return [
        first,
        *lost,
        *held,
        *stack.notes,
        *complete.notes,
        *exposed,
        *([other] if other else []),
    ]


def exposure_lines(run: SliceRun) -> Iterator[str]:
    """Lines on exposures that are no resin's, and on how deep they cure."""
    from fracslice.slicing.printers import START

    if run.resin is None:
        return
    keys = attrgetter("name", "exposure", "bottom_exposure", "bottom_layers", "transition_layers")
    if keys(run.resin) == keys(START):
        times = f"{START.exposure:g} s a layer and {START.bottom_exposure:g} s a bottom layer"
        start = "start here, then calibrate (--exposure, --resin)"
        yield f"exposed for {times}, as UVtools does by default: {start}"
    depth = run.resin.cured_depth(run.resin.exposure)
    excess = run.resin.excess(float(run.stack.heights.max()))
    if depth is not None and excess is not None:
        yield f"a layer cures {depth:.2f} mm deep, and faces that look down {excess:.2f} mm too deep"


def resin_of(given: LayerFileOptions) -> Resin | None:
    """Exposure and motion of --resin, else of the printer's own; --exposure changes them. None if there is
    neither.
    """
    from fracslice.slicing.printers import Resin, default_resin, moving, resin

    machine, (layer, _) = given.machine, given.layer
    profile = default_resin(machine, layer) if machine else None
    if given.resin is not None:
        profile = resin(given.resin, machine, layer)
    if given.exposure is None:
        return profile
    exposure, bottom = given.exposure
    if profile is None:
        return moving(Resin(exposure, bottom), machine)
    return replace(profile, exposure=exposure, bottom_exposure=bottom)


def refuse_what_no_print_has(given: LayerFileOptions, kind: str, resin: Resin | None) -> None:
    """Raise a usage error for options that a printer's file does not allow.

    This is checked before print preparation, which may take minutes.
    """
    from fracslice.export.layers import ENDINGS, is_convertible, printers_file
    from fracslice.slicing.printers import PRINTERS

    machine, output = given.machine, given.output
    if machine is None:
        able = next((f", such as {p.name}" for p in PRINTERS.values() if not printers_file(p, output)), "")
        raise click.UsageError(f'{output}: a .{kind} file needs --printer{able}; "list" shows all')
    other = printers_file(machine, output)
    if other and not (is_convertible(output) and f".{machine.file}" not in ENDINGS):
        raise click.UsageError(f"{output}: {other}")
    if resin is None:
        raise click.UsageError(
            f"{output}: no exposure is known for {machine.title}; expected --resin, or --exposure: "
            "the seconds of a layer and of a bottom layer, as in your slicer"
        )
    if given.layer[1] is not None and kind == "sl1":
        raise click.UsageError(f"{output}: an SL1 archive has layers of one height, not a range")


def upload(output: str, address: str | None, work: Work) -> str | None:
    """Upload the file to an address, if there is one; return the printer's answer."""
    if address is None:
        return None
    from fracslice.export.sending import send  # imports an HTTP client

    return send(output, address, work)


def refuse_to_send(output: str, kind: str, address: str) -> None:
    """Raise an error for a file that no printer reads, or an invalid address, before any work is done."""
    from fracslice.export.layers import PRINTS
    from fracslice.export.sending import printer_address

    if kind not in PRINTS:
        raise click.UsageError(f"{output}: --send is for printers' files")
    printer_address(address)


def creation_date() -> datetime:
    """Date of print files, UTC: now, or of SOURCE_DATE_EPOCH."""
    seconds = os.environ.get(DATE)
    if not seconds:
        return datetime.now(UTC)
    try:
        return datetime.fromtimestamp(int(seconds), UTC)
    except (ValueError, OverflowError, OSError):
        raise click.UsageError(f"{DATE}={seconds}: expected seconds since 1970") from None


def write_preview(stack: Stack, path: str, work: Work) -> None:
    """Write a contact sheet (.png) or an animation (.webp) of the layers."""
    from fracslice.common.files import replacing
    from fracslice.slicing.raster import animation, contact_sheet

    with replacing(path) as file:
        (contact_sheet if path.lower().endswith(".png") else animation)(stack, file, work)
