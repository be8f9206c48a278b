"""What is known of the tool itself: what it promises, and the result of its last self-test."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from adeye.outputs import write_atomically
from adeye.report.model.part import Count, Part

RESULT: Final = "selftest.json"
"""Name of the file, in the folder of the database."""
NOT_RUN: Final = "Known-bad masters: not run with this version; adeye selftest does it."


class SelfTestResult(Part):
    """What a complete self-test came to."""

    version: str
    """Of adeye."""
    numerics_version: int
    created: str
    """UTC, ``YYYY-MM-DDTHH:MM:SS``."""
    masters: Count
    detected: Count
    low: float
    """Lower end of the exact interval of the share of masters that are detected."""
    confidence: float
    undetected: tuple[str, ...] = ()
    rejected_twins: tuple[str, ...] = ()
    """Masters whose good twin was taken for bad."""

    @property
    def is_good(self) -> bool:
        """Whether every master was detected and no twin was rejected."""
        return 0 < self.masters == self.detected and not (self.undetected or self.rejected_twins)

    @property
    def text(self) -> str:
        """The result in one sentence."""
        bad = f"; not detected: {', '.join(self.undetected)}" if self.undetected else ""
        if self.rejected_twins:
            bad += f"; good twins rejected: {', '.join(self.rejected_twins)}"
        return (
            f"Known-bad masters: {self.detected} of {self.masters} detected "
            f"(exact {100.0 * self.confidence:g} % interval: at least {100.0 * self.low:.1f} % of "
            f"masters of this kind){bad}; "
            f"version {self.version}, {self.created} UTC."
        )


def write_result(result: SelfTestResult, folder: Path) -> Path:
    """Keep the result of a self-test in the folder of a database.

    Raises:
        PlatformError: The file cannot be written.
    """
    path = folder / RESULT
    text = json.dumps(result.model_dump(mode="json"), indent=1, ensure_ascii=False)
    write_atomically(f"{text}\n".encode(), path)
    return path


def read_result(folder: Path, provenance: Mapping[str, Any]) -> SelfTestResult | None:
    """Read the result of a self-test; None if there is none that can be read, or of other code.

    Args:
        folder: Of the database.
        provenance: Of a campaign: the self-test must be of its version of adeye and of numerics.
    """
    try:
        found = SelfTestResult.model_validate_json((folder / RESULT).read_bytes())
    except (OSError, ValidationError):
        return None
    wanted = (provenance.get("adeye"), provenance.get("numerics_version"))
    return found if (found.version, found.numerics_version) == wanted else None


def determinism(backend: str, variant: str) -> str:
    """Return what is promised about running a campaign again.

    Args:
        backend: Traffic implementation; empty if the database does not say.
        variant: Its arithmetic.
    """
    if backend == "batch":
        promise = "portable: every run re-executes bit for bit on any processor, if plug-ins do"
    else:
        # highway-env computes with NumPy and the mathematical library, whose last bits differ.
        promise = "same platform: every run re-executes bit for bit on this kind of machine only"
    traffic = f" (traffic {backend}, {variant})" if backend else ""
    return (
        f"Class {promise}{traffic}, whatever the batch, the order and the number of threads or "
        "workers; `adeye replay` compares trace digests."
    )
