"""`zoobench render`: a film of a run's best episode."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

from typer import Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, DoneRunArgument
from zoobench.cli.output import console, say
from zoobench.cli.solutions import NamedSolution, solution_named
from zoobench.db.rows import MilestoneRow
from zoobench.errors import UsageError
from zoobench.registry import Kind, short
from zoobench.render.formats import Destination, FilmFormat
from zoobench.spec import repeat_command

ShowProgress = Callable[[str, int, int], None]
"""Shows progress: the name of the work, the steps that are done, and all steps."""


class Strip(StrEnum):
    """Pictures of several bodies side by side."""

    ITERATIONS = "iterations"
    GAIT = "gait"


def render(
    run: DoneRunArgument,
    out: Annotated[Path, Option("--out", "-o", help="Output file: .mp4, .gif, .png (six stills), .npz or .pvd.")],
    form: Annotated[
        FilmFormat | None, Option("--format", help="File format, for a file name without an ending.")
    ] = None,
    every: Annotated[int, Option("--every", min=1, help="Keep every n-th control frame.")] = 1,
    rate: Annotated[float, Option("--fps", min=1.0, max=120.0, help="Frames per second of the film.")] = 25.0,
    width: Annotated[
        int | None,
        Option("--width", min=320, max=7680, help="Width in pixels.", show_default="by format"),
    ] = None,
    strip: Annotated[
        Strip | None,
        Option(
            "--strip", help="Draw a .png instead of a film: the body over the iterations, or one period of the gait."
        ),
    ] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Film the best episode of a run.

    The episode is simulated again. The film shows the robot with its muscle activation in colour, the medium, the
    ground with a ruler, and the target's path. A .png file has six stills. For other tools, a .npz file has the frames
    as arrays, and a .pvd file (--format vtk) is an index of VTK files. A control frame is 8 ms. All formats but .npz
    need the extra `render`; no screen is needed.

    `--strip iterations` draws the best bodies after 1, 2, 4 and so on iterations, coloured by muscle and by stiffness.
    `--strip gait` draws the body and the muscle activation over the last period.
    """
    from zoobench.render.film import film
    from zoobench.render.film_files import check_tools, moments_of, write
    from zoobench.render.formats import destination

    target = destination(out, form)
    if strip is not None:
        _draw_strip(run, strip, target, db)
        print(target.path)
        return
    check_tools(target.form)
    found = solution_named(run, db)
    spec = found.spec
    moments = moments_of(target.form, spec.frames, every)
    with _progress() as step:
        step("simulating", 0, spec.frames)
        episode = film(spec, found.params, moments=moments, progress=lambda done: step("simulating", done, spec.frames))
        if episode.evaluation.score != found.score:
            say(
                f"This simulation gives {found.text(episode.evaluation.score, 6)}, and {found.text(found.score, 6)} is "
                "stored: the run was done with other code or on another processor."
            )
        title = f"{found.name}: {spec}, {short(Kind.FIDELITY, spec.fidelity)}, {found.text(found.score)}"
        write(
            episode,
            target,
            title=title,
            width=width,
            rate=rate,
            progress=lambda done: step("writing", done, len(moments)),
        )
    print(target.path)


def _draw_strip(text: str, strip: Strip, target: Destination, db: str) -> None:
    """Draw a run's bodies over its iterations, or its gait.

    Raises:
        UsageError: the file is no .png, or the run has no solution, or the wanted data was not kept.
    """
    from zoobench.render.canvas import check_drawing

    if target.form is not FilmFormat.PNG:
        raise UsageError(f"A strip is a picture, and {target.path.name} is none. Let it end in .png.")
    check_drawing()
    found = solution_named(text, db)
    if strip is Strip.GAIT:
        from zoobench.render.film import film
        from zoobench.render.gait import draw_gait

        with _progress() as step:
            frames = found.spec.frames
            episode = film(found.spec, found.params, progress=lambda done: step("simulating", done, frames))
        title = f"{found.name}: {found.spec}, {found.text(found.score)}"
        draw_gait(episode, target.path, title=title)
    else:
        _draw_stages(found, target, db)


def _draw_stages(found: NamedSolution, target: Destination, db: str) -> None:
    """Draw the bodies of a run over its iterations.

    Raises:
        UsageError: they were not kept.
    """
    from zoobench.db.store import Store
    from zoobench.render.canvas import save
    from zoobench.render.stages import stages_image, stages_of

    if found.run is None:
        raise UsageError(f"Only the best body of {found.name} is published. Run it: {repeat_command(found.spec)}")
    with Store(db, create=False) as store:
        milestones = store.milestones(found.run.id)
        iterations = next(final.value for final in store.finals(found.run.id) if final.name == "iterations")
    short = f"{found.name}: {found.spec.env.name} x {found.spec.task.name}"  # there is little room
    last = MilestoneRow(int(iterations), found.score, found.params)
    save(stages_image(stages_of(found.spec, [*milestones, last], found.text), short), target.path, colours=256)


@contextmanager
def _progress() -> Iterator[ShowProgress]:
    """Progress on standard error: a bar for each work on a terminal, a line elsewhere."""
    if not console(stderr=True).is_terminal:
        yield _Lines()
        return
    from rich.progress import Progress, TaskID

    bars: dict[str, TaskID] = {}
    with Progress(console=console(stderr=True)) as progress:

        def step(name: str, done: int, total: int) -> None:
            if name not in bars:
                bars[name] = progress.add_task(name, total=total)
            progress.update(bars[name], completed=done)

        yield step


class _Lines:
    """Prints the name of each work once."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def __call__(self, name: str, done: int, total: int) -> None:
        if name not in self._told:
            self._told.add(name)
            say(f"{name} {total} frames")
