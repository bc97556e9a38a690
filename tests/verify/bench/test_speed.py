"""The speed of one environment: what is counted, and against which clock."""

import pytest

from zoobench.errors import UsageError
from zoobench.spec import Ref
from zoobench_verify.bench import speed
from zoobench_verify.bench.speed import measure

GROUND, SMOKE = Ref("ground"), Ref("smoke")


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Episodes of at most two frames."""
    monkeypatch.setattr(speed, "_LONGEST_EPISODE", 2)


@pytest.fixture
def ticking(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by a second whenever it is read: every episode takes one."""
    ticks = iter(range(10**6))
    monkeypatch.setattr(speed, "work_clock", lambda _: lambda: float(next(ticks)))


@pytest.mark.slow
def test_rates_are_frames_by_the_clock(ticking: None) -> None:
    """Those of all worlds together; particle-substeps likewise, as many in a frame as its step needs."""
    one, two = (measure(GROUND, SMOKE, worlds=worlds, repeats=3) for worlds in (1, 2))
    assert (one.frames, one.forward.fps, two.forward.fps) == (2, 2.0, 4.0)
    assert two.forward.mps == pytest.approx(2 * one.forward.mps)
    assert one.forward.mps * 1e6 % one.particles == pytest.approx(0.0, abs=1e-6)
    assert one.forward.mps * 1e6 > 2 * one.particles
    assert two.gradient == two.forward


def test_a_rate_has_its_spread(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of three episodes of 1, 2 and 4 s: the one in the middle, with both ends."""
    reads = iter([0, 9, 0, 1, 0, 2, 0, 4])  # the first episode compiles
    monkeypatch.setattr(speed, "work_clock", lambda _: lambda: float(next(reads)))
    rate = measure(GROUND, SMOKE, gradients=False, repeats=3).forward
    assert (rate.fps, rate.least, rate.largest) == (1.0, 0.5, 2.0)


def test_gradients_can_be_left_out() -> None:
    """With them, an episode takes longer."""
    assert measure(GROUND, SMOKE, gradients=False, repeats=1).gradient is None
    found = measure(GROUND, SMOKE, repeats=1)
    assert found.gradient is not None
    assert 0.0 < found.gradient.fps < found.forward.fps


def test_a_device_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is simulated."""
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    with pytest.raises(UsageError, match="No CUDA device"):
        measure(GROUND, Ref.parse("smoke[device=cuda]"))
