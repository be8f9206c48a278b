"""Run the command line as ``python -m adeye``."""

import sys

from adeye.cli import main

if __name__ == "__main__":
    sys.exit(main())
