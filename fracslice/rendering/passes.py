"""Pictures after a pass."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..errors import RenderError
from ..scene.view import View
from .accumulator import Accumulator
from .crops import Crop
from .film import picture


@dataclass(frozen=True, eq=False)
class Pass:
    """The picture after a pass.

    Attributes
    ----------
    number : int
        Number of the pass, from 1.
    samples : float
        Mean samples per pixel.
    error : float
        Root mean square of the pixels' standard errors, in displayed brightness.
    active : float
        Samples of this pass per pixel of the picture.
    rate : float
        Samples per second.
    view : View
        View that develops the picture, with its lights.
    source : Accumulator
        Accumulator that holds the samples, with a margin around the picture.
    crop : Crop
        The picture in the film.
    """

    number: int
    samples: float
    error: float
    active: float
    rate: float
    view: View = field(repr=False)
    source: Accumulator = field(repr=False)
    crop: Crop = field(repr=False)

    @cached_property
    def mean(self) -> np.ndarray:
        """Mean of the samples.

        Returns
        -------
        ndarray of float32, shape (height, width, 4)
            Linear light, and the fraction of the samples whose camera ray hit.

        Raises
        ------
        RenderError
            If a later pass has replaced this picture.
        """
        return self.crop.within(self._current().host().mean())

    @property
    def image(self) -> np.ndarray:
        """Linear light, or the values of another mode; see `film.picture`."""
        return picture(self.mean, self.view.shading.mode)

    @property
    def alpha(self) -> np.ndarray:
        """Fraction of the samples whose camera ray hit, float32 [height, width]."""
        return np.ascontiguousarray(self.mean[..., 3])

    @cached_property
    def shown(self) -> np.ndarray:
        """Developed picture.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            sRGB.

        Raises
        ------
        RenderError
            If a later pass has replaced this picture.
        """
        return self.crop.within(self._current().shown(self.view))

    @cached_property
    def developed(self) -> np.ndarray:
        """Developed picture in floats.

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            sRGB in [0, 1].

        Raises
        ------
        RenderError
            If a later pass has replaced this picture.
        """
        return self.crop.within(self._current().host().developed(self.view))

    def _current(self) -> Accumulator:
        """The accumulator, if it still holds this pass."""
        if self.source.passes != self.number:
            raise RenderError(
                f"pass {self.number}: its picture was replaced by that of pass {self.source.passes}"
            )
        return self.source
