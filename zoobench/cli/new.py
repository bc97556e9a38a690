"""`zoobench new`: a package of your own that adds a component."""

from enum import StrEnum
from pathlib import Path
from shlex import quote
from typing import Annotated

from typer import Argument, Option

from zoobench.cli.output import say


class NewKind(StrEnum):
    """The kinds of components that can be begun."""

    ENVIRONMENT = "environment"
    TASK = "task"
    DESIGN = "design"
    METHOD = "method"


def new(
    kind: Annotated[NewKind, Argument(help="What the package adds.")],
    name: Annotated[str, Argument(help="Name of the component, in kebab-case: wet-rock.")],
    into: Annotated[Path, Option("--into", help="The folder in which the package's folder is made.")] = Path(),
) -> None:
    """Begin a package of your own with a component.

    It holds an environment, a task, a design or a method and works as it is: with an entry point, by which zoobench
    finds it once it is installed, and tests from `zoobench.testing`, which check what every component owes.
    """
    from zoobench.plugins.package import OFFERED, write_package

    (wanted,) = (each for each in OFFERED if each.noun == kind)
    package = write_package(wanted, name, into)
    say(f"Next: cd {quote(str(package))} && pip install -e '.[test]' && python -m pytest")
    print(package)
