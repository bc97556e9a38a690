"""Equal rounding of libraries on different processors."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from zoobench.rounding import CHOICES, unify


@pytest.fixture(autouse=True)
def _nothing_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Restore the variables after the test: without AVX2 later tests would crash."""
    for name in CHOICES:
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)


@pytest.mark.parametrize(
    ("flags", "chosen"),
    [("fpu sse2 avx avx2 fma bmi2 avx512f", True), ("fpu sse2 avx", False), ("", False)],
)
def test_only_what_the_processor_can_do_is_asked_for(tmp_path: Path, flags: str, chosen: bool) -> None:
    """AVX2 code needs AVX2; on unknown processors nothing is set."""
    (tmp_path / "cpuinfo").write_text(f"processor\t: 0\nvendor_id\t: any\nflags\t\t: {flags}\n\nflags\t: fpu\n")
    unify(tmp_path / "cpuinfo")
    assert {name: os.environ.get(name) for name in CHOICES} == {
        name: value if chosen else None for name, value in CHOICES.items()
    }
    unify(tmp_path / "missing")


def test_what_the_user_has_set_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A variable of the user is kept, the others are set."""
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Zen")
    (tmp_path / "cpuinfo").write_text("flags: avx2 fma\n")
    unify(tmp_path / "cpuinfo")
    assert (os.environ["OPENBLAS_CORETYPE"], os.environ["ATEN_CPU_CAPABILITY"]) == ("Zen", "avx2")


def test_the_libraries_heed_it() -> None:
    """In a process that imports zoobench first torch reports the code that it uses; its children are told the same."""
    look = "import torch; print(torch.backends.cpu.get_cpu_capability(), flush=True)"
    told = "import os; print(os.environ['ATEN_CPU_CAPABILITY'])"
    child = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {told!r}], check=True)"
    flags = Path("/proc/cpuinfo")
    if not flags.exists() or " avx2 " not in flags.read_text(encoding="utf-8"):
        pytest.skip("this processor has no AVX2, or does not say so")
    script = f"import zoobench; {look}; {child}"
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["AVX2", "avx2"]
