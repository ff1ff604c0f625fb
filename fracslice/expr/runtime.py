"""Machine code as functions of NumPy arrays, the CPU that it is made for, and texts kept in the cache of
kernels.

This is the only place where an array becomes an address, beside calls of CUDA's driver (`cuda_driver`), which
copy before they return. Code and arrays are kept alive by the call, or by the native object that holds both
(`fracslice/native/machine.h`), so neither can be freed while in use.

"System V Application Binary Interface", AMD64 supplement: the sections and relocations of LLVM's large and
small code models, without unwinding tables and without data that is written. All other files are left to
LLVM.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import numpy as np

from ..common.cache import PACKAGE, Kept, cache_folder, key, texts
from .language import WORDS, InMemory, words
from .loops import Loop, element_type, is_array

REGISTERS = 2
"""Vector registers per value: independent instructions in flight hide the latency of the arithmetic."""

PROCESSORS = Path("/proc/cpuinfo")
MOST = 1 << 14
"""Characters that the first processor takes at most."""
DESCRIBED = {"vendor_id", "cpu family", "model", "model name", "stepping", "flags"}
"""Lines of a processor in the file, from which LLVM's name and features follow."""

TRANSLATORS = "expr", "fields"
"""Packages that make texts of formulas and scenes, and code of these; it is kept under their own text."""


def lane_count(bits: int) -> int:
    """Return the number of points evaluated at once."""
    register = 512 if "+avx512f" in host()[1].split(",") else 256
    return REGISTERS * register // bits


def host() -> tuple[str, str]:
    """Return the host CPU as LLVM spells it."""
    name, features, _ = description()
    return name, features


@lru_cache(maxsize=1)
def description() -> tuple[str, str, str]:
    """Return the host CPU and the version of LLVM: cached for this processor, or asked of LLVM."""
    processor = _processor()
    if not processor:
        return _ask_llvm()
    library = os.stat(llvmlite.__file__)
    about = key(processor, llvmlite.__version__, llvmlite.__file__, library.st_mtime_ns)
    kept = Kept(cache_folder() / "hosts")
    text = kept.cached(f"{about}.txt", lambda: "\n".join(_ask_llvm()).encode()).decode()
    name, features, version = text.split("\n")
    return name, features, version


@lru_cache(maxsize=1)
def toolchain() -> str:
    """Return the key of everything that machine code depends on besides the functions."""
    own = texts(*(path for name in TRANSLATORS for path in sorted((PACKAGE / name).glob("*.py"))))
    return key(own, description(), llvmlite.__version__)


def _ask_llvm() -> tuple[str, str, str]:
    """Ask LLVM; loading its library takes a tenth of a small job."""
    import llvmlite.binding as llvm

    version = ".".join(map(str, llvm.llvm_version_info))
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten(), version


def _processor() -> str:
    """Lines of Linux that describe an x86 processor; empty on any other system."""
    try:
        with PROCESSORS.open(encoding="ascii", errors="replace") as file:
            first = file.read(MOST).split("\n\n", 1)[0]  # of hundreds of processors
    except OSError:
        return ""
    lines = [line for line in first.splitlines() if line.split("\t")[0].rstrip() in DESCRIBED]
    return "\n".join(lines) if len(lines) == len(DESCRIBED) else ""


def kept_text(kind: str, made_of: tuple[object, ...], make: Callable[[], str]) -> str:
    """Return a text: cached, or made and cached.

    A file that other users could have written is not used.
    """
    kept, name = _place(kind, made_of)
    return kept.cached(name, lambda: make().encode()).decode()


def keep_text(kind: str, made_of: tuple[object, ...], text: str) -> None:
    """Replace a cached text; see `kept_text`."""
    kept, name = _place(kind, made_of)
    kept.put_checked(name, text.encode())


def _place(kind: str, made_of: tuple[object, ...]) -> tuple[Kept, str]:
    return Kept(cache_folder() / kind), f"{key(kind, *made_of, toolchain())}.txt"


