"""Modules of written text, imported from cached files."""

from __future__ import annotations

import atexit
import importlib.util
import os
import shutil
import sys
import tempfile
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import BinaryIO

from ..common.cache_files import Kept, cache_folder
from ..errors import ExportError


def imported(name: str, text: str) -> ModuleType:
    """Import a module from a cached file: Numba caches machine code next to the source file.

    If other users could write to the cache folder, the file is private to this process.

    Returns
    -------
    module
        The module, the same for one name.
    """
    path = kept_text(cache_folder(), name, text) or kept_text(_own_folder(), name, text)
    assert path
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return sys.modules.setdefault(name, module)


@lru_cache(maxsize=1)
def _own_folder() -> Path:
    """Temporary folder of this process, removed at exit."""
    folder = Path(tempfile.mkdtemp(prefix="fracslice-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def kept_text(folder: Path, name: str, text: str) -> Path | None:
    """Write a text into a cache folder.

    The modification time of the file is that of the first write, which Numba's cache compares.

    Parameters
    ----------
    folder
        Cache folder.
    name
        Name of the file without its suffix.
    text
        Source text.

    Returns
    -------
    Path or None
        The file; None if it cannot be cached.
    """
    kept, file, whole = Kept(folder), f"{name}.py", text.encode()
    if kept.get(file, _read) != whole:
        with suppress(ExportError):
            kept.put(file, lambda to: to.write(whole))
        if kept.get(file, _read) != whole:
            return None
    return Path(os.path.realpath(folder), file)


def _read(file: BinaryIO) -> bytes:
    return file.read()
