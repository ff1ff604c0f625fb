"""Python signatures and docstrings of formulas."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from inspect import Parameter, Signature
from keyword import iskeyword
from typing import TYPE_CHECKING, Any, Literal

from ..common.suggestions import hint
from ..errors import SceneError
from .parameters import REQUIRED, Choice, Count, Vector

if TYPE_CHECKING:
    from .registry import Formula


def python_name(name: str) -> str:
    """Name of a parameter in Python; a keyword such as ``from`` becomes ``from_`` (PEP 8)."""
    return f"{name}_" if iskeyword(name) else name


def ordered(formula: Formula) -> dict[str, Any]:
    """Parameters of a formula by name; Python requires parameters without a default to come first."""
    return dict(sorted(formula.parameters.items(), key=lambda item: item[1].default is not REQUIRED))


def bound(
    formula: Formula, positional: tuple[Any, ...], keywords: Mapping[str, Any]
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Bind the arguments of a call to elements and parameters.

    Parameters
    ----------
    formula : Formula
        The formula that is called.
    positional : tuple
        Values of a shape's parameters in order; for other formulas, the elements inside.
    keywords : mapping of str to value
        Parameter values by their names in Python.

    Returns
    -------
    (tuple, dict)
        The elements inside, and the values by parameter name.

    Raises
    ------
    SceneError
        For an unknown name, a value that is given twice, or more values than parameters.
    """
    names = formula.names
    given = {names.get(name, name): value for name, value in keywords.items()}
    for name in given:
        if name not in formula.parameters:
            near = hint(name, names) if names else "it has none"
            raise SceneError(f"<{formula.name}> has no attribute {name!r}; {near}")
    if formula.children[1] != 0:
        return positional, given
    if len(positional) > len(names):
        most = f"at most {len(names)}: {', '.join(names)}" if names else "none"
        raise SceneError(f"<{formula.name}> has {len(positional)} values: expected {most}")
    first = dict(zip(names.values(), positional, strict=False))
    for name in first.keys() & given.keys():
        raise SceneError(f"<{formula.name}> has two values of {name}: expected one")
    return (), first | given


def signature(formula: Formula, node: type) -> Signature:
    """Signature of a formula as a Python function that makes a `node`."""
    alone = formula.children[1] == 0
    kind = Parameter.POSITIONAL_OR_KEYWORD if alone else Parameter.KEYWORD_ONLY
    elements = [] if alone else [Parameter("elements", Parameter.VAR_POSITIONAL, annotation=node)]
    values = [
        Parameter(
            python_name(name),
            kind,
            default=Parameter.empty if parameter.default is REQUIRED else parameter.default,
            annotation=annotation(parameter),
        )
        for name, parameter in ordered(formula).items()
    ]
    return Signature([*elements, *values], return_annotation=node)


def annotation(parameter: Any) -> Any:
    """Type annotation of a parameter's values."""
    match parameter:
        case Count(words=words):
            type_: Any = int | Literal[*words] if words else int
        case Vector(sizes=sizes, whole=whole):
            several = Sequence[int] if whole else Sequence[float]
            type_ = float | several if 1 in sizes else several
        case Choice(choices=choices):
            type_ = Literal[*choices]
        case _:
            type_ = float
    return type_ | None if parameter.default is None else type_


def docstring(formula: Formula) -> str:
    """Docstring of a formula with its parameters, in numpydoc style."""
    lines = [inspect.cleandoc(formula.doc)]
    if formula.children[1] != 0 or formula.parameters:
        lines += ["", "Parameters", "----------"]
    if formula.children[1] != 0:
        lines += ["*elements : Node", f"    {_ELEMENTS[formula.children[1] == 1]}"]
    return "\n".join([*lines, *parameter_lines(ordered(formula)), "", "Returns", "-------", "Node"])


def parameter_lines(parameters: Mapping[str, Any]) -> list[str]:
    """Describe parameters in numpydoc style.

    Parameters
    ----------
    parameters : mapping of str to Parameter
        Kinds by name.

    Returns
    -------
    list of str
        Lines of a section.
    """
    lines = []
    for name, parameter in parameters.items():
        default = "" if parameter.default in (REQUIRED, None) else f", default {parameter.default!r}"
        lines += [f"{python_name(name)} : {parameter.expects}{default}", f"    {parameter.doc}"]
    return lines


_ELEMENTS = {True: "What it is applied to; several are a union.", False: "What it is made of."}
