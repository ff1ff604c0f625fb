"""Cache of machine code: object files named by the hash of everything that they depend on."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

import llvmlite

from ..common.cache_files import Kept, cache_folder
from ..common.keys import key, texts
from ..errors import ExportError
from ..formulas import vocabulary
from .host import REGISTERS, host
from .linker import Linked
from .loop_linker import loop_source
from .loops import Loop

DIGEST = hashlib.sha256().digest_size
"""Length of a digest, bytes."""


def object_code(linked: Linked, bits: int, width: int, loops: Sequence[Loop]) -> bytes:
    """Return the object file of loops over a linked scene: cached, or compiled and cached.

    A file that other users could have written is not used.

    Parameters
    ----------
    linked
        Linked scene.
    bits
        Width of a float: 32 or 64.
    width
        Lanes.
    loops
        Loops to compile.

    Returns
    -------
    bytes
        Object file.

    Raises
    ------
    KernelError
        If the scene or a loop cannot be compiled.
    """
    texts_of_all = linked.source, loop_source(loops), [loop.arguments for loop in loops]
    kept, name = Kept(cache_folder()), f"{key(*texts_of_all, bits, width, toolchain())}.o"
    code = kept.get(name, _read)
    if code is None:
        from .compiler import Target, compile_object

        code = compile_object(linked, Target(bits, width, REGISTERS, *host()), loops)
        sealed = hashlib.sha256(code).digest() + code
        with suppress(ExportError):
            kept.put(name, lambda file: file.write(sealed))
    return code


@lru_cache(maxsize=1)
def toolchain() -> str:
    """Return the key of everything that machine code depends on besides the linked text."""
    from llvmlite.binding import llvm_version_info

    own = texts(*sorted(Path(__file__).parent.glob("*.py")), Path(vocabulary.__file__))
    return key(own, host(), llvmlite.__version__, llvm_version_info)


def _read(file: BinaryIO) -> bytes | None:
    """Code in a file; None if it is incomplete, since loading it would crash the process."""
    digest, code = file.read(DIGEST), file.read()
    return code if hashlib.sha256(code).digest() == digest else None
