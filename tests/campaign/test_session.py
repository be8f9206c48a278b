"""What a session is without options, and when it has ended."""

from adeye.campaign.run import DEADLINE_S, Limits, Session, Stop


def test_a_session_without_options_leaves_nothing_out() -> None:
    session = Session()
    assert session.choice.is_everything
    assert session.limits.allow(10**9)
    assert session.deadline_s == DEADLINE_S == 3_600.0
    assert not session.has_ended


def test_two_sessions_share_nothing() -> None:
    first, second = Session(), Session()
    first.limits.reached = "enough"
    first.stop.asked = KeyboardInterrupt
    assert not second.has_ended


def test_whatever_is_reached_or_asked_ends_it() -> None:
    assert Session(limits=Limits(reached="enough")).has_ended
    assert Session(stop=Stop(asked=KeyboardInterrupt)).has_ended
