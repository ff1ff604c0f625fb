"""Formulas that a scene defines by the text of their step, or of their distance."""

from __future__ import annotations

import ast
import linecache
from collections.abc import Callable
from dataclasses import dataclass, field
from hashlib import sha256
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from ..errors import KernelError, SceneError
from ..providers import provider
from . import verbs, vocabulary
from .box import Box, Triple
from .hooks import Hook
from .orbits import HOOKS, LIPSCHITZ
from .parameters import Parameter
from .registry import Formula, Node, names
from .rounds import OWN, orbit_step
from .white_list import checked, is_name

POINTS = {"step": ("w", "c"), "distance": ("x", "y", "z")}
"""Names that a text has the point from."""

ERRORS = KernelError, ArithmeticError, LookupError, TypeError, ValueError
"""Errors of texts that are not in the language, or confuse points and numbers."""

_DOC = "Defined in the scene."


@dataclass(frozen=True)
class Definition:
    """Text of a formula, with everything that the formula states.

    Attributes
    ----------
    name : str
        Name of its elements.
    parameters : tuple of (str, Parameter)
        Kinds of the parameters by name.
    text : str
        Statements. Names of the vocabulary, of the verbs (in a step) and of the parameters have a value.
    kind : {"step", "distance"}
        What the text returns: the next point of an orbit, or the signed distance of a solid.
    lipschitz : float
        Lipschitz bound of a distance.
    half : tuple of float, optional
        Half sizes of a box around the solid of a distance; None: endless.
    place : (str, int), optional
        File and line of the text.
    """

    name: str
    parameters: tuple[tuple[str, Parameter], ...]
    text: str
    kind: Literal["step", "distance"] = "step"
    lipschitz: float = 1.0
    half: Triple | None = None
    place: tuple[str, int] | None = field(default=None, compare=False)

    def fail(self, line: int, message: str) -> SceneError:
        """Error about a line of the text, from 1."""
        place = f"{self.place[0]}:{self.place[1] + line - 1}: " if self.place else ""
        return SceneError(f"{place}<define> {self.name}: {message}")


@dataclass(frozen=True, eq=False, repr=False)
class Defined(Formula):
    """Formula of a definition; formulas of equal definitions are equal.

    Attributes
    ----------
    definition : Definition
        The definition.
    """

    definition: Definition = field(kw_only=True)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Defined) and self.definition == other.definition

    def __hash__(self) -> int:
        return hash(self.definition)

    def __reduce__(self) -> tuple[Any, ...]:
        return formula, (self.definition,)


def formula(definition: Definition) -> Defined:
    """Make the formula of a definition.

    Parameters
    ----------
    definition : Definition
        The definition. Its text is checked before anything of it is executed.

    Returns
    -------
    Defined
        The formula; it is not registered.

    Raises
    ------
    SceneError
        If a name or the text is not allowed, with the line.
    """
    _check_names(definition)
    called = [*vocabulary.NAMES - {"any_of"}, *(verbs.NAMES if definition.kind == "step" else ())]
    given = [*POINTS[definition.kind], *dict(definition.parameters)]
    body = checked(definition.text, given, called, definition.fail)
    made = _made(definition, given, body)
    try:
        _try(made)
    except ERRORS as error:
        raise _located(definition, given, body, error) from None
    return made


def _made(definition: Definition, arguments: list[str], body: list[ast.stmt]) -> Defined:
    return Defined(
        definition.name,
        "shape",
        _function(definition, arguments, body),
        MappingProxyType(dict(definition.parameters) | (OWN if definition.kind == "step" else {})),
        lipschitz=LIPSCHITZ if definition.kind == "step" else definition.lipschitz,
        exterior_only=definition.kind == "step",
        hooks=_hooks(definition),
        definition=definition,
    )


def _check_names(definition: Definition) -> None:
    taken = {*POINTS[definition.kind], *OWN, "place"}
    for name in dict(definition.parameters):
        if not is_name(name) or name in taken:
            raise definition.fail(1, f"parameter {name!r}: expected another name of lower-case letters")
    if len(dict(definition.parameters)) < len(definition.parameters):
        raise definition.fail(1, "has two parameters of one name")
    if not is_name(definition.name) or definition.name in names():
        raise definition.fail(1, "expected a name of lower-case letters that no other element has")


def _hooks(definition: Definition) -> dict[str, Hook]:
    if definition.kind == "step":
        return {**HOOKS, "step": orbit_step}
    half = definition.half
    return {"bounds": lambda _: Box.centred(*half)} if half else {}


def _function(definition: Definition, arguments: list[str], body: list[ast.stmt]) -> Callable[..., Any]:
    """Function of checked statements, whose source the linker can read."""
    lines = "\n".join(map(ast.unparse, body)).replace("\n", "\n    ")
    text = f"def {definition.name}({', '.join(arguments)}):\n    {lines}\n"
    file = f"<define {definition.name} {sha256(text.encode()).hexdigest()[:12]}>"
    scope: dict[str, Any] = {n: getattr(vocabulary, n) for n in vocabulary.NAMES}
    scope |= {n: getattr(verbs, n) for n in verbs.NAMES} | {"__name__": __name__}
    exec(compile(text, file, "exec"), scope)
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    function: Callable[..., Any] = scope[definition.name]
    function.__doc__ = _DOC
    return function


def _try(made: Defined) -> None:
    """Translate the text; evaluate a distance at a point.

    A step is translated to straight-line code, which knows points from numbers; a distance is not.
    """
    definition = made.definition
    if definition.kind == "step":
        kinds = dict(definition.parameters).items()
        sizes = tuple((name, len(k.default) if isinstance(k.default, tuple) else 1) for name, k in kinds)
        provider("orbits").Code(made.function, sizes).traced(0)
        return
    value = provider("reference").reference(made())(*np.full((3, 1), 0.3))
    if value.dtype != np.float64 or value.shape != (1,):
        raise KernelError("expected it to return a number that depends on the point")


def _located(
    definition: Definition, arguments: list[str], body: list[ast.stmt], error: Exception
) -> SceneError:
    """Error of the first statement with which the text is at fault."""
    end = provider("parsing").parse("return w" if definition.kind == "step" else "return x").body
    for count, statement in enumerate(body, 1):
        try:
            _try(_made(definition, arguments, [*body[:count], *end]))
        except ERRORS as first:
            message = str(first).rpartition(f" {definition.name}: ")[2]
            return definition.fail(statement.lineno, message)
    return definition.fail(body[-1].lineno, str(error).rpartition(f" {definition.name}: ")[2])


def definitions(root: Node) -> list[Definition]:
    """Definitions of a tree's formulas, in the order of the tree.

    Raises
    ------
    SceneError
        If two definitions have one name.
    """
    used = dict.fromkeys(n.formula.definition for n in root.walk() if isinstance(n.formula, Defined))
    named: dict[str, Definition] = {}
    for definition in used:
        if named.setdefault(definition.name, definition) != definition:
            raise SceneError(f"<define> {definition.name}: expected one definition of this name in a scene")
    return list(used)
