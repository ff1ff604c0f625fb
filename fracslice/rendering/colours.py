"""Materials in a render kernel."""

from __future__ import annotations

from dataclasses import dataclass

from ..formulas.material import material, stops
from ..formulas.registry import Fixed, Node
from ..kernel.linker import Linker
from ..kernel.structure import link_tree
from .glow import glowing_bodies
from .image_files import load_picture
from .tracing import TraceDialect, traps
from .units import shade
from .units.pixel import linear
from .units.texture import triplanar

TEXELS = 1024 * 1024
"""Maximum number of pixels of a texture."""


def opaque_part(node: Node) -> Node | None:
    """Return a scene without the members of its unions that are transparent.

    Parameters
    ----------
    node : Node
        Root of the formula tree.

    Returns
    -------
    Node or None
        The rest; None if all of it is transparent, the tree itself if nothing is.
    """
    if node.formula.name == material.name and node["clear"]:
        return None
    parts = tuple(opaque_part(child) for child in node.children)
    if all(part is child for part, child in zip(parts, node.children, strict=True)):
        return node
    if node.formula.name != "union":  # a transparent tool cuts all the same
        return node.changed((parts[0], *node.children[1:])) if parts[0] else None
    left = tuple(part for part in parts if part)
    return node.changed(left) if left else None


def transparent_part(node: Node) -> Node | None:
    """Return a scene with those members of its unions alone that are transparent.

    Parameters
    ----------
    node : Node
        Root of the formula tree.

    Returns
    -------
    Node or None
        The rest; None if nothing is transparent.
    """
    if node.formula.name == material.name and node["clear"]:
        return node
    parts = tuple(transparent_part(child) for child in node.children)
    if node.formula.name != "union":
        return node.changed((parts[0], *node.children[1:])) if parts and parts[0] else None
    left = tuple(part for part in parts if part)
    return node.changed(left) if len(left) > 1 else (left or (None,))[0]


def _head_on(index: float) -> float:
    """Reflectance of glass at normal incidence (Fresnel)."""
    return ((index - 1) / (index + 1)) ** 2


