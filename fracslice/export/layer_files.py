"""Layer file formats by name."""

from __future__ import annotations

from pathlib import Path

from .._slices import Encoding
from ..common.files import check_target
from ..errors import ExportError
from ..slicing.printers import Printer
from . import anycubic, archives, chitu, goo, outlines, png, slices3mf
from .layer_formats import FolderFormat, LayerFormat
from .slice_run import SliceRun

PRINTS = {form.name: form for form in (*archives.FORMATS, goo.FORMAT, *chitu.FORMATS, anycubic.FORMAT)}
"""Formats of printers; they need a printer and a resin."""

PNG = FolderFormat(
    "png",
    png.encode_layer,
    lambda run: {"manifest.json": run.describe()},
    encoding=Encoding.PNG,
)
FORMATS: dict[str, LayerFormat] = {
    "png": PNG,
    **PRINTS,
    "3mf": slices3mf.FORMAT,
    **{form.name: form for form in outlines.FORMATS},
}
PICTURES = {"png", *PRINTS}
FOLDERS = {name for name, form in FORMATS.items() if isinstance(form, FolderFormat)}
PHOTON = "pwmx pwmo pwms pmsq pwma pwmb pmx2 pm3 pm3m pm3r dlp dl2p pw0 pwx"
"""Extensions of one format, one for each model."""

ENDINGS = {
    ".sl1": "sl1",
    ".sl1s": "sl1",
    ".goo": "goo",
    ".prz": "goo",
    ".ctb": "ctb",
    ".cbddlp": "cbddlp",
    ".photon": "cbddlp",
    **{f".{ending}": "pwmx" for ending in PHOTON.split()},
    ".nanodlp": "nanodlp",
    ".3mf": "3mf",
    ".svg": "slic3r",
    ".cli": "cli",
    ".json": "json",
    "": "png",
}


ALIASES = {".sl1": (".sl1s",), ".prz": (".goo",), ".photon": (".cbddlp",)}
"""Extensions of the same format that the same printers read."""


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
    own = {ending, *ALIASES.get(ending, ())}
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
    if form not in PICTURES and (run.sections > 1 or run.screen.compensation):
        raise ExportError(f"{path}: contours are of one section per layer, without compensation")
    FORMATS[form].write(run, Path(path))
    return Path(path)
