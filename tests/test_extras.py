"""The extras of the package, as `pyproject.toml` declares them."""

import re
import tomllib
from pathlib import Path

from zoobench import __version__

ROOT = Path(__file__).parents[1]
EXTRAS: dict[str, list[str]] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]
FOR_DEVELOPERS = {"dev", "docs", "slow", "verify"}
VERIFY = tomllib.loads((ROOT / "verify" / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_all_holds_every_extra_of_users() -> None:
    """By their names, so that no library is listed twice, and none of the developers' tools."""
    (everything,) = EXTRAS["all"]
    named = re.fullmatch(r"zoobench\[([\w,]+)\]", everything)
    assert named is not None
    assert named[1].split(",") == sorted(EXTRAS.keys() - FOR_DEVELOPERS - {"all"})


def test_developers_have_all_of_it_by_name() -> None:
    """What an extra of users needs is not listed again; only slow tests need a cluster and the site."""
    (named,) = (item for item in EXTRAS["dev"] if item.startswith("zoobench["))
    of_users = EXTRAS.keys() - FOR_DEVELOPERS - {"all"}
    assert named == f"zoobench[{','.join(sorted({*of_users, 'verify'} - {'ray'}))}]"
    assert "zoobench[docs,ray]" in EXTRAS["slow"]
    for own in ("dev", "slow"):
        listed = {item for name, items in EXTRAS.items() if name != own for item in items}
        assert not listed & set(EXTRAS[own])


def test_the_verification_is_of_the_same_version() -> None:
    """It is checked with this one alone, and the extra names it."""
    assert EXTRAS["verify"] == [VERIFY["name"]]
    assert VERIFY["version"] == __version__
    assert VERIFY["dependencies"] == [f"zoobench=={__version__}"]


def test_every_extra_that_is_named_exists() -> None:
    """In the code's advice, in the documents and in the README."""
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "zoobench").rglob("*.py")]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    named = re.findall(r"install '(?:zoobench|\.)\[([a-z]+(?:,[a-z]+)*)\]'", text) + re.findall(
        r"\bextra\(\"(\w+)\"", text
    )
    found = {name for names in named for name in names.split(",")}
    assert len(found) > 5
    assert found <= EXTRAS.keys()
    assert "all" in found
