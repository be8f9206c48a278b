"""Files that ask for nothing, or for what cannot be judged: refused before anything runs."""

from __future__ import annotations

from typing import Final

from tests.chaos.bench import BASELINE, Bench, Said
from tests.chaos.ways import Way

CONCEPT: Final = "odd/concepts/motorway_chauffeur.yaml"


def no_scenario(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["scenarios"] = []
    return bench.run()


def where_leaves_nothing(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["scenarios"][0]["sweep"]["where"] = ["gap < 1 m"]
    return bench.run()


def no_architecture(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["gate"] = {"architectures": []}
    return bench.run()


def duplicate_id(bench: Bench) -> Said:
    with bench.edited(CONCEPT) as concept:
        concept["requirements"][1]["id"] = "FSR-01"
    return bench.run()


def no_requirement(bench: Bench) -> Said:
    with bench.edited(CONCEPT) as concept:
        concept["requirements"] = []
    return bench.run()


def unknown_signal(bench: Bench) -> Said:
    with bench.fsr("FSR-06") as fsr:
        fsr["formula"] = "always(abs(ego.lane_offsett) <= 0.6 m)"
    return bench.run()


def not_applicable(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["architectures"].append("architectures/legacy_camera.yaml")
    with bench.fsr("FSR-08") as fsr:
        fsr["formula"] = "always(sensor.front_radar.age <= 0.4 s)"
    with bench.edited() as odd:
        odd["gate"] = {"architectures": ["legacy_camera"]}
    return bench.run()


def plugin_is_gone(bench: Bench) -> Said:
    bench.metric("pass")
    (bench.folder / "odd" / "odd_metric.py").unlink()
    return bench.run()


def baseline_of_another_odd(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["odd"] = "another"
    return bench.run_and_gate()


def baseline_cut_short(bench: Bench) -> Said:
    path = bench.folder / BASELINE
    path.write_bytes(path.read_bytes()[:-400])
    return bench.gate()


def baseline_is_gone(bench: Bench) -> Said:
    (bench.folder / BASELINE).unlink()
    return bench.gate()


def no_database(bench: Bench) -> Said:
    (bench.folder / "adeye.db").unlink()
    return bench.gate()


def tolerance_of_nothing(bench: Bench) -> Said:
    return bench.gate("--tolerance", "FSR-66=100")


WAYS: Final = [
    Way("ODD without a scenario", 2, "scenarios", no_scenario),
    Way(
        "`where` that excludes every point",
        2,
        "none of 2 combinations fulfils gap < 1 m",
        where_leaves_nothing,
    ),
    Way("gate without an architecture", 2, "gate", no_architecture),
    Way("concept without an FSR", 2, "requirements", no_requirement),
    Way("two FSRs with one id", 2, "'FSR-01' is defined twice", duplicate_id),
    Way("FSR over an unknown signal", 2, "ego.lane_offsett", unknown_signal),
    Way("FSR that does not apply to the gate", 2, "sensor.front_radar.age", not_applicable),
    Way("plug-in whose file is gone", 2, "odd_metric.py", plugin_is_gone),
    Way("baseline of another ODD", 2, "baseline of ODD 'small'", baseline_of_another_odd),
    Way("baseline cut short", 2, "this is no baseline", baseline_cut_short),
    Way("baseline that is not there", 2, "there is no such baseline", baseline_is_gone),
    Way("database that is not there", 2, "adeye.db", no_database),
    Way("tolerance for an FSR that is not there", 2, "'FSR-66'", tolerance_of_nothing),
]
