"""Lists as they are typed, with commas."""

from zoobench.errors import UsageError


def parse_names(text: str) -> list[str]:
    """Read `ice, desert` as names or globs."""
    return [name.strip() for name in text.split(",")]


def parse_counts(text: str, what: str) -> list[int]:
    """Read `1000,10000` as whole numbers; `what` they count is said in the message.

    Raises:
        UsageError: something else.
    """
    try:
        return [int(word) for word in text.split(",")]
    except ValueError:
        raise UsageError(f"Cannot read {text!r} as {what}. Write for example 1000,10000.") from None
