"""The top level of the command line: its commands, and the group that another distribution adds."""

from importlib.metadata import entry_points
from typing import Any

from typer.core import TyperGroup
from typer.main import get_command

from zoobench.errors import UsageError

GROUP = "zoobench.commands"
"""Entry points of distributions that add a group of commands, each a Typer application by the name of the group."""

_INSTALLABLE = ("verify",)
_ADVICE = "Install it: pip install 'zoobench[verify]', or in a checkout: pip install ./verify"

_FORMER = {
    **{name: f"verify {name}" for name in ("accuracy", "bench", "effects", "gradcheck", "stability", "validate")},
    **{name: f"db {name}" for name in ("export", "merge", "remove")},
    "logs": "show RUN --log",
    "picture": "design picture",
    "plan": "run --dry-run",
}
"""The present names of former commands."""

ANY_ARGUMENTS = {"ignore_unknown_options": True, "allow_extra_args": True}
"""Settings by which the stand-in for a group that is not installed accepts any arguments."""


class TopLevel(TyperGroup):
    """All commands. A group of another distribution is loaded when it is called, so that help stays fast."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """The command that the first argument names, and its arguments.

        Raises:
            UsageError: it has another name today, or cannot be loaded.
        """
        if args[0] in _FORMER and not ctx.resilient_parsing:
            raise UsageError(f"`zoobench {args[0]}` has a new name: zoobench {_FORMER[args[0]]}")
        name, command, rest = super().resolve_command(ctx, args)
        for point in entry_points(group=GROUP, name=name) if name in _INSTALLABLE else ():
            try:
                return name, get_command(point.load()), rest
            except ImportError as error:
                raise UsageError(f"The package of `zoobench {name}` cannot be loaded: {error}. {_ADVICE}") from error
        return name, command, rest


def verify() -> None:
    """Verify the simulator (package zoobench-verify)."""
    raise UsageError(f"`zoobench verify` needs the package zoobench-verify, which is not installed. {_ADVICE}")
