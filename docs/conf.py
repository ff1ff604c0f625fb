"""The site: `make docs` builds it, warnings are errors."""

from __future__ import annotations

import shutil
import tempfile
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

from fracslice.viewer import picture

OUTPUT = Path(tempfile.mkdtemp(prefix="fracslice-docs-"))
SMALL = {
    "build_and_mesh.py": [str(OUTPUT / "bauble.3mf"), "96"],
    "a_family.py": [str(OUTPUT), "48"],
    "fly_around.py": [str(OUTPUT), "4", "360x240"],
    "from_numpy.py": [str(OUTPUT / "implant.3mf"), "96"],
}
"""The arguments that examples run with, small enough for a page."""

project = "fracslice"
copyright = "the authors of fracslice, MIT licence"
release = version = installed("fracslice")
extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx_click",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "examples/*.ipynb", "examples/*.md5"]
myst_heading_anchors = 3
default_role = "code"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
suppress_warnings = ["config.cache"]  # of functions in the configuration
html_theme = "pydata_sphinx_theme"
html_theme_options = {
    "navbar_align": "left",
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
}
html_sidebars = {page: [] for page in ("index", "start", "measurements", "gallery", "changelog")}
html_title = "fracslice"
html_show_sourcelink = False


def arguments(_: dict[str, Any], variables: dict[str, Any]) -> list[str]:
    """What an example is started with."""
    return SMALL[Path(variables["src_file"]).name]


def figures(_: tuple[str, str, int], variables: dict[str, Any], configuration: dict[str, Any]) -> str:
    """The pictures that a part of an example wrote, and its mesh."""
    made = sorted(OUTPUT.glob("*.png"))
    mesh = variables["example_globals"].pop("mesh", None)
    if mesh is not None:
        made.append(picture(mesh, OUTPUT / "mesh.png", (640, 480)))
    names = [
        str(shutil.move(path, name))
        for path, name in zip(made, variables["image_path_iterator"], strict=False)
    ]
    return figure_rst(names, configuration["src_dir"])


sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "examples",
    "filename_pattern": r"\.py$",
    "reset_argv": arguments,
    "image_scrapers": (figures,),
    "reset_modules": (),
    "show_memory": False,
    "min_reported_time": 3600,
    "download_all_examples": False,
    "write_computation_times": False,
}