MAGIC, KIND = b"\x7fELF\x02\x01\x01", struct.pack("<HH", 1, 62)
"""Begin of a file of 64 bits, and its kind: relocatable, of x86-64."""
SYMBOLS, RELOCATIONS, ZEROS = 2, 4, 8
"""Types of sections."""
WRITTEN, IN_MEMORY = 1, 2
"""Flags of sections."""
WORD = struct.Struct("<Q")
"""Entry of the global offset table."""
GOT = b"_GLOBAL_OFFSET_TABLE_"


class UnsupportedError(Exception):
    """The file has something that this loader does not know."""


class Section(NamedTuple):
    """Header of a section."""

    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    alignment: int
    entry: int

    def data(self, code: bytes) -> bytes:
        """Contents of the section in a file."""
        return code[self.offset : self.offset + self.size]


class Symbol(NamedTuple):
    """Entry of the symbol table."""

    name: int
    info: int
    other: int
    section: int
    value: int
    size: int


class Image:
    """Executable copy of an object file, valid while this object exists."""

    def __init__(self, code: bytes) -> None:
        if not code.startswith(MAGIC) or code[16:20] != KIND:
            raise UnsupportedError
        sections = _sections(code)
        starts, end = _layout(sections)
        (table,) = (section for section in sections if section.kind == SYMBOLS)
        symbols = [Symbol(*entry) for entry in struct.iter_unpack("<IBBHQQ", table.data(code))]
        texts = sections[table.link].data(code)
        self._names = {texts[s.name : texts.index(0, s.name)]: k for k, s in enumerate(symbols)}
        private = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
        self._memory = mmap.mmap(-1, end + WORD.size * len(symbols), private)
        self._base = ctypes.addressof(ctypes.c_char.from_buffer(self._memory))
        self._got = self._base + end
        names = {k: name for name, k in self._names.items()}
        self._addresses = [self._address(s, names.get(k, b""), starts) for k, s in enumerate(symbols)]
        self._fill(code, sections, starts)
        for k, address in enumerate(self._addresses):
            WORD.pack_into(self._memory, end + WORD.size * k, address)
        self._protect()

    def get_function_address(self, name: str) -> int:
        """Return the address of a function."""
        return self._addresses[self._names[name.encode()]]

    def _address(self, symbol: Symbol, name: bytes, starts: dict[int, int]) -> int:
        if symbol.section in starts:
            return self._base + starts[symbol.section] + symbol.value
        if name == GOT:
            return self._got
        if symbol.section == 0 and name:  # of the C library
            function = getattr(ctypes.pythonapi, name.decode(), None)
            if function is None:
                raise UnsupportedError
            return ctypes.cast(function, ctypes.c_void_p).value or 0
        return 0

    def _fill(self, code: bytes, sections: list[Section], starts: dict[int, int]) -> None:
        for k, start in starts.items():
            if sections[k].kind != ZEROS:
                self._memory[start : start + sections[k].size] = sections[k].data(code)
        for section in sections:
            if section.kind == RELOCATIONS and section.info in starts:
                for offset, info, addend in struct.iter_unpack("<QQq", section.data(code)):
                    self._relocate(starts[section.info] + offset, info & 0xFFFFFFFF, info >> 32, addend)

    def _relocate(self, place: int, kind: int, symbol: int, addend: int) -> None:
        target, here = self._addresses[symbol] + addend, self._base + place
        entry = WORD.size * symbol + addend
        try:
            form, value = {
                1: ("<Q", target),  # R_X86_64_64
                2: ("<i", target - here),  # R_X86_64_PC32
                4: ("<i", target - here),  # R_X86_64_PLT32
                24: ("<q", target - here),  # R_X86_64_PC64
                25: ("<q", target - self._got),  # R_X86_64_GOTOFF64
                27: ("<q", entry),  # R_X86_64_GOT64
                29: ("<q", self._got + addend - here),  # R_X86_64_GOTPC64
            }[kind]
            struct.pack_into(form, self._memory, place, value)
        except (KeyError, struct.error):
            raise UnsupportedError from None

    def _protect(self) -> None:
        """Make the memory executable, and no longer writable."""
        size, rights = ctypes.c_size_t(len(self._memory)), mmap.PROT_READ | mmap.PROT_EXEC
        if ctypes.pythonapi.mprotect(ctypes.c_void_p(self._base), size, rights):
            raise UnsupportedError


