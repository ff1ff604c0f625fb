"""A folder of PNG pictures, with a manifest."""

from __future__ import annotations

from ..._slices import Encoding
from ..layer_formats import FolderFormat
from ..png import encode_layer

FORMATS = (
    FolderFormat(
        "png",
        encode_layer,
        lambda run: {"manifest.json": run.describe()},
        encoding=Encoding.PNG,
        endings=("",),
    ),
)
