"""The script of the charts."""

import subprocess
from pathlib import Path
from typing import Any

import pytest

from zoobench.errors import ZoobenchError
from zoobench.report.page import vega


@pytest.mark.slow
def test_it_is_taken_out_once_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The next report begins no process for it; a place that cannot be written does no harm."""
    monkeypatch.setenv("ZOOBENCH_CACHE", str(tmp_path / "cache"))
    first = vega.bundle()
    assert "vegaEmbed" in first
    real = subprocess.run
    monkeypatch.setattr(subprocess, "run", None)
    assert vega.bundle() == first
    monkeypatch.setattr(subprocess, "run", real)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ZOOBENCH_CACHE", str(tmp_path / "file"))
    assert vega.bundle() == first


def test_a_library_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its last line."""
    monkeypatch.setenv("ZOOBENCH_CACHE", str(tmp_path))

    def fails(*_: Any, **__: Any) -> subprocess.CompletedProcess[bytes]:
        return subprocess.CompletedProcess((), 1, b"", b"Traceback\nno such thing\n")

    monkeypatch.setattr(subprocess, "run", fails)
    with pytest.raises(ZoobenchError, match="no such thing"):
        vega.bundle()
