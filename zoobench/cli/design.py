"""`zoobench design`: what is done with bodies alone."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, Typer

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption
from zoobench.cli.output import say
from zoobench.cli.solutions import body_of_run, names_run
from zoobench.spec import Ref

design = Typer(no_args_is_help=True, help="What is done with bodies alone.")


@design.callback()
def _group() -> None:
    """What is done with bodies alone."""


@design.command("export")
def export(
    name: Annotated[str, Argument(help="A design, as in panda or 'mesh[path=body.stl]', or a run that is done.")],
    out: Annotated[Path, Option("--out", "-o", help="The file: .stl is a surface, .ply, .pcd and .npz are particles.")],
    fidelity: Annotated[
        str | None, Option("--fidelity", help="How finely.", show_default="fine, or a run's own")
    ] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write a body to a file for other tools: a design's, or that which a run has found.

    In metres, x ahead and y up. A surface (.stl) encloses the body's volume and needs the extra `meshes`; particles
    (.ply, .pcd, .npz) come with their muscles, fibres, stiffness and density. Of a design space without a run it is the
    workspace.
    """
    from zoobench.harness.grid import parse_one
    from zoobench.registry import Kind
    from zoobench.studies.bodies import body_at, export_body

    grid_ref = None if fidelity is None else parse_one(fidelity, Kind.FIDELITY)
    if names_run(name, db):
        sampled, _ = body_of_run(name, db, grid_ref)
    else:
        sampled = body_at(parse_one(name, Kind.DESIGN), grid_ref or Ref("fine"))
    export_body(sampled, out)
    say(f"{sampled.body.particle_count:,} particles")
    print(out)
