# Made from the registry of formulas by `python docs/generate.py`; do not edit.
from collections.abc import Callable, Sequence
from typing import Any, Literal, Union

from ..common.parameters import Axis as Axis
from ..common.parameters import Choice as Choice
from ..common.parameters import Count as Count
from ..common.parameters import Number as Number
from ..common.parameters import Vector as Vector
from ..expr.vocabulary import absolute as absolute
from ..expr.vocabulary import any_of as any_of
from ..expr.vocabulary import atan2 as atan2
from ..expr.vocabulary import cos as cos
from ..expr.vocabulary import exp as exp
from ..expr.vocabulary import floor as floor
from ..expr.vocabulary import log as log
from ..expr.vocabulary import maximum as maximum
from ..expr.vocabulary import minimum as minimum
from ..expr.vocabulary import ratio as ratio
from ..expr.vocabulary import rsqrt as rsqrt
from ..expr.vocabulary import sin as sin
from ..expr.vocabulary import sqrt as sqrt
from ..expr.vocabulary import where as where
from ..fields.box import Box as Box
from ..fields.orbits import orbit as orbit
from ..fields.registry import Fixed as Fixed
from ..fields.registry import Formula as Formula
from ..fields.registry import Node as Node
from ..fields.registry import csg_operator as csg_operator
from ..fields.registry import domain_operator as domain_operator
from ..fields.registry import get as get
from ..fields.registry import names as names
from ..fields.registry import shape as shape

