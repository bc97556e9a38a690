"""`zoobench` and `python -m zoobench`: the command line, which an interrupt ends in silence while it still loads."""

import sys


def main() -> int:
    """Run the command line of the process; returns its exit code."""
    try:
        from zoobench.cli.main import main as run

        return run()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
