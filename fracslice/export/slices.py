"""Layer file formats by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fracslice.errors import ExportError
from fracslice.export import outlines, pictures, slices3mf
from fracslice.export.jobs import SliceRun
from fracslice.files import check_target

FORMATS: dict[str, Callable[[SliceRun, str | Path], Path]] = {
    "png": pictures.write_folder,
    "sl1": pictures.write_sl1,
    "3mf": slices3mf.write_3mf,
    **outlines.WRITERS,
}
FOLDERS = {"png", "svg"}
ENDINGS = {
    ".sl1": "sl1",
    ".sl1s": "sl1",
    ".3mf": "3mf",
    ".svg": "slic3r",
    ".cli": "cli",
    ".json": "json",
    "": "png",
}


def slice_format(path: str | Path, name: str | None = None) -> str:
    """Name of the layer format of a file or folder, which is checked to be writable.

    Parameters
    ----------
    path : str or path
        The file or folder to write.
    name : str, optional
        Name of the format; by default, the extension of `path` selects it.

    Returns
    -------
    str
        A key of `FORMATS`.

    Raises
    ------
    ExportError
        For an unknown format or extension, or a path that cannot be written.
    """
    ending = Path(path).suffix.lower()
    if name is None:
        name = ENDINGS.get(ending)
        if name is None:
            raise ExportError(
                f"{path}: unknown kind of file; known are {', '.join(e for e in ENDINGS if e)}, or a folder"
            )
    elif name not in FORMATS:
        raise ExportError(f"format {name!r}: known are {', '.join(FORMATS)}")
    check_target(Path(path) / "layer" if name in FOLDERS and Path(path).is_dir() else path)
    return name


def write_slices(run: SliceRun, path: str | Path, name: str | None = None) -> Path:
    """Slice a planned stack and write the layers to a file or folder.

    Parameters
    ----------
    run : SliceRun
        The layers to write.
    path : str or path
        The file or folder.
    name : str, optional
        Name of the format; by default, the extension of `path` selects it.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        For an unknown format, or an error of the file system.
    SliceError
        If the layers cannot be cut.
    Cancelled
        When the work is cancelled.
    """
    return FORMATS[slice_format(path, name)](run, path)
