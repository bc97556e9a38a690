"""`zoobench list` and `zoobench show`: all components, and one component or run in full."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from zoobench.cli import completion
from zoobench.cli.kinds import KindName, kind_named
from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption
from zoobench.cli.output import Format, emit, emit_facts, emit_json, print_text, say
from zoobench.cli.run_log import print_log
from zoobench.cli.solutions import may_be_run, names_published, names_run
from zoobench.errors import UnknownNameError, UsageError
from zoobench.report.listing import Listing, cell_text
from zoobench.spec import AXES, Ref, RunSpec

if TYPE_CHECKING:
    from collections.abc import Callable

    from zoobench.registry import Component
    from zoobench.spec import Budget


def _kinds(incomplete: str) -> list[str]:
    return completion.starting(KindName, incomplete)


def list_components(
    name: Annotated[
        str,
        Argument(
            metavar="KIND",
            help=f"Kind to list: {', '.join(KindName)}.",
            show_default=False,
            autocompletion=_kinds,
        ),
    ] = "",
    form: FormatOption = Format.TABLE,
) -> None:
    """List the components of the benchmark.

    These are the environments, tasks, designs, controllers, methods and fidelities in their newest versions, and the
    suites of `zoobench run --suite`. `zoobench list presets` shows the settings of `zoobench run --preset`, and
    `zoobench list solutions` the names of the best solutions on the leaderboards.
    """
    from zoobench import registry
    from zoobench.db import published
    from zoobench.harness import suites

    kind = kind_named(name) if name else None
    if kind is KindName.PRESETS:
        _emit_presets(form)
        return
    if kind is KindName.SOLUTIONS:
        emit(Listing(("name", "solution"), tuple(completion.solutions_like(published.PREFIX))), form)
        return
    rows: list[tuple[str, str, int | None, str, str | None]] = []
    for each in registry.Kind:
        if kind in (None, KindName(each)):
            found = (registry.get(each, name) for name in registry.names(each))
            rows += [(each, item.name, item.version, item.summary, registry.caveat(each, item.ref)) for item in found]
    if kind in (None, KindName.SUITES):
        found_suites = (item for name in suites.names() for item in suites.summaries(name).items())
        rows += [(KindName.SUITES, name, None, summary, "") for name, summary in found_suites]
    columns = ("kind", "name", "version", "summary")
    people = tuple((*row[:3], f"{row[3]}{' (provisional)' * bool(row[4])}") for row in rows)
    programs = tuple((*row[:4], row[4] or None) for row in rows)
    emit(Listing(columns, people), form, programs=Listing((*columns, "provisional"), programs))


def show(
    name: Annotated[
        str,
        Argument(
            help="A component (desert, diffphysics-v1), or a run: its number or key.",
            autocompletion=completion.components_and_runs,
        ),
    ],
    picture: Annotated[
        Path | None, Option("--picture", help="Draw the body of the design or run into this PNG file.")
    ] = None,
    log: Annotated[bool, Option("--log", help="Print the log and the traceback of the run instead.")] = False,
    attempt: Annotated[int | None, Option("--attempt", help="With --log: number of the attempt. Default: all.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Show a component or a run in full.

    Of a component it shows the parameters and their defaults, and of a design also size, mass, muscles and particle
    counts. Of a run it shows state, attempts, final values, provenance, and the command that repeats it. A picture
    needs the extra `render`.
    """
    if log:
        print_log(name, attempt, db)
        return
    if attempt is not None:
        raise UsageError("--attempt chooses a part of the log. Give --log, too.")
    if form not in (Format.TABLE, Format.JSON):
        raise UsageError(f"`zoobench show` prints no {form}. Choose table or json.")
    if names_published(name):
        raise UsageError(
            f"{name!r} is a solution on a leaderboard and no run of a database. `zoobench evaluate {name}` shows its "
            f"metrics, `zoobench design export {name}` writes its body."
        )
    found = _components(name)
    if picture is not None:
        _check_picture(name, found)
    card: list[dict[str, Any]] | dict[str, Any]
    card = [_component_card(component, name) for component in found] if found else _run_card(name, db)
    if picture is not None:
        _draw(name, found, db, picture)
    if form is Format.JSON:
        emit_json(card)
    elif isinstance(card, list):
        _print_components(card)
    else:
        _print_run(card)


