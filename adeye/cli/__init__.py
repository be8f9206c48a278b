"""The command line: ``adeye VERB``; each verb parses, calls one function and prints.

No result is computed here, and nothing heavy is imported before a verb needs it. Begin with
``app``.
"""

from adeye.cli.app import main

__all__ = ["main"]
