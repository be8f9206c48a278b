"""Which catalogue of scenarios the verbs read."""

from __future__ import annotations

from pathlib import Path


def catalogue_folder(chosen: Path | None) -> Path:
    """Find the folder of scenarios: the chosen one, ``scenarios_db`` here, or the shipped one.

    Raises:
        UsageError: The chosen one is not a folder.
    """
    from adeye.errors import UsageError
    from adeye.spec.load import shipped

    if chosen is not None:
        if not chosen.is_dir():
            raise UsageError(f"catalogue {chosen} is not a folder", remedy="Name a folder of YAML.")
        return chosen
    here = Path("scenarios_db")
    return here if here.is_dir() else shipped("scenarios_db")
