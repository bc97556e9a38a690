"""The plan of the house: who may import whom, what stays in one package, and names that mean one thing.

`ALLOWED` is the picture in `docs/architecture.md`, where it stands line by line.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "zoobench"
VERIFY = ROOT / "verify" / "zoobench_verify"
LONGEST_FILE = 500

WORDS = ("api", "errors", "arrays", "files", "rounding", "spec", "inputs", "registry", "fidelities")
"""The modules of the top level; every other module is in a package."""

ALLOWED = {
    "errors": "",
    "arrays": "",
    "files": "errors",
    "rounding": "",
    "__init__": "rounding api",
    "api": "errors spec registry cell render db studies harness cli",
    "spec": "errors",
    "inputs": "errors files spec",
    "registry": "errors spec inputs",
    "sim.model": "errors arrays",
    "sim.kernels": "sim.model",
    "sim": "errors arrays files sim.model sim.kernels",
    "fidelities": "registry sim.model",
    "accuracy": "errors spec registry",
    "designs": "errors arrays spec inputs registry sim.model",
    "envs": "errors arrays registry sim.model designs",
    "tasks": "errors arrays spec inputs registry",
    "controllers": "errors arrays spec inputs registry",
    "cell": "errors arrays files spec inputs registry rounding sim.model sim designs envs tasks controllers",
    "render": "errors arrays spec registry sim.model sim designs envs tasks cell",
    "gym": "errors arrays spec registry tasks controllers cell render",
    "methods": "errors arrays inputs registry cell gym",
    "db": "errors spec inputs",
    "report": "errors arrays files spec registry tasks db render",
    "studies": "errors arrays spec inputs registry sim.model tasks cell db",
    "harness": "errors files spec inputs registry rounding tasks cell methods db",
    "testing": "errors arrays spec inputs registry sim.model controllers cell methods",
    "plugins": "errors files registry",
    "cli": "errors files spec inputs registry accuracy cell methods db studies harness report render plugins",
    "__main__": "cli",
}
"""What a package, or a module of the top level, may import from, anywhere in its files: not even inside a function."""

ONLY = {"taichi": {"sim", "sim.kernels"}, "sqlalchemy": {"db"}, "alembic": {"db"}, "click": set()}
"""Libraries that stay in these packages; Typer brings a copy of click, so there may be none to import."""

SHARED_NAMES = {"__init__", "base"}
"""Modules of which there are several: `base.py` holds the protocol of each kind of component."""

FILES = sorted(PACKAGE.rglob("*.py"))
VERIFY_FILES = sorted(VERIFY.rglob("*.py"))


def module_of(path: Path, package: Path = PACKAGE) -> str:
    """The dotted name of a file below the package, `sim.model.scene`."""
    parts = path.relative_to(package).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


MODULES = {module_of(path) for path in FILES}
VERIFY_MODULES = {module_of(path, VERIFY) for path in VERIFY_FILES}


def package_of(module: str) -> str:
    """The longest entry of `ALLOWED` that a module belongs to, or its own name."""
    parts = module.split(".")
    for length in (2, 1):
        if (name := ".".join(parts[:length])) in ALLOWED:
            return name
    return module


@cache
def imports_of(path: Path) -> tuple[str, ...]:
    """Every module that a file imports, at any depth, as a dotted name."""
    return tuple(_imports_of(path))


def _imports_of(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide the direction of a dependency"
            assert node.module is not None
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def own_imports(path: Path) -> set[str]:
    """The modules of ours that a file imports, below the package."""
    return {name.removeprefix("zoobench.") for name in imports_of(path)} & MODULES


def verify_imports(path: Path) -> set[str]:
    """The modules of the verification that a file imports, below its package."""
    return {name.removeprefix("zoobench_verify.") for name in imports_of(path)} & VERIFY_MODULES


def test_packages_import_only_what_the_plan_allows() -> None:
    """Data flows one way; a package or module that the plan does not name fails as well."""
    wrong = [
        f"{module_of(path)} imports {other}"
        for path in FILES
        for other in sorted(own_imports(path))
        if package_of(other) not in {package_of(module_of(path)), *ALLOWED.get(package_of(module_of(path)), "").split()}
    ]
    assert not wrong
    assert {package_of(module_of(path)) for path in FILES} == set(ALLOWED)


def test_the_core_imports_nothing_of_the_verification() -> None:
    """It works where the verification is not installed; a command of that is found by its entry point."""
    names = [(module_of(path), name) for path in FILES for name in imports_of(path)]
    assert not [f"{module} imports {name}" for module, name in names if name.partition(".")[0] == VERIFY.name]
    assert any(own_imports(path) for path in VERIFY_FILES)


def test_the_plan_allows_nothing_that_nobody_imports() -> None:
    """A permission that is not used any more is taken back."""
    used = {(package_of(module_of(path)), package_of(other)) for path in FILES for other in own_imports(path)}
    assert not [f"{name} no longer imports {other}" for name in ALLOWED for other in ALLOWED[name].split()
                if (name, other) not in used]  # fmt: skip


def test_the_top_level_holds_the_words_of_the_benchmark_alone() -> None:
    """A new loose module belongs into a package."""
    assert {path.stem for path in PACKAGE.glob("*.py")} == {*WORDS, "__init__", "__main__"}
    assert len(WORDS) <= 9


def test_nothing_imports_itself_by_a_detour() -> None:
    """Neither the packages of the plan nor the modules form a circle; imports for types alone count."""
    TopologicalSorter({name: row.split() for name, row in ALLOWED.items()}).prepare()
    TopologicalSorter({module_of(path): own_imports(path) - {module_of(path)} for path in FILES}).prepare()
    TopologicalSorter({module_of(path, VERIFY): verify_imports(path) for path in VERIFY_FILES}).prepare()
    with pytest.raises(CycleError):
        TopologicalSorter({"a": ["b"], "b": ["a"]}).prepare()


def test_libraries_stay_where_they_belong() -> None:
    """A port to another engine touches one package, another database one other."""
    wrong = [
        f"{module_of(path)} imports {name}"
        for path in FILES
        for name in {name.partition(".")[0] for name in imports_of(path)} & ONLY.keys()
        if package_of(module_of(path)) not in ONLY[name]
    ]
    wrong += [f"{path.name} imports {name}" for path in VERIFY_FILES for name in imports_of(path) if name in ONLY]
    assert not wrong


def defined_in(path: Path) -> Iterator[str]:
    """Public functions and constants of a module."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = [node.target] if isinstance(node, ast.AnnAssign) else getattr(node, "targets", [])
        named = [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
        named += [node.name] if isinstance(node, ast.FunctionDef) else []
        yield from (name for name in named if not name.startswith("_"))


def test_one_name_means_one_thing() -> None:
    """Public classes have names of their own, and so have functions and constants of kernels. So have modules, but for
    commands and laws: those are named by subject."""
    classes = Counter(
        node.name
        for path in FILES + VERIFY_FILES
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    kernels = Counter(name for path in FILES if module_of(path).startswith("sim.kernels") for name in defined_in(path))
    modules = Counter(path.stem for path in FILES + VERIFY_FILES if path.parent.name not in ("cli", "laws"))
    assert not [name for name, count in classes.items() if count > 1]
    assert not [name for name, count in kernels.items() if count > 1 and name not in ("LAW", "each_node")]
    assert not [name for name, count in modules.items() if count > 1 and name not in SHARED_NAMES]


def test_files_stay_short() -> None:
    """A file that reaches 500 lines is to be split."""
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES + VERIFY_FILES}
    assert not {path: length for path, length in lengths.items() if length >= LONGEST_FILE}


def test_the_picture_in_the_documents_is_the_plan() -> None:
    """`docs/architecture.md` has a row for every package with what it may import."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([\w.]+)` \| .* \| ([\w., ]*?) *\|$", text, flags=re.MULTILINE))
    assert {name: " ".join(row.replace(",", "").split()) for name, row in rows.items()} == ALLOWED
