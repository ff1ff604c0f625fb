"""Machine code of linked scenes: object files in a folder, named by the hash of everything that made them."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Sequence
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

from .host import REGISTERS, host
from .linker import Linked
from .loops import Loop


def object_code(linked: Linked, bits: int, width: int, loops: Sequence[Loop]) -> bytes:
    """The object file of loops over a linked scene: from the cache, or compiled and kept there.

    Raises `KernelError`.
    """
    parts = [linked.source, *(loop.source for loop in loops), str(bits), str(width), _toolchain()]
    key = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]
    path = cache_folder() / f"{key}.o"
    try:
        code = path.read_bytes()
    except OSError:
        from .compiler import Target, compile_object

        code = compile_object(linked, Target(bits, width, REGISTERS, *host()), loops)
        _keep(path, code)
    return code


def cache_folder() -> Path:
    """Where kernels are kept: $FRACSLICE_CACHE, else fracslice/ in the user's cache folder."""
    given = os.environ.get("FRACSLICE_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(given or Path(base) / "fracslice" / "kernels").expanduser()


@lru_cache(maxsize=1)
def _toolchain() -> str:
    """Everything beside the scene that the machine code depends on."""
    here = Path(__file__).parent
    texts = [
        (here / name).read_text() for name in ("registers.py", "lanes.py", "lanes_math.py", "compiler.py")
    ]
    versions = [version(p) for p in ("numba", "llvmlite")]
    return "\n".join([*host(), *versions, *texts])


def _keep(path: Path, code: bytes) -> None:
    """Written beside and renamed, so that two processes cannot spoil it; a folder that cannot be written is
    no error.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(code)
        os.replace(file.name, path)
    except OSError:
        return
