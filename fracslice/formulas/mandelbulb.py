"""The Mandelbulb: w -> w^n + p in White and Nylander's triplex numbers, or w^n + c (its Julia sets)."""

from __future__ import annotations

from ..common.parameters import Number, Vector
from . import power_maps
from .orbits import ITERATIONS, REPEAT, orbit
from .powers import calm_power
from .registry import Node


@orbit(
    power=Number(
        8.0, "the exponent; whole numbers need no trigonometry and are several times faster", least=2, most=32
    ),
    iterations=ITERATIONS,
    bailout=Number(2.0, "the solid is where the last step is not larger than this", above=1, most=1e6),
    julia=Vector(
        None,
        "adds this point in each step instead of the start point: a Julia set of the Mandelbulb",
        most=4,
        least=-4,
    ),
    repeat=REPEAT,
)
def mandelbulb(w, c, power, calm):  # type: ignore[no-untyped-def]
    """The Mandelbulb: whole powers by complex multiplication, others in polar coordinates.

    White and Nylander 2009; distance: Quilez 2009, "Mandelbulb", after Hart, Sandin and Kauffman 1989. With
    w = (rho e^(i phi), z), w^n = (Im (z + i rho)^n e^(i n phi), Re (z + i rho)^n).

    The map stretches by n r^(n-1) along meridians and by n |sin n theta / sin theta| r^(n-1) along circles of
    latitude. The usual dr ignores the second stretch, and overestimates distances up to 13 times near the
    poles. Here it counts as far out as a point of the solid can come (`escape.farthest`). Farther out, each
    step increases the radius in any direction, so only the radial stretch matters, and the second is faded
    out.

    There is no theorem for three dimensions; L = 2 is measured (`docs/how/accuracy.md`). It fails for a
    disconnected set (a constant far out): there the field also stays below twice `escape.sure_distance`. A
    fractional power tears space where the azimuth jumps from pi to -pi. No bound holds across the tear, so
    the conservative field stays below the sure distance to it.
    """
    return calm_power(w, power, calm) + c


mandelbulb.hooks.update(power_maps.HOOKS)


@mandelbulb.check  # type: ignore[untyped-decorator]
def mandelbulb_check(node: Node) -> None:
    if node["bailout"] ** node["power"] > 1e15:
        raise node.fail(
            f"bailout={node['bailout']:g}: expected at most {1e15 ** (1 / node['power']):.4g} "
            f"for power {node['power']:g}"
        )
