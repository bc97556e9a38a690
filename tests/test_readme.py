"""The README does not promise what is not so."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from zoobench.cli.main import main

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
CI = (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The code blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)


def test_two_commands_come_first_and_the_checks_use_the_same() -> None:
    """The first installs and runs, the second installs and tests; `.ci/run` installs and tests in the same words."""
    run, test = blocks("sh")[:2]
    assert run.strip().endswith("zoobench run --env desert --task turning")
    lines = CI.splitlines()
    for command in test.strip().split(" && ")[2:]:
        assert command in lines


def test_every_example_is_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each `zoobench run` of the examples is a command line that `plan` accepts."""
    monkeypatch.chdir(ROOT)
    examples = re.findall(r"^zoobench run (.*?)(?:\s+#.*)?$", blocks("sh")[2], flags=re.MULTILINE)
    assert len(examples) >= 5
    for example in examples:
        options = shlex.split(example.replace("--retry failed", ""))
        with pytest.raises(SystemExit) as stop:
            main(["plan", *options, "--db", "none.db"])
        assert stop.value.code == 0, example


def test_the_example_component_works() -> None:
    """The file that the README shows registers an environment that can be created with its parameter."""
    (source,) = (block for block in blocks("python") if "@register" in block)
    script = (
        f"{source}\n"
        "from zoobench import registry\n"
        "from zoobench.spec import Ref\n"
        "print(registry.create(Kind.ENV, Ref.parse('wet-rock[friction=0.1]')).friction)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout == "0.1\n", done.stderr
