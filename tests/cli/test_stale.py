"""``stale``: what it prints of a campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


@pytest.mark.slow
def test_nothing_is_stale_after_a_run(adeye: Any, mini: Executed) -> None:
    done = adeye("stale", str(mini.project.odd), "--db", str(mini.db))
    assert done.code == 0, done.err
    found = adeye("stale", str(mini.project.odd), "--db", str(mini.db), "--json").document
    assert found["counts"] == found["evidence"] == found["now"]["there"] > 0
    assert found["stale"] == []
    assert f"{found['counts']:,} of {found['evidence']:,} verdicts still count" in done.out


def test_odd_without_campaign_is_an_input_error(adeye: Any, mini: Executed, tmp_path: Path) -> None:
    done = adeye("stale", str(mini.project.odd), "--db", str(tmp_path / "no.db"))
    assert done.code == 2
