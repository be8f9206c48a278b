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


def catalogue_files(chosen: Path | None) -> dict[str, Path]:
    """List the scenarios that the verbs read by id: those of a folder chosen, or of both others.

    One in ``scenarios_db`` here takes the place of the shipped one of the same id.

    Raises:
        UsageError: The chosen one is not a folder.
        SpecError: Two files of one folder have one id.
    """
    from adeye.spec.load import SCENARIOS, scenario_files, shipped

    found = {} if chosen is not None else scenario_files(shipped(SCENARIOS))
    return dict(sorted((found | scenario_files(catalogue_folder(chosen))).items()))
