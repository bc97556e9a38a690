"""`python -m zoobench`: the command line without the script."""

import sys

from zoobench.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
