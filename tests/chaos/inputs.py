"""Files that ask for nothing, or for what cannot be judged: refused before anything runs."""

from __future__ import annotations

from typing import Final

from tests.chaos.bench import BASELINE, DB, ODD_FILE, Bench, Said
from tests.chaos.ways import Do, Way, edited, fsr
from tests.project import CONCEPT


def not_applicable(bench: Bench) -> Said:
    with bench.edited() as odd:
        odd["architectures"].append("architectures/legacy_camera.yaml")
        odd["gate"] = {"architectures": ["legacy_camera"]}
    return fsr("FSR-08", formula="always(sensor.front_radar.age <= 0.4 s)")(bench)


def plugin_is_gone(bench: Bench) -> Said:
    bench.metric("pass")
    (bench.folder / "odd" / "odd_metric.py").unlink()
    return bench.run()


def cut(name: str, until: int) -> Do:
    """Cut a file short, or take it away; then ask the gate."""

    def do(bench: Bench) -> Said:
        path = bench.folder / name
        content = path.read_bytes()[:until]
        path.unlink()
        if content:
            path.write_bytes(content)
        return bench.gate()

    return do


WAYS: Final = [
    Way("ODD without a scenario", 2, "scenarios",
        edited(ODD_FILE, lambda odd: odd.update(scenarios=[]))),
    Way("`where` that excludes every point", 2, "none of 2 combinations fulfils gap < 1 m",
        edited(ODD_FILE, lambda odd: odd["scenarios"][0]["sweep"].update(where=["gap < 1 m"]))),
    Way("gate without an architecture", 2, "gate",
        edited(ODD_FILE, lambda odd: odd.update(gate={"architectures": []}))),
    Way("concept without an FSR", 2, "requirements",
        edited(CONCEPT, lambda concept: concept.update(requirements=[]))),
    Way("two FSRs with one id", 2, "'FSR-01' is defined twice",
        edited(CONCEPT, lambda concept: concept["requirements"][1].update(id="FSR-01"))),
    Way("FSR over an unknown signal", 2, "ego.lane_offsett",
        fsr("FSR-06", formula="always(abs(ego.lane_offsett) <= 0.6 m)")),
    Way("FSR that does not apply to the gate", 2, "sensor.front_radar.age", not_applicable),
    Way("plug-in whose file is gone", 2, "odd_metric.py", plugin_is_gone),
    Way("baseline of another ODD", 2, "baseline of ODD 'small'",
        edited(ODD_FILE, lambda odd: odd.update(odd="another"), Bench.run_and_gate)),
    Way("baseline cut short", 2, "this is no baseline", cut(BASELINE, -400)),
    Way("baseline that is not there", 2, "there is no such baseline", cut(BASELINE, 0)),
    Way("database that is not there", 2, "adeye.db", cut(DB, 0)),
    Way("tolerance for an FSR that is not there", 2, "'FSR-66'",
        lambda bench: bench.gate("--tolerance", "FSR-66=100")),
]  # fmt: skip
