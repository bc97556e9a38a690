"""Fixtures of the tests of the simulator."""

import pytest

from zoobench.sim.kernels import serial, survey


@pytest.fixture
def nothing_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """The substep, its reverse and the survey are compiled anew, whatever was compiled before.

    That is there again afterwards, so that it costs less than to stop the runtime, which must go on in the test.
    """
    for kernel in (serial.advance, serial.reverse, survey.survey):
        monkeypatch.setattr(kernel._primal, "compiled_kernels", {})
