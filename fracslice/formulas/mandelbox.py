"""The Mandelbox and its relatives: folds into a box and out of a ball."""

from __future__ import annotations

from ..common.parameters import Number, Vector
from ..fields.maps import ball, fold, fold_to, turn
from ..fields.orbits import orbit

SCALE = Number(2.0, "how much each step enlarges; less than -1 or more than 1", least=-10, most=10)
INNER = Number(0.5, "radius within which the ball's fold only scales", above=0, most=1)


@orbit(scale=SCALE, inner=INNER)
def mandelbox(w, c, scale, inner):  # type: ignore[no-untyped-def]
    """The Mandelbox (Lowe 2010, "What is a Mandelbox?"). L = 2 is measured."""
    return scale * ball(fold(w, 1.0), inner) + c


@orbit(
    scale=SCALE,
    inner=INNER,
    size=Vector((1.0, 1.0, 0.7), "half sizes of the box that is folded into", above=0, most=1e6),
    angle=Number(0.0, "rotation about the z axis in each step, degrees"),
)
def abox(w, c, scale, inner, size, angle):  # type: ignore[no-untyped-def]
    """The asymmetric Mandelbox, turned in each step (Rrrola and Knighty 2010, fractalforums.com).

    With a third size of 1e6, z is never folded: the Amazing Surf (Kali 2011). L = 2 is measured.
    """
    return scale * turn(ball(fold_to(w, size), inner), (0.0, 0.0, 1.0), angle) + c


@orbit(scale=SCALE, inner=INNER)
def amazing_surf(w, c, scale, inner):  # type: ignore[no-untyped-def]
    """The Amazing Surf (Kali 2011, fractalforums.com): a Mandelbox that is not folded along z. L = 2 is
    measured.
    """
    return scale * ball(fold_to(w, (1.0, 1.0, 1e6)), inner) + c
