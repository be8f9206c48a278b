"""Numbers that the compiled parts of the switch share fit what the file says."""

from typing import get_args

from adeye.signals import NO_CHANNEL
from adeye.simulate.switch import policy as columns
from adeye.spec.switch import Switch


def test_policies_are_those_of_the_file_in_its_order() -> None:
    assert get_args(Switch.model_fields["policy"].annotation) == columns.POLICIES
    numbers = (columns.FIXED_PRIORITY, columns.HYSTERESIS, columns.VOTING, columns.STUCK)
    assert numbers == tuple(range(len(columns.POLICIES)))


def test_before_the_first_channel_is_neither_a_channel_nor_nobody() -> None:
    assert {columns.START, NO_CHANNEL} == {-2, -1}
