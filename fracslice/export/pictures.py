"""Layers as pictures: a folder of PNG files with a manifest, and archives for Prusa's SL1 and SL1S."""

from __future__ import annotations

import math
import zipfile
from functools import partial
from pathlib import Path

from fracslice.errors import ExportError
from fracslice.export import png
from fracslice.export.jobs import SliceRun
from fracslice.files import replacing

MOST_MEMBERS = 65_535


def write_folder(run: SliceRun, path: str | Path) -> Path:
    """Write a folder of pictures 00000.png, ... and, last, manifest.json.

    An interrupted job resumes.

    Parameters
    ----------
    run : SliceRun
        The layers to write.
    path : str or path
        The folder; it must be new, empty, or left by an interrupted job.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        For a folder with other files, or an error of the file system.
    """
    encode = partial(png.encode_layer, run.screen)
    return run.into_folder(path, "png", encode, png.is_whole, {"manifest.json": run.describe()})


def write_sl1(run: SliceRun, path: str | Path) -> Path:
    """Write an archive for the SL1 family: config.ini, prusaslicer.ini and a PNG for each layer.

    PrusaSlicer opens the archive. An interrupted job resumes.

    Parameters
    ----------
    run : SliceRun
        The layers to write, with a printer.
    path : str or path
        The file to write.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        Without a printer, for layers of unequal heights, which the format cannot express, for too many
        layers, or for an error of the file system.
    """
    if not run.screen.printer:
        raise ExportError(f"{path}: an SL1 archive needs a printer")
    heights = run.stack.heights
    if heights.max() - heights.min() > 1e-9:
        raise ExportError(f"{path}: an SL1 archive has layers of one height; others take a range of heights")
    if run.layers >= MOST_MEMBERS:
        raise ExportError(f"{path}: {run.layers} layers are too many for an archive")
    name = Path(path).stem
    about = {
        "config.ini": _ini(_config(run, name)),
        "fracslice.json": run.describe(),
        "prusaslicer.ini": _ini(_settings(run)),
    }
    with (
        run.encoded(path, "png", partial(png.encode_layer, run.screen)) as layers,
        replacing(path) as file,
        zipfile.ZipFile(file, "w") as archive,
    ):
        for member, data in about.items():
            archive.writestr(zipfile.ZipInfo(member), data)
        for index, data in enumerate(layers):
            archive.writestr(zipfile.ZipInfo(f"{name}{index:05d}.png"), data)
    return Path(path)


def _ini(values: dict[str, object]) -> bytes:
    return "".join(f"{key} = {value}\n" for key, value in values.items()).encode()


def _config(run: SliceRun, name: str) -> dict[str, object]:
    """Settings for the printer, with the keys of PrusaSlicer 2.5."""
    exposure, first = run.exposure
    printer = run.screen.printer
    assert printer
    fade = min(10, run.layers)
    seconds = run.layers * (exposure + 5) + fade * (first - exposure) / 2
    return {
        "action": "print",
        "expTime": f"{exposure:g}",
        "expTimeFirst": f"{first:g}",
        "expUserProfile": 0,
        "fileCreationTimestamp": "1980-01-01 at 00:00:00 UTC",
        "hollow": 0,
        "jobDir": name,
        "layerHeight": f"{run.stack.heights[0]:g}",
        "materialName": "unknown",
        "numFade": fade,
        "numFast": run.layers,
        "numSlow": 0,
        "printProfile": "fracslice",
        "printTime": f"{seconds:.1f}",
        "printerModel": printer.name.upper() if printer.portrait else "SL1",
        "printerProfile": printer.title,
        "printerVariant": "default",
        "prusaSlicerVersion": "fracslice",
        "usedMaterial": 0,
    }


def _settings(run: SliceRun) -> dict[str, object]:
    """Settings with which PrusaSlicer can import the layers."""
    printer = run.screen.printer
    assert printer
    (width, depth), (across, along) = printer.screen, printer.pixels
    mirror = run.screen.mirror if run.screen.mirror is not None else printer.mirror
    layer = f"{run.stack.heights[0]:g}"
    return {
        "bed_shape": f"0x0,{width:g}x0,{width:g}x{depth:g},0x{depth:g}",
        "display_height": f"{depth:g}",
        "display_mirror_x": int(mirror),
        "display_mirror_y": 0,
        "display_orientation": "portrait" if printer.portrait else "landscape",
        "display_pixels_x": across,
        "display_pixels_y": along,
        "display_width": f"{width:g}",
        "exposure_time": f"{run.exposure[0]:g}",
        "faded_layers": min(10, run.layers),
        "gamma_correction": f"{run.screen.gamma:g}",
        "initial_exposure_time": f"{run.exposure[1]:g}",
        "initial_layer_height": layer,
        "layer_height": layer,
        "max_print_height": f"{math.ceil(printer.height)}",
        "printer_technology": "SLA",
        "relative_correction": "1,1",
    }
