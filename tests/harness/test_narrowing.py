"""A suite narrowed down: part of it, in its order, or a refusal."""

from typing import Any

import pytest

from zoobench.errors import UnknownNameError, UsageError
from zoobench.harness import suites
from zoobench.harness.narrowing import narrowed
from zoobench.harness.suites import Suite, spec_of
from zoobench.spec import AXES, Budget, RunSelection, RunSpec


@pytest.fixture(scope="module")
def gaits() -> Suite:
    """A suite with all axes."""
    return suites.load("gaits")


def chosen(suite: Suite, **words: Any) -> list[RunSpec]:
    """The selected runs."""
    selection = RunSelection(**{name: word for name, word in words.items() if name in AXES})
    settings = {name: word for name, word in words.items() if name not in AXES}
    return [spec_of(cell) for cell in narrowed(suite, selection, **settings)]


@pytest.mark.slow
def test_nothing_said_is_all_of_it(gaits: Suite) -> None:
    """In its order."""
    assert chosen(gaits) == list(gaits.specs)


@pytest.mark.parametrize(
    ("words", "count"),
    [
        ({"env": "ground,sn*"}, 2 * 93),
        ({"task": "turning", "design": "fish-v8"}, 7 * 9),
        ({"method": "diffphysics[restarts=1]", "controller": "sine*"}, 70 * 3),
        ({"method": "*[batch=10],cma*"}, 70 * 6 + 7 * 3),
        ({"seeds": (2, 0)}, 70 * 6 + 7 * 2),
        ({"budget": Budget("substeps", 380_000)}, 93),
        ({"frames": 200, "fidelity": "standard"}, 2 * 93),
        ({"frames": 200, "fidelity": "draft,standard"}, 651),
        ({"env": "ice", "task": "turning", "design": "fish", "method": "random", "seeds": (1,)}, 1),
    ],
)
def test_a_part_is_what_fits_every_word_in_the_order_of_the_suite(
    gaits: Suite, words: dict[str, Any], count: int
) -> None:
    """Names, globs, versions, parameters, seeds, budgets and frames."""
    part = chosen(gaits, **words)
    assert len(part) == count
    wanted = set(part)
    assert part == [spec for spec in gaits.specs if spec in wanted]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            {"method": "diffphysics[lr=0.5]"},
            r"No method in the.* is 'diffphysics\[lr=0.5\]'. Options narrow.*lr=0.1",
        ),
        ({"method": "random-v9"}, "No method in the suite 'gaits' is 'random-v9'"),
        ({"seeds": (0, 3)}, "has no seed 3.*It has 0, 1, 2"),
        ({"budget": Budget("substeps", 5)}, "has no budget 5 substeps.*252000 substeps"),
        ({"frames": 7}, "has no frames 7.*It has 200"),
        ({"env": "ground", "budget": Budget("substeps", 380_000)}, "No run in the suite 'gaits'.*--env, --budget"),
    ],
)
def test_what_the_suite_does_not_have_is_refused(gaits: Suite, words: dict[str, Any], message: str) -> None:
    """A suite is narrowed down, not changed; so is what leaves nothing."""
    with pytest.raises(UsageError, match=message):
        chosen(gaits, **words)


@pytest.mark.parametrize(("name", "hint"), [("grond", "Did you mean 'ground'"), ("sea*", "Known: clay"), ("lake", "")])
def test_an_unknown_name_is_refused_with_those_of_the_suite(gaits: Suite, name: str, hint: str) -> None:
    """Even beside one that is known."""
    with pytest.raises(UnknownNameError, match=rf"env in the suite 'gaits'.*{hint}"):
        chosen(gaits, env=f"ice,{name}")
