"""Twins and what they told in the database: kept once, refused when they contradict."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.store.repository import Repository


@pytest.mark.slow
def test_what_twins_told_is_read_as_it_was_saved(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 4)
    assert repository.hindsight.half_steps.uncertainty(campaign) == ()
    example.halved(repository, campaign)
    (line,) = repository.hindsight.half_steps.uncertainty(campaign)
    found = line.difference
    assert (found.name, found.unit, found.pairs, found.uncertainty) == ("FSR9", "m", 11, 0.5)
    assert found.changes == {"PASS → FAIL": 1}
    assert (line.fsr_digest, line.judged_digest) == ("f" * 64, "e" * 64)
    example.halved(repository, campaign)
    assert repository.hindsight.half_steps.uncertainty(campaign) == (line,)
    assert repository.verify() == ()


def test_something_else_is_refused(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 4)
    example.halved(repository, campaign)
    halves = repository.hindsight.half_steps
    (line,) = halves.uncertainty(campaign)
    other = replace(line, difference=replace(line.difference, p95=0.6))
    with pytest.raises(IntegrityError, match="something else before"):
        halves.save_uncertainty(campaign, [other])
    assert halves.uncertainty(campaign) == (line,)
