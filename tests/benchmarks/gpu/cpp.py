"""A linked scene as CUDA C++, word for word: what nvcc makes of the same arithmetic is the bound to compare
with."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from typing import Any

WORDS = {
    "where": "({} ? {} : {})",
    "any_of": "{}",
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
}
OPERATORS = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.Not: "!",
    ast.USub: "-",
}

PRELUDE = """
#include <cmath>
template <int N> struct Tuple {{
    float v[N];
    __host__ __device__ float operator[](int i) const {{ return v[i]; }}
}};
template <class A, class B> struct Pair {{
    A first;
    B second;
}};
template <class A, class B> __device__ __forceinline__ Pair<A, B> pair_of(A a, B b) {{ return {{a, b}}; }}
using Parameters = Tuple<{count}>;
"""


def translated(source: str, parameters: Sequence[float]) -> str:
    """The functions of a linked scene, each name with a ``_`` behind it, and its parameters GIVEN."""
    functions = [_function(f) for f in _callees_first(source)]
    given = f"const Parameters GIVEN = {{{{{', '.join(_number(p) for p in parameters)}}}}};"
    return "\n".join([PRELUDE.format(count=len(parameters)), *functions, given, ""])


def _callees_first(source: str) -> list[ast.FunctionDef]:
    """The functions in the order that C++ asks for, without those that shift bits, written by hand."""
    named = {f.name: f for f in ast.parse(source).body if isinstance(f, ast.FunctionDef)}
    ordered: dict[str, ast.FunctionDef] = {}

    def visit(name: str) -> None:
        called = [
            n.func.id
            for n in ast.walk(named[name])
            if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)
        ]
        for callee in called:
            if callee in named and callee not in ordered:
                visit(callee)
        ordered[name] = named[name]

    for name, function in named.items():
        if not any(isinstance(n, (ast.BitXor, ast.RShift)) for n in ast.walk(function)):
            visit(name)
    return list(ordered.values())


def _number(value: Any) -> str:
    return "INFINITY" if value == float("inf") else f"{float(value)!r}f"


def _function(node: ast.FunctionDef) -> str:
    arguments = [a.arg for a in node.args.args]
    declared = {**_assigned(node), **dict.fromkeys(arguments, "")}
    lines = [f"{kind} {name};" for name, kind in declared.items() if kind]
    body = [line for statement in node.body for line in _statement(statement)]
    kinds = ", ".join(f"class T_{a}" for a in arguments)
    taken = ", ".join(f"T_{a} {a}" for a in arguments)
    head = f"template <{kinds}> __device__ __forceinline__ auto {node.name}_({taken})"
    return "\n    ".join([f"{head} {{", *lines, *body]) + "\n}"


def _assigned(node: ast.FunctionDef) -> dict[str, str]:
    """The C++ type of each name that a function assigns: bool for what is compared, else float."""
    result: dict[str, str] = {}
    for inner in ast.walk(node):
        if isinstance(inner, ast.Assign) and not _makes_tuple(inner):
            target = inner.targets[0]
            for name in target.elts if isinstance(target, ast.Tuple) else [target]:
                assert isinstance(name, ast.Name)
                mask = isinstance(inner.value, ast.Compare) or (
                    isinstance(inner.value, ast.BinOp) and isinstance(inner.value.op, (ast.BitAnd, ast.BitOr))
                )
                result[name.id] = "bool" if mask else "float"
    return result


def _makes_tuple(node: ast.Assign) -> bool:
    return isinstance(node.targets[0], ast.Name) and isinstance(node.value, ast.Tuple)


def _statement(node: ast.stmt) -> list[str]:
    match node:
        case ast.Assign([ast.Name(name)], ast.Tuple() as value):
            return [f"auto {name} = {_expression(value)};"]
        case ast.Assign([ast.Name(name)], value):
            return [f"{name} = {_expression(value)};"]
        case ast.Assign([ast.Tuple(targets)], ast.Tuple(values)):
            news = [f"auto new{i} = {_expression(v)};" for i, v in enumerate(values)]
            sets = [f"{_expression(t)} = new{i};" for i, t in enumerate(targets)]
            return ["{", *news, *sets, "}"]
        case ast.Assign([ast.Tuple(targets)], value):
            sets = [f"{_expression(t)} = all[{i}];" for i, t in enumerate(targets)]
            return ["{", f"auto all = {_expression(value)};", *sets, "}"]
        case ast.If(test, body, orelse):
            other = ["} else {", *(line for s in orelse for line in _statement(s))] if orelse else []
            return [
                f"if ({_expression(test)}) {{",
                *(line for s in body for line in _statement(s)),
                *other,
                "}",
            ]
        case ast.For(ast.Name(i), ast.Call(ast.Name("range"), [end]), body):
            head = f"for (int {i} = 0; {i} < {_count(end)}; {i}++) {{"
            return [head, *(line for s in body for line in _statement(s)), "}"]
        case ast.Break():
            return ["break;"]
        case ast.Return(value) if value is not None:
            return [f"return {_expression(value)};"]
    raise NotImplementedError(ast.unparse(node))


def _count(node: ast.expr) -> str:
    return str(node.value) if isinstance(node, ast.Constant) else _expression(node)


def after_parameters(arguments: list[ast.expr]) -> list[ast.expr]:
    """The arguments of a call after P: integer offsets into P."""
    names = [a.id if isinstance(a, ast.Name) else "" for a in arguments]
    return arguments[names.index("P") + 1 :] if "P" in names[:-1] else []


def _expression(node: ast.expr) -> str:
    match node:
        case ast.Name(name):
            return name
        case ast.Constant(bool(value)):
            return str(value).lower()
        case ast.Constant(value):
            return _number(value)
        case ast.Subscript(value, index):
            return f"{_expression(value)}[{ast.unparse(index)}]"
        case ast.IfExp(test, yes, no):
            return f"({_expression(test)} ? {_expression(yes)} : {_expression(no)})"
        case ast.BinOp(left, ast.Mod(), right):
            return f"({ast.unparse(left)} % {ast.unparse(right)})"
        case ast.Tuple([]):
            return "Tuple<1>{{0.0f}}"
        case ast.Tuple([ast.Tuple() as first, ast.Tuple() as second]):
            return f"pair_of({_expression(first)}, {_expression(second)})"
        case ast.Tuple(values):
            return f"Tuple<{len(values)}>{{{{{', '.join(map(_expression, values))}}}}}"
        case ast.UnaryOp(op, value):
            return f"({OPERATORS[type(op)]}{_expression(value)})"
        case ast.BinOp(left, op, right) | ast.Compare(left, [op], [right]):
            return f"({_expression(left)} {OPERATORS[type(op)]} {_expression(right)})"
        case ast.Call(ast.Name(name), arguments):
            places = after_parameters(arguments)
            passed = [_expression(a) for a in arguments[: len(arguments) - len(places)]]
            passed += map(ast.unparse, places)
            return WORDS[name].format(*passed) if name in WORDS else f"{name}_({', '.join(passed)})"
    raise NotImplementedError(ast.unparse(node))