def _emit_presets(form: Format) -> None:
    """Print the settings of each preset."""
    from zoobench.harness import presets

    found = [presets.get(name) for name in presets.names()]
    lists = [
        [",".join(map(str, refs)) for refs in (each.designs, each.controllers, each.methods, each.envs)]
        for each in found
    ]
    begin, end = ("name", "summary", "fidelity", "frames"), ("seeds", "designs", "controllers", "methods", "envs")

    def listing(budget: tuple[str, ...], amount: "Callable[[Budget], tuple[object, ...]]") -> Listing:
        rows = (
            (each.name, each.summary, str(each.fidelity), each.frames, *amount(each.budget), len(each.seeds), *own)
            for each, own in zip(found, lists, strict=True)
        )
        return Listing((*begin, *budget, *end), tuple(rows))

    people = listing(("budget",), lambda budget: (str(budget),))
    emit(people, form, programs=listing(("budget_kind", "budget_amount"), lambda each: (each.kind, each.amount)))


def _components(text: str) -> list["Component"]:
    """The components of that name; two kinds may share one.

    Raises:
        UsageError: one has no such version, or none of them a parameter that is given.
    """
    from zoobench import registry

    if may_be_run(text):
        return []
    ref = Ref.parse(text)
    kinds = [kind for kind in registry.Kind if ref.name in registry.names(kind)]
    found = [registry.get(kind, ref.name, ref.version) for kind in kinds]
    known = {key for component in found for key in component.parameters}
    if found and (unknown := [key for key in ref.kwargs if key not in known]):
        raise UnknownNameError(f"parameter of {ref.name!r}:", unknown[0], known)
    return found


def _check_picture(name: str, found: "list[Component]") -> None:
    """Check before any work that there is a body to draw, and that this machine can draw.

    Raises:
        UsageError: there is none, or it cannot.
    """
    from zoobench.registry import Kind
    from zoobench.render.canvas import check_drawing

    if found and not any(component.kind is Kind.DESIGN for component in found):
        raise UsageError(
            f"--picture draws designs and the bodies of runs, and {name!r} is neither. See `zoobench list`."
        )
    check_drawing()


def _draw(name: str, found: "list[Component]", db: str, path: Path) -> None:
    """Draw the body of a design, at the fidelity `fine`, or of a run's solution."""
    from zoobench.cli.solutions import body_of_run
    from zoobench.render.bodies import body_at
    from zoobench.render.canvas import save
    from zoobench.render.stills import portrait_image

    sampled, title = (body_at(Ref.parse(name), Ref("fine")), name) if found else body_of_run(name, db)
    save(portrait_image(sampled, title), path)
    say(f"Drawn: {path}")


def _run_card(text: str, db: str) -> dict[str, Any]:
    from zoobench import registry

    if not names_run(text, db):
        known = [name for kind in registry.Kind for name in registry.names(kind)]
        raise UnknownNameError("component", text, known)

    from zoobench.db.store import Store
    from zoobench.harness.starts import run_and_its_starts
    from zoobench.report.run_results import RunResult
    from zoobench.report.views import run_card

    with Store(db, create=False) as store:
        run = store.run(text)
        result = RunResult(run, {final.name: final for final in store.finals(run.id)})
        return run_card(result, store.attempts(run.id), run_and_its_starts(store, run))


def _component_card(component: "Component", text: str) -> dict[str, Any]:
    """All about a component, with properties of a design's body unless a required parameter is missing."""
    from zoobench.registry import Kind, caveat

    ref = Ref.parse(text)
    card = {
        "name": component.name,
        "kind": component.kind.noun,
        "version": component.version,
        "summary": component.summary,
        "description": component.description,
        "tags": sorted(component.tags),
        "provisional": caveat(component.kind, ref) or None,
        "parameters": [
            {"name": name, "type": _type_name(expected), "default": component.defaults.get(name)}
            for name, expected in component.parameters.items()
        ],
    }
    if component.kind is Kind.DESIGN and component.required <= ref.kwargs.keys():
        from zoobench.render import bodies

        card["body"] = bodies.card(ref)
    return card