def abox(scale: float = 2.0, inner: float = 0.5, size: Sequence[float] = (1.0, 1.0, 0.7), angle: float = 0.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The asymmetric Mandelbox, turned in each step (Rrrola and Knighty 2010, fractalforums.com).

    With a third size of 1e6, z is never folded: the Amazing Surf (Kali 2011). L = 2 is measured.

    Parameters
    ----------
    scale : a number >= -10 and <= 10, default 2.0
        how much each step enlarges; less than -1 or more than 1
    inner : a number > 0 and <= 1, default 0.5
        radius within which the ball's fold only scales
    size : 3 numbers > 0 and <= 1e+06, default (1.0, 1.0, 0.7)
        half sizes of the box that is folded into
    angle : a number, default 0.0
        rotation about the z axis in each step, degrees
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def amazing_surf(scale: float = 2.0, inner: float = 0.5, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The Amazing Surf (Kali 2011, fractalforums.com): a Mandelbox that is not folded along z. L = 2 is
    measured.

    Parameters
    ----------
    scale : a number >= -10 and <= 10, default 2.0
        how much each step enlarges; less than -1 or more than 1
    inner : a number > 0 and <= 1, default 0.5
        radius within which the ball's fold only scales
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def apollonian(level: int = 4, swell: float = 1.02) -> Node:
    """Apollonian packing of balls in the unit ball (Soddy 1936, "The kiss precise"; Boyd 1973).

    Inversions in the five spheres at right angles to four of the five first ones, the four balls and the
    outside, make all others: one for each level, in the sphere that a point is deepest in, as the others do
    not move the ball that it is in. A ball of radius d around an image point, all outside or all in one ball,
    comes from one of radius d / (a + b d) at least, and these maps compose. L = 2 is measured, on both sides:
    balls of further levels are left out.

    Parameters
    ----------
    level : a whole number from 0 to 12, default 4
        how often the gaps are filled
    swell : a number >= 0.5 and <= 1.1, default 1.02
        radius of the balls in units of that at which they touch

    Returns
    -------
    Node
    """

def beams(file: str, thickness: float = 0.1, smooth: float = 0.0, size: float | None = None, place: Literal['as is', 'centre', 'bed'] = 'as is', units: Literal['um', 'µm', 'mm', 'cm', 'in', 'm'] = 'mm', sha256: str | None = None) -> Node:
    """Beams between points, round and with round ends, as a file has them (round cones: Quilez 2008,
    "Distance functions"). L = 1: an exact distance outside, and inside of what is in one beam alone. With
    seams, f is that for which max(0, f + smooth - d)^2, summed over the distances d of all beams, is
    smooth^2; they fill less than `smooth`.

    Parameters
    ----------
    file : the name of a file
        a graph, in the folder of the scene: .csv, .json, lines of .obj, edges of .ply, beams of .3mf
    thickness : a number > 0, default 0.1
        diameter of beams whose radius the file does not state
    smooth : a number >= 0, default 0.0
        width of rounded seams: where distances of beams differ by less than this they are blended (0: none)
    size : a number > 0
        longest side of the box of all ends; without it, a scene unit is a millimetre
    place : as is, centre or bed, default 'as is'
        where the file has it, with the box of all ends centred at the origin, or there from z = 0
    units : um, µm, mm, cm, in or m, default 'mm'
        unit of the file
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def bend(*elements: Node, degrees: float, axis: Literal['x', 'y', 'z'] = 'z') -> Node:
    """The element bent: a straight axis becomes an arc (Barr 1984, "Global and Local Deformations of Solid
    Primitives").

    In polar coordinates (r, theta) around the arc's centre, at distance 1 / curvature, the element is
    evaluated at theta / curvature and 1 / curvature - r. Lengths shrink towards the centre; at half the
    smallest radius r that the element reaches, L = 2 / (curvature r) times the element's. Nearer to the
    centre, and near the cut opposite to the element, the value is a distance to the sector that holds the
    element.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    degrees : a number
        how far to turn per unit of length along the bent axis
    axis : x, y or z, default 'z'
        the hinge, which stays straight: z bends x towards y, x bends y towards z, y bends z towards x

    Returns
    -------
    Node
    """

def benesi(scale: float = 2.0, offset: float = 2.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """Folds in a frame along the space diagonal, then a square about the x axis (Benesi 2010,
    fractalforums.com: "Pine tree" after the transform T1). Of the constant, x is added alone; scale 1 and
    offset 0 leave the folds.

    The square doubles the angle about the x axis, counted from the z axis to the y axis, and that to it:
    lengths grow by 2 r along meridians and by 4 |x| along circles. L = 2 is measured.

    Parameters
    ----------
    scale : a number > 0 and <= 4, default 2.0
        how much space is enlarged before it is squared
    offset : a number >= -4 and <= 4, default 2.0
        how far it is moved along the x axis before that
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def bounds(*elements: Node, min: Sequence[float], max: Sequence[float]) -> Node:
    """The part of the element inside a box; far from the box the element is not evaluated.

    The element may be unbounded. L = maximum of 1 (the box) and the element's.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    min : 3 numbers
        the corner with the smallest coordinates
    max : 3 numbers
        the corner with the largest coordinates

    Returns
    -------
    Node
    """

def box(size: Sequence[float] = (1.0, 1.0, 1.0), round: float = 0.0) -> Node:
    """A box centred at the origin, with sharp or rounded edges. L = 1: an exact distance.

    Parameters
    ----------
    size : 3 numbers > 0, default (1.0, 1.0, 1.0)
        the three edge lengths
    round : a number >= 0, default 0.0
        radius of the rounded edges and corners, within the size

    Returns
    -------
    Node
    """

def bristorbrot(iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The Bristorbrot (Bristor 2009, fractalforums.com). L = 2 is measured.

    Parameters
    ----------
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def burning_ship(power: float = 8.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The Mandelbulb of absolute coordinates, after Michelitsch and Roessler 1992, "The burning ship".

    L = 2 is measured.

    Parameters
    ----------
    power : a number >= 2 and <= 16, default 8.0
        the exponent
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def capsule(from_: Sequence[float] = (0.0, 0.0, -0.5), to: Sequence[float] = (0.0, 0.0, 0.5), radius: float = 0.25, end: float | None = None) -> Node:
    """A capsule: all points within the radius of a segment; with `end`, a round cone between two balls
    (Quilez 2008, "Distance functions"). L = 1: an exact distance.

    Parameters
    ----------
    from_ : 3 numbers, default (0.0, 0.0, -0.5)
        centre of one end
    to : 3 numbers, default (0.0, 0.0, 0.5)
        centre of the other end
    radius : a number > 0, default 0.25
        the radius
    end : a number > 0
        the radius at the other end; without it, the same

    Returns
    -------
    Node
    """

def cells(keep: float | Sequence[int] = (1, 2, 3), level: int = 3) -> Node:
    """Fractals of kept cells in the cube [-1, 1]^3.

    Kept 0 is Cantor dust (Cantor 1883), 0 and 1 the Menger sponge (Menger 1926), 2 and 3 the Vicsek fractal
    (Vicsek 1983, "Fractal models for diffusion controlled aggregation"), 1 and 2, or 1 to 3, Mosely's
    snowflake (Mosely 2006). Each level is a lattice of kept cells; the fields of all are joined by their
    maximum. They are built from minima and maxima of coordinates, so L = 1.

    Parameters
    ----------
    keep : 1, 2 or 3 whole numbers >= 0 and <= 3, default (1, 2, 3)
        cells kept: 0 at a corner, 1 at an edge, 2 at a face, 3 at the centre
    level : a whole number from 0 to 20, default 3
        how often every cell is cut into 27

    Returns
    -------
    Node
    """

def cone(radius: float = 0.5, height: float = 1.0) -> Node:
    """A cone along the z axis, with its tip up. L = 1: an exact distance.

    Parameters
    ----------
    radius : a number > 0, default 0.5
        radius of the base
    height : a number > 0, default 1.0
        from the base up to the tip along z, centred at the origin

    Returns
    -------
    Node
    """

def cosine_bulb(power: float = 9.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The Mandelbulb with angles counted from the equator (Nylander 2009, bugman123.com): odd powers.

    Lengths along meridians grow by n r^(n-1), along circles of latitude by r^(n-1) |cos n theta / cos theta|,
    without limit near the poles if n is not odd: space tears there. L = 2 is measured.

    Parameters
    ----------
    power : a number >= 2 and <= 16, default 9.0
        the exponent
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def cylinder(radius: float = 0.5, height: float = 1.0) -> Node:
    """A cylinder along the z axis, with flat ends. L = 1: an exact distance.

    Parameters
    ----------
    radius : a number > 0, default 0.5
        the radius
    height : a number > 0, default 1.0
        the height along z, centred at the origin

    Returns
    -------
    Node
    """

def difference(*elements: Node, smooth: float | str | Callable[..., Any] = 0.0) -> Node:
    """The first element minus the others. L = maximum of the elements', as for a union.

    Parameters
    ----------
    *elements : Node
        What it is made of.
    smooth : a number >= 0, or an expression such as 0.1+0.02*z, default 0.0
        width of the rounded seam: where two fields differ by less than this they are blended (0: a sharp seam)

    Returns
    -------
    Node
    """

def displace(*elements: Node, by: float | str | Callable[..., Any]) -> Node:
    """The element whose surface moves by an expression in x, y and z (Cook 1984, "Shade trees"). L = the
    element's plus the bound of the expression's slope, or 1 if that is more. The result is clipped at the box
    of the element, grown by the largest displacement there; the field of an escape-time fractal as by
    `<offset>`.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    by : a number, or an expression such as 0.1+0.02*z
        how far outward the surface moves at each point, in scene units; negative: inward

    Returns
    -------
    Node
    """

def extrude(file: str, size: float | None = None, height: float = 1.0, place: Literal['centre', 'bed', 'as is'] = 'centre', sha256: str | None = None) -> Node:
    """What an SVG file fills, extruded along z (Quilez 2008, "Distance functions"). L = 1: an exact distance,
    but for curves, which are segments within 1/20000 of the longest side. Strokes, clipping and masks do not
    count.

    Parameters
    ----------
    file : the name of a file
        an SVG file, in the folder of the scene
    size : a number > 0
        the longest side of the outline; without it, a scene unit is a millimetre
    height : a number > 0, default 1.0
        along z
    place : centre, bed or as is, default 'centre'
        centred at the origin, or there from z = 0, or from z = 0 where the file has it, y up
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def fischer_koch_s(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the surface S of Fischer and Koch 1987. The gradient of its level function is at most
    2.444: L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def flake(solid: Literal['tetrahedron', 'octahedron', 'dodecahedron', 'icosahedron'] = 'icosahedron', level: int = 3) -> Node:
    """The flake of a Platonic solid with corners on the unit sphere.

    Sierpinski 1915 has the flat one; folds: Knighty 2010, "Kaleidoscopic (escape time) IFS". Reflections move
    no two points apart, and copies are made smaller, not space larger, so L = 1. Copies touch in points and
    edges.

    Parameters
    ----------
    solid : tetrahedron, octahedron, dodecahedron or icosahedron, default 'icosahedron'
        the Platonic solid
    level : a whole number from 0 to 20, default 3
        how often each solid is replaced by copies at its corners

    Returns
    -------
    Node
    """

def frd(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the surface F-RD of Schoen 1970. The gradient of its level function is at most 7.041:
    L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def gear(teeth: int = 16, radius: float = 1.0, height: float = 0.4, bore: float = 0.2, angle: float = 20.0) -> Node:
    """A spur gear along the z axis with involute flanks (Euler 1765; Litvin and Fuentes 2004, "Gear Geometry
    and Applied Theory"): addendum 1 and dedendum 1.25 modules.

    Involutes of one circle are parallel, so the distance to a flank is the base radius times an angle. Below
    the base circle flanks are radial: L = sqrt(1 + (pi / teeth)^2).

    Parameters
    ----------
    teeth : a whole number from 6 to 1000, default 16
        number of teeth
    radius : a number > 0, default 1.0
        of the pitch circle
    height : a number > 0, default 0.4
        the height along z, centred at the origin
    bore : a number >= 0, default 0.2
        radius of the hole along the axis
    angle : a number >= 10 and <= 30, default 20.0
        pressure angle, degrees

    Returns
    -------
    Node
    """

def gyroid(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the gyroid (Schoen 1970, "Infinite periodic minimal surfaces without
    self-intersections"). The gradient of its level function is at most sqrt(3): L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def heightmap(file: str, size: float = 1.0, height: float = 0.1, base: float = 0.05, place: Literal['centre', 'bed'] = 'centre', sha256: str | None = None) -> Node:
    """A picture as a landscape: above the middle of each pixel the height of its level of grey, of 8 or 16
    bits, and bilinear between (a displacement map: Cook 1984, "Shade trees"). The field is measured along z,
    and L = sqrt(1 + s^2), where s is the largest slope of the picture, from all its pixels. One of more than
    4 million pixels is averaged.

    Parameters
    ----------
    file : the name of a file
        a picture, .png, .jpg, .webp or .tif, in the folder of the scene
    size : a number > 0, default 1.0
        longest side, between the middles of pixels
    height : a number > 0, default 0.1
        of white above black
    base : a number > 0, default 0.05
        thickness below black
    place : centre or bed, default 'centre'
        centred at the origin, or there from z = 0
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def hilbert(level: int = 2, thickness: float = 0.5) -> Node:
    """A tube along a Hilbert curve in the cube [-1, 1]^3 (Hilbert 1891; as a Lindenmayer system by
    Prusinkiewicz and Lindenmayer 1990, "The Algorithmic Beauty of Plants").

    The distance to the two halves of the curve's edges in the point's cell, clipped at half a cell, which is
    nearer than those of any other cell: L = 1.

    Parameters
    ----------
    level : a whole number from 1 to 10, default 2
        how often every cell is cut into eight
    thickness : a number > 0 and < 1, default 0.5
        diameter of the tube in cells

    Returns
    -------
    Node
    """

def honeycomb(kind: Literal['435', '534', '535', '353'] = '534', thickness: float = 0.16, reach: float = 0.95) -> Node:
    """Struts along the edges of a regular honeycomb of hyperbolic space, in Poincare's ball (Coxeter 1954,
    "Regular honeycombs in hyperbolic space"; Nelson and Segerman 2017): a Kleinian group of reflections.

    Points of the hyperboloid are reflected into a cell of the group. The hyperbolic distance to the edge
    there bounds that in space, as the ball of radius artanh t around a point at r holds one of radius
    (1 - r^2) t / (1 + r t): L = 1.

    Parameters
    ----------
    kind : 435, 534, 535 or 353, default '534'
        Schlaefli symbol: p-gons, q at a corner of a cell, r cells at an edge
    thickness : a number > 0 and <= 2, default 0.16
        hyperbolic diameter of the struts
    reach : a number > 0 and <= 0.995, default 0.95
        radius of the ball that is filled; at 1 is infinity

    Returns
    -------
    Node
    """

def infill(*elements: Node, shell: float | str | Callable[..., Any], denser: float = 0.0, within: float = 1.0) -> Node:
    """The first element, of which a wall stays whole, and behind it what the other elements fill, such as a
    lattice. L = maximum of the elements'; with `denser`, the fillers' plus denser / 2 / within times that of
    the first element.

    Parameters
    ----------
    *elements : Node
        What it is made of.
    shell : a number > 0, or an expression such as 0.1+0.02*z
        thickness of the wall that stays whole, in scene units
    denser : a number, default 0.0
        how much thicker what fills it is at the surface of the first element, by less deeper inside
    within : a number > 0, default 1.0
        depth from which on it is as thick as given

    Returns
    -------
    Node
    """

def intersection(*elements: Node, smooth: float | str | Callable[..., Any] = 0.0) -> Node:
    """The intersection of the elements. L = maximum of the elements', as for a union.

    Parameters
    ----------
    *elements : Node
        What it is made of.
    smooth : a number >= 0, or an expression such as 0.1+0.02*z, default 0.0
        width of the rounded seam: where two fields differ by less than this they are blended (0: a sharp seam)

    Returns
    -------
    Node
    """

def iwp(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the surface I-WP of Schoen 1970. The gradient of its level function is at most
    3 sqrt(3): L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def jerusalem(level: int = 3) -> Node:
    """The Jerusalem cube in [-1, 1]^3 (Baird 2011): 8 cubes of size sqrt(2) - 1 at the corners, and 12 of its
    square on the edges, which are one level ahead.

    Space is folded into the part nearest to one corner and one edge; the smallest of the fields of both is
    taken in every step, so L = 1. Volume V(n) = 8 k^3 V(n - 1) + 12 k^6 V(n - 2), k = sqrt(2) - 1.

    Parameters
    ----------
    level : a whole number from 0 to 5, default 3
        how often every cube is replaced by 20

    Returns
    -------
    Node
    """

def julia(c: Sequence[float] = (-0.2, 0.8, 0.0, 0.0), iterations: Union[int, Literal['auto']] = 'auto', bailout: float = 2.0, repeat: int = 1) -> Node:
    """The filled Julia set of q^2 + c in the quaternions, cut at k = 0.

    Norton 1982, "Generation and Display of Geometric Fractals in 3-D"; distance: Hart, Sandin and Kauffman
    1989, "Ray Tracing Deterministic 3-D Fractals". The derivative of q^2 has the norm 2|q| exactly. L = 2 is
    Koebe's bound for connected complex Julia sets; for a disconnected set, the derivative near zero is taken
    at a larger |q|, see `escape.CORE`. For quaternions L = 2 is measured (`docs/how/accuracy.md`). Results
    are frozen once a lane has escaped; w itself runs on, unused.

    Parameters
    ----------
    c : 4 numbers >= -4 and <= 4, default (-0.2, 0.8, 0.0, 0.0)
        the constant added in each step: real part, i, j, k
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    bailout : a number > 1 and <= 1e+06, default 2.0
        the solid is where the last step is not larger than this
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def kifs_dodecahedron(scale: float = 2.0, angle: float = 0.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The dodecahedron in a kaleidoscope (Knighty 2010). L = 1.

    Parameters
    ----------
    scale : a number >= 1.1 and <= 10, default 2.0
        how much each step enlarges
    angle : a number, default 0.0
        rotation about the corner's axis in each step, degrees
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def kifs_icosahedron(scale: float = 2.0, angle: float = 0.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The icosahedron in a kaleidoscope (Knighty 2010). L = 1.

    Parameters
    ----------
    scale : a number >= 1.1 and <= 10, default 2.0
        how much each step enlarges
    angle : a number, default 0.0
        rotation about the corner's axis in each step, degrees
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def kifs_octahedron(scale: float = 2.0, angle: float = 0.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The octahedron in a kaleidoscope (Knighty 2010). L = 1.

    Parameters
    ----------
    scale : a number >= 1.1 and <= 10, default 2.0
        how much each step enlarges
    angle : a number, default 0.0
        rotation about the corner's axis in each step, degrees
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def kifs_tetrahedron(scale: float = 2.0, angle: float = 0.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The tetrahedron in a kaleidoscope (Knighty 2010); a scale of 2 is Sierpinski's. L = 1.

    Parameters
    ----------
    scale : a number >= 1.1 and <= 10, default 2.0
        how much each step enlarges
    angle : a number, default 0.0
        rotation about the corner's axis in each step, degrees
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def koch(radius: float = 1.0, height: float = 0.5, level: int = 4) -> Node:
    """A prism over the snowflake of von Koch 1904.

    L = 1: an exact distance. The triangle is folded onto half an edge, and every edge onto a quarter, by
    mirrors that take the curve on one side to that on the other.

    Parameters
    ----------
    radius : a number > 0, default 1.0
        from the axis to the corners
    height : a number > 0, default 0.5
        the height along z, centred at the origin
    level : a whole number from 0 to 12, default 4
        how often the middle third of every edge is replaced by two

    Returns
    -------
    Node
    """

def lambda_bulb(power: float = 4.0, factor: float = 1.1, angle: float = 30.0, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The filled Julia set of lambda (w - w^n) in the triplex numbers, after the logistic map (May 1976,
    "Simple mathematical models with very complicated dynamics"). L = 2 is measured for powers up to 12, L = 3
    beyond.

    Parameters
    ----------
    power : a number >= 2 and <= 16, default 4.0
        the exponent
    factor : a number > 0 and <= 4, default 1.1
        size of lambda
    angle : a number, default 30.0
        angle of lambda, about the z axis, degrees
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def lidinoid(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the lidinoid (Lidin and Larsson 1990). The gradient of its level function is at most
    1.5 sqrt(3): L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def lithophane(file: str, form: Literal['flat', 'cylinder', 'sphere'] = 'flat', size: float = 1.0, thinnest: float = 0.01, thickest: float = 0.05, degrees: float = 360.0, place: Literal['centre', 'bed'] = 'centre', sha256: str | None = None) -> Node:
    """A picture that shows where light shines through (de Bourgoing 1827): the darker, the thicker, linear in
    levels of grey, of 8 or 16 bits. One face is smooth, the lower or inner one; a ball takes a map of
    longitudes and latitudes. The field is measured across the smooth face, and L = sqrt(1 + s^2), where s is
    the largest slope of the picture, from all its pixels. One of more than 4 million pixels is averaged.

    Parameters
    ----------
    file : the name of a file
        a picture, .png, .jpg, .webp or .tif, in the folder of the scene
    form : flat, cylinder or sphere, default 'flat'
        a plate; a wall around the z axis, the picture's middle towards -y; a ball, of a map of its surface
    size : a number > 0, default 1.0
        longest side of the plate, height of the wall, or inner diameter of the ball
    thinnest : a number > 0, default 0.01
        thickness of white
    thickest : a number > 0, default 0.05
        thickness of black
    degrees : a number > 0 and <= 360, default 360.0
        how far a wall goes around the axis, to a whole column of pixels
    place : centre or bed, default 'centre'
        centred at the origin, or there from z = 0
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def mandelbox(scale: float = 2.0, inner: float = 0.5, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The Mandelbox (Lowe 2010, "What is a Mandelbox?"). L = 2 is measured.

    Parameters
    ----------
    scale : a number >= -10 and <= 10, default 2.0
        how much each step enlarges; less than -1 or more than 1
    inner : a number > 0 and <= 1, default 0.5
        radius within which the ball's fold only scales
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def mandelbulb(power: float = 8.0, iterations: Union[int, Literal['auto']] = 'auto', bailout: float = 2.0, julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
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

    Parameters
    ----------
    power : a number >= 2 and <= 32, default 8.0
        the exponent; whole numbers need no trigonometry and are several times faster
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    bailout : a number > 1 and <= 1e+06, default 2.0
        the solid is where the last step is not larger than this
    julia : 3 numbers >= -4 and <= 4
        adds this point in each step instead of the start point: a Julia set of the Mandelbulb
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def material(*elements: Node, colour: Sequence[float] = (0.8, 0.8, 0.8), palette: Literal['colours', 'viridis', 'plasma', 'inferno', 'magma', 'cividis', 'twilight'] = 'colours', trap: Literal['point', 'axes', 'planes', 'sphere', 'steps', 'direction'] = 'point', texture: str | None = None, tile: float = 1.0, repeats: float = 1.0, shift: float = 0.0, specular: float = 0.2, shininess: float = 32.0, glow: float = 0.0, reflect: float = 0.0, roughness: float = 0.0, vary: float = 0.0, coat: float = 0.0, metallic: float = 0.0, clear: float = 0.0, index: float = 1.5, absorb: Sequence[float] = (0.0, 0.0, 0.0)) -> Node:
    """The appearance of the element in pictures. A material nested deeper takes precedence.

    A palette shows the smallest distance of the orbit to the origin (point), to the axes or to the coordinate
    planes, the smallest | |w|^2 - 1 | (sphere), its number of steps, or its last angle about the z axis
    (direction). It is run through once from 0 to 1, and again beyond; shapes without an orbit have 1.

    The field is that of the element: L = the element's.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    colour : 3, 6, 9, 12, 15, 18, 21 or 24 numbers >= 0 and <= 1, default (0.8, 0.8, 0.8)
        red, green and blue; several colours, three numbers each, are a palette for the orbit
    palette : colours, viridis, plasma, inferno, magma, cividis or twilight, default 'colours'
        a palette by name in place of the colours
    trap : point, axes, planes, sphere, steps or direction, default 'point'
        property of the orbit that the palette shows
    texture : the name of a file
        a picture that multiplies the colour, seen along the three axes
    tile : a number > 0, default 1.0
        width of that picture, in scene units
    repeats : a number > 0 and <= 1000, default 1.0
        how often the palette is run through
    shift : a number >= 0 and <= 1, default 0.0
        where in the palette it starts, from 0 to 1
    specular : a number >= 0 and <= 100, default 0.2
        strength of the highlight
    shininess : a number >= 1 and <= 10000, default 32.0
        sharpness of the highlight
    glow : a number >= 0 and <= 1000, default 0.0
        light of its own, in its colour
    reflect : a number >= 0 and <= 1, default 0.0
        the part of light that is mirrored head on; more is at grazing angles
    roughness : a number >= 0 and <= 1, default 0.0
        roughness of the reflection: 0 is a mirror, 1 is dull
    vary : a number >= -1 and <= 1, default 0.0
        how much rougher it is in the middle of the palette, by the orbit
    coat : a number >= 0 and <= 1, default 0.0
        strength of a clear, smooth lacquer over it
    metallic : a number >= 0 and <= 1, default 0.0
        1 for a metal, which reflects in its colour and has no other light
    clear : a number >= 0 and <= 1, default 0.0
        the part of light that goes through
    index : a number >= 1 and <= 4, default 1.5
        how strongly that light is bent: 1.33 water, 1.5 glass, 2.4 diamond
    absorb : 3 numbers >= 0 and <= 1e+06, default (0.0, 0.0, 0.0)
        how quickly red, green and blue fade inside, per scene unit

    Returns
    -------
    Node
    """

def menger(level: int = 3) -> Node:
    """The Menger sponge of any level in the cube [-1, 1]^3.

    Menger 1926; distance: Quilez 2011, "Menger fractal": a box minus an infinite lattice of crosses for each
    level. Every term is the distance to its own solid or less, so their maximum has L = 1. Volume 8
    (20/27)^n, area 4 (2 (20/9)^n + 4 (8/9)^n).

    q is the offset of a point from the centre of its cell, in cells; the next level's is
    |3 q - nearest whole|.

    Parameters
    ----------
    level : a whole number from 0 to 20, default 3
        how often holes are cut; meshes and layers stop at bars of a voxel

    Returns
    -------
    Node
    """

def mirror(*elements: Node, axis: Literal['x', 'y', 'z']) -> Node:
    """The half of the element on the positive side of an axis, and its mirror image.

    L = the element's: folding space does not increase distances.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    axis : x, y or z
        normal of the mirror plane: the half on its positive side is mirrored to the other side

    Returns
    -------
    Node
    """

def model(file: str, size: float | None = None, place: Literal['as is', 'centre', 'bed'] = 'as is', units: Literal['um', 'µm', 'mm', 'cm', 'in', 'm'] = 'mm', sha256: str | None = None) -> Node:
    """A triangle model, closed and without self-intersections. L = 1: the exact distance to its triangles, on
    the side that Baerentzen and Aanaes 2005, "Signed Distance Computation Using the Angle Weighted
    Pseudonormal", have.

    Parameters
    ----------
    file : the name of a file
        a model, .3mf, .glb, .obj, .ply or .stl, in the folder of the scene
    size : a number > 0
        the longest side; without it, a scene unit is a millimetre of the model
    place : as is, centre or bed, default 'as is'
        where the file has it, with its box centred at the origin, or there with its lowest point at z = 0
    units : um, µm, mm, cm, in or m, default 'mm'
        unit of a file that states none, as .3mf and .glb do
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def neovius(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the surface of Neovius 1883. The gradient of its level function is at most 7: L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def noise(*elements: Node, kind: Literal['perlin', 'simplex'] = 'simplex', amplitude: float = 0.1, period: float = 0.5, octaves: int = 1, seed: int = 0) -> Node:
    """The element with its surface displaced by gradient noise: Perlin 2002, "Improving noise", or simplex
    noise (Gustavson 2005, "Simplex noise demystified").

    The noise of every octave has the same steepest gradient, so L = the element's + 3.225 octaves amplitude /
    period, with simplex noise 7.803. The result is clipped at the element's box grown by all amplitudes.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    kind : perlin or simplex, default 'simplex'
        the noise
    amplitude : a number > 0, default 0.1
        largest displacement by the first octave
    period : a number > 0, default 0.5
        distance between lattice points of the first octave
    octaves : a whole number from 1 to 8, default 1
        layers of noise, each half as large and twice as fine
    seed : a whole number from 0 to 288, default 0
        another number is another noise

    Returns
    -------
    Node
    """

def octahedron(radius: float = 1.0) -> Node:
    """A regular octahedron centred at the origin. L = 1: an exact distance.

    Parameters
    ----------
    radius : a number > 0, default 1.0
        from the centre to each of the six corners

    Returns
    -------
    Node
    """

def offset(*elements: Node, distance: float) -> Node:
    """The element grown or shrunk by a distance; exact where its field is a distance.

    A field that underestimates distances would grow too far; the result is clipped at the grown box.
    L = maximum of 1 (the box) and the element's; more for an escape-time fractal, whose field is steeper away
    from its surface (`Bounds.steepening`; measured). A shrunk element lies inside the original. The field of
    a fractal is an exterior bound only, so the conservative field of a shrunk fractal is that of the
    original.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    distance : a number
        how far outward the surface moves, in scene units; negative: inward

    Returns
    -------
    Node
    """

def onion(*elements: Node, period: float, thickness: float | str | Callable[..., Any]) -> Node:
    """Walls within the element that follow its surface, one below the other, the first with the surface as
    its outer face (after Quilez 2008, "Distance functions"). L = the element's.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    period : a number > 0
        distance from wall to wall
    thickness : a number > 0, or an expression such as 0.1+0.02*z
        of the walls

    Returns
    -------
    Node
    """

def plane(normal: Sequence[float] = (0.0, 0.0, 1.0), offset: float = 0.0) -> Node:
    """The half-space behind a plane. L = 1: an exact distance.

    Parameters
    ----------
    normal : 3 numbers, not all zero, default (0.0, 0.0, 1.0)
        points out of the solid; any length
    offset : a number, default 0.0
        distance of the plane from the origin along the normal

    Returns
    -------
    Node
    """

def preimage(*elements: Node, of: Literal['last', 'every'] = 'last') -> Node:
    """The points that the orbit of a fractal leads into a solid (Knighty 2012, fractalforums.com).

    The first element is an escape-time fractal or an `orbit`, of which the steps alone count; the others are
    the solid. The value is that of the solid at the orbit's last point, divided by the stretch of its steps,
    or the least of all rounds. A stretch below 1 counts as 1, for an inversion shrinks what is far alone.
    L = the solid's if the steps stretch alike everywhere; else twice that, which is measured, once for one
    inside another. Where a step tears space, the value jumps.

    Parameters
    ----------
    *elements : Node
        What it is made of.
    of : last or every, default 'last'
        points of an orbit that count: the last, or one after every round

    Returns
    -------
    Node
    """

def prism(sides: int = 6, radius: float = 0.5, height: float = 1.0) -> Node:
    """A regular prism along the z axis, with a corner on the x axis (Quilez 2020, "Distance functions").

    L = 1: an exact distance.

    Parameters
    ----------
    sides : a whole number from 3 to 1000, default 6
        number of sides
    radius : a number > 0, default 0.5
        from the axis to the corners
    height : a number > 0, default 1.0
        the height along z, centred at the origin

    Returns
    -------
    Node
    """

def pseudo_kleinian(size: Sequence[float] = (0.92436, 0.90756, 0.92436), ball: float = 1.0, c: Sequence[float] = (0.0, 0.0, 0.0), thickness: float = 0.05, steps: int = 8) -> Node:
    """Folds into a box and out of a ball, around a cross of a plane and an axis (Theli-at and Knighty 2011,
    fractalforums.com: "Scale 1 JuliaBox + something"). Without end; put `bounds` around it.

    Steps are similarities beside their creases: the stretch is a number. L = 2 is measured.

    Parameters
    ----------
    size : 3 numbers > 0 and <= 4, default (0.92436, 0.90756, 0.92436)
        half sizes of the box that is folded into
    ball : a number > 0 and <= 4, default 1.0
        square of the radius of the ball that is folded out of
    c : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        added in each step
    thickness : a number > 0 and <= 1, default 0.05
        of the innermost shape
    steps : a whole number from 1 to 60, default 8
        steps of the orbit

    Returns
    -------
    Node
    """

def quaternion_mandelbrot(iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The Mandelbrot set of q^2 + c in the quaternions, cut at k = 0 (Norton 1982).

    It is the complex Mandelbrot set turned about the real axis. L = 2 is measured.

    Parameters
    ----------
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def quaternion_power(power: int = 3, iterations: Union[int, Literal['auto']] = 'auto', julia: Sequence[float] | None = None, repeat: int = 1) -> Node:
    """The Mandelbrot set of q^n + c in the quaternions, cut at k = 0, or with `julia` the Julia set (Bedding
    and Briggs 1995, "Iteration of quaternion maps").

    With q = x + u, |u|^2 = y^2 + z^2, the real part and the factor of u are polynomials. The derivative of
    q^n has the norm n |q|^(n-1) at most. L = 2 is measured.

    Parameters
    ----------
    power : a whole number from 2 to 9, default 3
        the exponent
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size
    julia : 3 numbers >= -100 and <= 100
        adds this point in each step instead of the start point: a Julia set
    repeat : a whole number from 1 to 8, default 1
        times that the step is taken in each round of an <orbit>

    Returns
    -------
    Node
    """

def relief(*elements: Node, file: str, size: float = 1.0, height: float = 0.05, sha256: str | None = None) -> Node:
    """The element raised by a picture that falls on it along z, by its levels of grey; around the picture, by
    the levels of its edge. L = the element's plus the largest slope of the picture, from all its pixels.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    file : the name of a file
        a picture, .png, .jpg, .webp or .tif, in the folder of the scene
    size : a number > 0, default 1.0
        longest side, between the middles of pixels; its middle is on the z axis
    height : a number > 0, default 0.05
        by which the surface rises under white, from none under black
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def repeat(*elements: Node, period: Sequence[float], count: Sequence[int] = (0, 0, 0)) -> Node:
    """Copies on a lattice. Every copy that can be the nearest is evaluated, so cell borders are right.

    Copies farther than `gap` are skipped. The value never exceeds `gap` inside the lattice, so a skipped copy
    does not change it. For the same reason a copy's value is at least the distance to its box. L = maximum of
    1 and the element's: skipped values are larger than `gap`, and minima preserve the bound.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    period : 3 numbers > 0
        distance between copies along x, y and z
    count : 3 whole numbers >= 0 and <= 1e+06, default (0, 0, 0)
        copies along x, y and z, centred at the origin; 0: without end

    Returns
    -------
    Node
    """

def revolve(file: str, size: float | None = None, offset: float = 0.0, place: Literal['centre', 'bed'] = 'centre', sha256: str | None = None) -> Node:
    """What an SVG file fills, turned around the z axis, with its left edge there and its y along z (after
    Quilez 2008, "Distance functions"). L = 1: an exact distance, with curves and fills as of `<extrude>`.

    Parameters
    ----------
    file : the name of a file
        an SVG file, in the folder of the scene
    size : a number > 0
        the longest side of the outline; without it, a scene unit is a millimetre
    offset : a number >= 0, default 0.0
        from the axis to the left edge of the outline
    place : centre or bed, default 'centre'
        centred at the origin, or from z = 0
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def scaffold(*elements: Node, of: Literal['voronoi', 'delaunay'] = 'voronoi', where: Literal['inside', 'surface'] = 'inside', count: int = 100, thickness: float = 0.1, smooth: float = 0.0, seed: int = 0) -> Node:
    """Beams along the edges of Voronoi 1908 cells or of Delaunay 1934 tetrahedra of points that are spread
    evenly in the element, or on its surface (Edelsbrunner and Shah 1997, "Triangulating topological spaces"),
    which they follow. L = maximum of 1 and the element's; on the surface, 1.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    of : voronoi or delaunay, default 'voronoi'
        edges of the cells of what is nearest to each point, or lines from points to their neighbours
    where : inside or surface, default 'inside'
        points in the element, whose beams end at its surface, or on it
    count : a whole number from 5 to 20000, default 100
        number of points
    thickness : a number > 0, default 0.1
        diameter of the beams
    smooth : a number >= 0, default 0.0
        width of rounded seams: where distances of beams differ by less than this they are blended (0: none)
    seed : a whole number from 0 to 2147483647, default 0
        number that chooses another arrangement

    Returns
    -------
    Node
    """

def schwarz_d(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the surface D of Schwarz 1890. The gradient of its level function is at most
    sqrt(3): L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def schwarz_p(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the surface P of Schwarz 1890. The gradient of its level function is at most
    sqrt(3): L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def shell(*elements: Node, thickness: float | str | Callable[..., Any]) -> Node:
    """The element made hollow: material deeper inside than the thickness is removed. L = the element's.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    thickness : a number > 0, or an expression such as 0.1+0.02*z
        of the wall, in scene units; its outer face is the element's surface

    Returns
    -------
    Node
    """

def sphere(radius: float = 1.0) -> Node:
    """A sphere centred at the origin. L = 1: an exact distance.

    Parameters
    ----------
    radius : a number > 0, default 1.0
        the radius

    Returns
    -------
    Node
    """

def split_p(period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, grade: Sequence[float] = (0.0, 0.0, 0.0), volume_fraction: float | None = None) -> Node:
    """A wall along the surface Split P of Lord and Mackay 2003. The gradient of its level function is at most
    3.6201: L = 1.

    Parameters
    ----------
    period : a number > 0, default 1.0
        length after which the surface repeats
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        of the wall at its thinnest, at the origin, or at each point
    grade : 3 numbers >= -4 and <= 4, default (0.0, 0.0, 0.0)
        growth of the thickness per length along x, y and z
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def struts(kind: Literal['cubic', 'bcc', 'fcc', 'octet', 'kelvin'] = 'octet', period: float = 1.0, thickness: float | str | Callable[..., Any] = 0.1, volume_fraction: float | None = None) -> Node:
    """Struts along a cubic lattice: its edges, the space diagonals (bcc), the face diagonals (fcc), these and
    an octahedron (octet truss: Fuller 1961; Deshpande, Fleck and Ashby 2001), or the edges of truncated
    octahedra (Kelvin cells: Thomson 1887, "On the division of space with minimum partitional area").

    L = 1: an exact distance. Space is folded into an eighth of a cell, by mirrors of the lattice.

    Parameters
    ----------
    kind : cubic, bcc, fcc, octet or kelvin, default 'octet'
        the lattice
    period : a number > 0, default 1.0
        length of the edges of a cell
    thickness : a number > 0, or an expression such as 0.1+0.02*z, default 0.1
        diameter of the struts
    volume_fraction : a number > 0 and < 1
        share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness

    Returns
    -------
    Node
    """

def superquadric(size: Sequence[float] = (1.0, 1.0, 1.0), exponent: float = 4.0) -> Node:
    """A superellipsoid (Barr 1981, "Superquadrics and angle-preserving transformations").

    The p-norm of the coordinates in half diameters, minus 1, times the smallest one. For p >= 2 the gradient
    of the p-norm is at most 1, so L = 1.

    Parameters
    ----------
    size : 3 numbers > 0, default (1.0, 1.0, 1.0)
        the three diameters
    exponent : a number >= 2 and <= 100, default 4.0
        2 is an ellipsoid; larger numbers come near to a box

    Returns
    -------
    Node
    """

def sweep(file: str, size: float | None = None, anchor: Literal['centre', 'origin'] = 'centre', path: str | None = None, length: float | None = None, place: Literal['centre', 'as is'] = 'centre', points: str | Sequence[Sequence[float]] | None = None, closed: Literal['no', 'yes'] = 'no', sha256: str | None = None, path_sha256: str | None = None) -> Node:
    """What an SVG file fills, swept along a path: seen along the path, its x is to the right, and its y up,
    towards z where the path starts (Wang, Juettler, Zheng and Liu 2008, "Computation of Rotation Minimizing
    Frames"). Corners below 165 degrees are mitred. L = 1: an exact distance, but for curves, which are
    segments within 1/20000 of the longest side of the outline, or of the path. Where a path meets itself, or
    bends more tightly than the outline is wide, parts are united: inside, the distance is then a bound.

    Parameters
    ----------
    file : the name of a file
        an SVG file, in the folder of the scene
    size : a number > 0
        the longest side of the outline; without it, a scene unit is a millimetre
    anchor : centre or origin, default 'centre'
        the point of the outline that is on the path: the centre of its box, or the origin of its file
    path : the name of a file
        an SVG file whose lines are the path, in the folder of the scene
    length : a number > 0
        longest side of that path; without it, a scene unit is a millimetre
    place : centre or as is, default 'centre'
        that path centred at the origin, or where its file has it, y up
    points : points such as 0 0 0, 5 0 0, 5 5 2
        corners of the path, in place of a file
    closed : no or yes, default 'no'
        whether points are joined to a ring
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed
    path_sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file of the path, in the same way

    Returns
    -------
    Node
    """

def tetrabrot(iterations: Union[int, Literal['auto']] = 'auto') -> Node:
    """The Tetrabrot (Rochon 2000, "A generalized Mandelbrot set for bicomplex numbers").

    Idempotents split the bicomplex square into two complex ones: a point is inside if both x + (y - z) i and
    x + (y + z) i are in the complex Mandelbrot set. It is the intersection of two skew cylinders, whose maps
    stretch lengths by sqrt(2). L = 2 is Koebe's bound for both.

    Parameters
    ----------
    iterations : a whole number from 1 to 10000 or "auto", default 'auto'
        steps of the orbit; "auto": until one more moves most by less than 1/512 of the size

    Returns
    -------
    Node
    """

def text(text: str, font: str, size: float = 1.0, depth: float = 1.0, place: Literal['centre', 'bed', 'as is'] = 'centre', variations: str = '', sha256: str | None = None) -> Node:
    """A text, extruded along z (Quilez 2008, "Distance functions"), with ligatures and scripts in all
    directions by HarfBuzz. L = 1: an exact distance, but for curves, which are segments within 1/20000 of the
    em.

    Parameters
    ----------
    text : text in one line
        the text, in one line and one direction of writing
    font : the name of a file
        a TrueType or OpenType font, in the folder of the scene
    size : a number > 0, default 1.0
        font size: the em, of which a capital letter is about 0.7
    depth : a number > 0, default 1.0
        along z
    place : centre, bed or as is, default 'centre'
        centred at the origin, or there from z = 0, or along the base line from the origin and from z = 0
    variations : text in one line, default ''
        where on its axes a variable font is, such as wght=700, wdth=80
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the font, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def thicken(*elements: Node, by: float, within: float = 1.0) -> Node:
    """The first element, such as a lattice, thicker inside the others, and by less the farther from them: its
    density follows a solid, a model, a text or the heights of a picture. L = the first element's plus
    by / 2 / within times the others', or 1 if that is more. The result is clipped at the grown box.

    Parameters
    ----------
    *elements : Node
        What it is made of.
    by : a number
        how much thicker the first element is on both sides together; negative: thinner
    within : a number > 0, default 1.0
        distance from the others from which on it is as it was

    Returns
    -------
    Node
    """

def thread(radius: float = 0.5, pitch: float = 0.2, height: float = 1.5) -> Node:
    """A right-handed screw along the z axis with the basic profile of ISO metric threads (ISO 68-1).

    Oberg and Jones 1914, "Machinery's Handbook". The radial distance to the profile, times the
    cosine of its steepest slope, is clipped deep inside, where a turn moves points too little: L = 1.

    Parameters
    ----------
    radius : a number > 0, default 0.5
        outer radius
    pitch : a number > 0, default 0.2
        height of one turn
    height : a number > 0, default 1.5
        the height along z, centred at the origin

    Returns
    -------
    Node
    """

def torus(radius: float = 1.0, tube: float = 0.25) -> Node:
    """A torus around the z axis. L = 1: an exact distance.

    Parameters
    ----------
    radius : a number > 0, default 1.0
        from the centre to the middle of the tube
    tube : a number > 0, default 0.25
        radius of the tube

    Returns
    -------
    Node
    """

def transform(*elements: Node, translate: Sequence[float] = (0.0, 0.0, 0.0), rotate: Sequence[float] | None = None, scale: float | Sequence[float] = (1.0,), matrix: Sequence[float] | None = None) -> Node:
    """The element scaled, then rotated, then translated.

    The element's field is multiplied by the smallest singular value of the map. So L = the element's, and an
    exact distance stays exact where the scale is uniform.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    translate : 3 numbers, default (0.0, 0.0, 0.0)
        moves by this, last
    rotate : 4 numbers
        an axis and an angle in degrees, counter-clockwise seen against the axis
    scale : 1 or 3 numbers, default (1.0,)
        one factor, or one per axis, first
    matrix : 12 or 16 numbers
        3 x 4 or 4 x 4 numbers row by row, applied before the other three

    Returns
    -------
    Node
    """

def tree(branches: int = 3, level: int = 4, angle: float = 35.0, ratio: float = 0.7, thickness: float = 0.2) -> Node:
    """The tree of the Lindenmayer system A -> F [&A] [/&A] ..., from the origin along the z axis (Honda 1971;
    Prusinkiewicz and Lindenmayer 1990, "The Algorithmic Beauty of Plants").

    Space is folded onto one branch of every fork, so branches end where they meet the plane between two, and
    L = 1.

    Parameters
    ----------
    branches : a whole number from 2 to 12, default 3
        branches at the end of every branch
    level : a whole number from 0 to 12, default 4
        how often branches fork
    angle : a number >= 0 and <= 90, default 35.0
        between a branch and the one before, degrees
    ratio : a number > 0 and <= 0.9, default 0.7
        size of a branch in units of the one before
    thickness : a number > 0 and <= 1, default 0.2
        diameter of the trunk, whose length is 1

    Returns
    -------
    Node
    """

def twist(*elements: Node, degrees: float, axis: Literal['x', 'y', 'z'] = 'z') -> Node:
    """The element twisted about an axis (Barr 1984, "Global and Local Deformations of Solid Primitives").

    At radius rho the twist shears space by s = rate rho, which stretches lengths by (s + sqrt(s^2 + 4)) / 2.
    L = the element's times this stretch at 5/4 of the element's radius. Beyond, the value is the distance to
    the cylinder around the element.

    Parameters
    ----------
    *elements : Node
        What it is applied to; several are a union.
    degrees : a number
        how far to turn per unit of length along the axis
    axis : x, y or z, default 'z'
        the axis to turn about

    Returns
    -------
    Node
    """

def union(*elements: Node, smooth: float | str | Callable[..., Any] = 0.0) -> Node:
    """The union of the elements; with `smooth`, seams are filled by at most smooth/4 (Quilez 2013,
    quadratic).

    The gradient in a seam is a weighted mean of the elements' gradients, so L = maximum of the elements'. A
    seam with one escape-time fractal has 1.25 times that, a seam between several 3 times (measured;
    `conservative_union` avoids the factor).

    Parameters
    ----------
    *elements : Node
        What it is made of.
    smooth : a number >= 0, or an expression such as 0.1+0.02*z, default 0.0
        width of the rounded seam: where two fields differ by less than this they are blended (0: a sharp seam)

    Returns
    -------
    Node
    """

def volume(file: str, grid: str = '', kind: Literal['as stated', 'surface', 'density'] = 'as stated', iso: float | None = None, size: float | None = None, place: Literal['as is', 'centre', 'bed'] = 'as is', units: Literal['um', 'µm', 'mm', 'cm', 'in', 'm'] = 'mm', sha256: str | None = None) -> Node:
    """A grid of an OpenVDB file (Museth 2013, "VDB: High-Resolution Sparse Volumes with Dynamic Topology").
    Near the surface its distances, linear between samples; farther off, distances to where edges of the grid
    cross the surface. Other numbers become distances first. L = 1 is measured at the samples, with a margin.

    Parameters
    ----------
    file : the name of a file
        an OpenVDB file, in the folder of the scene
    grid : text in one line, default ''
        name of a grid of the file; by default surface or density, or the only one
    kind : as stated, surface or density, default 'as stated'
        signed distances, negative inside, or densities, larger inside; or what the class of the grid says
    iso : a number
        value at the surface; by default 0 of a surface and 0.5 of a density
    size : a number > 0
        the longest side; without it, a scene unit is a millimetre of the grid
    place : as is, centre or bed, default 'as is'
        where the file has it, with its box centred at the origin, or there with its lowest point at z = 0
    units : um, µm, mm, cm, in or m, default 'mm'
        unit of the file
    sha256 : the SHA-256 of the file, 64 hexadecimal digits
        hash of the file, by which a file that has changed is noticed

    Returns
    -------
    Node
    """

def voronoi(kind: Literal['struts', 'walls'] = 'struts', period: float = 1.0, thickness: float = 0.1, irregularity: float = 0.8, seed: int = 0) -> Node:
    """A foam of Voronoi cells, without end; put `bounds` around it (Voronoi 1908; cells by Worley 1996,
    "A cellular texture basis function").

    Half the difference of the distances to the nearest and to the second nearest centre, of struts to the
    third: each distance has slope 1, so L = 1. Distances are clipped where a centre out of the 27 nearest
    lattice cells could be nearer.

    Parameters
    ----------
    kind : struts or walls, default 'struts'
        along the edges of the cells or their faces
    period : a number > 0, default 1.0
        distance between cell centres before they are moved
    thickness : a number > 0, default 0.1
        of struts or walls, at their thinnest
    irregularity : a number >= 0 and <= 1, default 0.8
        how far cell centres are moved at random, in periods
    seed : a whole number from 0 to 288, default 0
        another number is another foam

    Returns
    -------
    Node
    """
