"""Linking of loops and the functions that they call, and the keys of the code made from them.

Numbers from outside a function (of its module, of an enumeration, of a fixed record) become constants, and
branches on constants are resolved. A function called with fixed arguments is copied for them. Intrinsics keep
their names.
"""

from __future__ import annotations

import ast
import builtins
import copy
import linecache
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, is_dataclass
from enum import Enum
from functools import lru_cache
from types import CodeType, FunctionType, ModuleType
from typing import Any, NoReturn

from ..errors import KernelError
from . import functions, language
from .host import kept_text
from .language import Folding, parse
from .loops import Loop, is_intrinsic


def identity(*values: Any) -> str:
    """Describe functions, the functions that they call, and all values that these use from outside."""
    described = _Described()
    for value in sorted(values, key=lambda value: not isinstance(value, FunctionType)):
        described.add(value, tuple(sorted(described.names)))
    return "\n".join(described.lines)


class _Described:
    """Lines on values and on everything that they refer to, each once."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.seen: dict[tuple[int, tuple[str, ...]], Any] = {}
        self.names = set[str]()
        """Names that the functions so far use: their arguments are used by these."""

    def add(self, value: Any, names: tuple[str, ...]) -> None:
        """Add a value; of a module, class or record the attributes with some names."""
        if value is None or isinstance(value, (bool, int, float, str, Enum)):
            self.lines.append(repr(value))
            return
        self.lines.append(_label(value))
        if isinstance(value, FunctionType):
            names = functions.outer_names(value.__code__)
        if (id(value), names) in self.seen:
            return
        self.seen[id(value), names] = value
        if isinstance(value, FunctionType):
            self.names.update(names)
            self.lines += _bytecode(value.__code__)
            outside = functions.scope(value)
            self.named({name: outside[name] for name in names if name in outside}, names)
        elif type(value) is tuple:
            for item in value:
                self.add(item, names)
        elif isinstance(value, (ModuleType, type, tuple)) or is_dataclass(value):
            self.named({name: getattr(value, name) for name in names if hasattr(value, name)}, names)

    def named(self, values: dict[str, Any], names: tuple[str, ...]) -> None:
        """Add values with their names."""
        for name, value in values.items():
            self.lines.append(name)
            self.add(value, names)


def _label(value: Any) -> str:
    """Kind and name of a value, without its address."""
    name = getattr(value, "__qualname__", getattr(value, "__name__", ""))
    return f"{type(value).__qualname__} {getattr(value, '__module__', '')}.{name}"


def _bytecode(code: CodeType) -> list[str]:
    """Instructions and constants of a function, and of those inside it."""
    own = [repr(c) for c in code.co_consts if not isinstance(c, CodeType)]
    inner = [line for c in code.co_consts if isinstance(c, CodeType) for line in _bytecode(c)]
    return [code.co_code.hex(), repr(code.co_varnames), repr(code.co_names), *own, *inner]


OF_LOOPS = "l_"
"""Prefix of the names of functions that loops call, distinct from those of formulas and units."""

Fixed = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class LinkedFunction:
    """Function that calls only linked functions and intrinsics."""

    tree: ast.FunctionDef  # syntax tree
    file: str  # file of its lines


@lru_cache(maxsize=32)
def link_loops(loops: tuple[Loop, ...]) -> dict[str, LinkedFunction]:
    """Link loops and the functions that they call."""
    linker = _LoopLinker()
    for loop in loops:
        linker.linked(loop.function, loop.fixed, loop.name)
    return linker.functions


def loop_source(loops: Sequence[Loop]) -> str:
    """Return the text of loops and of the functions that they call: cached, or linked and cached."""

    def linked() -> str:
        return "\n\n\n".join(ast.unparse(linked.tree) for linked in link_loops(tuple(loops)).values())

    about = [identity(loop.function, *(value for pair in loop.fixed for value in pair)) for loop in loops]
    return kept_text("linked", (sys.version, *about), linked)


@dataclass
class _LoopLinker:
    functions: dict[str, LinkedFunction] = field(default_factory=dict)
    names: dict[tuple[Callable[..., Any], Fixed], str] = field(default_factory=dict)

    def linked(self, function: Callable[..., Any], fixed: Fixed, name: str) -> str:
        """Link a function once per set of fixed arguments; return its name, extended if that is in use."""
        if (function, fixed) not in self.names:
            while name in self.names.values():
                name += "_"
            self.names[function, fixed] = name
            tree = _Resolver(self, function, dict(fixed)).tree(name)
            self.functions[name] = LinkedFunction(tree, function.__code__.co_filename)
        return self.names[function, fixed]


_UNKNOWN = object()


class _Resolver(Folding):
    """Substitutes the values of outside names in a function."""

    def __init__(self, linker: _LoopLinker, function: Callable[..., Any], fixed: dict[str, Any]) -> None:
        self.linker, self.function, self.fixed = linker, function, fixed
        self.scope = functions.scope(function)
        self.local = {*function.__code__.co_varnames, *function.__code__.co_cellvars} - fixed.keys()

    def tree(self, name: str) -> ast.FunctionDef:
        """Function under another name, without its fixed arguments."""
        tree = _parse_function(self.function)
        arguments = [a.arg for a in tree.args.args if a.arg not in self.fixed]
        tree.name, tree.returns = name, None
        tree.args = ast.arguments([], [ast.arg(a) for a in arguments], None, [], [], None, [])
        tree.body = self.statements(tree.body[1:] if ast.get_docstring(tree) is not None else tree.body)
        tree.decorator_list = [mark for mark in tree.decorator_list if isinstance(mark, ast.Name)]
        return tree

    def fail(self, node: ast.AST, message: str) -> NoReturn:
        code = self.function.__code__
        line = getattr(node, "lineno", code.co_firstlineno)
        raise KernelError(f"{code.co_filename}:{line}: loop {self.function.__name__}: {message}")

    def known(self, node: ast.expr) -> Any:
        """Value of an expression that is constant for the loop."""
        match node:
            case ast.Name(name) if name in self.fixed:
                return self.fixed[name]
            case ast.Name(name) if name not in self.local:
                return self.scope.get(name, _UNKNOWN)
            case ast.Attribute(record, name):
                return getattr(self.known(record), name, _UNKNOWN)
        return _UNKNOWN

    # --- names ---
    def visit_Name(self, node: ast.Name) -> ast.AST:
        return node if self.is_local(node) or node.id == "WIDTH" else self.resolved(node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        local = any(self.is_local(n) for n in ast.walk(node) if isinstance(n, ast.Name))
        return self.generic_visit(node) if local else self.resolved(node)

    def is_local(self, node: ast.Name) -> bool:
        return node.id in self.local and node.id not in self.fixed  # fixed while a tuple is unrolled

    def resolved(self, node: ast.Name | ast.Attribute) -> ast.AST:
        value = self.known(node)
        expression: ast.expr
        if isinstance(value, (bool, float)):
            expression = ast.Constant(value)
        elif isinstance(value, int):
            expression = ast.Constant(int(value))
        elif isinstance(node, ast.Name) and value is getattr(builtins, node.id, _UNKNOWN):
            expression = ast.Name(node.id, ast.Load())
        elif name := language.intrinsic_name(value):
            expression = ast.Name(name, ast.Load())
        elif is_intrinsic(value):
            expression = ast.Name(value.__name__, ast.Load())
        elif isinstance(value, FunctionType):
            expression = ast.Name(self.linker.linked(value, (), OF_LOOPS + value.__name__), ast.Load())
        else:
            self.fail(node, f"{ast.unparse(node)!r} has no value here")
        return ast.copy_location(expression, node)

    # --- calls ---
    def visit_Call(self, node: ast.Call) -> ast.AST:
        if node.keywords:
            self.fail(node, f"{ast.unparse(node)!r}: expected arguments by their place")
        match node:
            case ast.Call(ast.Name("tuple"), [ast.GeneratorExp(element, [generator])]):
                return self.unrolled(node, element, generator)
        called = self.known(node.func)
        if not isinstance(called, FunctionType) or is_intrinsic(called) or language.intrinsic_name(called):
            return self.generic_visit(node)
        fixed, passed = [], []
        for parameter, argument in zip(functions.parameters(called), node.args, strict=False):
            value = self.known(argument)
            if value is _UNKNOWN or isinstance(value, (int, float)):
                passed.append(self.visit(argument))
            else:
                fixed.append((parameter, value))
        passed += map(self.visit, node.args[len(fixed) + len(passed) :])
        name = self.linker.linked(called, tuple(fixed), OF_LOOPS + called.__name__)
        return ast.copy_location(ast.Call(ast.Name(name, ast.Load()), passed, []), node)

    def unrolled(self, node: ast.Call, element: ast.expr, generator: ast.comprehension) -> ast.AST:
        """Unroll a tuple of known length."""
        match generator:
            case ast.comprehension(ast.Name(counter), ast.Call(ast.Name("range"), [limit]), []):
                match self.visit(limit):
                    case ast.Constant(int(count)):
                        elements = [self.element(element, counter, k) for k in range(count)]
                        return ast.copy_location(ast.Tuple(elements, ast.Load()), node)
        self.fail(node, "expected a range that is known when the loop is compiled")

    def element(self, element: ast.expr, counter: str, k: int) -> ast.expr:
        outer, self.fixed = self.fixed, {**self.fixed, counter: k}
        expression: ast.expr = self.visit(copy.deepcopy(element))
        self.fixed = outer
        return expression


def _parse_function(function: Callable[..., Any]) -> ast.FunctionDef:
    """Syntax tree of a function with the line numbers of its file."""
    code = function.__code__
    lines, first = linecache.getlines(code.co_filename), code.co_firstlineno
    last = _functions("".join(lines)).get(first)
    if last is None:
        raise KernelError(f"{code.co_filename}:{first}: loop {function.__name__}: expected a def in a module")
    (tree,) = parse("\n" * (first - 1) + "".join(lines[first - 1 : last])).body
    assert isinstance(tree, ast.FunctionDef)
    return tree


@lru_cache(maxsize=32)
def _functions(text: str) -> dict[int, int]:
    """First and last line of each function of a file, decorators included."""
    ends = {}
    for node in parse(text).body:
        if isinstance(node, ast.FunctionDef):
            ends[min([node.lineno, *(mark.lineno for mark in node.decorator_list)])] = node.end_lineno or 0
    return ends
