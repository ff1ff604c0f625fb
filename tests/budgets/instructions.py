"""How many instructions the kernels are, compiled for one CPU whatever CPU compiles them; none is run.

`python -m tests.budgets.instructions` prints them as JSON.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from fracslice.expr.loops import Loop, points
from fracslice.expr.runtime import REGISTERS
from fracslice.fields.linker import Linked, link

from .workloads import WORKLOADS

CPU, FEATURES = "skylake-avx512", "+avx512f,+avx512bw,+avx512cd,+avx512dq,+avx512vl,+avx2,+fma,+bmi,+bmi2"
LANES = {32: 32, 64: 16}

_LABEL = re.compile(r"^(\.?\w+):")
_JUMP = re.compile(r"^\tj\w+\t(\.\w+)")


def instructions() -> dict[str, int]:
    """By workload and float width: instructions of the kernel's hot loop and of all of it."""
    result = {}
    for name, root in WORKLOADS.items():
        for bits in LANES:
            hot, whole = sizes(assembly(link(root), bits))
            result[f"{name}: instructions of the hot loop, float{bits}"] = hot
            result[f"{name}: instructions of the kernel, float{bits}"] = whole
    return result


def assembly(linked: Linked, bits: int, loops: Sequence[Loop] = (points,)) -> list[str]:
    """The lines of a scene's loops: labels and instructions."""
    from fracslice.expr import emitter

    class Text:
        """In the place of LLVM's target machine: gives assembly where an object file is asked for."""

        def __init__(self, target: emitter.Target) -> None:
            self.machine = machine(target)

        def emit_object(self, module: object) -> bytes:
            return str(self.machine.emit_assembly(module)).encode()

    machine, emitter._machine = emitter._machine, Text
    try:
        target = emitter.Target(bits, LANES[bits], REGISTERS, CPU, FEATURES)
        text = emitter.compile_object(linked.program, target, loops).decode()
    finally:
        emitter._machine = machine
    return [line for line in text.splitlines() if _LABEL.match(line) or re.match(r"^\t[a-z]", line)]


def sizes(lines: list[str]) -> tuple[int, int]:
    """Instructions of the longest innermost loop, and of all lines.

    A loop is what lies between a label and the last jump back to it; it is innermost if it holds no other.
    """
    places = {match[1]: i for i, line in enumerate(lines) if (match := _LABEL.match(line))}
    loops: dict[int, int] = {}
    for i, line in enumerate(lines):
        jump = _JUMP.match(line)
        if jump and places.get(jump[1], i + 1) <= i:
            loops[places[jump[1]]] = i
    inner = [
        (a, b)
        for a, b in loops.items()
        if not any(a < c and d <= b for c, d in loops.items() if (a, b) != (c, d))
    ]
    return max(_count(lines[a : b + 1]) for a, b in inner), _count(lines)


def _count(lines: list[str]) -> int:
    return sum(line.startswith("\t") for line in lines)


if __name__ == "__main__":
    print(json.dumps(instructions()))
