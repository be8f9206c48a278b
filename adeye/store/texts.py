"""Texts as a database keeps them: clean, JSON in one spelling, and times of day in UTC."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import Any


def clean_text(text: str) -> str:
    r"""Escape what a database cannot keep: lone surrogates and NUL.

    >>> clean_text("a\x00b")
    'a\\x00b'
    """
    return text.encode("utf-8", "backslashreplace").decode("utf-8").replace("\x00", "\\x00")


def json_text(value: Any) -> str:
    """Write JSON with sorted keys; refuse NaN and infinity.

    Raises:
        ValueError: A number is not finite.
    """
    return clean_text(
        json.dumps(
            value, ensure_ascii=False, sort_keys=True, separators=(",", ":"), allow_nan=False
        )
    )


def utc_text(moment: datetime | None) -> str:
    """Write a time of day as UTC in ISO 8601, or now if there is none."""
    moment = datetime.now(UTC) if moment is None else moment
    return moment.astimezone(UTC).isoformat(timespec="milliseconds")
