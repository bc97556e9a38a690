"""`zoobench design`: files and pictures of bodies."""

from functools import partial
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from zoobench.cli.app import App
from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    EnvOption,
    OneControllerOption,
    OneDesignOption,
    OneFidelityOption,
)
from zoobench.cli.output import say
from zoobench.cli.solutions import archive_of, body_of_run, names_run
from zoobench.errors import SceneError, UsageError
from zoobench.spec import Ref

design = App(no_args_is_help=True, help="Export and draw bodies.")


@design.callback()
def _group() -> None:
    """Export and draw bodies."""


@design.command("export")
def export(
    name: Annotated[str, Argument(help="A design, as in panda or 'mesh[path=body.stl]', or a finished run.")],
    out: Annotated[
        Path, Option("--out", "-o", help="Output file: .stl for a surface; .ply, .pcd or .npz for particles.")
    ],
    fidelity: Annotated[
        str | None,
        Option("--fidelity", help="Fidelity that sets the particle spacing.", show_default="fine, or a run's own"),
    ] = None,
    elite: Annotated[
        int | None, Option("--elite", min=1, help="Rank of a body in the run's archive; 1 is the best.")
    ] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Export the body of a design or of a run's solution.

    Coordinates are in metres, with x forward and y up. A surface (.stl) encloses the body's volume and needs the extra
    `meshes`. Particles (.ply, .pcd, .npz) have their muscles, fibre directions, stiffness and density. For a design
    space, the whole workspace is exported.
    """
    from zoobench.harness.grid import parse_one
    from zoobench.registry import Kind
    from zoobench.render.bodies import body_at, export_body

    grid_ref = None if fidelity is None else parse_one(fidelity, Kind.FIDELITY)
    if names_run(name, db):
        sampled, _ = body_of_run(name, db, grid_ref, elite=elite)
    elif elite is not None:
        raise UsageError(f"--elite needs a run, and {name!r} is a design. Give a run's number.")
    else:
        sampled = body_at(parse_one(name, Kind.DESIGN), grid_ref or Ref("fine"))
    for note in sampled.body.notes:
        say(note)
    export_body(sampled, out)
    say(f"{sampled.body.particle_count:,} particles")
    print(out)


@design.command("archive")
def archive(
    name: Annotated[str, Argument(help="A finished run of the method quality-diversity.")],
    out: Annotated[Path, Option("--out", "-o", help="Output file: .csv, .png or .npz.")],
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Export the archive of a quality-diversity run.

    The archive has the best body for each size and shape. A .csv file has rank, score, volume (as a fraction of the
    workspace) and elongation of each body. A .png file is a map of the archive and needs the extra `plots`. A .npz file
    has the parameters, too. `design export --elite` exports one body.
    """
    from zoobench.db.store import Store
    from zoobench.render.elites import write

    with Store(db, create=False) as store:
        run = store.run(name)
        found = archive_of(store, run)
        unit = next((final.unit for final in store.finals(run.id) if final.name == "score"), "")
    spec = run.spec
    title = f"run {run.id}: {spec.env.name} x {spec.task.name} x {spec.design.name}"
    write(found, out, title=title, unit=unit)
    say(f"{len(found.scores):,} elites in {found.cells ** len(found.names):,} cells")
    print(out)


@design.command("picture")
def picture(
    env: EnvOption = "*",
    out: Annotated[Path, Option("--out", help="Folder of the PNG files.")] = Path("pictures"),
    design: OneDesignOption = "caterpillar",
    controller: OneControllerOption = "sine-basis",
    fidelity: OneFidelityOption = "draft",
    frames: Annotated[int, Option("--frames", min=0, help="Control frames simulated before the picture.")] = 0,
    seed: Annotated[int, Option("--seed", min=0, help="Seed of the controller's random parameters.")] = 0,
) -> None:
    """Draw a design in its environments.

    Each environment has a PNG file, which shows the robot at rest or after some frames with random controller
    parameters. With several environments, one more file shows all of them. Needs the extra `render`.
    """
    from zoobench.harness.grid import parse_one, parse_selector
    from zoobench.registry import Kind
    from zoobench.render.canvas import check_drawing
    from zoobench.render.recording import Snapshot, snapshots
    from zoobench.render.stills import draw_snapshots

    check_drawing()
    envs, shots = parse_selector(env, Kind.ENV), list[Snapshot]()
    draw = partial(
        snapshots,
        design=parse_one(design, Kind.DESIGN),
        controller=parse_one(controller, Kind.CONTROLLER),
        fidelity=parse_one(fidelity, Kind.FIDELITY),
        frames=frames,
        seed=seed,
    )
    for name in envs:
        try:
            shots += draw([name])
        except SceneError as error:
            if name == envs[-1] and not shots:
                raise
            say(f"{name}: left out. {error}")
        else:
            say(f"{shots[-1].env}: simulated")
    for path in draw_snapshots(shots, out):
        print(path)
