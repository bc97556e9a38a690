"""`zoobench` and `python -m zoobench`: the command line; an interrupt during loading ends it silently."""

import sys


def main() -> int:
    """Run the command line; returns the exit code."""
    try:
        from zoobench.cli.main import main as run

        return run()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