@dataclass
class Look:
    """Materials of a scene, and the kernel lines that load the material at a hit.

    With one material, its numbers are read from P. With several, `paint` selects among them.

    Attributes
    ----------
    linker : Linker
        Linker of the kernel.
    root : Node
        Root of the formula tree.
    paths : bool
        True if rays also continue where a surface scatters light.
    """

    linker: Linker
    root: Node
    paths: bool = False

    def __post_init__(self) -> None:
        self.nodes = [n for n in self.root.walk() if n.formula.name == material.name]
        covered = bool(self.nodes) and self.root is self.nodes[0] and len(self.nodes) == 1
        plain = material(self.root)
        self.all = self.nodes if covered else [plain, *self.nodes]
        self.paints = {id(n): self.all.index(n) if covered else k + 1 for k, n in enumerate(self.nodes)}
        self.palettes = any(len(stops(n)) > 3 or n["vary"] for n in self.all)
        self.textured = any(n["texture"] for n in self.all)
        self.varies = any(n["vary"] for n in self.all)
        self.coated = any(n["coat"] for n in self.all)
        self.glows = any(n["glow"] for n in self.all)
        self.bodies = glowing_bodies(self.root) if self.paths else []
        self.inside = any(n["clear"] for n in self.all)
        rough = any(n["roughness"] or n["vary"] or n["metallic"] for n in self.all)
        self.glossy = self.paths or self.coated or rough
        self.bounces = self.inside or self.glossy or any(n["reflect"] for n in self.all)

    def lines(self) -> list[str]:
        """Return the lines that set cr, cg, cb, specular, shininess and the other properties in use.

        Returns
        -------
        list of str
            Kernel source lines.
        """
        lines = []
        if len(self.all) > 1 or self.palettes:
            lines += self.trap()
        lines += self.chosen([self.colour(k, n) for k, n in enumerate(self.all)], ("cr", "cg", "cb"))
        names = ["specular", "shininess"]
        names += ["glow"] * self.glows + ["reflect"] * self.bounces + ["clear", "index"] * self.inside
        names += ["roughness", "metallic"] * self.glossy + ["coat"] * self.coated
        for name in names:
            values = [[self.linker.argument(n[name])] for n in self.all]
            lines += self.chosen([([], v) for v in values], (name,))
        if self.varies:
            lines += self.varied()
        if self.inside:
            fading = [[self.linker.argument(a) for a in n["absorb"]] for n in self.all]
            lines += self.chosen([([], v) for v in fading], ("absorbr", "absorbg", "absorbb"))
        return lines

    def trap(self) -> list[str]:
        """Return the line that sets the material's number and the orbit trap.

        Returns
        -------
        list of str
            Kernel source lines.
        """
        dialect = TraceDialect(self.linker, materials=self.paints, traps=traps(self.root))
        return [f"_, paint, tone = {link_tree(self.linker, self.root, dialect)}"]

    def transparent(self) -> list[str]:
        """Return the lines of `units.intrinsics.transparent`.

        Returns
        -------
        list of str
            Kernel source lines.
        """
        part = transparent_part(self.root)
        assert part
        dialect = TraceDialect(self.linker, materials=self.paints, traps=traps(self.root))
        lines = [f"f, paint, tone = {link_tree(self.linker, part, dialect)}", "t = 0.0 * x"]
        values = [(*n["absorb"], n["clear"] * (1 - _head_on(n["index"]))) for n in self.all]
        options: list[tuple[list[str], list[str]]] = [
            ([], [self.linker.argument(v) for v in row]) for row in values
        ]
        return [*lines, *self.chosen(options, ("r", "g", "b", "kept")), "return f, r, g, b, kept"]

    def colour(self, k: int, node: Node) -> tuple[list[str], list[str]]:
        """Return the colour of a material.

        Parameters
        ----------
        k : int
            Index of the material.
        node : Node
            The material.

        Returns
        -------
        lines : list of str
            Kernel source lines.
        values : list of str
            Expressions of red, green and blue.
        """
        colours = linear(stops(node))
        lines, values = [], [f"p{k}{c}" for c in "rgb"]
        if len(colours) == 3:
            values = [self.linker.argument(c) for c in colours]
        else:
            count = Fixed(len(colours) // 3)
            self.linker.bind(f"palette{k}", shade.palette, {"stops": colours, "count": count})
            turns = f"turns{k} = {self.turns(node)}"
            lines = [turns, f"{', '.join(values)} = palette{k}(turns{k} - floor(turns{k}), P)"]
        if not node["texture"]:
            return lines, values
        picture = load_picture(node["texture"], TEXELS, node.fail)
        width, height = picture.size
        given = {"light": picture.light, "width": width, "height": height, "tile": node["tile"]}
        self.linker.bind(f"texture{k}", triplanar, given)
        seen = [f"q{k}{c}" for c in "rgb"]
        lines.append(f"{', '.join(seen)} = texture{k}(x, y, z, nx, ny, nz, P)")
        return lines, [f"{value} * {q}" for value, q in zip(values, seen, strict=True)]

    def turns(self, node: Node) -> str:
        """Expression of the position in a palette, before its whole part is removed."""
        return f"tone * {self.linker.argument(node['repeats'])} + {self.linker.argument(node['shift'])}"

    def varied(self) -> list[str]:
        """Return the lines that change the roughness along the palette."""
        self.linker.share(shade.varied)
        turns: list[tuple[list[str], list[str]]] = [
            ([], [self.turns(n), self.linker.argument(n["vary"])]) for n in self.all
        ]
        return [*self.chosen(turns, ("turn", "vary")), "roughness = varied(roughness, vary, turn)"]

    def chosen(self, options: list[tuple[list[str], list[str]]], names: tuple[str, ...]) -> list[str]:
        """Return the lines that set variables to the values of the material selected by `paint`.

        Parameters
        ----------
        options : list of tuple
            Lines and value expressions of each material.
        names : tuple of str
            Variables to set.

        Returns
        -------
        list of str
            Kernel source lines.
        """
        lines = [line for before, _ in options for line in before]
        for i, name in enumerate(names):
            lines.append(f"{name} = {options[0][1][i]} + 0.0 * t")
            for k, (_, values) in enumerate(options[1:], 1):
                lines.append(f"{name} = where(paint > {k - 0.5}, {values[i]}, {name})")
        return lines
