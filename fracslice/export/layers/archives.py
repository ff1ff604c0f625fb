"""PNG pictures in a folder, or in ZIP archives: .sl1 of Prusa, .nanodlp of NanoDLP."""

from __future__ import annotations

import io
import json
import math
import zipfile
from collections.abc import Iterator
from itertools import chain
from typing import BinaryIO

from isal.isal_zlib import crc32

from ..._slices import Encoding
from ...errors import ExportError
from ...version import __version__
from ..images import encode_layer, write_png
from ..layer_formats import FolderFormat, PrintData, PrintFormat
from ..slice_run import Encode, SliceRun

MOST_MEMBERS = 65_535

SL1_PREVIEWS = (400, 400), (800, 480)
NANODLP_PREVIEW = 200, 100
"""Width and height of the previews, pixels."""


class ArchiveFormat(PrintFormat):
    """Archive with a PNG file for each layer."""

    def encoder(self, run: SliceRun) -> Encode:
        if run.layers + 100 > MOST_MEMBERS:
            raise ExportError(f"{run.layers} layers are too many for an archive")
        return super().encoder(run)


class Sl1Format(ArchiveFormat):
    """Archive for the SL1 family, whose layers have one height."""

    def encoder(self, run: SliceRun) -> Encode:
        heights = run.stack.heights
        if heights.max() - heights.min() > 1e-9:
            raise ExportError("an SL1 archive has layers of one height; .goo takes a range of heights")
        return super().encoder(run)


def _assemble_sl1(job: PrintData, file: BinaryIO) -> None:
    """Write config.ini, prusaslicer.ini, previews and pictures; PrusaSlicer opens the archive."""
    about = {
        "config.ini": _ini(_config(job)),
        "fracslice.json": job.run.describe(job.name),
        "prusaslicer.ini": _ini(_settings(job)),
    }
    previews = {
        f"thumbnail/thumbnail{width}x{height}.png": preview_png(job, width, height)
        for width, height in SL1_PREVIEWS
    }
    layers = ((f"{job.name}{k:05d}.png", data) for k, data in enumerate(job))
    write_archive(file, chain(about.items(), previews.items(), layers))


def _assemble_nanodlp(job: PrintData, file: BinaryIO) -> None:
    """Write the members that docs.nanodlp.com/manual/format lists."""
    about = {f"{name}.json": _json(values) for name, values in _plate(job).items()}
    about["3d.png"] = preview_png(job, *NANODLP_PREVIEW)
    write_archive(file, chain(about.items(), ((f"{k}.png", data) for k, data in enumerate(job, 1))))


def write_archive(file: BinaryIO, members: Iterator[tuple[str, bytes]]) -> None:
    """Write members that are not compressed and carry no time.

    ZipFile.writestr gives the same bytes; its checksum is slower, and it goes back to each header.
    """
    with zipfile.ZipFile(file, "w") as archive:
        for name, data in members:
            info = zipfile.ZipInfo(name)
            info.external_attr, info.header_offset = 0o600 << 16, archive.start_dir
            info.CRC, info.file_size, info.compress_size = crc32(data), len(data), len(data)
            header = info.FileHeader()
            file.write(header)
            file.write(data)
            archive.filelist.append(info)
            archive.start_dir += len(header) + len(data)


def preview_png(job: PrintData, width: int, height: int) -> bytes:
    """Picture of the object, as PNG."""
    file = io.BytesIO()
    write_png(file, (height, width, 3), [job.preview(width, height)], 8, {}, job.run.work, level=1)
    return file.getvalue()


def _ini(values: dict[str, object]) -> bytes:
    return "".join(f"{key} = {value}\n" for key, value in values.items()).encode()


def _json(values: object) -> bytes:
    return json.dumps(values, indent=1).encode()


def _config(job: PrintData) -> dict[str, object]:
    """Settings for the printer, with the keys of PrusaSlicer 2.5."""
    printer, resin = job.printer, job.resin
    return {
        "action": "print",
        "expTime": f"{resin.exposure:g}",
        "expTimeFirst": f"{resin.bottom_exposure:g}",
        "expUserProfile": 0,
        "fileCreationTimestamp": f"{job.run.created:%Y-%m-%d at %H:%M:%S UTC}",
        "hollow": 0,
        "jobDir": job.name,
        "layerHeight": f"{job.heights[0]:g}",
        "materialName": resin.name,
        "numFade": min(resin.transition_layers, job.layers),
        "numFast": job.layers,
        "numSlow": 0,
        "printProfile": "fracslice",
        "printTime": f"{job.seconds:.1f}",
        "printerModel": printer.name.upper() if printer.file == "sl1" else "SL1",
        "printerProfile": printer.title,
        "printerVariant": "default",
        "prusaSlicerVersion": f"fracslice-{__version__}",
        "usedMaterial": f"{job.volume_ml:.6f}",
    }


