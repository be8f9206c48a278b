"""Texts and tables that stand beside the code in files of their own, and are shipped with it."""

from __future__ import annotations

from importlib import resources
from typing import Any


def packaged_text(package: str, name: str) -> str:
    """Return the text of a file of a package.

    Args:
        package: Dotted name.
        name: Of the file; with a path below the package's folder.
    """
    return resources.files(package).joinpath(*name.split("/")).read_text("utf-8")


def of_yaml(text: str) -> Any:
    """Return what YAML of our own says; that of others is read by ``spec.document``."""
    import yaml

    # Most verbs read some of these files as they start; libyaml takes a tenth of the time.
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    return yaml.load(text, Loader=loader)  # noqa: S506 - both are safe loaders


def packaged_yaml(package: str, name: str) -> Any:
    """Return what a YAML file of a package says; see ``packaged_text``."""
    return of_yaml(packaged_text(package, name))
