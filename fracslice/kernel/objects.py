"""Cache of machine code: object files named by the hash of everything that they depend on."""

from __future__ import annotations

from collections.abc import Sequence

from ..common.cache_files import Kept, cache_folder
from ..common.keys import key
from .host import REGISTERS, host, toolchain
from .linker import Linked
from .loop_linker import loop_source
from .loops import Loop


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

    Raises
    ------
    KernelError
        If the scene or a loop cannot be compiled.
    """
    texts_of_all = linked.source, loop_source(loops), [loop.arguments for loop in loops]
    name = f"{key(*texts_of_all, bits, width, toolchain())}.o"

    def compiled() -> bytes:
        from .compiler import Target, compile_object

        return compile_object(linked, Target(bits, width, REGISTERS, *host()), loops)

    return Kept(cache_folder()).cached(name, compiled)  # incomplete code would crash the process
