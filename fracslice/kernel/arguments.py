"""Arguments of a node's function: fixed in the text, or read from the parameter array P."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..errors import KernelError
from ..formulas.registry import Fixed, Node
from . import functions


@dataclass(frozen=True)
class Arguments:
    """Function of a node and its arguments.

    Attributes
    ----------
    function
        Function of the formula.
    fixed
        Arguments substituted in a copy of the function.
    passed
        Expressions that read the other arguments from P, in the function's order.
    numbers
        Numbers in P.
    """

    function: Callable[..., Any]
    fixed: tuple[tuple[str, Any], ...]
    passed: tuple[str, ...]
    numbers: tuple[float, ...]


def arguments(node: Node, leading: int) -> Arguments:
    """Return the function of a node and its arguments.

    Parameters
    ----------
    node
        Node of a scene.
    leading
        Number of the function's arguments that are points, values or a child.

    Raises
    ------
    KernelError
        If the arguments of the formula and of its function differ.
    """
    function, values = node.function, node.arguments
    names = functions.parameters(function)[leading:]
    if set(names) != set(values):
        place = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        wanted, given = (", ".join(s) or "nothing" for s in (values, names))
        raise KernelError(
            f"{place}: formula {node.formula.name}: expected {function.__name__} to take {wanted} "
            f"after its points, found {given}"
        )
    fixed = tuple((name, values[name].value) for name in names if isinstance(values[name], Fixed))
    numbers: list[float] = []
    passed = [read(values[name], numbers, "P0") for name in names if not isinstance(values[name], Fixed)]
    return Arguments(function, fixed, tuple(passed), tuple(numbers))


def read(value: Any, numbers: list[float], origin: str = "") -> str:
    """Append a number or a tuple of numbers to a list.

    Parameters
    ----------
    value
        Number or nested tuple of numbers.
    numbers
        List to append to.
    origin
        Expression of the list's offset in P; default: 0.

    Returns
    -------
    str
        Expression that reads the value back from P.
    """
    if isinstance(value, tuple):
        return f"({', '.join(read(v, numbers, origin) for v in value)},)"
    place = f"{origin} + {len(numbers)}" if origin else str(len(numbers))
    numbers.append(float(value))
    return f"int(P[{place}])" if isinstance(value, int) else f"P[{place}]"
