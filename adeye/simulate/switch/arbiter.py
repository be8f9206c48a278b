"""The switch on a batch: proposals of all channels in, the acting command and its holder out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.jit import compiled
from adeye.signals import (
    NO_CHANNEL,
    Authority,
    Bools,
    ControlCommand,
    Floats,
    Ints,
    SwitchFaults,
    parameter_record,
    spec_columns,
)
from adeye.simulate.switch.handover import blend, connect
from adeye.simulate.switch.policy import (
    ACCELERATION,
    CONNECTED,
    HOLDER,
    NUMBERS,
    PENDING,
    POLICIES,
    QUIET,
    SOURCE,
    START,
    STEERING,
    WORDS,
    Bench,
    decide,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SwitchContext, SwitchModel
    from adeye.spec.switch import Switch


def make_switch(context: SwitchContext) -> SwitchModel:
    """Build the switch of an architecture.

    Args:
        context: Spec of each run, channel ids and clock.
    """
    return Arbiter(context)


class Arbiter:
    """Decides by the policy of each run, and hands authority over as it says.

    A channel is usable unless it is in fault, its command is not finite, or it is older than the
    staleness time. Only a usable channel's command acts; without one the ego coasts: no
    acceleration, steering as last commanded.

    *Fixed priority*: the default channel acts until another has requested authority for the
    debounce time, the first in order of priority if there are several, or until the acting channel
    is unusable. Then the first usable channel in order of priority acts. Authority that a channel
    above the default has taken is kept if the switch latches; a request of higher priority still
    overrides it.

    *Hysteresis*: the same, but authority that any channel has taken from the default goes back once
    the default has been usable, neither silent nor degraded, and nobody has requested authority,
    for ``return_after`` without a break.

    *Voting*: the default acts while a majority of the voters agrees with it, else the first voter
    in order of priority that one agrees with, see ``voting``. Requests count of those only that do
    not vote. Without a majority ``without_majority`` acts, or nobody.

    *Stuck*: the default, whatever happens.

    Start-up: a default that has not been usable yet, or a majority that has not been there yet,
    hands over to nobody before the staleness time has passed since the start, because sensors with
    latency have not delivered by then.
    """

    def __init__(self, context: SwitchContext) -> None:
        specs, ids = context.specs, context.channels
        runs, count = len(specs), len(ids)
        self._bench = Bench(
            records=parameter_record(
                spec_columns(specs, lambda spec: _numbers(spec, ids, context.step))
            ),
            order=np.full((runs, count), -1, dtype=np.int64),
            voters=np.zeros((runs, count), dtype=np.bool_),
            numbers=np.zeros((runs, count, 3)),
            status=np.zeros((runs, count), dtype=np.int64),
            since=np.full((runs, count), np.nan),
            words=np.zeros((runs, WORDS), dtype=np.int64),
            memory=np.zeros((runs, NUMBERS)),
            usable=np.zeros(count, dtype=np.bool_),
            group=np.zeros(count, dtype=np.bool_),
        )
        self._bench.words[:, [HOLDER, PENDING]] = NO_CHANNEL
        self._bench.words[:, [CONNECTED, SOURCE]] = START
        self._bench.memory[:, QUIET] = np.nan
        for run, spec in enumerate(specs):
            ranked = [ids.index(name) for name in spec.priority]
            self._bench.order[run, : len(ranked)] = ranked
            if spec.policy == "voting":
                self._bench.voters[run, [ids.index(name) for name in spec.voters or ()]] = True
        self._sound = SwitchFaults.none(runs)

    def arbitrate(
        self,
        time: float,
        proposals: Sequence[ControlCommand],
        faults: SwitchFaults | None = None,
    ) -> tuple[Floats, Authority]:
        """Return the acting command (B, 2) and who has authority, why.

        Args:
            time: Of this tick [s].
            proposals: Newest command of every channel, in the architecture's order.
            faults: What is wrong with the switch itself at this tick; None for nothing.
        """
        bench = self._bench
        for index, proposal in enumerate(proposals):
            bench.numbers[:, index, 0] = proposal.acceleration
            bench.numbers[:, index, 1] = proposal.steering_angle
            bench.numbers[:, index, 2] = proposal.stamp
            bench.status[:, index] = proposal.status
        wrong = self._sound if faults is None else faults
        runs = bench.words.shape[0]
        command = np.zeros((runs, 2))
        decision = np.zeros((runs, 2), dtype=np.int64)
        _arbitrate(bench, time, wrong.stuck, wrong.delay, command, decision)
        return command, Authority(decision[:, 0].copy(), decision[:, 1].copy())


def _numbers(spec: Switch, ids: tuple[str, ...], step: float) -> dict[str, float]:
    fallback = spec.without_majority
    bumpless = spec.bumpless
    return {
        "policy": POLICIES.index(spec.policy),
        "default": ids.index(spec.default),
        "debounce": spec.debounce,
        "latch": spec.latch,
        "staleness": spec.staleness,
        "return_after": np.inf if spec.return_after is None else spec.return_after,
        "return_degraded": spec.return_degraded,
        "acceleration_tolerance": spec.acceleration_tolerance or 0.0,
        "steering_tolerance": spec.steering_tolerance or 0.0,
        "quorum": spec.agreeing,
        "median": spec.vote == "median",
        "fallback": NO_CHANNEL if fallback is None else ids.index(fallback),
        "handover": spec.handover,
        "coasts": spec.meanwhile == "coast",
        "is_bumpless": bumpless is not None,
        "most_jerk": np.inf if bumpless is None else bumpless.jerk * step,
        "most_steering": np.inf if bumpless is None else bumpless.steering_rate * step,
    }


@compiled
def _arbitrate(
    bench: Bench, time: float, stuck: Bools, delay: Floats, command: Floats, decision: Ints
) -> None:
    for run in range(bench.records.shape[0]):
        chosen, why = decide(bench, run, time)
        acting, reason = connect(bench, run, time, chosen, why, stuck[run], delay[run])
        blend(bench, run, acting)
        decision[run, 0] = acting
        decision[run, 1] = reason
        command[run, 0] = bench.memory[run, ACCELERATION]
        command[run, 1] = bench.memory[run, STEERING]
