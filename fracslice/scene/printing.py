"""Print settings of a scene: the record behind `<print>`, which command-line flags fill as well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..formulas.parameters import Choice
from .element import Part, described
from .lengths import Length


def _length(doc: str, default: float = 0.0) -> Length:
    return Length(default, doc, zero=True)


@dataclass(frozen=True, kw_only=True)
class Print(Part):
    """Changes that make the object printable, applied in this order.

    Lengths are those of the finished object, in mm. The size of the solid is measured on the connected
    components that are kept, before anything is cut off or added.
    """

    element = "print"
    cavities: Literal["keep", "fill"] = described(
        Choice("keep", "sealed cavities stay or are filled", ("keep", "fill"))
    )
    keep: Literal["all", "largest"] = described(
        Choice("all", "all bodies stay, or the largest alone", ("all", "largest"))
    )
    bridge: float = described(_length("loose bodies are joined where they are nearest, by struts this thick"))
    gap: float = described(_length("gaps up to this width are closed"))
    thickness: float = described(_length("thinner walls are thickened to this"))
    hollow: float = described(_length("the object is hollowed out, leaving walls this thick"))
    drain: float = described(_length("diameter of the two holes that let the resin out of the hollow", 3.0))
    base: float = described(_length("height that is cut off at the bottom, to stand flat"))
    raft: float = described(_length("the object stands on a plate of this height"))

    def validate(self) -> None:
        """Raise `SceneError` for `keep` combined with `bridge`."""
        if self.keep == "largest" and self.bridge:
            raise self.fail("keep and bridge: expected one of them; where one body stays, none is loose")

    @property
    def sorts(self) -> bool:
        """True if connected components or cavities may be removed."""
        return self.keep == "largest" or self.cavities == "fill"

    @property
    def whole(self) -> bool:
        """True if connected components and cavities are only kept or removed as a whole."""
        return not any((self.bridge, self.gap, self.thickness, self.hollow, self.base, self.raft))
