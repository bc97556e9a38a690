"""Bars on a terminal, each with a name and a text; loaded only where there is a terminal."""

from rich.console import Console, Group
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.table import Table
from rich.text import Text

_BAR_WIDTH = 24
_ONE_LINE = 120  # columns that hold a run's name, its bar and its text


class BarBoard(Progress):
    """Bars that are never squeezed: on a narrow terminal the name stands above its bar instead of on its left.

    Every task has a field `standing`, the text of its bar, or an object that gives the text whenever the bar is drawn.
    """

    def __init__(self, console: Console) -> None:
        columns = (BarColumn(bar_width=_BAR_WIDTH), _Standing())
        if console.width >= _ONE_LINE:
            super().__init__(TextColumn("{task.description}", markup=False), *columns, console=console)
        else:
            super().__init__(_Stacked(*columns), console=console)


class _Standing(ProgressColumn):
    """The text of a bar."""

    def render(self, task: Task) -> Text:
        standing = task.fields["standing"]
        return Text(standing() if callable(standing) else standing, overflow="ellipsis", no_wrap=True)


class _Stacked(ProgressColumn):
    """A name, and below it other columns."""

    def __init__(self, *below: ProgressColumn) -> None:
        super().__init__()
        self._below = below

    def render(self, task: Task) -> Group:
        line = Table.grid(padding=(0, 1))
        line.add_row(*(column(task) for column in self._below))
        return Group(Text(task.description, overflow="ellipsis", no_wrap=True), line)
