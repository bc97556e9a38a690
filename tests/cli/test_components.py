"""`list` and `show`."""

import json
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from tests.render.filmed import needs_drawing
from zoobench import registry
from zoobench.harness import presets, suites


def test_list_names_every_component(zoobench: Command) -> None:
    """All kinds, each with version and summary, and the suites."""
    records = json.loads(zoobench("list", "--format", "json").out)
    expected = {(str(kind), name) for kind in registry.Kind for name in registry.names(kind)}
    expected |= {("suites", name) for suite in suites.names() for name in suites.summaries(suite)}
    assert {(record["kind"], record["name"]) for record in records} == expected
    assert all(record["summary"] for record in records)
    assert all(record["version"] >= 1 for record in records if record["kind"] != "suites")


def test_list_of_one_kind(zoobench: Command) -> None:
    """Only the environments, also as csv."""
    lines = zoobench("list", "envs", "--format", "csv").out.splitlines()
    assert lines[0] == "kind,name,version,summary,provisional"
    assert [line.split(",")[1] for line in lines[1:]] == registry.names(registry.Kind.ENV)


def test_a_kind_may_be_named_in_the_singular(zoobench: Command) -> None:
    """And an environment in full; another word is refused with one that may be meant."""
    for one, many in (("env", "envs"), ("environment", "envs"), ("fidelity", "fidelities"), ("suite", "suites")):
        assert zoobench("list", one).out == zoobench("list", many).out != ""
    refused = zoobench("list", "envy")
    assert refused.code == 2
    assert "Did you mean 'envs'?" in refused.err


def test_presets_are_listed_with_their_settings(zoobench: Command) -> None:
    """Every one, each setting as it can be typed."""
    records = json.loads(zoobench("list", "presets", "--format", "json").out)
    assert [record["name"] for record in records] == presets.names()
    (animals,) = (record for record in records if record["name"] == "animals")
    assert animals["methods"] == "diffphysics[iterations=30,lr=0.1,restarts=8],random[batch=24]"
    assert animals["designs"].split(",") == ["caterpillar", "baby-seal", "fish", "panda"]
    assert (animals["budget_amount"], animals["budget_kind"]) == (30.0, "iterations")


def test_show_a_component_states_its_parameters_and_defaults(zoobench: Command) -> None:
    """As text and as JSON."""
    assert "lr" in zoobench("show", "diffphysics").out
    (card,) = json.loads(zoobench("show", "diffphysics-v2", "--format", "json").out)
    assert card["kind"] == "method"
    defaults = {item["name"]: item["default"] for item in card["parameters"]}
    assert defaults == dict(registry.get(registry.Kind.METHOD, "diffphysics").defaults)


def test_a_colon_in_a_setting_makes_no_run_of_a_component(zoobench: Command) -> None:
    """Only `best:` names a solution."""
    reply = zoobench("show", "external[policy=agent.py:act]", "--format", "json")
    assert reply.code == 0, reply.err
    assert [card["name"] for card in json.loads(reply.out)] == ["external"]


def test_show_a_provisional_environment_says_why(zoobench: Command) -> None:
    """For readers and for programs; firm ground is what it is called."""
    assert "provisional" in zoobench("show", "wetland").out
    assert (
        "softer clay is not resolved" in json.loads(zoobench("show", "clay", "--format", "json").out)[0]["provisional"]
    )
    assert "provisional" not in zoobench("show", "ground").out
    listed = json.loads(zoobench("list", "envs", "--format", "json").out)
    assert {row["name"] for row in listed if row["provisional"]} == {"clay", "shallow-water", "wetland"}


@pytest.mark.parametrize("name", ["desrt", "diffphysics-v99", "a b", "12", "zzzz", "desert[frction=1]"])
def test_show_something_unknown_is_a_usage_error(zoobench: Command, name: str) -> None:
    """Names that fit nothing, and a run where there is no database, which is not made by asking."""
    reply = zoobench("show", name)
    assert reply.code == 2
    assert reply.err.startswith("Error: ")
    assert not Path("zoobench.db").exists()


def test_show_a_run_gives_finals_attempts_origin_and_the_command(zoobench: Command, database: Path) -> None:
    """By number, as text."""
    text = zoobench("show", 1).out
    for fact in ("diffphysics-v2[lr=0.1]", "state", "1 m/s", "1  done", "Example 9000", "zoobench run --env desert-v1"):
        assert fact in text


def test_show_a_run_by_its_key(zoobench: Command, database: Path) -> None:
    """The start of the key is enough, and a failed run keeps its traceback."""
    card = json.loads(zoobench("show", 10, "--format", "json").out)
    again = json.loads(zoobench("show", card["key"][:12], "--format", "json").out)
    assert again == card
    assert card["attempts"][0]["traceback"].endswith("ValueError: boom")


def test_show_prints_no_csv(zoobench: Command) -> None:
    """A card is no table."""
    assert zoobench("show", "desert", "--format", "csv").code == 2


def test_show_a_design_gives_its_card(zoobench: Command) -> None:
    """Size, mass, muscles and particles at every fidelity; a parameter changes them."""
    (card,) = json.loads(zoobench("show", "caterpillar[length=0.08]", "--format", "json").out)
    body = card["body"]
    assert body["size"] == pytest.approx([0.08, 0.05, 0.05], abs=0.004)
    assert list(body["particles"]) == sorted(body["particles"], key=lambda name: body["particles"][name])
    assert set(body["particles"]) == set(registry.names(registry.Kind.FIDELITY))
    assert sum(body["muscles"].values()) + body["passive"] == pytest.approx(1.0)
    text = zoobench("show", "caterpillar[length=0.08]").out
    for fact in ("mm (length, height, width)", "ventral-1-left", str(body["particles"]["draft"]), "particles"):
        assert fact in text


@pytest.mark.slow
def test_show_draws_a_design(zoobench: Command) -> None:
    """A picture in colour of the caterpillar, which only a design has."""
    needs_drawing()
    imageio = pytest.importorskip("imageio.v2")
    assert zoobench("show", "caterpillar", "--picture", "body.png").code == 0
    image = imageio.imread("body.png").astype(float)
    purple = (image[..., 0] > 1.6 * image[..., 1]) & (image[..., 2] > 2.0 * image[..., 1])
    assert purple.mean() > 0.02
    assert "draws designs" in zoobench("show", "desert", "--picture", "x.png").err
    reply = zoobench("show", "caterpillar", "--picture", "body.png/body.png")
    assert reply.code == 2
    assert "body.png/body.png" in reply.err


def test_a_picture_without_its_extra_is_refused_before_any_work(
    zoobench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is measured, simulated or printed; the message names the extra."""
    for name in ("zoobench.render.bodies.card", "zoobench.render.recording.snapshots"):
        monkeypatch.setattr(name, lambda *_, **__: pytest.fail("work before the check"))
    monkeypatch.setitem(sys.modules, "pyvista", None)
    for words in (("show", "caterpillar", "--picture", "body.png"), ("design", "picture", "--env", "ground")):
        reply = zoobench(*words)
        assert (reply.code, reply.out) == (2, "")
        assert "pip install 'zoobench[render]'" in reply.err
