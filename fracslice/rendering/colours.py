"""Materials in a render kernel."""

from __future__ import annotations

from dataclasses import dataclass

from ..formulas.material import material, stops
from ..formulas.registry import Fixed, Node
from ..kernel.linker import Linker
from ..kernel.structure import link_tree
from .tracing import TraceDialect, traps
from .units import shade
from .units.pixel import linear


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
        self.palettes = any(len(stops(n)) > 3 for n in self.all)
        self.glows = any(n["glow"] for n in self.all)
        self.inside = any(n["clear"] for n in self.all)
        self.glossy = self.paths or any(n["roughness"] or n["metallic"] for n in self.all)
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
            trace = link_tree(
                self.linker,
                self.root,
                TraceDialect(self.linker, materials=self.paints, traps=traps(self.root)),
            )
            lines.append(f"_, paint, tone = {trace}")
        lines += self.chosen([self.colour(k, n) for k, n in enumerate(self.all)], ("cr", "cg", "cb"))
        names = ["specular", "shininess"]
        names += ["glow"] * self.glows + ["reflect"] * self.bounces + ["clear", "index"] * self.inside
        names += ["roughness", "metallic"] * self.glossy
        for name in names:
            values = [[self.linker.argument(n[name])] for n in self.all]
            lines += self.chosen([([], v) for v in values], (name,))
        if self.inside:
            fading = [[self.linker.argument(a) for a in n["absorb"]] for n in self.all]
            lines += self.chosen([([], v) for v in fading], ("absorbr", "absorbg", "absorbb"))
        return lines

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
        if len(colours) == 3:
            return [], [self.linker.argument(c) for c in colours]
        self.linker.bind(f"palette{k}", shade.palette, {"stops": colours, "count": Fixed(len(colours) // 3)})
        repeats, shift = self.linker.argument(node["repeats"]), self.linker.argument(node["shift"])
        turns = f"turns{k} = tone * {repeats} + {shift}"
        names = [f"p{k}{c}" for c in "rgb"]
        return [turns, f"{', '.join(names)} = palette{k}(turns{k} - floor(turns{k}), P)"], names

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
