"""Typer as zoobench uses it.

An option that is given twice is refused, where Typer takes the last in silence, and values that do not fit are told of
in the words of zoobench.
"""

from collections import Counter
from collections.abc import Callable
from typing import Any

from typer import BadParameter, Context, Typer
from typer.core import TyperCommand, TyperOption

from zoobench.errors import UsageError


class _Command(TyperCommand):
    """A command whose options are given at most once."""

    def parse_args(self, ctx: Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Parse the command line.

        Raises:
            UsageError: an option that takes one value has several.
        """
        if not ctx.resilient_parsing:  # completion reads lines that are not finished
            _, _, given = self.make_parser(ctx).parse_args(args=list(args))
            _refuse_repeats([option for option in given if isinstance(option, TyperOption)])
        try:
            return super().parse_args(ctx, args)
        except BadParameter as error:
            error.message = _in_plain_words(error)
            raise


def _in_plain_words(error: BadParameter) -> str:
    """The message for a value that does not fit; that of the validation library names the library's own types."""
    details = getattr(error.__cause__, "errors", None)
    if details is None:
        return error.message
    first = details()[0]
    kind, given, limits = first["type"], first.get("input"), first.get("ctx", {})
    if kind.startswith("int_"):
        return f"{given!r} is not a whole number."
    if kind.startswith("float_") or str(given).strip().lower() == "nan":
        return f"{given!r} is not a number."
    if kind == "greater_than_equal":
        return f"{given} is too small. Give at least {limits['ge']:g}."
    if kind == "less_than_equal":
        return f"{given} is too large. Give at most {limits['le']:g}."
    return str(limits.get("error", error.message))


def _refuse_repeats(given: list[TyperOption]) -> None:
    """Refuse options with two values, of which one would be lost."""
    for option, times in Counter(given).items():
        if times > 1 and not (option.multiple or option.is_flag or option.count):
            name = option.opts[0]
            raise UsageError(
                f"{name} is given {times} times, and only the last would count. Give it once; "
                f"where it takes several values, separate them by commas: {name} a,b."
            )


class App(Typer):
    """A group of commands whose options are given at most once."""

    def command(self, name: str | None = None, **settings: Any) -> Callable[[Any], Any]:
        """A decorator that registers a function as the command of that name."""
        return super().command(name, cls=_Command, **settings)
