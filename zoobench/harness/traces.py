"""What a run may leave behind in the process that has done it, as far as that can be told."""

import os
import random
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil


class Surroundings:
    """What this process has beside its modules, as it was when this was made.

    Kernels, bodies and whatever else is made once are not of one run: they depend on what was asked for alone.
    """

    def __init__(self) -> None:
        self._environment = dict(os.environ)
        self._random = random.getstate()
        self._of_numpy = np.random.get_state()
        self._of_torch = torch.get_rng_state() if (torch := sys.modules.get("torch")) else None
        self._others = _others()

    def are_back(self) -> bool:
        """Put back what libraries change when they are loaded or used; whether all else is as it was.

        That is the environment and the random numbers of the whole process.
        """
        if os.environ != self._environment:
            os.environ.clear()
            os.environ.update(self._environment)
        random.setstate(self._random)
        np.random.set_state(self._of_numpy)
        if self._of_torch is not None:
            sys.modules["torch"].set_rng_state(self._of_torch)
        return _others() == self._others


def _others() -> dict[str, Any]:
    """What a run has no reason to change."""
    return {
        "folder": _folder(),
        "search path": list(sys.path),
        "descriptors": [_file(descriptor) for descriptor in range(3)],
        "streams": [(stream, stream is None or stream.closed) for stream in (sys.stdin, sys.stdout, sys.stderr)],
        "threads": set(sys._current_frames()),
        "processes": [child.pid for child in psutil.Process().children()],
        "signals": {number: signal.getsignal(number) for number in signal.valid_signals()},
        "denormals": sys.float_info.min / 2.0,  # 0 where a library has set the processor so
        "errors": np.geterr(),
        "torch": _settings_of_torch(),
    }


def _folder() -> Path | None:
    with suppress(OSError):  # it may have been removed
        return Path.cwd()
    return None


def _file(descriptor: int) -> tuple[int, int] | None:
    """What a descriptor is of; None if it is closed."""
    with suppress(OSError):
        found = os.fstat(descriptor)
        return found.st_dev, found.st_ino
    return None


def _settings_of_torch() -> tuple[Any, ...]:
    """Those by which it computes; empty if it is not loaded."""
    if (torch := sys.modules.get("torch")) is None:
        return ()
    settings = torch.get_default_dtype(), torch.get_num_threads(), torch.is_grad_enabled()
    return *settings, torch.are_deterministic_algorithms_enabled()
