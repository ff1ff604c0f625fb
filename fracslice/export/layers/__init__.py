"""Layer file formats: one module each, with `FORMATS`."""

from __future__ import annotations

from importlib import import_module
from itertools import chain
from pathlib import Path
from pkgutil import iter_modules

from ...common.files import check_target
from ...errors import ExportError
from ...slicing.printers import Printer
from ..layer_formats import FolderFormat, LayerFormat, PrintFormat
from ..slice_run import SliceRun

_MODULES = [import_module(f".{module.name}", __name__) for module in iter_modules(__path__)]
FORMATS: dict[str, LayerFormat] = {form.name: form for module in _MODULES for form in module.FORMATS}
PRINTS = {name: form for name, form in FORMATS.items() if isinstance(form, PrintFormat)}
"""Formats of printers; they need a printer and a resin."""

PICTURES = {name for name, form in FORMATS.items() if name in PRINTS or form.encoding is not None}
FOLDERS = {name for name, form in FORMATS.items() if isinstance(form, FolderFormat)}
ENDINGS = {ending: name for name, form in FORMATS.items() for ending in form.endings}
"""Format of each extension; that of a folder has none."""

ALSO = dict(chain.from_iterable(form.also.items() for form in FORMATS.values()))
"""Second extension that printers of an extension read."""


def slice_format(path: str | Path, name: str | None = None) -> str:
    """Name of the layer format of a file or folder, which is checked to be writable."""
    ending = Path(path).suffix.lower()
    if Path(path).name.lower().endswith(".encrypted.ctb"):
        raise ExportError(
            f"{path}: encrypted .ctb files are not written: make a .goo and convert it with UVtools"
        )
    if name is None:
        name = ENDINGS.get(ending)
        if name is None:
            raise ExportError(
                f"{path}: unknown kind of file; known are {', '.join(e for e in ENDINGS if e)}, or a folder"
            )
    elif name not in FORMATS:
        raise ExportError(f"format {name!r}: known are {', '.join(FORMATS)}")
    if name in FOLDERS and Path(path).exists() and not Path(path).is_dir():
        raise ExportError(f"{path}: expected a folder for {name} files")
    check_target(Path(path) / "layer" if name in FOLDERS and Path(path).is_dir() else path)
    return name


def printers_file(printer: Printer, output: str | Path) -> str:
    """Compare the file to write with the one that a printer reads."""
    path, ending = Path(output), f".{printer.file}"
    own = {ending, ALSO.get(ending, ending)}
    if not printer.file or path.suffix.lower() in own:
        return ""
    if ending in ENDINGS:
        return f"{printer.title} reads {ending} files: make {path.with_suffix(ending).name}"
    kind, name = ending.replace(".encrypted", "encrypted "), path.with_suffix(".goo").name
    make = f"convert {name}" if path.name == name else f"make {name} and convert it"
    return f"{printer.title} reads {kind} files, which are not written: {make} with UVtools"


def is_convertible(output: str | Path) -> bool:
    """True for a file of pictures that UVtools converts to formats that are not written here."""
    return Path(output).suffix.lower() in (".goo", ".sl1")


def write_slices(run: SliceRun, path: str | Path, name: str | None = None) -> Path:
    """Slice a planned stack and write the layers to a file or folder."""
    form = slice_format(path, name)
    if form not in PICTURES and (run.sections > 1 or run.screen.compensation or run.screen.elephant_foot):
        raise ExportError(f"{path}: contours are of one section per layer, without compensation")
    FORMATS[form].write(run, Path(path))
    return Path(path)
