"""A formula defined in the cell of a notebook, used at once, edited and run again."""

from __future__ import annotations

import subprocess
import sys

CELLS = [
    """
from fracslice import box, make_mesh, render, slice_layers, sphere
from fracslice.formulas import Box, Number, shape, sqrt
""",
    """
@shape(radius=Number(1.0, "the radius", above=0), height=Number(2.0, "the height", above=0))
def egg(x, y, z, radius, height):
    '''A ball that is stretched. L = 1 where it is higher than wide.'''
    s = 2.0 * radius / height
    return sqrt(x * x + y * y + s * s * z * z) - radius


@egg.bounds
def egg_bounds(node):
    return Box.centred(node["radius"], node["radius"], node["height"] / 2)
""",
    """
mesh = make_mesh(egg(1, height=3) - box(), resolution=24)
field = egg(1).distance([[0, 0, 0], [3, 0, 0]])
slices = slice_layers(egg(1), layer=0.25, pixel=0.1)
picture = render(egg(1), size=(24, 16), samples=1)
assert mesh.is_watertight and mesh.size.round(1).tolist() == [2, 2, 3], mesh
assert field.tolist() == [-1.0, 2.0] and len(slices) == 8 and slices[4].max() == 255
assert picture.std() > 5
""",
]
RUN = """
import linecache, sys
for number, cell in enumerate(eval(sys.stdin.read())):
    name = f"/tmp/ipykernel_7/{number}.py"  # as IPython names cells: a file that is in memory only
    linecache.cache[name] = len(cell), None, cell.splitlines(True), name
    exec(compile(cell, name, "exec"), globals())
"""


def notebook(*cells: str) -> None:
    """Runs the cells in a Python of their own."""
    done = subprocess.run(
        [sys.executable, "-c", RUN], input=repr(list(cells)), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_a_formula_is_used_in_the_next_cell() -> None:
    notebook(*CELLS)


def test_a_cell_is_edited_and_run_again() -> None:
    larger = (
        CELLS[1].replace("- radius\n", "- 2.0 * radius\n").replace('node["radius"]', '2 * node["radius"]')
    )
    check = "assert egg(1).distance([3, 0, 0]) == {}"
    notebook(*CELLS[:2], check.format(2.0), larger, check.format(1.0))
