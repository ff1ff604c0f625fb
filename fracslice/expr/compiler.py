"""Compilation of a linked scene to machine code by LLVM. Imported only if the kernel is not cached."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir

from . import lanes_math
from .emitter import Emitter
from .language import CALLED, Linked, parse
from .loop_linker import link_loops
from .loops import Loop
from .values import DOUBLE, FLOAT, WHOLE, Lanes

PART = ["x", "y", "z", "P", "P0"]
"""Arguments of a part's function."""


@dataclass(frozen=True)
class Target:
    """Compilation target."""

    bits: int  # width of a float: 32 or 64
    width: int  # lanes
    registers: int  # vector registers per value
    cpu: str  # CPU name and features, as LLVM spells them
    features: str


def compile_object(linked: Linked, target: Target, loops: Sequence[Loop]) -> bytes:
    """Compile loops over a scene's field to an object file with one C function per loop."""
    lanes_math.HOST_FEATURES = frozenset(f[1:] for f in target.features.split(",") if f.startswith("+"))
    module = llvm.parse_assembly(_text(linked, target, loops))
    _optimise(module, _target_machine(target))
    return bytes(_machine(target).emit_object(module))


def _text(linked: Linked, target: Target, loops: Sequence[Loop]) -> str:
    """LLVM IR of the loops and of the scene's functions that they call.

    Stack frames are aligned to whole registers; otherwise registers spilled to the stack would straddle two
    cache lines.
    """
    trees = [tree for tree in parse(linked.source).body if isinstance(tree, ast.FunctionDef)]
    called = frozenset(tree.name for tree in trees if CALLED in map(ast.unparse, tree.decorator_list))
    lanes = Lanes(target.bits, target.width, target.registers)
    own = link_loops(tuple(loops))
    functions = {tree.name: tree for tree in (*trees, *(linked.tree for linked in own.values()))}
    emitter = Emitter(lanes, functions, called, {name: linked.file for name, linked in own.items()})
    real = FLOAT if target.bits == 32 else DOUBLE
    kinds = {"r": real.as_pointer(), "i": ir.IntType(32).as_pointer(), "n": WHOLE}
    for tree in trees:  # innermost elements first, so that the recursion is not as deep as the scene
        if [a.arg for a in tree.args.args] == PART:
            for points in sorted({loop.points for loop in loops}):
                emitter.function(tree.name, (points, points, points, kinds["r"], WHOLE))
    for loop in loops:
        emitter.entry(loop.name, tuple(kinds[letter] for letter in loop.arguments))
    emitter.module.triple = llvm.get_process_triple()
    return re.sub(r"(?m)^define .*$", r'\g<0> "stackrealign"', str(emitter.module))


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
