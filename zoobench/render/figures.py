"""Figures of matplotlib, drawn without a screen: an empty figure, and its file."""

from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.errors import UsageError, extra

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def blank(size: tuple[float, float], *, dpi: int = 110) -> "Figure":
    """An empty figure of this size [inches], whose axes matplotlib arranges.

    Raises:
        UsageError: matplotlib is not installed.
    """
    with extra("plots", "Figures need"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    figure = Figure(figsize=size, dpi=dpi, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: "Figure", path: Path) -> None:
    """Write a figure in the format that the path's ending names; folders on the way are made.

    Raises:
        UsageError: the file cannot be written, or its ending names no format of pictures.
    """
    from matplotlib import rc_context

    if not path.suffix:  # matplotlib would add one and write to another file
        raise UsageError(f"{str(path)!r} has no ending that names a format. Give for example picture.png.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with rc_context({"pdf.fonttype": 42, "ps.fonttype": 42}):  # publishers refuse fonts of Type 3
            figure.savefig(path)
    except (OSError, ValueError) as error:  # ValueError: an unknown format
        raise UsageError(
            f"No picture can be written to {str(path)!r}: {error}. Give another file, as {path.stem}.png in a folder "
            "that you may write to."
        ) from error