def _type_name(expected: Any) -> str:
    return expected.__name__ if isinstance(expected, type) else str(expected).removeprefix("typing.")


def _print_components(cards: list[dict[str, Any]]) -> None:
    for card in cards:
        parameters = [
            (f"  {item['name']}", f"{item['type']}, default {item['default']}") for item in card["parameters"]
        ]
        emit_facts([("name", f"{card['name']} ({card['kind']}, version {card['version']})")])
        print_text(f"\n{card['description']}\n")
        if card["provisional"]:
            emit_facts([("provisional", card["provisional"])])
        if card["tags"]:
            emit_facts([("tags", ", ".join(card["tags"]))])
        print("parameters" if parameters else "no parameters")
        emit_facts(parameters)
        if "body" in card:
            _print_body(card["body"])


def _print_body(body: dict[str, Any]) -> None:
    from zoobench.render.bodies import DENSITY

    def span(bounds: list[float]) -> str:
        low, high = bounds
        return f"{low:.2g}" if high - low < 1e-9 else f"{low:.2g} to {high:.2g}"

    print("body")
    emit_facts(
        [
            ("  size", " x ".join(f"{1e3 * edge:.0f}" for edge in body["size"]) + " mm (length, height, width)"),
            ("  mass", f"{1e3 * body['mass']:.1f} g at {DENSITY:g} kg/m^3"),
            ("  stiffness", f"{span(body['stiffness'])} of its material's"),
            ("  density", f"{span(body['density'])} of its material's"),
        ]
    )
    shares = {**body["muscles"], "no muscle": body["passive"]}
    print(f"muscles ({len(body['muscles'])}), by mass")
    emit_facts((f"  {name}", f"{100 * share:.1f} %") for name, share in shares.items())
    print("particles")
    counts = body["particles"].items()
    emit_facts((f"  {name}", "too coarse" if count is None else f"{count:,}") for name, count in counts)
    for note in body["notes"]:
        print_text(note)


def _print_run(card: dict[str, Any]) -> None:
    from zoobench.report.views import duration, finals_shown

    spec = RunSpec.from_dict(card["spec"])
    emit_facts(
        [
            ("run", f"{card['run']}{' (smoke: the numbers mean nothing)' if card['is_smoke'] else ''}"),
            ("key", card["key"]),
            *((axis, str(getattr(spec, axis))) for axis in AXES),
            ("seed", str(spec.seed)),
            ("frames", str(spec.frames)),
            ("budget", str(spec.budget)),
            ("state", card["state"] + (f": {card['reason']}" if card["reason"] else "")),
            ("time", duration(card["seconds"])),
            *([("note", card["provisional"])] if card["provisional"] else []),
        ]
    )
    finals = [
        (f"  {name}", f"{cell_text(value)} {unit}".rstrip())
        for name, value, unit in finals_shown(spec.task, card["finals"])
    ]
    for title, entries in (("finals", finals), ("attempts", _attempt_facts(card))):
        print(f"\n{title}" + ("" if entries else ": none"))
        emit_facts(entries)
    if card["attempts"]:
        print("\nprovenance of the last attempt")
        provenance = card["attempts"][-1]["provenance"]
        emit_facts((f"  {name}", cell_text(value)) for name, value in _flat(provenance))
    print_text(f"\nrepeat it in another database with\n  {card['repeat']}")


def _attempt_facts(card: dict[str, Any]) -> list[tuple[str, str]]:
    from zoobench.report.views import duration

    facts = []
    for attempt in card["attempts"]:
        text = attempt["outcome"]
        text += f" after {duration(attempt['seconds'])}" if attempt["seconds"] is not None else ""
        text += ", resumed from a checkpoint" if attempt["resumed"] else ""
        text += f", killed by signal {attempt['signal']}" if attempt["signal"] else ""
        text += f": {attempt['reason']}" if attempt["reason"] else ""
        facts.append((f"  {attempt['number']}", text))
    return facts


def _flat(data: dict[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    """Nested plain data by dotted names."""
    facts: list[tuple[str, Any]] = []
    for name, value in data.items():
        if isinstance(value, dict):
            facts += _flat(value, f"{prefix}{name}.")
        else:
            facts.append((prefix + name, ", ".join(map(str, value)) if isinstance(value, list) else value))
    return facts