def _settings(job: PrintData) -> dict[str, object]:
    """Settings with which PrusaSlicer can import the layers."""
    printer, resin = job.printer, job.resin
    (width, depth), (across, along) = printer.screen, printer.pixels
    layer = f"{job.heights[0]:g}"
    return {
        "bed_shape": f"0x0,{width:g}x0,{width:g}x{depth:g},0x{depth:g}",
        "display_height": f"{depth:g}",
        "display_mirror_x": int(job.mirrored),
        "display_mirror_y": 0,
        "display_orientation": "portrait" if printer.portrait else "landscape",
        "display_pixels_x": across,
        "display_pixels_y": along,
        "display_width": f"{width:g}",
        "exposure_time": f"{resin.exposure:g}",
        "faded_layers": min(resin.transition_layers, job.layers),
        "gamma_correction": f"{job.run.screen.gamma:g}",
        "initial_exposure_time": f"{resin.bottom_exposure:g}",
        "initial_layer_height": layer,
        "layer_height": layer,
        "max_print_height": f"{math.ceil(printer.height)}",
        "printer_technology": "SLA",
        "relative_correction": "1,1",
    }


META = {
    "FormatVersion": 2,
    "Distro": "generic",
    "Program": "fracslice",
    "Version": __version__,
    "OS": "any",
    "Arch": "any",
    "Profile": True,
}
"""Contents of the file meta.json of a .nanodlp archive."""


def _plate(job: PrintData) -> dict[str, object]:
    """Contents of the JSON files of a .nanodlp archive. Heights are in micrometres."""
    heights = 1000 * job.heights
    (x, y, z), (width, height) = job.run.stack.size, job.printer.pixel
    box = {"XMin": -x / 2, "XMax": x / 2, "YMin": -y / 2, "YMax": y / 2, "ZMin": 0.0, "ZMax": z}
    uneven = heights.max() - heights.min() > 1e-6
    varying = {
        "CureTimes": job.exposures.tolist(),
        "DynamicThickness": heights.tolist() if uneven else [],
    }
    size = {"XRes": 1000 * width, "YRes": 1000 * height, "ZRes": float(heights.max())}
    return {
        "meta": META,
        "plate": {**_job(job), **size, **varying, **box},
        "slicer": {**_screen(job), "Boundary": box, **varying},
        "profile": _profile(job),
        "info": [
            {"TotalSolidArea": area, "LayerNumber": k, "LayerHeight": float(height)}
            for k, (area, height) in enumerate(zip(job.areas.tolist(), heights, strict=True))
        ],
    }


def _job(job: PrintData) -> dict[str, object]:
    """Name, date, duration and layers, for plate.json."""
    created = int(job.run.created.timestamp())
    return {
        "PlateID": 1,
        "ProfileID": 1,
        "Path": job.run.metadata.get("Title", "fracslice"),
        "CreatedDate": created,
        "Updated": created,
        "PrintTime": round(job.seconds),
        "PrintEst": round(job.seconds),
        "LayersCount": job.layers,
        "TotalSolidArea": float(job.areas @ (1000 * job.heights)),
        "MultiMaterial": False,
    }


def _screen(job: PrintData) -> dict[str, object]:
    """Pixels and layers, for slicer.json."""
    (rows, columns), (width, height) = job.run.screen.shape, job.printer.pixel
    return {
        "Type": "stl",
        "PWidth": columns,
        "PHeight": rows,
        "Thickness": float(1000 * job.heights.max()),
        "SupportDepth": float(1000 * job.heights[0]),
        "SupportLayerNumber": job.resin.bottom_layers,
        "XPixelSize": 1000 * width,
        "YPixelSize": 1000 * height,
        "ImageMirror": int(job.mirrored),
        "LayerCount": job.layers,
    }


def _profile(job: PrintData) -> dict[str, object]:
    """Exposure and motion of the resin, for profile.json."""
    resin = job.resin
    return {
        "ResinID": 1,
        "ProfileID": 1,
        "Title": resin.name,
        "Depth": float(1000 * job.heights.max()),
        "SupportDepth": float(1000 * job.heights[0]),
        "SupportLayerNumber": resin.bottom_layers,
        "TransitionalLayer": resin.transition_layers,
        "CureTime": resin.exposure,
        "SupportCureTime": resin.bottom_exposure,
        "WaitHeight": resin.whole_lift,
        "SupportWaitHeight": resin.whole_lift,
        "WaitBeforePrint": resin.rest,
        "SupportWaitBeforePrint": resin.rest,
        "ResinPrice": resin.price,
    }


FORMATS = (
    FolderFormat(
        "png",
        encode_layer,
        lambda run: {"manifest.json": run.describe()},
        encoding=Encoding.PNG,
        endings=("",),
    ),
    Sl1Format(
        "sl1",
        encode_layer,
        _assemble_sl1,
        encoding=Encoding.PNG,
        endings=(".sl1", ".sl1s"),
        also={".sl1": ".sl1s"},
    ),
    ArchiveFormat("nanodlp", encode_layer, _assemble_nanodlp, encoding=Encoding.PNG, endings=(".nanodlp",)),
)
