"""Fixtures of the tests of the simulator."""

import pytest

from zoobench.sim.kernels import serial, survey
from zoobench.sim.kernels.water_grid import immersed


@pytest.fixture
def nothing_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """The substep, its reverse and the survey are compiled anew, whatever was compiled before.

    That is there again afterwards, so that it costs less than to stop the runtime, which must go on in the test.
    """
    kernels = (serial.advance, serial.reverse, immersed.advance_immersed, immersed.reverse_immersed, survey.survey)
    for kernel in kernels:
        monkeypatch.setattr(kernel._primal, "compiled_kernels", {})
