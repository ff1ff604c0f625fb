""".pwsz of Anycubic's Photon Mono M7 Pro, after UVtools' description: a ZIP archive of settings in JSON, of
the pictures of .pwmx, and of a table of the extents of the layers.

Lengths are mm, speeds mm/s; places are measured from the middle of the screen, whose y runs down.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any, BinaryIO

import numpy as np

from ..._slices import Encoding
from ...slicing import Layer
from ...slicing.feature_graph import Runs, layer_components
from ...slicing.printers import Resin
from ...version import __version__
from ..layer_formats import PrintData
from ..slice_run import SliceRun
from .archives import ArchiveFormat, preview_png, write_archive

PREVIEWS = (224, 168), (336, 252), (800, 600)
"""Width and height of the previews, pixels."""

MAGIC, RELEASE, VERSION = b"ANYCUBIC-PWSZ", 3, 1
"""Begin of the table of extents, kind of its numbers as the firmware reads them, and its version."""

_EXTENT = struct.Struct("<4fIf")
"""What stands before a picture: corners of what it shows, number of its components, and the largest area."""

_SCENE = struct.Struct("<16s64s4IfI6fI256x4sI")
_LAYER = struct.Struct("<6fIf32x")


def _encode(run: SliceRun, layer: Layer) -> bytes:
    """Extent of a layer, and its picture."""
    solid, _ = layer_components(layer.runs)
    largest = float(solid.nodes.area.max(initial=0)) * run.stack.pixel[0] * run.stack.pixel[1]
    extent = _EXTENT.pack(*_corners(run, layer.runs), len(solid), largest)
    return extent + run.screen.encoded(layer, Encoding.RLE4)


def _corners(run: SliceRun, runs: Runs) -> list[float]:
    """Low and high corner of what a picture shows, mm from the middle of the screen."""
    rows = np.flatnonzero(np.diff(runs.rows))
    if not len(rows):
        return [0.0] * 4
    screen, (ny, nx), (width, depth) = run.screen, run.stack.shape, run.stack.pixel
    x = width * (np.array([runs.begin.min(), runs.end.max()]) - nx / 2)
    y = depth * (np.array([rows[0], rows[-1] + 1]) - ny / 2)
    across, down = (-y, -x) if screen.printer and screen.printer.portrait else (x, -y)
    seen = np.sort([-across if screen.mirrored else across, down])
    return [float(c) for c in seen.T.ravel()]


def _assemble(job: PrintData, file: BinaryIO) -> None:
    extents = list[tuple[Any, ...]]()

    def pictures() -> Iterator[tuple[str, bytes]]:
        for index, data in enumerate(job):
            extents.append(_EXTENT.unpack_from(data))
            yield f"layer_images/layer_{index}.pw0Img", data[_EXTENT.size :]

    def scene() -> Iterator[tuple[str, bytes]]:
        yield "scene.slice", _scene(job, extents)

    settings = {
        "anycubic_photon_resins.pwsp": _settings(job),
        "layers_controller.conf": {"count": job.layers, "paras": _layers(job)},
        "print_info.json": _amounts(job),
        "software_info.conf": {"mark": "fracslice", "opengl": "", "os": "any", "Version": __version__},
    }
    texts = ((name, json.dumps(values, indent=1).encode()) for name, values in settings.items())
    previews = (
        (f"preview_images/preview_{k}.png", preview_png(job, *size)) for k, size in enumerate(PREVIEWS)
    )
    write_archive(file, chain(previews, texts, pictures(), scene()))


def _scene(job: PrintData, extents: Sequence[tuple[Any, ...]]) -> bytes:
    """Table of the extents of the layers, and that of the whole."""
    known = np.array([extent[:4] for extent in extents if extent[4]], float).reshape(-1, 4)
    low, high = known[:, :2].min(0, initial=0.0).tolist(), known[:, 2:].max(0, initial=0.0).tolist()
    kinds, box = (RELEASE, VERSION, 0, 0, 1.0), (*low, 0.0, *high, float(job.tops[-1]))
    head = _SCENE.pack(MAGIC, b"fracslice", *kinds, job.layers, *box, 0, b"<---", job.layers)
    rows = (
        _LAYER.pack(float(top), area, *extent)
        for top, area, extent in zip(job.tops, job.areas.tolist(), extents, strict=True)
    )
    return b"".join([head, *rows, b"--->"])


def _layers(job: PrintData) -> list[dict[str, float]]:
    """Exposure, place and lift of each layer."""
    rows = zip(job.exposures.tolist(), job.tops.tolist(), job.heights.tolist(), job.resins, strict=True)
    return [
        {
            "exposure_time": exposure,
            "layer_index": index,
            "layer_minheight": round(top - height, 6),
            "layer_thickness": round(height, 6),
            "zup_height": own.whole_lift,
            "zup_speed": own.lift_speed / 60,
        }
        for index, (exposure, top, height, own) in enumerate(rows)
    ]


def _amounts(job: PrintData) -> dict[str, Any]:
    """Time, volume, weight and cost."""
    made = {"model_layers_count": job.layers, "currency": "", "cost": job.cost, "print_time": job.seconds}
    return made | {"volume": job.volume_ml, "weight": job.weight_g}


def _settings(job: PrintData) -> dict[str, Any]:
    """The printer, and the resin in use."""
    resin = _resin(job)
    extern = {"alias": job.printer.title, "factory_resins": [resin], "user_resins": [resin]}
    return {
        "version": "3",
        "machine_type": _machine(job),
        "machine_extern": {"version": "3", **extern, "active_resins": [resin["property"]["name"]]},
    }


def _machine(job: PrintData) -> dict[str, Any]:
    (rows, columns), printer = job.run.screen.shape, job.printer
    small, middle, large = (list(size) for size in PREVIEWS)
    return {
        "version": "3",
        "name": printer.title,
        "key_suffix": "pwsz",
        "key_image_format": "pw0Img",
        "res_x": columns,
        "res_y": rows,
        "xy_pixel": 1000 * printer.pixel[0],
        "xy_pixel_y": 1000 * printer.pixel[1],
        "rotate_z": 0.0,
        "max_samples": 16,
        "property": 119,
        "print_xsize": printer.screen[0],
        "print_ysize": printer.screen[1],
        "print_zsize": printer.height,
        "max_file_version": 518,
        "child_screen": [{"x": 0, "y": 0, "width": columns, "height": rows}],
        "prev_image_size": small,
        "prev2_image_size": middle,
        "cloudprev_imag_size": large,
        "raster_antialiasing": min(job.run.screen.levels, 16),
    }


def _resin(job: PrintData) -> dict[str, Any]:
    resin = job.resin
    named = {"name": resin.name, "resin_name": resin.name, "type": "Standard resin"}
    return {
        "version": "2",
        "property": {"version": "3", **named, "density": resin.density, "price": resin.price, "volume": 1000},
        "slice_extpara": {
            "version": "3",
            "multi_state_used": int(bool(resin.lift_2)),
            "transition_layercount": resin.transition_layers,
            "transition_type": 0,
            "multi_state_paras": _stages(resin),
        },
        "slicepara": {
            "anti_count": min(job.run.screen.levels, 16),
            "blur_level": job.run.screen.blur,
            "bott_layers": resin.bottom_layers,
            "bott_time": resin.bottom_exposure,
            "bott_off_time": resin.wait,
            "bott_wait_before_lift": resin.wait_after,
            "bott_wait_after_lift": resin.wait_lifted,
            "exposure_time": resin.exposure,
            "off_time": resin.wait,
            "wait_before_lift": resin.wait_after,
            "wait_after_lift": resin.wait_lifted,
            "use_indivi_layerpara": 1,
            "zthick": float(job.heights.max()),
            "zup_height": resin.whole_lift,
            "zup_speed": resin.lift_speed / 60,
            "zdown_speed": resin.retract_speed / 60,
        },
    }


def _stages(resin: Resin) -> dict[str, dict[str, float]]:
    """Both stages of the lift, of bottom layers and of others; the way back has the same, in reverse."""
    last = resin.retract_speed_2 if resin.retract_2 else resin.retract_speed
    stages = (
        (resin.lift, resin.lift_speed, last),
        (resin.lift_2, resin.lift_speed_2, resin.retract_speed),
    )
    return {
        f"{layers}_{number}": {"height": way, "up_speed": up / 60, "down_speed": down / 60}
        for layers in ("bott", "normal")
        for number, (way, up, down) in enumerate(stages)
    }


FORMATS = (ArchiveFormat("pwsz", _encode, _assemble, endings=(".pwsz",)),)
