"""Guests may not change what is judged: whatever they write into, the rest is as it was."""

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pytest

from adeye import api
from adeye.delivery import no_measurement
from adeye.errors import IntegrityError
from adeye.judge.verdict import ExitCode
from adeye.plugins import Part
from adeye.selftest.bench import BARE, DB, DRIVING, Bench, Edit
from adeye.selftest.inputs import bounded
from adeye.signals import Measurement, Scene
from adeye.simulate.sensors.rig import _Guest
from adeye.store.read.query import run_query
from adeye.trace import Trace
from tests.simulate.sensors.scenes import CAR, scene, scene_context
from tests.stored import stored

OSCILLATES = Edit(BARE, "flaw: none", "flaw: oscillates")
"""A car whose steering fails FSR-04, so that there is something to hide."""

GUEST: str = stored("plugins")["tampering"]


@dataclass(frozen=True)
class Came:
    """What came of a campaign: exit code, traces with built-in metrics, verdicts."""

    code: ExitCode
    results: Any
    verdicts: Any
    folder: Path


def run(bench: Bench, attack: str, *edits: Edit) -> Came:
    """Run the bench with a guest that does something to what it is shown."""
    folder = bench.settle(edits)
    text = GUEST + textwrap.indent(textwrap.dedent(attack), "    ")
    for place in ("odd/guest.py", "odd/architectures/guest.py"):
        (folder / place).write_text(text, "utf-8")
    db = folder / DB
    db.unlink(missing_ok=True)
    summary = api.run(folder / DRIVING, db=db)
    # Digests of results and rows name the guest; what was measured does not.
    columns = ", ".join(
        (
            "r.trace_digest",
            "r.outcome",
            "r.trace_rows",
            "m.min_distance_m",
            "m.max_deceleration_mps2",
            "m.max_jerk_mps3",
            "m.min_ttc_s",
        )
    )
    query = f"SELECT {columns} FROM run r JOIN metric m ON m.run_number = r.number ORDER BY 1"  # noqa: S608 - ours
    numbers = run_query(db, query).rows
    verdicts = "SELECT fsr_id, verdict, margin FROM verdict ORDER BY fsr_id, margin"
    return Came(summary.exit_code, numbers, run_query(db, verdicts).rows, folder)


def listed(*names: str) -> Edit:
    return Edit(DRIVING, "plugins: []", f"plugins: [{', '.join(f'./guest.py:{n}' for n in names)}]")


_FRONT = Edit(
    BARE,
    "  localisation: {kind: localisation, rate: 20 Hz}\n",
    "  localisation: {kind: localisation, rate: 20 Hz}\n"
    "  spy: {kind: ./guest.py:Sensor, rate: 20 Hz}\n",
)
_SPY = Edit(
    BARE,
    "    parameters: {flaw: none}\n    realises: car\n",
    "    parameters: {flaw: oscillates}\n    realises: car\n"
    "  spy: {kind: ./guest.py:Channel, links: [localisation, channels.nominal], rate: 20 Hz}\n",
)
ATTACKS: dict[str, dict[str, str]] = stored("attacks")
GUESTS = {
    "traces": (OSCILLATES, listed("Metric")),
    "scenes": (OSCILLATES, _FRONT),
    "roads": (_SPY,),
}
"""What makes a metric, a sensor and a channel a guest: each is shown what it attacks."""


@pytest.mark.slow
@pytest.mark.parametrize("shown", GUESTS)
def test_what_a_guest_does_to_what_it_is_shown_changes_nothing_else(
    tmp_path: Path, shown: str
) -> None:
    bench = Bench(tmp_path)
    honest = run(bench, "pass", *GUESTS[shown])
    assert honest.code == 1
    assert ("FSR-04", "FAIL") in {row[:2] for row in honest.verdicts}
    for name, attack in ATTACKS[shown].items():
        came = run(bench, attack, *GUESTS[shown])
        assert came.code == honest.code, name
        assert came.results == honest.results, name
        assert came.verdicts == honest.verdicts, name


