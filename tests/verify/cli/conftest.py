"""The command line in this process, as the tests of the core have it."""

from tests.cli.conftest import zoobench

__all__ = ["zoobench"]
