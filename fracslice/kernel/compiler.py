"""From a linked scene to machine code, by Numba and LLVM. Imported only when a kernel is not in the cache."""

from __future__ import annotations

from dataclasses import dataclass

import llvmlite.binding as llvm
from numba import cfunc, njit, types

from . import lanes, lanes_math
from .linker import FIELD, Linked

VOCABULARY = "where sqrt rsqrt log exp sin cos atan2 floor minimum maximum absolute any_of".split()

LOOPS = '''
def points(P, X, Y, Z, F, n):
    for i in range(0, n, WIDTH):
        x = load(X, i)
        y = load(Y, i)
        z = load(Z, i)
        f = field(x, y, z, P)
        store(F, i, where((x == x) & (y == y) & (z == z), f, x + y + z))


def bricks(P, FRAME, I, J, K, corners, F, n):
    h = FRAME[3]
    for b in range(n):
        x0 = corners[3 * b]
        y0 = corners[3 * b + 1]
        z0 = corners[3 * b + 2]
        for s in range(0, 512, WIDTH):
            x = (load(I, s) + x0) * h + FRAME[0]
            y = (load(J, s) + y0) * h + FRAME[1]
            z = (load(K, s) + z0) * h + FRAME[2]
            store(F, 512 * b + s, field(x, y, z, P))
'''


@dataclass(frozen=True)
class Target:
    """What code is made for: float width, lanes per vector, CPU name and features."""

    bits: int
    width: int
    cpu: str
    features: str


def compile_object(linked: Linked, target: Target) -> bytes:
    """An object file with the C functions `points` and `bricks` over the scene's field.

    ``points(P, X, Y, Z, F, n)``: n a multiple of the width. ``bricks(P, frame, I, J, K, corners, F, n)``: 512 samples of
    each of n bricks at ``frame[:3] + frame[3] * (corner + (I, J, K))``. All arrays of the target's float type but
    `corners`, int32 [n, 3].
    """
    lanes_math.HOST_FEATURES = frozenset(f[1:] for f in target.features.split(",") if f.startswith("+"))
    kind = lanes.Lanes(target.bits, target.width)
    scope = {name: getattr(lanes, name) for name in VOCABULARY}
    scope |= {"load": lanes.loader(kind), "store": lanes.store, "WIDTH": target.width}
    exec(compile(linked.source, "<linked scene>", "exec"), scope)
    for name, value in list(scope.items()):
        if callable(value) and getattr(value, "__code__", None) and value.__code__.co_filename == "<linked scene>":
            scope[name] = njit(forceinline=True, error_model="numpy")(value)
    assert FIELD in scope
    exec(LOOPS, scope)
    real = types.CPointer(types.float32 if target.bits == 32 else types.float64)
    corner = types.CPointer(types.int32)
    n = types.intp
    signatures = {
        "points": types.void(real, real, real, real, real, n),
        "bricks": types.void(real, real, real, real, real, corner, real, n),
    }
    modules = [_exported(scope[name], signature, name) for name, signature in signatures.items()]
    whole = llvm.parse_assembly(modules[0])
    whole.link_in(llvm.parse_assembly(modules[1]))
    return bytes(_machine(target).emit_object(whole))


def _exported(function: object, signature: object, name: str) -> str:
    """Optimised LLVM assembly of one C function, under its own name."""
    compiled = cfunc(signature, error_model="numpy")(function)
    text = compiled._library.get_llvm_str()
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
    return triple.create_target_machine(cpu=target.cpu, features=target.features, opt=3, reloc="pic", codemodel="jitdefault", jit=True)
