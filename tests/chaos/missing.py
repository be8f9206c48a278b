"""Evidence that is not there, or says nothing: never green, and what is missing is named."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

from adeye.campaign import run as runner
from adeye.testing import zoo
from tests.chaos.bench import DB, ODD_FILE, Bench, Said
from tests.chaos.ways import Do, Way, edited, fsr
from tests.project import CANDIDATE, CONCEPT

NO_VALUE: Final = (
    "FSR-06 ERROR for camera_radar (odd_m, the metric has no finite value that it may have)"
)
TIGHT: Final = "always(abs(ego.lane_offset) <= 0.001 m)"
LEAD_BRAKING: Final = "scenarios_db/motorway/lead_braking.yaml"
gated = partial(edited, then=Bench.run_and_gate)
in_odd = partial(gated, ODD_FILE)
not_realised = edited(
    LEAD_BRAKING, lambda scenario: scenario["storyboard"]["brake"].update(when="time >= 100 s")
)


def spoilt_metric(body: str, *options: str) -> Do:
    def spoil(bench: Bench) -> Said:
        bench.metric(body)
        return bench.run(*options)

    return spoil


def broken_channel(body: str) -> Do:
    def spoil(bench: Bench) -> Said:
        bench.channel(body)
        return bench.run("--workers", "1")

    return spoil


def others_collide(scenario: Any) -> None:
    for name, gap, speed in (("still", "40 m", "0 m/s"), ("fast", "32 m", "30 m/s")):
        start = {"lane": 0, "ahead_of": "ego", "gap": gap, "speed": speed}
        scenario["actors"][name] = {"kind": "car", "start": start}


def waive(concept: Any, *names: str, expires: str) -> None:
    chosen = names or [item["id"] for item in concept["requirements"]]
    waiver = {"reason": "known", "author": "me", "expires": expires}
    concept["waivers"] = [{"requirement": name, **waiver} for name in chosen]


def without(concept: Any, word: str) -> None:
    """Take away the FSRs whose id or formula has a word."""
    kept = [i for i in concept["requirements"] if word not in i["id"] + i.get("formula", "")]
    concept["requirements"] = kept


def interrupted(bench: Bench, blocks: int = 0) -> Said:
    """Interrupt another campaign after some blocks."""
    bench.monkeypatch.setattr(runner, "block_size", lambda _: 1)
    absorb, left = runner._absorb, iter(range(blocks))

    def stop(*arguments: Any) -> Any:
        if next(left, None) is None:
            raise KeyboardInterrupt
        return absorb(*arguments)

    bench.monkeypatch.setattr(runner, "_absorb", stop)
    with bench.edited() as odd:
        odd["seed"] = 8
    return bench.run("--threads", "1")


def interrupted_and_judged(bench: Bench) -> Said:
    assert interrupted(bench, blocks=2).code == 130
    return bench.gate()


def mastered_channel(bench: Bench) -> Said:
    bench.channel("raise RuntimeError('no track')")
    with bench.edited(CANDIDATE) as content:
        content["switch"]["policy"] = "fixed_priority"
    return edited(CONCEPT, lambda concept: without(concept, "silent"))(bench)


def hanging_channel(bench: Bench) -> Said:
    zoo.settle(bench.folder / "odd" / "architectures")
    with bench.edited(CANDIDATE) as content:
        nominal = content["channels"]["nominal"]
        nominal |= {"kind": "process", "parameters": zoo.parameters("hangs_in_c")}
        content["switch"]["policy"] = "stuck"
    return bench.run("--workers", "1")


def architecture_gone(bench: Bench) -> Said:
    with bench.edited(CANDIDATE) as content:
        content["architecture"] = "renamed"
    return in_odd(lambda odd: odd.update(gate={"architectures": ["renamed"]}))(bench)


def out_of_the_gate(bench: Bench) -> Said:
    with bench.edited(CANDIDATE) as content:
        twin = {**content, "architecture": "twin"}
    bench.write("odd/architectures/twin.yaml", twin)
    with bench.edited() as odd:
        odd["architectures"].append("architectures/twin.yaml")
        odd["gate"] = {"architectures": ["twin"]}
    return bench.run_and_gate()


def put_back_to_what_failed(bench: Bench) -> Said:
    path = bench.folder / CONCEPT
    concept = path.read_text("utf-8")
    fsr("FSR-06", formula=TIGHT)(bench)
    failing_concept = path.read_text("utf-8")
    for text in (concept, failing_concept):
        path.write_text(text, "utf-8")
        bench.run()
    # No new campaign came of the third run, and yet it is the latest.
    return bench.adeye("gate", "--db", DB)


def update_of_incomplete(bench: Bench) -> Said:
    not_realised(bench)
    return bench.gate("--update")


WAYS: Final = [
    Way("metric that raises", 3, NO_VALUE, spoilt_metric("raise RuntimeError('no track')")),
    Way("metric that is NaN", 3, NO_VALUE, spoilt_metric("values[0] = np.nan")),
    Way("metric that is infinite", 3, NO_VALUE, spoilt_metric("values[0] = np.inf")),
    Way("metric of a wrong shape", 3, NO_VALUE, spoilt_metric("values = values[:-1]")),
    Way("metric with an unknown status", 3, NO_VALUE,
        spoilt_metric("statuses = ('fine',) * runs")),
    Way("metric that leaves the process", 3, NO_VALUE, spoilt_metric("raise SystemExit(0)")),
    Way("FSR whose precondition never holds", 3, "FSR-08 VACUOUS",
        fsr("FSR-08", formula="always(ego.speed > 60 m/s implies ego.speed >= 90 m/s)")),
    Way("fewer exercised runs than asked for", 3, "FSR-06 VACUOUS", fsr("FSR-06", min_exercised=7)),
    Way("scenario that does not come about", 3, "INVALID", not_realised),
    Way("other traffic collides first", 3, "INVALID", edited(LEAD_BRAKING, others_collide)),
    Way("waiver that has expired", 3, "INVALID",
        edited(CONCEPT, partial(waive, expires="2020-01-31"), not_realised)),
    Way("interrupted campaign that is judged", 3, "2 of 6 test cases", interrupted_and_judged),
    Way("campaign that is interrupted", 130, "go on with: adeye run", interrupted),
    Way("worker that is killed", 3, "blocks were given up",
        spoilt_metric("os.kill(os.getpid(), 9)", "--workers", "2"), is_slow=True),
    Way("channel that raises", 1, "channel_error of channel nominal",
        broken_channel("raise RuntimeError('no track')")),
    Way("channel that raises and is mastered", 3, "(RuntimeError: no track (guest.py:",
        mastered_channel),
    Way("channel that answers NaN", 1, "channel_invalid_output of channel nominal",
        broken_channel("return float('nan'), 0.0")),
    Way("channel that hangs", 1, "channel_timeout of channel nominal", hanging_channel,
        is_slow=True),
    Way("FSR of the baseline is gone", 3, "missing: FSR-05: the FSR is gone",
        gated(CONCEPT, lambda concept: without(concept, "FSR-05"))),
    Way("scenario of the baseline is gone", 3, "missing: lead_braking",
        in_odd(lambda odd: odd["scenarios"].pop())),
    Way("architecture of the baseline is gone", 3, "missing: camera_radar", architecture_gone),
    Way("test case of the baseline is gone", 3, "2 of 4 test cases are gone",
        in_odd(lambda odd: odd["scenarios"][0]["sweep"]["parameters"].update(gap=["50 m"]))),
    Way("fault entry of the baseline is gone", 3, "fault entries nominal_silent",
        in_odd(lambda odd: odd["scenarios"][0].update(faults=["none"]))),
    Way("fault that comes later than it did", 3, "fault entries nominal_silent",
        in_odd(lambda odd: odd["faults"][0].update(onset={"when": "time >= 9 s"}))),
    Way("threshold that was loosened", 3, "changed: FSR-06",
        fsr("FSR-06", Bench.run_and_gate, formula="always(abs(ego.lane_offset) <= 1.6 m)")),
    Way("FSR that was made optional", 3, "FSR-06: was mandatory",
        fsr("FSR-06", Bench.run_and_gate, mandatory=False)),
    Way("architecture taken out of the gate", 3, "camera_radar: was in the gate", out_of_the_gate),
    Way("waiver that was added", 3, "FSR-06: is waived until",
        gated(CONCEPT, lambda concept: waive(concept, "FSR-06", expires="2999-01-01"))),
    Way("architecture that fails now", 1, "newly failing",
        gated(CANDIDATE, lambda content: content["switch"].update(policy="stuck"))),
    Way("margin lost against the baseline", 1, "margin: FSR-05",
        gated(CANDIDATE, lambda content: content["channels"]["safety"].update(
            parameters={"stop_deceleration": "4.3 m/s^2"}))),
    Way("file edited since it was run", 3, "edited: requirements FSR-06",
        fsr("FSR-06", lambda bench: bench.adeye("gate", ODD_FILE, "--db", DB), formula=TIGHT)),
    Way("files put back to what failed", 1, "FSR-06, camera_radar", put_back_to_what_failed),
    Way("baseline written from too little", 3, "was not written", update_of_incomplete),
]  # fmt: skip
