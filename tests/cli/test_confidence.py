"""``confidence``: what is printed and said to a machine, and when nothing may be said."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


@pytest.fixture
def db(folder: Path, suites: Executed) -> tuple[str, str]:
    assert folder.is_dir()
    return "--db", str(suites.db)


def test_bounds_and_refusals_are_printed(adeye: Any, db: tuple[str, str]) -> None:
    ended = adeye("confidence", *db, "--target", "0.01")
    assert ended.err == ""
    assert "camera_radar (gate)" in ended.out
    assert "Needed for 0.010" in ended.out
    assert "No statement about lead_braking" in ended.out
    assert "not a random sample" in ended.out
    assert "Every bound is conditional" in ended.out


def test_json_is_one_document(adeye: Any, db: tuple[str, str]) -> None:
    ended = adeye("confidence", *db, "--json", "--level", "0.9")
    found = json.loads(ended.out)
    assert found["level"] == 0.9
    assert {item["scenario"] for item in found["claims"]} == {"cut_in", "lead_braking"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--level", "95"), "level is 95"),
        (("--method", "wald"), "there is no method 'wald'"),
        (("nowhere",), "nowhere"),
    ],
)
def test_what_is_wrong_is_refused(
    adeye: Any, db: tuple[str, str], options: tuple[str, ...], said: str
) -> None:
    ended = adeye("confidence", *options, *db)
    assert ended.code == 2
    assert said in ended.err
    assert ended.out == ""
