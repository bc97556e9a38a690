"""`zoobench new`: a package of your own that adds a component."""

from pathlib import Path
from shlex import quote
from typing import Annotated

from typer import Argument, Option

from zoobench.cli import completion
from zoobench.cli.kinds import KindName, kind_named
from zoobench.cli.output import say

_OFFERED = (KindName.ENVS, KindName.TASKS, KindName.DESIGNS, KindName.CONTROLLERS, KindName.METHODS)


def _kinds(incomplete: str) -> list[str]:
    return completion.starting((kind.singular for kind in _OFFERED), incomplete)


def new(
    kind: Annotated[
        str,
        Argument(
            metavar="KIND",
            help=f"Kind of the component: {', '.join(kind.singular for kind in _OFFERED)}.",
            autocompletion=_kinds,
        ),
    ],
    name: Annotated[str, Argument(help="Name of the component in kebab-case, as in wet-rock.")],
    into: Annotated[Path, Option("--into", help="Parent folder of the package.")] = Path(),
) -> None:
    """Create a package with a new component.

    The package works as it is. Its entry point lets zoobench find the component once the package is installed. Its
    tests, from `zoobench.testing`, check the requirements of every component.
    """
    wanted = kind_named(kind, _OFFERED)
    from zoobench.plugins.package import write_package
    from zoobench.registry import Kind

    package = write_package(Kind(wanted), name, into)
    say(f"Next: cd {quote(str(package))} && pip install -e '.[test]' && python -m pytest")
    print(package)
