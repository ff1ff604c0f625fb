"""An object during the edits that make it printable, and its samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import VolumeError
from ..kernel import Field
from ..meshjob import DUST
from ..scene import Print
from ..volume import Bricks, Plan, extent
from ..volume.sizing import Sizing
from ..work import Work

# Measuring needs Numba and SciPy, whose import takes as long as a small mesh: import where needed.
if TYPE_CHECKING:
    from .samples import Samples
    from .solid_components import SolidComponents

COARSE, FINE = 128, 640
"""Minimum and maximum number of samples along the longest side for measuring lengths."""

SHARP = 6
"""Samples across a length to thicken, close or keep, as far as `FINE` permits."""

THIN = 1.0
"""Area of walls or gaps that samples may miss, from which finer samples are taken, mm^2."""


@dataclass
class Preparation:
    """The object during its edits."""

    planned: Plan
    sizing: Sizing
    how: Print
    work: Work
    scale: float
    """mm per scene unit."""
    known: SolidComponents | None = None
    """Components, once computed."""

    @property
    def size(self) -> float:
        """Approximate longest side, mm."""
        return self.sizing.longest

    @property
    def root(self) -> Field:
        """The current field."""
        return self.planned.root

    def put(self, root: Field) -> None:
        """Replace the current field."""
        self.planned = replace(self.planned, root=root)

    def bound(self) -> None:
        """Recompute the extent of the object."""
        extents = extent(self.root, self.work)
        self.planned = replace(self.planned, box=extents.box, outer=extents.outer, tips=extents.tips)

    def enlarged(self) -> None:
        """Recompute the extent around the same centre, so that samples stay at the same points."""
        middle = self.planned.outer.centre
        self.bound()
        self.planned = replace(self.planned, outer=self.planned.outer.about(middle))

    def sampled(self, length: float = np.inf) -> Bricks:
        """Samples of the current object, fine enough for a length in mm."""
        samples = min(max(COARSE, SHARP * self.size / length), FINE)
        if length < 2 * self.size / samples:
            least = 2 * self.size / samples
            raise VolumeError(
                f"a length of {length:g} mm is too small for an object of {self.size:g} mm: "
                f"expected at least {least:.3g} mm, or 0"
            )
        from .connectivity import sampled_object

        return sampled_object(self.root, self.planned.outer, max(self.planned.box.size), samples, self.work)

    def connected(self) -> SolidComponents:
        """Components of samples that resolve connectivity; shared by cavities, bodies and bridges."""
        from .connectivity import resolved
        from .solid_components import components_of

        if self.known is None:
            coarse = self.sampled()
            components = components_of(coarse)
            unit = max(self.planned.box.size) / self.size
            bricks = resolved(self.root, coarse, THIN * unit**2, len(large_bodies(components)) > 1, self.work)
            self.known = components if bricks is coarse else components_of(bricks)
        return self.known

    def seen(self, length: float) -> Samples:
        """The samples of `sampled` as an interpolated field."""
        from .samples import Samples

        return Samples(self.sampled(length))


def large_bodies(components: SolidComponents) -> np.ndarray:
    """Bodies that are not dust.

    Parameters
    ----------
    components : SolidComponents
        Connected components of a sampled solid.

    Returns
    -------
    int64 [k]
        Their numbers, the largest first.
    """
    bodies = components.bodies
    return np.asarray(bodies[components.count[bodies] > DUST * components.count[components.inside].sum()])
