"""Robots are watched: moved by hand, by their gait, and by the best gait of a run that goes on."""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import pytest

from tests.conformance.cells import cell
from tests.render.browser import node, skin_centres
from zoobench.cell.free_cell import free_cell, with_gait
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.inputs import Start
from zoobench.render.pace import Pace
from zoobench.render.panel import Panel
from zoobench.render.viewer import Viewer
from zoobench.render.watching import Watched, watch
from zoobench.spec import FRAME_SECONDS, RunSpec
from zoobench.testing import DOUBLE

BY_HAND = Watched(free_cell("ground", "movement-speed", "caterpillar", "smoke", 4), "by hand")


@pytest.fixture
def viewer(monkeypatch: pytest.MonkeyPatch) -> Iterator[Viewer]:
    """A page that somebody looks at, to whom time does not matter."""
    monkeypatch.setattr(Viewer, "is_watched", True)
    monkeypatch.setattr(Pace, "wait", lambda self, seconds: None)
    made = Viewer(port=0)
    yield made
    made.close()


def _after(frames: int, then: Callable[[int], None] = lambda _: None) -> Callable[[], None]:
    """A check that ends it after so many frames, and calls `then` with the number of each."""
    calls = 0

    def check() -> None:
        nonlocal calls
        calls += 1
        then(calls)
        if calls > frames:
            raise KeyboardInterrupt

    return check


def test_a_slider_moves_its_muscle(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the next frame on; an episode that ends is told with its score, and another begins."""
    panels: list[Panel] = []
    make = Panel.__init__

    def remember(self: Panel, *args: object, **options: object) -> None:
        make(self, *args, **options)  # type: ignore[arg-type]
        panels.append(self)

    monkeypatch.setattr(Panel, "__init__", remember)
    places: list[np.ndarray] = []

    def look(number: int) -> None:
        if len(panels) == 2:
            places.append(np.array(skin_centres(viewer)) if viewer._world else np.zeros(0))
            if number == 3:
                panels[1]._sliders[0].value = 1.0

    told: list[str] = []
    monkeypatch.setattr(Viewer, "is_due", True)
    frames = watch(viewer, lambda: BY_HAND, told.append, _after(8, look))
    assert frames == 6
    assert told[0] == f"Open {viewer.address} in a browser; Ctrl-C ends it."
    assert [line[:6] for line in told[1:]] == ["score "]
    moved = [float(np.abs(after - before).max()) for before, after in pairwise(places)]
    assert max(moved[:1]) < 1e-5 < 1e-4 < moved[2], moved


@pytest.mark.parametrize("controller", ["sine-basis", "policy-network"])
@pytest.mark.parametrize("design", ["caterpillar", pytest.param("voxel[edge=0.025]", marks=pytest.mark.slow)])
def test_a_gait_does_what_it_did(viewer: Viewer, controller: str, design: str) -> None:
    """In an open and a closed loop, of a body that is given and one that was found: the score is the run's."""
    spec = cell(controller=controller, design=design, frames=4)
    problem = Problem(spec)
    params = problem.initial(np.random.default_rng(1))
    told: list[str] = []
    watch(viewer, lambda: Watched(_trained(spec, params), ""), told.append, _after(5))
    expected = problem.evaluate(params).score
    assert told[1:] == [f"score {expected:.4g} {problem.task.unit}"]
    assert expected


def test_an_episode_on_a_path_is_told_by_its_error(viewer: Viewer) -> None:
    """As tables show it: above zero."""
    told: list[str] = []
    path = Watched(free_cell("ground", "waypoint-following", "caterpillar", "smoke", 4), "by hand")
    watch(viewer, lambda: path, told.append, _after(8))
    noun, error, unit = told[1].split()
    assert (noun, unit) == ("error", "m")
    assert float(error) > 0.0


def test_an_object_is_watched(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is thrown goes on the page as fast as it does; the score of its task is told."""
    monkeypatch.setattr(Viewer, "is_due", True)
    env = "ground[object=box,object_gap=0.1,object_speed=0.5,object_ground_friction=0]"
    thrown = free_cell(env, "push", "caterpillar", DOUBLE, 4)
    places: list[np.ndarray] = []
    told: list[str] = []

    def look(_: int) -> None:
        if viewer._world:
            places.append(node(viewer, "object").vertices.mean(axis=0))

    watch(viewer, lambda: Watched(thrown, "by hand"), told.append, _after(6, look))
    ways = np.diff(places, axis=0)[:4, 0]
    np.testing.assert_allclose(ways, -0.5 * FRAME_SECONDS, rtol=0.05)
    assert [line[-2:] for line in told[1:]] == [" m"]


def _trained(spec: RunSpec, params: np.ndarray) -> RunSpec:
    axes = (spec.env, spec.task, spec.design, spec.fidelity)
    return with_gait(free_cell(*map(str, axes), spec.frames), Start(spec, tuple(params.tolist())))


def test_a_run_is_watched_while_it_learns(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is simulated before it has found something; what it finds then is shown from the next episode on."""
    spec = cell(controller="sine-basis", frames=2)
    rng = np.random.default_rng(0)
    found = [_trained(spec, Problem(spec).initial(rng)) for _ in range(2)]
    answers = iter([None, None, Watched(found[0], "1"), Watched(found[0], "1"), Watched(found[1], "2")])
    shown: list[RunSpec] = []
    begin = Viewer.begin
    monkeypatch.setattr(
        Viewer, "begin", lambda self, problem, *rest: (shown.append(problem.spec), begin(self, problem, *rest))
    )
    monkeypatch.setattr(Pace, "rest", lambda self: None)
    told: list[str] = []
    assert watch(viewer, lambda: next(answers), told.append, _after(2 + 3 * 3)) == 6
    assert shown == [found[0], found[0], found[1]]
    assert told[1] == told[2] != told[3]


def test_time_stands_still_while_nobody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is simulated, and nothing lost."""
    viewer = Viewer(port=0)
    try:
        assert watch(viewer, lambda: BY_HAND, lambda _: None, _after(5)) == 0
        monkeypatch.setattr(Viewer, "is_watched", True)
        assert watch(viewer, lambda: BY_HAND, lambda _: None, _after(3)) == 2
    finally:
        viewer.close()


def test_a_robot_that_cannot_be_simulated_is_told_before_the_address(viewer: Viewer) -> None:
    """A design space without a body has none to show."""
    told: list[str] = []
    space = Watched(free_cell("ground", "movement-speed", "voxel", "smoke", 4), "")
    with pytest.raises(UsageError, match="design space"):
        watch(viewer, lambda: space, told.append, _after(3))
    assert told == []
