"""A folder of PNG files with a manifest."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from fracslice.export import png
from fracslice.export.jobs import SliceRun


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
