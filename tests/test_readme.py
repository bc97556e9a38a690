"""The README and the guide do not promise what is not so."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from zoobench.cli.main import main

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "docs" / "guide"
CI = (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def blocks(page: Path, language: str) -> list[str]:
    """The code blocks of one language in a page."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def test_two_commands_come_first_and_the_checks_use_the_same() -> None:
    """The first installs and runs, the second installs and tests; `.ci/run` installs and tests in the same words."""
    run, test = blocks(ROOT / "README.md", "sh")[:2]
    assert run.strip().endswith("zoobench run --env desert --task turning")
    lines = CI.splitlines()
    for command in test.strip().split(" && ")[2:]:
        assert command in lines


def test_every_example_is_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each `zoobench run` of the examples is a command line that is accepted."""
    monkeypatch.chdir(ROOT)
    printed = "".join(blocks(GUIDE / "runs.md", "sh"))
    examples = re.findall(r"^zoobench run (.*?)(?:\s+#.*)?$", printed, flags=re.MULTILINE)
    assert len(examples) >= 15
    for example in examples:
        options = shlex.split(example.replace("--retry failed", ""))
        with pytest.raises(SystemExit) as stop:
            main(["run", "--dry-run", *options, "--db", "none.db"])
        assert stop.value.code == 0, example


def _run(script: str) -> str:
    """What a program prints; it ends well."""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    "checked",
    [
        pytest.param("", id="documented"),
        pytest.param(
            "check_cell(small_cell(task='spin-box', fidelity=DOUBLE), lambda rewards: float(rewards[-1]))",
            id="checked",
        ),
    ],
)
def test_the_example_task_works(checked: str) -> None:
    """It is documented, and owes what every task does."""
    _, task = blocks(GUIDE / "adding.md", "python")
    _run(
        f"{task}\n"
        "from zoobench.testing import DOUBLE, check_cell, check_documentation, small_cell\n"
        "check_documentation(Kind.TASK, 'spin-box')\n"
        f"{checked}\n"
    )


def test_the_example_environment_works() -> None:
    """The file that the guide shows registers one that can be created with its parameter."""
    source, _ = blocks(GUIDE / "adding.md", "python")
    script = (
        f"{source}\n"
        "from zoobench import registry\n"
        "from zoobench.spec import Ref\n"
        "print(registry.create(Kind.ENV, Ref.parse('wet-rock[friction=0.1]')).friction)\n"
    )
    assert _run(script) == "0.1\n"


def test_the_readme_is_short_and_its_links_lead_somewhere() -> None:
    """Fewer than 150 lines, and every file that it names is there."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 150
    links = re.findall(r"\]\(([^)#]+)\)", text)
    assert len(links) > 10
    assert not [link for link in links if "://" not in link and not (ROOT / link).exists()]
