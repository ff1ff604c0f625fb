"""Write docs/reference/elements.md, the schema and the stub files, after adding a formula."""

from pathlib import Path

from fracslice import _WHERE
from fracslice.scene.manual import OPEN, PATH, markdown, open_relaxng, package_stub, relaxng, stub

ROOT = Path(__file__).parents[1]

if __name__ == "__main__":
    head = (ROOT / "docs/reference/elements.head").read_text(encoding="utf-8")
    (ROOT / "docs/reference/elements.md").write_text(f"{head}\n{markdown()}", encoding="utf-8")
    PATH.write_text(relaxng(), encoding="utf-8")
    OPEN.write_text(open_relaxng(), encoding="utf-8")
    (ROOT / "fracslice/formulas/__init__.pyi").write_text(stub(), encoding="utf-8")
    (ROOT / "fracslice/__init__.pyi").write_text(package_stub(_WHERE), encoding="utf-8")
