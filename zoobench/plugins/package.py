"""A package that adds a component to zoobench, written from templates."""

from collections.abc import Mapping
from importlib.resources import files
from keyword import iskeyword
from pathlib import Path
from string import Template

from zoobench import registry
from zoobench.errors import UsageError, reason
from zoobench.files import replace_files
from zoobench.registry import Kind

OFFERED = (Kind.ENV, Kind.TASK, Kind.DESIGN, Kind.CONTROLLER, Kind.METHOD)
"""The kinds of components for which there are templates."""

_RUNS = {
    Kind.ENV: "zoobench run --env {} --task movement-speed --smoke",
    Kind.TASK: "zoobench run --env ground --task {} --smoke",
    Kind.DESIGN: "zoobench run --env ground --task movement-speed --design {} --smoke",
    Kind.CONTROLLER: "zoobench run --env ground --task movement-speed --controller {} --smoke",
    Kind.METHOD: "zoobench run --env ground --task movement-speed --method {} --smoke",
}


def write_package(kind: Kind, name: str, folder: Path) -> Path:
    """Write the package `zoobench-NAME` with a component that works, its entry point and its tests.

    Args:
        kind: one of `OFFERED`.
        name: of the component, in kebab-case.
        folder: where the package's own folder is to be.

    Returns:
        The package's folder.

    Raises:
        UsageError: the name is malformed or taken, or the package's folder exists.
    """
    registry.check_name(name)
    if iskeyword(name):
        raise UsageError(f"{name!r} is a word of the language Python. Choose another name.")
    if name in registry.names(kind):
        raise UsageError(f"The {kind.noun} {name!r} exists already. Choose another name.")
    package = folder / f"zoobench-{name}"
    if package.exists():
        raise UsageError(f"{package} exists already. Choose another name, or another folder with --into.")
    try:
        replace_files({package / path: text.encode() for path, text in _texts(kind, name).items()}, make_folders=True)
    except OSError as error:
        raise UsageError(f"{package} cannot be written: {reason(error)}. Choose another folder with --into.") from error
    return package


def _texts(kind: Kind, name: str) -> Mapping[str, str]:
    """The package's files by their paths."""
    function = name.replace("-", "_")
    module = f"zoobench_{function}"
    words = {
        "name": name,
        "noun": kind.noun,
        "kind": str(kind),
        "module": module,
        "function": function,
        "class_name": "".join(part.capitalize() for part in name.split("-")),
        "run": _RUNS[kind].format(name),
    }
    sources = {
        "pyproject.toml": "pyproject.toml",
        "README.md": "README.md",
        f"{module}.py": f"{kind.noun}.py",
        f"tests/test_{function}.py": f"{kind.noun}_test.py",
    }
    templates = files("zoobench.plugins") / "templates"
    return {
        path: Template((templates / f"{source}.txt").read_text(encoding="utf-8")).substitute(words)
        for path, source in sources.items()
    }
