"""The packages depend on each other in one direction only, and no two modules on each other."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = {
    "fba": set(),
    "samples": {"fba"},
    "fat": {"fba"},
    "cloning": {"fba", "fat"},
    "authoring": {"fba", "fat", "cloning"},
    "formats": {"fba", "fat", "samples"},
    "studio": {"fba", "fat", "cloning", "authoring", "formats", "samples"},
}
MODULES = {
    ".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): p
    for package in ALLOWED
    for p in sorted((ROOT / package).rglob("*.py"))
    if "samples/build" not in p.as_posix()
}


def _imports(path: Path) -> tuple[set[str], set[str]]:
    """All own modules that a module imports, and those of them that it imports when it is loaded."""
    every: set[str] = set()
    at_load: set[str] = set()

    def visit(node: ast.AST, loading: bool) -> None:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            loading = False
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [a.name for a in node.names]
            if isinstance(node, ast.ImportFrom):
                # "from package import module" needs the module, not what the package's face re-exports.
                names = [n if (n := f"{node.module}.{a}") in MODULES else node.module or "" for a in names]
            own = {n for n in names if n in MODULES}
            every.update(own)
            if loading:
                at_load.update(own)
        for child in ast.iter_child_nodes(node):
            visit(child, loading)

    visit(ast.parse(path.read_text("utf-8")), True)
    return every, at_load


@pytest.mark.parametrize("module", sorted(MODULES))
def test_a_module_imports_only_packages_below_it(module: str) -> None:
    package = module.split(".")[0]
    used = {name.split(".")[0] for name in _imports(MODULES[module])[0]} - {package}
    assert used <= ALLOWED[package]


def test_no_two_modules_import_each_other() -> None:
    graph = {name: {i for i in _imports(path)[0] if i != name} for name, path in MODULES.items()}
    packages = {name for name, path in MODULES.items() if path.name == "__init__.py"}
    # A package's public face re-exports its modules; what would be a cycle is a module that imports its own face.
    for name, used in graph.items():
        parents = {name.rsplit(".", k)[0] for k in range(1, name.count(".") + 1)} & packages
        assert not used & parents, f"{name} imports {used & parents}, the face of its own package"
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"import cycle: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize(
    ("statement", "heavy"),
    [("import fba", ("scipy", "pxr", "PIL", "numba")), ("import studio.cli.app", ("scipy", "pxr", "PIL", "numba"))],
)
def test_importing_is_light(statement: str, heavy: tuple[str, ...]) -> None:
    code = f"import sys; {statement}; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
