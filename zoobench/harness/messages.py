"""The messages of a child process, each checked as it arrives: what a database would refuse ends that run alone.

The form of each is in `zoobench.harness.child`.
"""

import json
import math
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    AllowInfNan,
    Base64Bytes,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    StringConstraints,
    ValidationError,
)
from pydantic.alias_generators import to_snake

from zoobench.db.rows import decode_params, storable

_LARGEST = 2**31 - 1  # that a column of whole numbers holds in every database
_LONGEST_WORD = 80  # of what was given, in a message


def _check_params(data: bytes) -> bytes:
    if len(data) % 8 or not all(map(math.isfinite, decode_params(data))):
        raise ValueError("They are no finite numbers in double precision")
    return data


Whole = Annotated[int, Strict(), Field(ge=0, le=_LARGEST)]
Number = Annotated[float, Strict()]
Finite = Annotated[float, Strict(), AllowInfNan(False)]
Name = Annotated[str, Strict(), StringConstraints(min_length=1, max_length=100, pattern=r"^[^\x00]+$")]
Unit = Annotated[str, Strict(), StringConstraints(max_length=30, pattern=r"^[^\x00]*$")]
Key = Annotated[str, Strict(), StringConstraints(min_length=1, max_length=64, pattern=r"^[^\x00]+$")]
Words = Annotated[str, BeforeValidator(lambda text: storable(text) if isinstance(text, str) else text)]
Params = Annotated[Base64Bytes, AfterValidator(_check_params)]
Bytes = Annotated[int, Strict(), Field(ge=0, le=2**63 - 1)]


class RefusedMessageError(ValueError):
    """A message that cannot be taken, and why."""


class Message(BaseModel):
    """A message; the fields are those of its JSON object."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class MetricMessage(Message):
    """A point of the learning curves."""

    step: Whole
    values: dict[Name, Number]


class MilestoneMessage(Message):
    """The best parameters after so many iterations."""

    step: Whole
    score: Finite
    params: Params


class CheckpointMessage(Message):
    """The state to go on from."""

    data: Base64Bytes


class ProgressMessage(Message):
    """How much of the run is done, and the score of the incumbent."""

    fraction: Annotated[Finite, Field(ge=0.0, le=1.0)]
    score: Finite | None


class ReferenceWantedMessage(Message):
    """The child waits for a reference score."""

    key: Key


class ReferenceMessage(Message):
    """A reference score that it has computed; NaN where there is none."""

    key: Key
    value: Number
    unit: Unit


class LastWord(Message):
    """The ending of the run."""

    peak_memory: Bytes | None


class DoneMessage(LastWord):
    """It has a result."""

    finals: list[tuple[Name, Finite, Unit]]
    params: list[Finite]
    archive: Base64Bytes | None


class DivergedMessage(LastWord):
    """Every simulation diverged."""

    reason: Words


class FailedMessage(LastWord):
    """It met an error."""

    reason: Words
    traceback: Words


class StoppedMessage(LastWord):
    """It has obeyed."""


_KINDS: dict[str, type[Message]] = {
    to_snake(kind.__name__.removesuffix("Message")): kind
    for kind in (
        MetricMessage,
        MilestoneMessage,
        CheckpointMessage,
        ProgressMessage,
        ReferenceWantedMessage,
        ReferenceMessage,
        DoneMessage,
        DivergedMessage,
        FailedMessage,
        StoppedMessage,
    )
}


def read_message(line: bytes) -> Message | None:
    """The message in a line; None if it is none, such as one that a kill has cut off.

    Raises:
        RefusedMessageError: it is one that cannot be taken.
    """
    try:
        contents = json.loads(line)
        kind = contents.pop("type")
    except RecursionError:
        raise RefusedMessageError("The method sent data nested too deep.") from None
    except (ValueError, KeyError, AttributeError, TypeError):
        return None
    if not isinstance(kind, str) or kind not in _KINDS:
        raise RefusedMessageError(f"The method sent {_short(kind)}, which is no message.")
    try:
        return _KINDS[kind].model_validate(contents)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"] if part != "[key]")
        given = "missing" if first["type"] == "missing" else _short(first["input"])
        raise RefusedMessageError(
            f"The method sent what cannot be kept as {kind}: {place} is {given}. "
            f"{first['msg'].replace('Input', 'It', 1)}. Correct the method."
        ) from None


def _short(value: Any) -> str:
    text = ascii(value)
    return text if len(text) <= _LONGEST_WORD else f"{text[:_LONGEST_WORD]}..."
