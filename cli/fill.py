"""fracslice fill: a solid with a lattice inside."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fracslice.common.parameters import Number

from .mesh import MeshFileOptions, Parts, make_files
from .options import LENGTH, OfKind, command, option
from .sweeps import families

if TYPE_CHECKING:
    from fracslice.scene import Scene
    from fracslice.work import Work


def known_lattice(_: click.Context, __: click.Parameter, name: str) -> str:
    """Check the name of a lattice."""
    from fracslice.volume.parts import LATTICES

    if name not in LATTICES:
        raise click.BadParameter(f"{name!r}: expected {', '.join(LATTICES)}")
    return name


class FillOptions(MeshFileOptions):
    """Options of `fill`."""

    lattice: str = option(
        str,
        "The lattice: gyroid, schwarz_p, ... (walls), octet, kelvin, ... (struts); gyroid by default.",
        "--with",
        metavar="NAME",
        default="gyroid",
        callback=known_lattice,
    )
    volume_fraction: float = option(
        OfKind(Number(0.2, "", above=0, below=1)),
        "Share of space that the lattice takes; 0.2 by default.",
        default=0.2,
    )
    period: float = option(LENGTH, "Length after which it repeats; 8mm by default.", default="8mm")
    shell: float = option(LENGTH, "Thickness of the wall that stays; 1.2mm by default.", default="1.2mm")


@command(FillOptions, short_help="Fill a MODEL or SCENE with a lattice behind a wall.")
@families("output", "report", "picture")
def fill(given: FillOptions) -> int:
    """Make a mesh of SCENE or MODEL with a wall, and behind it a lattice.

    Options are those of `fracslice mesh`. In a scene file, <infill> does the same.

    Examples
    --------
    fracslice fill my.stl -o filled.3mf
    fracslice fill my.stl -o filled.3mf --with octet --volume-fraction 0.15 --shell 2mm --period 10mm
    """
    from fracslice.volume.parts import filled

    def parts(scene: Scene, work: Work) -> Parts:
        values = given.lattice, given.volume_fraction, given.period, given.shell
        return [("", filled(scene, *values, given.mesh_job(scene).size, work))]

    return make_files(given.but(size=None), parts)
