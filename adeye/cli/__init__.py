"""The command line: ``adeye VERB``; each verb parses, calls one function and prints.

No result is computed here, and nothing heavy is imported before a verb needs it. Begin with
``app``.
"""

import sys

if sys.flags.optimize > 1:
    sys.stderr.write("PlatformError: verbs need docstrings. Unset PYTHONOPTIMIZE, or use no -OO.\n")
    sys.exit(5)

from adeye.cli.app import main

__all__ = ["main"]
