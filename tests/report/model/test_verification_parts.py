"""Records of the verification table."""

from adeye.judge.verdict import Outcome
from adeye.report.model.concept import Realisation


def test_only_what_came_about_as_asked_is_realised() -> None:
    outcomes = {Outcome.COMPLETED: 4, Outcome.CHANNEL_ERROR: 1, Outcome.NOT_REALISED: 2}
    item = Realisation(scenario="a", design="", planned=9, executed=7, outcomes=outcomes)
    assert item.realised == 5
