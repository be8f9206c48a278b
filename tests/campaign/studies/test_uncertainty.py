"""Reading what halving the step changed: only of a campaign that asked for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign.studies.half_step import uncertainty_table
from adeye.errors import InputError

if TYPE_CHECKING:
    from tests.project import Executed


@pytest.mark.parametrize("what", [None, "mini", "1"])
def test_campaign_that_did_not_ask_is_refused(mini: Executed, what: str | None) -> None:
    with pytest.raises(InputError, match="without numeric uncertainty"):
        uncertainty_table(mini.db, what)
