"""The commands of `zoobench verify` refuse what they cannot do before they start anything."""

from pathlib import Path

import pytest

from tests.cli.conftest import Command


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("accuracy show", "zoobench.db"),
        ("accuracy exact --stored", "zoobench.db"),
        ("accuracy run --levels coarse", "coarse"),
        ("accuracy run --draws 1,2", "draws"),
        ("accuracy show --from none.json", "none.json"),
        ("accuracy show --table none", "none"),
        ("effects --env ground --fidelity smoke --repeats 1 --format csv", "--table"),
        ("gradcheck --env dessert", "desert"),
        ("gradcheck --horizons ten", "Cannot read 'ten' as horizons"),
        ("gradcheck --horizons 0", ""),
        ("gradcheck --table all-of-them", ""),
        ("gradcheck --env ground --task turning --horizons 5 --format csv", "--table"),
        ("stability --case one-particel", ""),
        ("stability --largest-step --case one-particle", "Leave --case and --fast out"),
        ("stability --largest-step --fast", "Leave --case and --fast out"),
        ("validate --case dam-brake", "'dam-break'"),
        ("validate --case dam-brake", "hydrostatic-column"),
    ],
)
def test_what_cannot_be_done_is_refused(zoobench: Command, tmp_path: Path, words: str, said: str) -> None:
    """Exit code 2 and the reason, with what there is instead; no file is made."""
    reply = zoobench("verify", *words.split())
    assert reply.code == 2
    assert said in reply.err
    assert list(tmp_path.iterdir()) == []
