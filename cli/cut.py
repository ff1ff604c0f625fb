"""fracslice cut: two solids of one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracslice.common.parameters import Shift

from .mesh import MeshFileOptions, Parts, make_files
from .options import Parsed, command, option
from .sweeps import families

if TYPE_CHECKING:
    from fracslice.scene import Scene
    from fracslice.work import Work

BELOW, ABOVE = "-below", "-above"
"""What the names of the files end in."""


def parse_plane(text: str) -> tuple[int, float]:
    """Axis and place of a plane, mm."""
    axis, _, place = (word.strip() for word in text.partition("="))
    if axis not in ("x", "y", "z"):
        raise ValueError("a plane such as z=10mm, x=0 or y=-2cm")
    return "xyz".index(axis), Shift(None, "").read(place)


class CutOptions(MeshFileOptions):
    """Options of `cut`."""

    without = frozenset({"orient"})

    plane: tuple[int, float] = option(
        Parsed(parse_plane, "AXIS=LENGTH"), "The plane, such as z=10mm.", required=True
    )


@command(CutOptions, short_help="Cut a MODEL or SCENE into two by a plane.")
@families("output", "report", "picture")
def cut(given: CutOptions) -> int:
    """Make two meshes of SCENE or MODEL: what is below a plane, and what is above.

    With -o part.3mf, they are part-below.3mf and part-above.3mf. z is measured from the lowest point,
    x and y from the middle. Options are those of `fracslice mesh`.

    Examples
    --------
    fracslice cut my.stl --plane z=4mm -o part.3mf
    fracslice cut mandelbulb --plane x=0 -o half.stl --size 8cm
    """
    from fracslice.volume.parts import cut as halves

    def parts(scene: Scene, work: Work) -> Parts:
        return zip((BELOW, ABOVE), halves(scene, *given.plane, given.mesh_job(scene).size, work), strict=True)

    return make_files(given.but(size=None), parts)