@pytest.mark.slow
def test_metric_does_not_change_what_another_is_shown(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bound = bounded("After", "guest_after_m", "at_least: 1e6")[1]
    edits = (OSCILLATES, listed("Metric", "After"), bound)
    attack = ATTACKS["traces"]["in_place"] + "; shown.length[:] = 1"
    honest = run(bench, "pass", *edits)
    assert ("FSR-02", "FAIL") in {row[:2] for row in honest.verdicts}
    assert run(bench, attack, *edits).verdicts == honest.verdicts


@pytest.mark.slow
def test_requirement_on_a_guests_metric_is_judged_and_the_others_are_before_it(
    tmp_path: Path,
) -> None:
    bound = bounded("Whole", "guest_m", "at_least: 0.5")
    edits = (OSCILLATES, listed("Metric"), bound[1])
    came = run(Bench(tmp_path), ATTACKS["traces"]["in_place"], *edits)
    found = {row[:2] for row in came.verdicts}
    assert {("FSR-02", "PASS"), ("FSR-04", "FAIL")} <= found
    assert came.code == 1


@pytest.mark.slow
def test_metric_that_finds_its_way_to_the_trace_itself_is_named(tmp_path: Path) -> None:
    attack = """
        frame = sys._getframe()
        while frame is not None:
            trace = getattr(frame.f_locals.get("series"), "trace", None)
            if trace is not None:
                force(trace["ego"], 0.0)
            frame = frame.f_back
        """
    with pytest.raises(IntegrityError, match=r"\./guest\.py:Metric \(guest_m\) altered the trace"):
        run(Bench(tmp_path), attack, OSCILLATES, listed("Metric"))


class Reusing:
    """A sensor that answers with one array at every tick."""

    def __init__(self, made: Measurement) -> None:
        self.made = made

    def sense(self, scene: Scene) -> Measurement:
        self.made.stamp[:] = scene.time
        return self.made


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["traces", "scenes"])
def test_guest_that_reads_what_no_identity_holds_is_not_believed(
    tmp_path: Path, shown: str
) -> None:
    bench = Bench(tmp_path)
    (tmp_path / "hidden.csv").write_text("1")
    bound = (bounded("Whole", "guest_m", "at_least: 0.5")[1],) if shown == "traces" else ()
    edits = (*GUESTS[shown][1:], *bound)
    assert run(bench, "pass", *edits).code == 0
    attack = f"open({str(tmp_path / 'hidden.csv')!r}).read()"
    came = run(bench, attack, *edits)
    assert came.code == 3
    # A sensor ends its batch, of which nothing is kept.
    kept = {("FSR-02", "ERROR")} if shown == "traces" else set()
    assert {row[:2] for row in came.verdicts if row[1] != "PASS"} == kept


def test_what_a_sensor_has_answered_stays_as_it_was() -> None:
    context = scene_context([CAR], step=0.1)
    made = no_measurement(1, 1, with_estimate=False)
    part = Part(lambda _: Reusing(made), "./own.py:Reusing", "", "")
    sensor = _Guest(part, cast("Any", None))
    first = sensor.sense(scene(context, [(40.0, 0.0)], tick=0))
    sensor.sense(scene(context, [(40.0, 0.0)], tick=9))
    assert first.stamp.tolist() == [0.0]


@pytest.mark.slow
def test_replay_of_a_tampered_run_is_of_the_truth(tmp_path: Path) -> None:
    came = run(Bench(tmp_path), ATTACKS["scenes"]["the_ego"], OSCILLATES, _FRONT)
    db = came.folder / DB
    digest = str(run_query(db, "SELECT result_digest FROM run ORDER BY number").rows[0][0])
    again = api.replay(digest, db=db)
    assert again.identical
    assert again.verdicts["FSR-04"] == "FAIL"


@pytest.mark.slow
def test_built_in_parts_pay_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hashed = []
    honest = Trace._digest

    def count(self: Trace) -> list[tuple[str, str]]:
        hashed.append(1)
        return honest(self)

    monkeypatch.setattr(Trace, "_digest", count)
    run(Bench(tmp_path), "pass")
    assert len(hashed) == 1