def _sections(code: bytes) -> list[Section]:
    (table,), (count,) = struct.unpack_from("<Q", code, 40), struct.unpack_from("<H", code, 60)
    headers = struct.iter_unpack("<IIQQQQIIQQ", code[table : table + 64 * count])
    return [Section(*header) for header in headers]


def _layout(sections: list[Section]) -> tuple[dict[int, int], int]:
    """Starts of the sections in memory by their numbers, and the end of all."""
    starts, end = {}, 0
    for k, section in enumerate(sections):
        if section.flags & IN_MEMORY:
            if section.flags & WRITTEN:
                raise UnsupportedError
            start = -(-end // max(section.alignment, 1)) * max(section.alignment, 1)
            starts[k], end = start, start + section.size
    return starts, -(-end // WORD.size) * WORD.size


class CompiledFunction:
    """Compiled loop, called with arrays and integers. Thread-safe; releases the GIL.

    Arrays must be C-contiguous, of the type that the loop's letter says; otherwise a call raises
    `ctypes.ArgumentError`.
    """

    def __init__(self, engine: Any, loop: Loop, dtype: np.dtype) -> None:
        kinds: dict[str, Any] = {a: _Pointer(element_type(a, dtype)) for a in loop.arguments if is_array(a)}
        kinds |= {"n": ctypes.c_ssize_t, "x": np.ctypeslib.as_ctypes_type(dtype)}
        self.arguments = loop.arguments
        self.address: int = engine.get_function_address(loop.name)
        self._call = ctypes.CFUNCTYPE(None, *[kinds[a] for a in loop.arguments])(self.address)
        self._engine = engine

    def __call__(self, *arguments: np.ndarray | float) -> None:
        self._call(*arguments)


@dataclass(frozen=True)
class _Pointer:
    """Argument type for ctypes, which calls `from_param` and keeps the array alive until the function
    returns. Those of one dtype are equal: ctypes keeps the type of each other signature for ever.
    """

    dtype: np.dtype

    def from_param(self, array: np.ndarray) -> Any:
        if array.dtype != self.dtype or not array.flags.c_contiguous:
            order = "C-contiguous" if array.flags.c_contiguous else "not C-contiguous"
            raise TypeError(f"an array of {array.dtype}, {order}: expected {self.dtype}, C-contiguous")
        if array.flags.writeable and array.size:
            # Three times as fast as the code below, which read-only and empty arrays need.
            return ctypes.byref(ctypes.c_char.from_buffer(array.data))
        return ctypes.c_void_p(array.ctypes.data)


def load_object(code: bytes, loops: Sequence[Loop], dtype: np.dtype) -> dict[str, CompiledFunction]:
    """Load the functions of an object file."""
    try:
        engine: Any = Image(code)
    except UnsupportedError:
        engine = _by_llvm(code)
    return {loop.name: CompiledFunction(engine, loop, dtype) for loop in loops}


def _by_llvm(code: bytes) -> Any:
    """Execution engine of an object file."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine


class Owner(np.ndarray):
    """Array with addresses, and what lies there."""

    held: Sequence[tuple[int, InMemory]] = ()


def constant(
    values: np.ndarray, dtype: np.dtype | str, held: Sequence[tuple[int, InMemory]] = ()
) -> np.ndarray:
    """Return a read-only, C-contiguous copy, which threads may share.

    `held`: what lies in memory, each with the index of the numbers that become its address. The copy keeps it
    alive.
    """
    kept = np.array(values, dtype, order="C").view(Owner if held else np.ndarray)
    for place, memory in held:
        kept[place : place + WORDS] = words(memory.address)
    if isinstance(kept, Owner):
        kept.held = held
    kept.setflags(write=False)
    return kept
