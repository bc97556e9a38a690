"""Warm starts: names of stored runs, and the parts of a solution that fit another run."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.cell.warm_start import overlay_of
from zoobench.errors import UsageError
from zoobench.inputs import Start, named_run, run_name
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec

KEY = "1f3a0c5d7e9b2a46" + 48 * "0"
SPACE = "voxel[base=caterpillar]"


def start_of(spec: RunSpec) -> Start:
    """A solution that differs from every draw."""
    return Start(spec, tuple(np.linspace(-0.5, 0.5, Problem(spec).parameter_count).tolist()))


def draws(spec: RunSpec, start: Start | None) -> tuple[np.ndarray, int]:
    """The first draw of a run, and the number of its controller's parameters."""
    problem = Problem(spec, start=start)
    return problem.initial(np.random.default_rng(3)), problem.robot.control_count


@pytest.mark.parametrize(("method", "key"), [("diffphysics", "c06228818460c41d"), ("cmaes", "b76788bbd79fc096")])
def test_a_run_without_a_start_keeps_its_key(method: str, key: str) -> None:
    """The key is that of versions without the parameter."""
    assert "start" not in cell(method=method).method.kwargs
    assert cell(method=method).key().startswith(key)
    assert cell(method=f"{method}[start={run_name(KEY)}]").key() != cell(method=method).key()


def test_a_stored_run_is_named_by_its_key() -> None:
    """The name is part of the reference and can be read back; other texts are refused."""
    ref = registry.resolve(Kind.METHOD, Ref.parse(f"cmaes[start={run_name(KEY)}]"))
    assert named_run(Ref.parse(str(ref))) == KEY[:16]
    assert named_run(cell().method) == ""
    for bad in ("12", "run-12", "run-1f3a0c5d7e9b2a4g"):
        with pytest.raises(UsageError, match="names no stored run"):
            registry.resolve(Kind.METHOD, Ref.parse(f"diffphysics[start={bad}]"))
    with pytest.raises(UsageError, match=r"has no parameter 'start'.*cmaes, diffphysics"):
        registry.resolve(Kind.METHOD, Ref.parse(f"random[start={run_name(KEY)}]"))


def test_a_start_that_fits_as_a_whole_is_where_the_run_begins() -> None:
    """All draws are replaced, in another environment as well."""
    start = start_of(cell(design=SPACE))
    begun, _ = draws(cell(design=SPACE, environment="ice"), start)
    np.testing.assert_array_equal(begun, start.params)


@pytest.mark.parametrize(
    ("home", "takes_control"),
    [({"design": SPACE, "controller": "fixed-sine"}, False), ({"design": "caterpillar"}, True)],
)
def test_of_a_start_that_fits_in_part_the_rest_is_drawn(home: dict[str, str], takes_control: bool) -> None:
    """The body, or the controller, of a stored run is the start of a co-design."""
    start, whole = start_of(cell(**home)), cell(design=SPACE)
    (cold, count), (begun, _) = draws(whole, None), draws(whole, start)
    taken, drawn = (slice(count), slice(count, None)) if takes_control else (slice(count, None), slice(count))
    np.testing.assert_array_equal(begun[taken], start.params)
    np.testing.assert_array_equal(begun[drawn], cold[drawn])
    words = overlay_of(start, whole).words
    assert f"the {'controller' if takes_control else 'design'}'s {len(start.params)} parameters are those of" in words
    assert (
        f"the {'design' if takes_control else 'controller'}'s {len(cold) - len(start.params)} parameters are drawn"
        in words
    )


@pytest.mark.parametrize("other", [{"controller": "trajectory"}, {"design": "fish"}])
def test_a_start_that_does_not_fit_is_refused(other: dict[str, str]) -> None:
    """Another controller, or a body with fewer muscles; the message has both counts."""
    start = start_of(cell())
    with pytest.raises(
        UsageError, match=rf"it has {len(start.params)} of the controller sine-basis.* takes [0-9]+ of the controller"
    ):
        overlay_of(start, cell(**other))


def test_a_policy_that_saw_another_target_is_refused() -> None:
    """Equal counts do not make it fit; one that sees its body only fits any task."""
    home, away = (
        cell(task=task, controller="policy-network[hidden=4]") for task in ("movement-speed", "velocity-tracking")
    )
    start = start_of(home)
    assert len(start.params) == Problem(away).parameter_count
    with pytest.raises(UsageError, match=r"observes.*target direction \(2\).*is given.*target velocity \(2\)"):
        overlay_of(start, away)
    blind = [cell(task=task, controller="policy-network[sees=body]") for task in ("turning", "velocity-tracking")]
    assert "are those of the start" in overlay_of(start_of(blind[0]), blind[1]).words


@pytest.mark.parametrize("controller", ["policy-network", "sine-feedback"])
def test_a_policy_of_the_version_that_saw_no_target_is_refused(controller: str) -> None:
    """It has other inputs, so that it is not read as the present one."""
    spec = cell(controller=controller)
    old = replace(spec, controller=replace(spec.controller, version=1))
    with pytest.raises(UsageError, match=rf"'{controller}' has no version 1. Known: {controller}-v2"):
        overlay_of(Start(old, start_of(spec).params), spec)
