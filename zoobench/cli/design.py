"""`zoobench design`: what is done with bodies alone."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option, Typer

from zoobench.cli.options import OneFidelityOption
from zoobench.cli.output import say

design = Typer(no_args_is_help=True, help="What is done with bodies alone.")


@design.callback()
def _group() -> None:
    """What is done with bodies alone."""


@design.command("export")
def export(
    name: Annotated[str, Argument(help="A design, as in panda or 'mesh[path=body.stl]'.")],
    out: Annotated[Path, Option("--out", "-o", help="The file: .stl is a surface, .ply and .npz are particles.")],
    fidelity: OneFidelityOption = "fine",
) -> None:
    """Write a body to a file for other tools.

    In metres, x ahead and y up. A surface (.stl) encloses the body's volume and needs the extra `meshes`; particles
    (.ply, .npz) come with their muscles, fibres, stiffness and density.
    """
    from zoobench.harness.grid import parse_one
    from zoobench.registry import Kind
    from zoobench.studies.bodies import export_body

    count = export_body(parse_one(name, Kind.DESIGN), parse_one(fidelity, Kind.FIDELITY), out)
    say(f"{count:,} particles")
    print(out)
