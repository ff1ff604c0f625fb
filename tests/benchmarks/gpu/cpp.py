"""A linked scene as CUDA C++, operation for operation: what nvcc makes of the same arithmetic is the bound to
compare with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from fracslice.expr.graph import Block, Branch, Function, Jump, Program, Return, Value, Width

THREAD = Width(1, on_gpu=True)

WORDS = {
    "where": "({} ? {} : {})",
    "any_of": "{}",
    "truth": "bool({})",
    "sqrt": "sqrtf({})",
    "rsqrt": "rsqrtf({})",
    "ratio": "({} / {})",
    "log": "logf({})",
    "exp": "expf({})",
    "sin": "sinf({})",
    "cos": "cosf({})",
    "atan2": "atan2f({}, {})",
    "floor": "floorf({})",
    "minimum": "fminf({}, {})",
    "maximum": "fmaxf({}, {})",
    "absolute": "fabsf({})",
    "int": "int({})",
    "element": "{}[{}]",
    "neg": "(-{})",
    "not_": "(!{})",
    "invert": "(!{})",
}
SIGNS = {"add": "+", "sub": "-", "mul": "*", "truediv": "/", "mod": "%", "and_": "&", "or_": "|"} | {
    "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="
}  # fmt: skip

PRELUDE = """
#include <cmath>
#include <type_traits>
template <int N> struct Tuple {{
    float v[N];
    __host__ __device__ float operator[](int i) const {{ return v[i]; }}
}};
template <class... Parts> struct List {{}};
template <class A, class... Others> struct List<A, Others...> {{
    A first;
    List<Others...> rest;
}};
template <int I, int N> __device__ __forceinline__ float item(const Tuple<N> &t) {{ return t.v[I]; }}
template <int I, class A, class... Others>
__device__ __forceinline__ auto item(const List<A, Others...> &t) {{
    if constexpr (I == 0) return t.first; else return item<I - 1>(t.rest);
}}
__device__ __forceinline__ List<> listed() {{ return {{}}; }}
template <class A, class... Others>
__device__ __forceinline__ List<A, Others...> listed(A a, Others... others) {{
    return {{a, listed(others...)}};
}}
template <class... Parts> __device__ __forceinline__ auto tuple_of(Parts... parts) {{
    if constexpr ((std::is_arithmetic_v<Parts> && ...))
        return Tuple<int(sizeof...(Parts))>{{{{float(parts)...}}}};
    else return listed(parts...);
}}
using Parameters = Tuple<{count}>;
"""


def translated(program: Program, parameters: Sequence[float]) -> str:
    """The functions of a linked scene, each name with a ``_`` behind it, and its parameters GIVEN."""
    functions = _Functions(program)
    for name in program.functions:
        functions.write(program.functions[name], f"{name}_")
    given = f"const Parameters GIVEN = {{{{{', '.join(_number(p) for p in parameters)}}}}};"
    return "\n".join([PRELUDE.format(count=len(parameters)), *functions.texts, given, ""])


class _Functions:
    """Functions in the order that C++ asks for, without those that shift bits, written by hand."""

    def __init__(self, program: Program) -> None:
        self.program, self.names, self.texts = program, dict[Function, str](), list[str]()

    def write(self, function: Function, name: str) -> None:
        """Write a function and before it those that it calls, once."""
        if function in self.names:
            return
        values = [value for block in function.graph(THREAD).blocks for value in block.body]
        if any(value.op in ("xor", "rshift") for value in values):
            return
        self.names[function] = name
        for value in values:
            if value.op == "call":
                callee = self.callee(value.data)
                known = next((n for n, f in self.program.functions.items() if f is callee), None)
                self.write(callee, f"{known}_" if known else f"{callee.name}_{len(self.names)}_")
        self.texts.append("\n    ".join(self.lines(function)) + "\n}")

    def callee(self, data: Function | str) -> Function:
        return self.program.functions[data] if isinstance(data, str) else data

    def lines(self, function: Function) -> Iterator[str]:
        graph = function.graph(THREAD)
        known = {value: f"a{k}" for k, value in enumerate(graph.arguments)}
        blocks = {block: f"b{k}" for k, block in enumerate(graph.blocks)}
        bodies = _bodies(graph.blocks)
        values = [v for block in graph.blocks for v in (*block.parameters, *bodies[block])]
        known |= {value: f"v{k}" for k, value in enumerate(values)}

        def shown(value: Value) -> str:
            return known[value] if value in known else _number(value.data)

        kinds = ", ".join(f"class T{k}" for k in range(len(graph.arguments)))
        taken = ", ".join(f"T{k} a{k}" for k in range(len(graph.arguments)))
        yield f"template <{kinds}> __device__ __forceinline__ auto {self.names[function]}({taken}) {{"
        for block in graph.blocks:
            first = next(iter(_passed(graph.blocks, block)), [])
            for parameter, value in zip(block.parameters, first, strict=True):
                yield f"std::decay_t<decltype({shown(value)})> {known[parameter]};"
            for value in bodies[block]:
                yield f"std::decay_t<decltype({self.expression(value, shown)})> {known[value]};"
        for block in graph.blocks:
            yield f"{blocks[block]}:;"
            for value in bodies[block]:
                yield f"{known[value]} = {self.expression(value, shown)};"
            match block.exit:
                case Jump(target, passed):
                    news = [f"auto new{k} = {shown(v)};" for k, v in enumerate(passed)]
                    sets = [f"{known[p]} = new{k};" for k, p in enumerate(target.parameters)]
                    yield " ".join(["{", *news, *sets, f"goto {blocks[target]};", "}"])
                case Branch(test, yes, no):
                    yield f"if ({shown(test)}) goto {blocks[yes]}; else goto {blocks[no]};"
                case Return(Value() as value):
                    yield f"return {shown(value)};"

    def expression(self, value: Value, shown: Callable[[Value], str]) -> str:
        given = list(map(shown, value.operands))
        match value.op:
            case "call":
                return f"{self.names[self.callee(value.data)]}({', '.join(given)})"
            case "index":
                return f"int({given[0]})" if given else str(value.data)
            case "item":
                return f"item<{value.data[0]}>({given[0]})"
            case "tuple" if not given:
                return "Tuple<1>{{0.0f}}"
            case "tuple":
                return f"tuple_of({', '.join(given)})"
            case "element" if type(value.operands[1].known) is int:
                return f"item<{given[1]}>({given[0]})"
        if value.op in SIGNS:
            return f"({given[0]} {SIGNS[value.op]} {given[1]})"
        return WORDS[value.op].format(*given)


def _bodies(blocks: Sequence[Block]) -> dict[Block, list[Value]]:
    """Values of blocks, without tuples that are only taken apart."""
    used = set[Value]()
    for block in blocks:
        match block.exit:
            case Jump(_, passed):
                used.update(passed)
            case Return(Value() as value):
                used.add(value)
    for value in reversed([value for block in blocks for value in block.body]):
        if value.op != "tuple" or value in used:
            used.update(value.operands)
    return {block: [v for v in block.body if v.op != "tuple" or v in used] for block in blocks}


def _passed(blocks: Sequence[Block], target: Block) -> Iterator[list[Value]]:
    """What the jumps to a block pass."""
    return (b.exit.passed for b in blocks if isinstance(b.exit, Jump) and b.exit.target is target)


def _number(value: Any) -> str:
    if isinstance(value, (bool, int)):
        return str(value).lower()
    return "INFINITY" if value == float("inf") else f"{float(value)!r}f"
