"""The command line: ``adeye VERB``; each verb parses, calls one function and prints."""

from adeye.cli.app import main

__all__ = ["main"]
