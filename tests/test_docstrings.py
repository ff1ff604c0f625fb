"""Docstrings speak of what there is: names in backticks are defined in the code or in a module it imports."""

from __future__ import annotations

import ast
import builtins
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
NATIVE = "".join(
    p.read_text(encoding="utf-8")
    for p in (ROOT / "fracslice/native").rglob("*")
    if p.suffix in (".h", ".cpp")
)


def test_every_name_in_backticks_exists() -> None:
    trees = {
        p: ast.parse(p.read_text(encoding="utf-8"))
        for f in ("fracslice", "cli")
        for p in (ROOT / f).rglob("*.py")
    }
    known = {part for path in trees for part in (path.stem, *path.parent.parts)}
    known |= set(re.findall(r"\w+", NATIVE)) | set(dir(builtins)) | {"docs", "md"}
    imported = set()
    for node in (n for tree in trees.values() for n in ast.walk(tree)):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                known.add(name)
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                known.add(name)
            case ast.Import(names=names):
                imported |= {a.asname or a.name for a in names}
    gone = [
        f"{path.relative_to(ROOT)}: `{name}`"
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
        for name in re.findall(r"(?<!`)`([^`\n]+)`(?!`)", ast.get_docstring(node) or "")
        if not name.startswith("<")
        and name.split(".")[0] not in imported
        and set(re.findall(r"[A-Za-z_]\w*", name)) - known
    ]
    assert not gone, "\n".join(gone)
