"""Docstrings: names in backticks exist; public ones name every parameter and the result."""

from __future__ import annotations

import ast
import builtins
import inspect
import re
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
NATIVE = "".join(
    p.read_text(encoding="utf-8")
    for p in (ROOT / "fracslice/native").rglob("*")
    if p.suffix in (".h", ".cpp")
)


@pytest.fixture(scope="module")
def trees() -> dict[Path, ast.Module]:
    """The program's text."""
    return {
        p: ast.parse(p.read_text(encoding="utf-8"))
        for f in ("fracslice", "cli")
        for p in (ROOT / f).rglob("*.py")
    }


def test_no_two_public_classes_have_one_name(trees: dict[Path, ast.Module]) -> None:
    classes = [n.name for tree in trees.values() for n in tree.body if isinstance(n, ast.ClassDef)]
    public = Counter(name for name in classes if not name.startswith("_"))
    assert [name for name, count in public.items() if count > 1] == []


TWINS = {"camera", "cuda", "model", "models", "outlines", "reliefs"}
"""Modules of one name in two packages: mostly two sides of one thing, such as a formula and its kernel."""


def test_no_further_modules_have_one_name(trees: dict[Path, ast.Module]) -> None:
    library = Counter(path.stem for path in trees if "cli" not in path.parts and path.stem[0] != "_")
    assert {name for name, count in library.items() if count > 1} == TWINS


def test_the_library_imports_itself_relatively(trees: dict[Path, ast.Module]) -> None:
    absolute = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path, tree in trees.items()
        if "cli" not in path.parts
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        and not node.level
        and (node.module or "").split(".")[0] == "fracslice"
    ]
    assert not absolute


def test_every_name_in_backticks_exists(trees: dict[Path, ast.Module]) -> None:
    known = {part for path in trees for part in (path.stem, *path.parent.parts)}
    known |= (
        set(re.findall(r"\w+", NATIVE))
        | set(dir(builtins))
        | {"docs", "md"}
        | {p.stem for p in ROOT.glob("docs/**/*.md")}
    )
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


PACKAGES = [
    "animation", "cluster", "errors", "export", "formulas", "mesh", "printing", "rendering",
    "scene", "slicing", "viewer", "volume",
]  # fmt: skip


def documented(doc: str, *titles: str) -> set[str]:
    """Names in sections of a numpydoc docstring."""
    texts = re.findall(rf"^(?:{'|'.join(titles)})\n-+\n(.*?)(?=\n\n\w[\w ]*\n-+\n|\Z)", doc, re.S | re.M)
    lines = [line for text in texts for line in text.splitlines() if line and not line[0].isspace()]
    return set(re.findall(r"\w+", " ".join(line.split(" : ")[0] for line in lines)))


def lacking(thing: Any, name: str) -> list[str]:
    """Parameters, and a result, that a docstring leaves out; one that refers to another is whole."""
    docs = [inspect.getdoc(of) or "" for of in ([*thing.__mro__] if inspect.isclass(thing) else [thing])]
    if not docs[0]:
        return [f"{name}: a docstring"]
    if isinstance(thing, property) or re.search(r"\b[Ss]ee `", docs[0]):
        return []
    own = not inspect.isclass(thing) or vars(thing).keys() & {"__init__", "__dataclass_fields__"}
    if not own or getattr(thing, "_is_protocol", False):
        return []
    signature = inspect.signature(thing)
    known = {"self", "cls"}.union(*(documented(doc, "Parameters", "Attributes") for doc in docs))
    returned = inspect.isclass(thing) or signature.return_annotation in (None, "None", "Iterator[None]")
    whole = returned or re.search(r"^(Returns|Yields)\n---", docs[0], re.M)
    missing = [p for p in signature.parameters if p not in known and not p.startswith("_")]
    return [f"{name}: {p}" for p in missing] + [f"{name}: Returns"] * (not whole)


def public(package: str) -> Iterator[tuple[str, Any]]:
    """Functions and classes that a package exports, and the methods and properties of the classes."""
    module = import_module(package)
    for name in getattr(module, "__all__", None) or vars(module):
        thing = getattr(module, name)
        if name.startswith("_") or not getattr(thing, "__module__", "").startswith("fracslice"):
            continue
        if inspect.isclass(thing) or inspect.isroutine(thing):
            yield name, thing
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            method = getattr(value, "__name__", member) == member  # not a function that is a default
            if method and member[0] != "_" and isinstance(value, (FunctionType, property, classmethod)):
                yield f"{name}.{member}", value.__func__ if isinstance(value, classmethod) else value


@pytest.mark.parametrize("package", ["fracslice", *(f"fracslice.{name}" for name in PACKAGES)])
def test_public_docstrings_name_every_parameter_and_the_result(package: str) -> None:
    missing = [line for name, thing in public(package) for line in lacking(thing, name)]
    assert not missing, "\n".join(missing)
