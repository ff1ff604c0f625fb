"""From a linked scene to machine code, by Numba and LLVM. Imported only when a kernel is not in the cache."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
from numba import cfunc, njit, types
from numba.core.errors import NumbaError

from ..errors import KernelError
from ..formulas.vocabulary import NAMES
from . import lanes, lanes_math
from .linker import CALLED, Linked
from .loops import Loop

SOURCE = "<linked scene>"


@dataclass(frozen=True)
class Target:
    """What code is made for: float width, lanes and the registers they fill, CPU name and features."""

    bits: int
    width: int
    registers: int
    cpu: str
    features: str


def compile_object(linked: Linked, target: Target, loops: Sequence[Loop]) -> bytes:
    """An object file with one C function per loop over the scene's field. Raises `KernelError`."""
    lanes_math.HOST_FEATURES = frozenset(f[1:] for f in target.features.split(",") if f.startswith("+"))
    kind = lanes.Lanes(target.bits, target.width, target.registers)
    scope: dict[str, Any] = {name: getattr(lanes, name) for name in NAMES}
    scope |= {"load": lanes.loader(kind), "store": lanes.store, "WIDTH": target.width}
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    inlined = njit(forceinline=True, error_model="numpy", **options)
    scope[CALLED] = njit(error_model="numpy", **options)
    exec(compile(linked.source, SOURCE, "exec"), scope)
    for name, value in list(scope.items()):
        if isinstance(value, FunctionType) and value.__code__.co_filename == SOURCE:
            scope[name] = inlined(value)
    letters = {
        "r": types.CPointer(types.float32 if target.bits == 32 else types.float64),
        "i": types.CPointer(types.int32),
        "n": types.intp,
    }
    whole = llvm.parse_assembly("")
    for loop in loops:
        exec(loop.source, scope)
        signature = types.void(*[letters[a] for a in loop.arguments])
        try:
            text = _exported(scope[loop.name], signature, loop.name)
        except NumbaError as error:
            raise KernelError(
                f"a formula cannot be compiled: {str(error).strip().splitlines()[0]}"
            ) from error
        whole.link_in(llvm.parse_assembly(text))
    return bytes(_machine(target).emit_object(whole))


def _exported(function: Any, signature: object, name: str) -> str:
    """Optimised LLVM assembly of one C function, under its own name.

    Its stack is aligned to whole registers: those that are kept there would lie across two cache lines else.
    """
    compiled: Any = cfunc(signature, error_model="numpy")(function)
    text = re.sub(r"(?m)^attributes #\d+ = {", r'\g<0> "stackrealign"', compiled._library.get_llvm_str())
    module = llvm.parse_assembly(text)
    for f in module.functions:
        if f.name == compiled._wrapper_name:
            f.name = name
        elif not f.is_declaration:
            f.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    return str(module)


def _machine(target: Target) -> llvm.TargetMachine:
    triple = llvm.Target.from_triple(llvm.get_process_triple())
    return triple.create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, reloc="pic", codemodel="jitdefault", jit=True
    )
