"""Write docs/reference/elements.md and fracslice/scene/scene.rng from the registry of formulas."""

from pathlib import Path

from fracslice.scene.manual import markdown
from fracslice.scene.schema import relaxng

ROOT = Path(__file__).parents[1]

if __name__ == "__main__":
    (ROOT / "docs/reference/elements.md").write_text(markdown(), encoding="utf-8")
    (ROOT / "fracslice/scene/scene.rng").write_text(relaxng(), encoding="utf-8")
