"""The command line as a whole: help, light imports, exit codes, documentation."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from tests.cli.conftest import Command
from zoobench import __version__
from zoobench.cli.main import app

PROCESS = [sys.executable, "-c", "import sys; from zoobench.cli.main import main; sys.exit(main())"]
GUIDE = Path(__file__).parents[2] / "docs" / "guide" / "commands.md"
COMMANDS = (
    "list", "show", "run", "work", "status", "cancel", "results", "table", "curves", "report", "render", "watch",
    "evaluate", "submit", "doctor", "new", "verify", "leaderboard", "design", "db",
)  # fmt: skip
HEAVY = {"alembic", "matplotlib", "numpy", "pandas", "pyvista", "scipy", "sqlalchemy", "taichi", "torch"}


def loaded_by(*words: str) -> set[str]:
    """The top-level modules that a command line loads, run in a fresh process."""
    script = (
        "import sys, json, contextlib, io\n"
        "from zoobench.cli.main import main\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    main(sys.argv[1:])\n"
        "print(json.dumps(sorted({name.partition('.')[0] for name in sys.modules})))\n"
    )
    done = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["verify", "bench", "--help"], ["--version"]])
def test_help_imports_nothing_heavy(words: list[str]) -> None:
    """Asking for help does not pay for simulation, databases or statistics."""
    assert not loaded_by(*words) & HEAVY


def test_run_itself_loads_no_simulator_and_no_statistics(tmp_path: Path) -> None:
    """Those are for the processes that do the runs, and for --tolerance."""
    words = ("run", "--env", "ground", "--task", "turning", "--method", "neat", "--db", str(tmp_path / "zoo.db"))
    loaded = loaded_by(*words)
    assert (tmp_path / "zoo.db").exists()
    assert not loaded & {"matplotlib", "pandas", "pyvista", "scipy", "taichi", "torch"}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("words", [["--version"], pytest.param(["list"], marks=pytest.mark.slow)])
def test_a_full_disk_is_told_in_one_line(words: list[str]) -> None:
    """Output that does not fit, however little, is an error with what to do, and no traceback."""
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(PROCESS + words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "Error: The output does not fit: the disk is full. Free some space, then try again."
    ]


@pytest.mark.slow
def test_a_reader_who_has_seen_enough_is_no_error_to_tell_of() -> None:
    """As `zoobench list | head -1` has it."""
    listing = subprocess.Popen([*PROCESS, "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert listing.stdout is not None
    listing.stdout.close()
    assert listing.communicate()[1] == ""


def test_an_interrupt_while_it_loads_is_an_interrupt() -> None:
    """Ctrl-C in the first moment leaves no traceback."""
    script = (
        "import sys\n"
        "class Interrupted:\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'zoobench.cli.main':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupted())\n"
        "from zoobench.__main__ import main\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_listing_components_does_not_start_the_simulator() -> None:
    """`list` loads the components but neither Taichi nor torch nor the database."""
    assert not loaded_by("list") & {"taichi", "torch", "sqlalchemy", "pandas"}


def test_the_commands_are_those_that_are_documented() -> None:
    """A command that is added must be added here and in the guide."""
    assert tuple(get_command(app).commands) == COMMANDS  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_and_is_in_the_guide(zoobench: Command, command: str) -> None:
    """`-h` works everywhere, says what the command is for, and the guide shows the command."""
    reply = zoobench(command, "-h")
    assert reply.code == 0
    assert f"Usage: zoobench {command}" in reply.out
    summary = reply.out.split("\n\n")[1].strip()
    assert len(summary) > 20
    assert f"zoobench {command}" in GUIDE.read_text(encoding="utf-8")


def test_summaries_are_shown_whole_in_the_overview(zoobench: Command) -> None:
    """No summary is so long that the overview cuts it off."""
    assert "..." not in zoobench("-h").out.replace("[ARGS]...", "")


def _options(command: Any, name: str = "zoobench") -> Iterator[tuple[str, str]]:
    """Name and help of every option and argument of a command and its subcommands."""
    yield from ((f"{name} {each.opts[0]}", each.help) for each in command.params)
    for word in getattr(command, "commands", ()):
        _, child, _ = command.resolve_command(None, [word])
        yield from _options(child, f"{name} {word}")


def test_every_option_is_explained_in_sentences() -> None:
    """Each help text is a whole sentence that names the thing, without pointing to the option before it."""
    texts = dict(_options(get_command(app)))
    assert len(texts) > 150
    pointing = re.compile(r"^(Of|What|How|Instead|Where [a-z]+s) |[Ll]ikewise|anew|if not given")
    assert not [name for name, text in texts.items() if not text or not text.endswith(".") or pointing.search(text)]


def test_version(zoobench: Command) -> None:
    """`--version` prints name and version on standard output."""
    assert zoobench("--version").out == f"zoobench {__version__}\n"


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["rn"], "Did you mean 'run'?"),
        (["results", "--formt", "csv"], "--format"),
        (["list", "enws"], "envs"),
        (["run", "--env", "desert"], "--task"),
        (["results", "--format", "xml"], "table"),
    ],
)
def test_a_mistyped_command_line_is_a_usage_error_with_a_hint(zoobench: Command, words: list[str], hint: str) -> None:
    """Exit code 2, and the message names what was probably meant; nothing goes to standard output."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert reply.out == ""
    assert hint in reply.err
    assert "Traceback" not in reply.err


def test_module_entry_point_returns_the_exit_code() -> None:
    """The console script ends the process with the code of the error."""
    script = "import sys; from zoobench.cli.main import main; sys.exit(main(['show', 'no-such-thing']))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("Error: ")


@pytest.mark.parametrize("words", [["results"], pytest.param(["list", "envs"], marks=pytest.mark.slow)])
def test_a_closed_standard_output_is_refused(words: list[str], tmp_path: Path) -> None:
    """In words; whatever is opened instead of it is not printed into."""
    done = subprocess.run(
        ["sh", "-c", 'exec "$@" >&-', "sh", *PROCESS, *words], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert (done.returncode, done.stderr[:35]) == (2, "Error: Standard output is closed. L")


@pytest.mark.slow
def test_without_standard_error_data_stay_data(tmp_path: Path) -> None:
    """A message that nobody can hear is not printed among them."""
    command = ["sh", "-c", 'exec "$@" 2>&- <&-', "sh", *PROCESS, "results"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
