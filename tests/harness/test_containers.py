"""Launchers in containers: PID namespaces of their own under one host name."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.harness.helpers import enqueue, fake
from zoobench.db.rows import RunState
from zoobench.db.store import Store

_CONTAINER = ("unshare", "--user", "--map-root-user", "--pid", "--fork", "--kill-child", "--mount-proc")
_LAUNCH = "import sys; from tests.harness.helpers import *; run_all(sys.argv[1], range(1, 5), child=sys.argv[2:])"


def _may_contain() -> bool:
    if shutil.which("unshare") is None:
        return False
    return subprocess.run([*_CONTAINER, "true"], capture_output=True, check=False).returncode == 0


@pytest.mark.slow  # tests/db/test_owner.py tells the processes of one namespace from those of another
@pytest.mark.skipif(not _may_contain(), reason="no PID namespaces can be made here")
def test_launchers_in_two_containers_do_every_run_once(tmp_path: Path) -> None:
    """Each sees processes of other numbers than the other, and takes none of its runs for lost."""
    path = tmp_path / "zoo.db"
    ids = enqueue(path, 4)
    command = [*_CONTAINER, sys.executable, "-c", _LAUNCH, str(path), *fake(iterations=60, pause=0.02)]
    launchers = [subprocess.Popen(command) for _ in range(2)]
    assert [launcher.wait(120.0) for launcher in launchers] == [0, 0]
    with Store(path) as store:
        assert [row.state for row in store.runs(ids=ids)] == [RunState.DONE] * 4
        assert [len(store.attempts(run_id)) for run_id in ids] == [1] * 4
