"""Print settings of a scene: the record behind `<print>`, which command-line flags fill as well."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from ..formulas.parameters import Choice, Count, attribute
from .element import Part
from .lengths import AnyLength, Length


@dataclass(frozen=True, kw_only=True)
class Print(Part):
    """Changes that make the object printable, applied in this order.

    Lengths are those of the finished object, in mm. The size of the solid is measured on the connected
    components that are kept, before anything is cut off or added.
    """

    element = "print"
    cavities: Literal["keep", "fill"] = attribute(
        Choice, "keep", "sealed cavities stay or are filled", ("keep", "fill")
    )
    keep: int | Literal["all", "largest"] = attribute(
        Count,
        "all",
        "all bodies stay, or the largest, or this number of the largest",
        1,
        1_000_000,
        ("all", "largest"),
    )
    bridge: float = attribute(
        Length, 0.0, "loose bodies are joined where they are nearest, by struts this thick", zero=True
    )
    gap: float = attribute(Length, 0.0, "gaps up to this width are closed", zero=True)
    thickness: float = attribute(Length, 0.0, "thinner walls are thickened to this", zero=True)
    hollow: float = attribute(Length, 0.0, "the object is hollowed out, leaving walls this thick", zero=True)
    drain: float = attribute(
        Length, 3.0, "diameter of the two holes that let the resin out of the hollow", zero=True
    )
    base: float = attribute(Length, 0.0, "height that is cut off at the bottom, to stand flat", zero=True)
    raft: float = attribute(Length, 0.0, "the object stands on a plate of this height", zero=True)

    if TYPE_CHECKING:  # what it takes is more than what it holds

        def __init__(
            self,
            *,
            cavities: Literal["keep", "fill"] = "keep",
            keep: int | Literal["all", "largest"] = "all",
            bridge: AnyLength = 0.0,
            gap: AnyLength = 0.0,
            thickness: AnyLength = 0.0,
            hollow: AnyLength = 0.0,
            drain: AnyLength = 3.0,
            base: AnyLength = 0.0,
            raft: AnyLength = 0.0,
        ) -> None: ...

    def validate(self) -> None:
        """Raise `SceneError` for `keep` combined with `bridge`."""
        if self.bodies == 1 and self.bridge:
            raise self.fail("keep and bridge: expected one of them; where one body stays, none is loose")

    @property
    def bodies(self) -> int | None:
        """Number of bodies that stay at most, the largest ones; None for all."""
        if isinstance(self.keep, int):
            return self.keep
        return 1 if self.keep == "largest" else None

    @property
    def sorts(self) -> bool:
        """True if connected components or cavities may be removed."""
        return self.bodies is not None or self.cavities == "fill"

    @property
    def whole(self) -> bool:
        """True if connected components and cavities are only kept or removed as a whole."""
        return not any((self.bridge, self.gap, self.thickness, self.hollow, self.base, self.raft))
