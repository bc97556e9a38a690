"""`zoobench picture`: pictures of environments."""

from pathlib import Path
from typing import Annotated

from typer import Option

from zoobench.cli.options import EnvOption, OneControllerOption, OneDesignOption, OneFidelityOption
from zoobench.cli.output import say


def picture(
    env: EnvOption = "*",
    out: Annotated[Path, Option("--out", help="Folder of the PNG files.")] = Path("pictures"),
    design: OneDesignOption = "caterpillar",
    controller: OneControllerOption = "sine-basis",
    fidelity: OneFidelityOption = "draft",
    frames: Annotated[int, Option("--frames", min=0, help="Control frames simulated before the picture.")] = 0,
    seed: Annotated[int, Option("--seed", min=0, help="Seed of the controller's random parameters.")] = 0,
) -> None:
    """Draw environments with a robot in them.

    Each environment has a PNG file, which shows the robot at rest or after some frames with random controller
    parameters. With several environments, one more file shows all of them. Needs the extra `render`.
    """
    from zoobench.harness.grid import parse_one, parse_selector
    from zoobench.registry import Kind
    from zoobench.render.canvas import check_drawing
    from zoobench.render.recording import snapshots
    from zoobench.render.stills import draw_snapshots

    check_drawing()
    shots = []
    for shot in snapshots(
        parse_selector(env, Kind.ENV),
        design=parse_one(design, Kind.DESIGN),
        controller=parse_one(controller, Kind.CONTROLLER),
        fidelity=parse_one(fidelity, Kind.FIDELITY),
        frames=frames,
        seed=seed,
    ):
        say(f"{shot.env}: simulated")
        shots.append(shot)
    for path in draw_snapshots(shots, out):
        print(path)
