"""`zoobench verify`: the group of commands that this distribution adds to the command line."""

from zoobench.cli.app import App
from zoobench_verify.cli.accuracy import accuracy
from zoobench_verify.cli.bench import bench
from zoobench_verify.cli.effects import effects
from zoobench_verify.cli.gradcheck import gradcheck
from zoobench_verify.cli.stability import stability
from zoobench_verify.cli.validate import validate

verify = App(no_args_is_help=True, add_completion=False, rich_markup_mode=None)


@verify.callback()
def _group() -> None:
    """Verify the simulator (package zoobench-verify)."""


verify.command("validate")(validate)
verify.command("stability")(stability)
verify.command("gradcheck")(gradcheck)
verify.add_typer(accuracy, name="accuracy")
verify.command("effects")(effects)
verify.command("bench")(bench)
