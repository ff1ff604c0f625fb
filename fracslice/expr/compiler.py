"""Compilation of a linked scene by LLVM, to machine code of the CPU or to PTX, the text that NVIDIA's driver
assembles. Imported only if the kernel is not cached.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir

from . import lanes_math
from .emitter import Emitter
from .frontend import loop_function
from .graph import Program
from .loops import OWN, Loop, element_type, is_array
from .values import DOUBLE, FLOAT, WHOLE, Lanes


@dataclass(frozen=True)
class Target:
    """Compilation target."""

    bits: int  # width of a float: 32 or 64
    width: int  # lanes
    registers: int  # vector registers per value
    cpu: str  # CPU name and features, as LLVM spells them
    features: str


def compile_object(program: Program, target: Target, loops: Sequence[Loop]) -> bytes:
    """Compile loops over a scene's field to an object file with one C function per loop.

    `program`: linked scene; an empty one for loops without a field.
    """
    lanes_math.HOST_FEATURES = frozenset(f[1:] for f in target.features.split(",") if f.startswith("+"))
    lanes = Lanes(target.bits, target.width, target.registers)
    text = _text(program, lanes, llvm.get_process_triple(), loops)
    # Stack frames are aligned to whole registers; otherwise registers spilled to the stack would straddle two
    # cache lines.
    module = llvm.parse_assembly(re.sub(r"(?m)^define .*$", r'\g<0> "stackrealign"', text))
    _optimise(module, _target_machine(target))
    return bytes(_machine(target).emit_object(module))


GPU = "nvptx64-nvidia-cuda"
ARCHITECTURES = {50: 15, 60: 15, 70: 15, 75: 15, 80: 15, 86: 15, 89: 16, 90: 16, 100: 20, 120: 20}
"""Compute capabilities, tenfold, that LLVM knows from a version on. Code for one runs on newer GPUs, too."""


def compile_ptx(program: Program, bits: int, capability: tuple[int, int], loops: Sequence[Loop]) -> bytes:
    """Compile loops over a scene's field to PTX with one kernel per loop.

    `program`: see `compile_object`; `capability`: compute capability of the GPU.
    """
    module = llvm.parse_assembly(_text(program, Lanes(bits, 1, 1, on_gpu=True), GPU, loops))
    version, most = llvm.llvm_version_info[0], 10 * capability[0] + capability[1]
    chosen = max(number for number, since in ARCHITECTURES.items() if since <= version and number <= most)
    features = "+ptx60" if chosen < 70 else ""  # has the barrier of a warp
    machine = _gpu_target().create_target_machine(cpu=f"sm_{chosen}", features=features, opt=3)
    _optimise(module, machine)
    return str(machine.emit_assembly(module)).encode()


@lru_cache(maxsize=1)
def _gpu_target() -> llvm.Target:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    llvm.set_option("", "-nvptx-fma-level=1")  # lets the GPU's assembler fuse products with sums
    return llvm.Target.from_triple(GPU)


def _text(program: Program, lanes: Lanes, triple: str, loops: Sequence[Loop]) -> str:
    """LLVM IR of the loops and of the scene's functions that they call."""
    emitter = Emitter(lanes, program.functions, program.called)
    for part in program.parts:  # innermost elements first, so that the recursion is not as deep as the scene
        for points in sorted({loop.points for loop in loops}):
            emitter.function(part, (points, points, points, lanes.scalar.as_pointer(), WHOLE))
    for loop in loops:
        own_arrays = {k: loop.own for k, letter in enumerate(loop.arguments) if letter in OWN}
        kinds = tuple(_kind(letter, lanes) for letter in loop.arguments)
        emitter.entry(loop_function(loop), kinds, own_arrays)
    emitter.module.triple = triple
    return str(emitter.module)


def _kind(letter: str, lanes: Lanes) -> ir.Type:
    """LLVM type of a loop's argument."""
    element = element_type(letter, np.dtype(f"float{lanes.bits}"))
    if element.kind == "f":
        number = FLOAT if element.itemsize == 4 else DOUBLE
    else:
        number = ir.IntType(8 * element.itemsize)
    return number.as_pointer() if is_array(letter) else number


def _optimise(module: llvm.ModuleRef, machine: llvm.TargetMachine) -> None:
    module.data_layout = str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.slp_vectorization = True, False
    builder = llvm.create_pass_builder(machine, options)
    for _ in range(2):
        builder.getModulePassManager().run(module, builder)


def _target_machine(target: Target) -> llvm.TargetMachine:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple = llvm.Target.from_triple(llvm.get_process_triple())
    return triple.create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, reloc="pic", codemodel="jitdefault", jit=True
    )


def _machine(target: Target) -> Any:
    """Target machine that emits the object file."""
    return _target_machine(target)
