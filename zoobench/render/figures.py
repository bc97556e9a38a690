"""Figures without a screen: an empty one to draw on, and its way into a file. matplotlib is an extra."""

from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.errors import UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def blank(size: tuple[float, float], *, dpi: int = 110, constrained: bool = True, colour: str = "white") -> "Figure":
    """An empty figure of this size [inches]; `constrained` leaves the arrangement of its axes to matplotlib.

    Raises:
        UsageError: matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise UsageError(
            "Pictures need matplotlib, which is not installed. Run: pip install 'zoobench[plots]'"
        ) from None
    figure = Figure(figsize=size, dpi=dpi, layout="constrained" if constrained else None, facecolor=colour)
    FigureCanvasAgg(figure)
    return figure


def save(figure: "Figure", path: Path) -> None:
    """Write a figure in the format that the path's ending names; folders on the way are made.

    Raises:
        UsageError: the file cannot be written, or it has no ending, or one that stands for no picture.
    """
    if not path.suffix:  # matplotlib would add one, and write to another file than the one that was named
        raise UsageError(f"{str(path)!r} has no ending that says which kind of picture. Give for example picture.png.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)
    except (OSError, ValueError) as error:  # ValueError: an ending that stands for no picture
        raise UsageError(
            f"No picture can be written to {str(path)!r}: {error}. Give another place, as {path.stem}.png in a folder "
            "that you may write to."
        ) from error
