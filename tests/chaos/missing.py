"""Evidence that is not there, or says nothing: never green, and what is missing is named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from adeye.campaign import run as runner
from adeye.testing import zoo
from tests.chaos.bench import DB, ODD_FILE, Bench, Said
from tests.chaos.ways import Way

CONCEPT: Final = "odd/concepts/motorway_chauffeur.yaml"
NO_VALUE: Final = "FSR-06 ERROR for camera_radar (odd_m, the metric has no finite value)"
EXPIRED: Final = "2020-01-31"


def spoilt_metric(body: str) -> Callable[[Bench], Said]:
    def spoil(bench: Bench) -> Said:
        bench.metric(body)
        return bench.run()

    return spoil


def vacuous(bench: Bench) -> Said:
    with bench.fsr("FSR-08") as fsr:
        fsr["formula"] = "always(time > 900 s implies ego.speed >= 500 m/s)"
    return bench.run()


def too_few_exercised(bench: Bench) -> Said:
    with bench.fsr("FSR-06") as fsr:
        fsr["min_exercised"] = 7
    return bench.run()


def not_realised(bench: Bench) -> Said:
    with bench.scenario() as scenario:
        scenario["storyboard"]["brake"]["when"] = "time >= 100 s"
    return bench.run()


def others_collide(bench: Bench) -> Said:
    with bench.scenario() as scenario:
        still = {"lane": 0, "ahead_of": "ego", "gap": "40 m", "speed": "0 m/s"}
        fast = {"lane": 0, "ahead_of": "ego", "gap": "32 m", "speed": "30 m/s"}
        scenario["actors"]["still"] = {"kind": "car", "start": still}
        scenario["actors"]["fast"] = {"kind": "car", "start": fast}
    return bench.run()


def waiver(bench: Bench, expires: str) -> Said:
    with bench.edited(CONCEPT) as concept:
        ids = [item["id"] for item in concept["requirements"]]
        concept["waivers"] = [
            {"requirement": name, "reason": "known", "author": "me", "expires": expires}
            for name in ids
        ]
    return not_realised(bench)


def waiver_expired(bench: Bench) -> Said:
    return waiver(bench, EXPIRED)


def interrupted(bench: Bench) -> Said:
    bench.monkeypatch.setattr(runner, "block_size", lambda _: 1)
    with bench.edited() as odd:
        odd["seed"] = 8
    absorb = runner._absorb
    blocks = []

    def stop(*arguments: Any) -> Any:
        blocks.append(1)
        if len(blocks) > 2:
            raise KeyboardInterrupt
        return absorb(*arguments)

    bench.monkeypatch.setattr(runner, "_absorb", stop)
    assert bench.run("--threads", "1").code == 130
    return bench.gate()


def interruption_itself(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["seed"] = 8

    def stop(*_: Any) -> Any:
        raise KeyboardInterrupt

    bench.monkeypatch.setattr(runner, "_absorb", stop)
    return bench.run("--threads", "1")


def killed_worker(bench: Bench) -> Said:
    bench.metric("os.kill(os.getpid(), 9)")
    return bench.run("--workers", "2")


def broken_channel(body: str) -> Callable[[Bench], Said]:
    def spoil(bench: Bench) -> Said:
        bench.channel(body)
        return bench.run("--workers", "1")

    return spoil


def mastered_channel(bench: Bench) -> Said:
    bench.channel("raise RuntimeError('no track')")
    with bench.architecture() as content:
        content["switch"]["policy"] = "fixed_priority"
    with bench.edited(CONCEPT) as concept:
        concept["requirements"] = [
            item for item in concept["requirements"] if "silent" not in item.get("formula", "")
        ]
    return bench.run("--workers", "1")


def hanging_channel(bench: Bench) -> Said:
    zoo.settle(bench.folder / "odd" / "architectures")
    with bench.architecture() as content:
        nominal = content["channels"]["nominal"]
        nominal |= {"kind": "process", "parameters": zoo.parameters("hangs_in_c")}
        content["switch"]["policy"] = "stuck"
    return bench.run("--workers", "1")


def fsr_gone(bench: Bench) -> Said:
    with bench.edited(CONCEPT) as concept:
        concept["requirements"] = [
            item for item in concept["requirements"] if item["id"] != "FSR-05"
        ]
    return bench.run_and_gate()


def scenario_gone(bench: Bench) -> Said:
    with bench.edited() as odd:
        del odd["scenarios"][1]
    return bench.run_and_gate()


def architecture_gone(bench: Bench) -> Said:
    with bench.architecture() as content:
        content["architecture"] = "renamed"
    with bench.edited() as odd:
        odd["gate"] = {"architectures": ["renamed"]}
    return bench.run_and_gate()


def case_gone(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["scenarios"][0]["sweep"]["parameters"]["gap"] = ["50 m"]
    return bench.run_and_gate()


def fault_gone(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["scenarios"][0]["faults"] = ["none"]
    return bench.run_and_gate()


def fault_made_mild(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["faults"][0]["onset"] = {"when": "time >= 9 s"}
    return bench.run_and_gate()


def threshold_loosened(bench: Bench) -> Said:
    with bench.fsr("FSR-06") as fsr:
        fsr["formula"] = "always(abs(ego.lane_offset) <= 1.6 m)"
    return bench.run_and_gate()


def made_optional(bench: Bench) -> Said:
    with bench.fsr("FSR-06") as fsr:
        fsr["mandatory"] = False
    return bench.run_and_gate()


def out_of_the_gate(bench: Bench) -> Said:
    with bench.architecture() as content:
        twin = {**content, "architecture": "twin"}
    bench.write("odd/architectures/twin.yaml", twin)
    with bench.edited() as odd:
        odd["architectures"].append("architectures/twin.yaml")
        odd["gate"] = {"architectures": ["twin"]}
    return bench.run_and_gate()


def waiver_added(bench: Bench) -> Said:
    with bench.edited(CONCEPT) as concept:
        concept["waivers"] = [
            {"requirement": "FSR-06", "reason": "x", "author": "me", "expires": "2999-01-01"}
        ]
    return bench.run_and_gate()


def failing(bench: Bench) -> Said:
    with bench.architecture() as content:
        content["switch"]["policy"] = "stuck"
    return bench.run_and_gate()


def margin_lost(bench: Bench) -> Said:
    with bench.architecture() as content:
        content["channels"]["safety"]["parameters"] = {"stop_deceleration": "4.3 m/s^2"}
    return bench.run_and_gate()


def edited_and_not_run(bench: Bench) -> Said:
    with bench.fsr("FSR-06") as fsr:
        fsr["formula"] = "always(abs(ego.lane_offset) <= 0.001 m)"
    return bench.adeye("gate", ODD_FILE, "--db", DB)


def put_back_to_what_failed(bench: Bench) -> Said:
    concept = (bench.folder / CONCEPT).read_text("utf-8")
    with bench.fsr("FSR-06") as fsr:
        fsr["formula"] = "always(abs(ego.lane_offset) <= 0.001 m)"
    failing_concept = (bench.folder / CONCEPT).read_text("utf-8")
    for text in (failing_concept, concept, failing_concept):
        (bench.folder / CONCEPT).write_text(text, "utf-8")
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
    Way("FSR whose precondition never holds", 3, "FSR-08 VACUOUS", vacuous),
    Way("fewer exercised runs than asked for", 3, "FSR-06 VACUOUS", too_few_exercised),
    Way("scenario that does not come about", 3, "INVALID", not_realised),
    Way("other traffic collides first", 3, "INVALID", others_collide),
    Way("waiver that has expired", 3, "INVALID", waiver_expired),
    Way("interrupted campaign that is judged", 3, "2 of 6 test cases", interrupted),
    Way("campaign that is interrupted", 130, "go on with: adeye run", interruption_itself),
    Way("worker that is killed", 3, "blocks were given up", killed_worker, is_slow=True),
    Way("channel that raises", 1, "channel_error of channel nominal",
        broken_channel("raise RuntimeError('no track')")),
    Way("channel that raises and is mastered", 3, "(RuntimeError: no track (guest.py:",
        mastered_channel),
    Way("channel that answers NaN", 1, "channel_invalid_output of channel nominal",
        broken_channel("return float('nan'), 0.0")),
    Way("channel that hangs", 1, "channel_timeout of channel nominal", hanging_channel,
        is_slow=True),
    Way("FSR of the baseline is gone", 3, "missing: FSR-05: the FSR is gone", fsr_gone),
    Way("scenario of the baseline is gone", 3, "missing: lead_braking", scenario_gone),
    Way("architecture of the baseline is gone", 3, "missing: camera_radar", architecture_gone),
    Way("test case of the baseline is gone", 3, "2 of 4 test cases are gone", case_gone),
    Way("fault entry of the baseline is gone", 3, "fault entries nominal_silent", fault_gone),
    Way("fault that comes later than it did", 3, "fault entries nominal_silent", fault_made_mild),
    Way("threshold that was loosened", 3, "changed: FSR-06", threshold_loosened),
    Way("FSR that was made optional", 3, "FSR-06: was mandatory", made_optional),
    Way("architecture taken out of the gate", 3, "camera_radar: was in the gate", out_of_the_gate),
    Way("waiver that was added", 3, "FSR-06: is waived until", waiver_added),
    Way("architecture that fails now", 1, "newly failing", failing),
    Way("margin lost against the baseline", 1, "margin: FSR-05", margin_lost),
    Way("file edited since it was run", 3, "edited: requirements FSR-06", edited_and_not_run),
    Way("files put back to what failed", 1, "FSR-06, camera_radar", put_back_to_what_failed),
    Way("baseline written from too little", 3, "was not written", update_of_incomplete),
]  # fmt: skip
