"""Text that others wrote, such as names, reasons and log lines, where some signs do more than stand there."""

import html
import re

# all but tab and newline of the control characters; those that turn the direction of writing; halves of pairs
_UNSEEN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_FORMULA = re.compile(r"\s*[=+\-@].")


def visible(text: str) -> str:
    r"""For a terminal: escape sequences and the like as `\x1b`, so that they are seen and do nothing."""
    return _UNSEEN.sub(lambda found: ascii(found[0])[1:-1], text)


def in_json(text: str) -> str:
    """The same for a text in JSON, whose meaning does not change."""
    return _UNSEEN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def in_csv(text: str) -> str:
    """For a spreadsheet: a text that it would take for a formula stands behind an apostrophe; numbers stay numbers."""
    text = visible(text)
    return f"'{text}" if _FORMULA.match(text) and not _is_number(text) else text


def in_markdown(text: str) -> str:
    """For Markdown: no HTML and no link."""
    return html.escape(visible(text), quote=False).replace("](", "]\\(")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
