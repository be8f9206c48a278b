"""Twins and what they told in the database: kept once, refused when they contradict."""

from __future__ import annotations

from dataclasses import replace

import pytest

from adeye.errors import IntegrityError
from tests.store.conftest import Store


@pytest.mark.slow
def test_what_twins_told_is_read_as_it_was_saved(store: Store) -> None:
    campaign = store.campaign(4)
    assert store.repository.hindsight.half_steps.uncertainty(campaign) == ()
    store.halved(campaign)
    (line,) = store.repository.hindsight.half_steps.uncertainty(campaign)
    found = line.difference
    assert (found.name, found.unit, found.pairs, found.uncertainty) == ("FSR9", "m", 11, 0.5)
    assert found.changes == {"PASS → FAIL": 1}
    assert (line.fsr_digest, line.judged_digest) == ("f" * 64, "e" * 64)
    store.halved(campaign)
    assert store.repository.hindsight.half_steps.uncertainty(campaign) == (line,)
    assert store.repository.verify() == ()


def test_something_else_is_refused(store: Store) -> None:
    campaign = store.campaign(4)
    store.halved(campaign)
    halves = store.repository.hindsight.half_steps
    (line,) = halves.uncertainty(campaign)
    other = replace(line, difference=replace(line.difference, p95=0.6))
    with pytest.raises(IntegrityError, match="something else before"):
        halves.save_uncertainty(campaign, [other])
    assert halves.uncertainty(campaign) == (line,)
