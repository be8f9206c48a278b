"""What each verb prints of one small campaign, in words and as JSON, pinned whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Verb
from tests.frozen import as_json, assert_frozen, masked, thinned
from tests.project import ROOT, Executed
from tests.sql import rows

READS: dict[str, tuple[str, ...]] = {
    "show": ("show", "RUN"),
    "show_all": ("show", "FAULTY", "--all"),
    "show_worst": ("show", "--worst", "FSR-02"),
    "timeline": ("timeline", "FAULTY", "--quiet"),
    "coverage": ("coverage", "ODD"),
    "plan": ("plan", "ODD"),
    "plan_list": ("plan", "ODD", "--list"),
    "signals": ("signals", "ODD"),
    "sensors": ("sensors", "ARCHITECTURE"),
    "dependencies": ("dependencies", "ODD"),
    "check": ("check", "ODD"),
    "gate": ("gate",),
    "stale": ("stale", "ODD"),
    "where": ("where", "FSR-02"),
    "where_by": ("where", "FSR-02", "--by", "gap"),
    "confidence": ("confidence",),
    "compare": ("compare",),
    "matrix": ("matrix",),
    "verify": ("db", "verify"),
    "scenarios": ("scenario", "list"),
    "scenario": ("scenario", "show", "cut_in"),
    "trace": ("trace", "FAULTY", "-s", "ego.*", "-s", "channel.*", "-s", "ttc"),
}
OF_NO_DATABASE = {"plan", "signals", "sensors", "dependencies", "scenario"}


def named(word: str, mini: Executed) -> str:
    """Put the file or run of the campaign in the place of its word."""
    project = mini.project
    if word in {"RUN", "FAULTY"}:
        sql = (
            "SELECT run FROM v_runs WHERE scenario = 'cut_in' AND fault_entry = ? "
            "AND architecture = 'camera_radar' ORDER BY ordinal"
        )
        fault = "none" if word == "RUN" else "nominal_silent"
        return str(rows(mini.db, sql, fault)[0][0])
    return {"ODD": str(project.odd), "ARCHITECTURE": str(project.folder / ARCHITECTURE)}.get(
        word, word
    )


ARCHITECTURE = "odd/architectures/camera_radar.yaml"


@pytest.mark.parametrize("name", READS)
@pytest.mark.parametrize("form", ["txt", "json"])
def test_what_a_verb_prints_is_frozen(adeye: Verb, mini: Executed, name: str, form: str) -> None:
    words = [named(word, mini) for word in READS[name]]
    if words[0] not in OF_NO_DATABASE:
        words += ["--db", str(mini.db)]
    if form == "json":
        words.append("--json")
    told = adeye(*words)
    folders = mini.project.folder, ROOT
    if form == "json":
        assert_frozen(f"verb_{name}.json", as_json(thinned(json.loads(told.out)), *folders))
    else:
        lines = told.out.splitlines()
        # Of a table of each row of a trace, every tenth.
        out = "\n".join(lines if len(lines) < 150 else lines[::10])
        text = f"{out}\n-- {told.code}\n{told.err}"
        assert_frozen(f"verb_{name}.txt", masked(text, *folders))


CONTENT = ROOT / "tests" / "content" / "maps"


@pytest.mark.parametrize("name", sorted(path.stem for path in CONTENT.glob("*.xodr")))
def test_what_verbs_say_of_a_map_is_frozen(adeye: Verb, folder: Path, name: str) -> None:
    path = str(CONTENT / f"{name}.xodr")
    parts = []
    for words in (("show",), ("check",)):
        told = adeye("map", *words, path)
        parts.append(f"-- {' '.join(words)}: {told.code}\n{told.out}{told.err}")
        document = json.loads(adeye("map", *words, path, "--json").out)
        parts.append(as_json(thinned(document), ROOT, folder))
    adeye("map", "export", path, "--lanes", "lanes.csv", "--step", "9").ok  # noqa: B018 - is checked
    lines = (folder / "lanes.csv").read_text("utf-8").splitlines()
    parts.append("\n".join([lines[0], *lines[1::5]]))
    adeye("map", "export", path, "--xodr", "again.xodr").ok  # noqa: B018 - is checked
    parts.append((folder / "again.xodr").read_text("utf-8"))
    assert_frozen(f"map_verbs_{name}.txt", masked("\n".join(parts), ROOT, folder))


TABLES = {
    "even": "time [s],gap [m],speed,on,mode\n"
    + "".join(
        f"{at / 10:g},{30 - at:g},{20 - 0.5 * at:g},{at % 3 == 0},{'near' if at > 5 else 'far'}\n"
        for at in range(10)
    ),
    "uneven": "t,gap [m]\n0,5\n0.1,4\n0.25,3\n0.3,2\n",
    "empty cells": "time,gap [m],on\n0,5,true\n1,,false\n2,3,\n3,2,true\n",
    "words": "time,gap [m]\n0,5\n1,many\n",
    "short row": "time,gap [m]\n0,5\n1\n",
    "same name": "time,gap [m],gap [m]\n0,5,6\n1,5,6\n",
    "backwards": "time,gap [m]\n0,5\n2,5\n1,5\n",
    "one row": "time,gap [m]\n0,5\n",
    "nothing": "",
}
JUDGED: tuple[tuple[str, ...], ...] = (
    ("always(gap > 22 m)", "even"),
    ("always(gap > 22 m)", "even", "--horizon", "0.5 s"),
    ("always(speed > 57 km/h)", "even", "--unit", "speed=m/s"),
    ("always(speed > 57 km/h)", "even", "--unit", "speed=parsec"),
    ("always(on implies eventually[0 s, 0.2 s] mode == near)", "even"),
    ("always(mode != late)", "even", "--words", "mode=far,near,late"),
    ("always(gap > limit)", "even", "--set", "limit=25 m"),
    ("always(gap > limit)", "even"),
    ("always(gap / speed > 1.2 s)", "even", "--unit", "speed=m/s"),
    ("always(gap > 1 m)", "uneven", "--time", "t"),
    ("always(gap > 1 m)", "uneven"),
    ("eventually(gap < 4 m)", "empty cells"),
    ("always(on)", "empty cells"),
    ("always(gap > 1 m)", "words"),
    ("always(gap > 1 m)", "short row"),
    ("always(gap > 1 m)", "same name"),
    ("always(gap > 1 m)", "backwards"),
    ("always(gap > 1 m)", "one row"),
    ("always(gap > 1 m)", "nothing"),
    ("always(gap > 1)", "even"),
    ("always(width > 1 m)", "even"),
)


def test_what_is_said_of_tables_is_frozen(adeye: Verb, folder: Path) -> None:
    """A formula on tables of all kinds, each row's robustness, and what is wrong with others."""
    for name, text in TABLES.items():
        (folder / f"{name}.csv").write_text(text, "utf-8")
    parts = []
    for formula, name, *options in JUDGED:
        words = ["stl", formula, f"{name}.csv", *options]
        told = adeye(*words)
        parts.append(f"-- {' '.join(words)}: {told.code}\n{told.out}{told.err}")
        if told.code in {0, 1}:
            document = adeye(*words, "--json", "--output", "rows.csv").document
            parts += [as_json(document, folder), (folder / "rows.csv").read_text("utf-8")]
    assert_frozen("stl_tables.txt", masked("\n".join(parts), folder))


AGAIN: tuple[tuple[str, ...], ...] = (
    ("faults", "--quiet"),
    ("faults", "--quiet", "--json"),
    ("forks", "--quiet"),
    ("forks", "--quiet", "--json"),
    ("preventability", "--quiet", "--model", "cc"),
    ("uncertainty",),
    ("uncertainty", "--json"),
    ("db", "metadata"),
    ("db", "withdraw", "RUN", "--author", "somebody", "--reason", "a slip"),
    ("db", "withdraw", "RUN", "--author", "somebody", "--reason", "again"),
    ("db", "verify", "--json"),
    ("gate",),
    ("gate", "--json"),
    ("check", "ODD"),
    ("stale", "ODD", "--json"),
    ("show", "RUN"),
    ("db", "prove", "RUN", "--json"),
    ("db", "copy", "--campaign", "1", "--to", "copy.db"),
    ("db", "copy", "--campaign", "2", "--to", "other.db"),
    ("judge", "ODD", "--quiet"),
    ("gate", "nobody"),
    ("show", "abc"),
    ("show", "zzzz"),
    ("where", "FSR-99"),
    ("where", "FSR-02", "--by", "gapp"),
    ("compare", "1", "camera_radar", "twin"),
    ("confidence", "--level", "1.5"),
    ("matrix", "--by", "nothing"),
    ("trace", "RUN", "-s", "nothing.*"),
    ("query", "SELECT * FROM nothing"),
    ("query", "SELECT fsr, verdict, COUNT(*) AS n FROM v_verdicts GROUP BY 1, 2 ORDER BY 1, 2"),
    ("query", "gate", "--format", "csv"),
    ("query", "worst-runs", "--json"),
    ("query", "least-slack"),
    ("query", "metrics-by-architecture", "--format", "csv"),
    ("query", "architecture-pairs"),
    ("query", "fault-coverage"),
    ("query", "evidence-by-element"),
    ("query", "unexercised"),
    ("query", "undetected-faults"),
    ("query", "contacts"),
    ("query", "outcomes"),
    ("run", "ODD", "--quiet"),
    ("run", "ODD", "--quiet", "-k", "nothing"),
    ("run", "ODD", "--quiet", "--shard", "3/2"),
    ("gate", "--json"),
)


def test_what_is_said_of_a_campaign_one_after_the_other_is_frozen(
    adeye: Verb, copied: str, mini: Executed, folder: Path
) -> None:
    """Faults and takeovers are measured, a run is withdrawn, and what follows; and slips."""
    parts = []
    for words in AGAIN:
        told = adeye(*(named(word, mini) for word in words), "--db", copied)
        out = told.out
        if "--json" in words and told.code != 2:
            out = as_json(thinned(json.loads(out)), mini.project.folder, folder)
        parts.append(f"-- {' '.join(words)}: {told.code}\n{out}{told.err}")
    text = masked("\n".join(parts), mini.project.folder, folder)
    assert_frozen("verbs_one_after_the_other.txt", text)


SCENES = (
    "ego_speed_mps,other_speed_mps,gap_m,lateral_speed_mps,lateral_offset_m\n"
    "27.8,16.7,25,1,3.5\n27.8,16.7,60,1.5,-3.5\n16.7,5,12,0.8,3.5\n33.3,30,8,1.2,3.5\n10,0,40,1,3.5\n"
)
REFERENCES: tuple[tuple[str, ...], ...] = (
    (),
    ("--json",),
    ("--models", "cc,rss", "--edition", "r157-01", "--step", "0.02"),
    ("--scene", "deceleration"),
    ("--scene", "nothing"),
    ("--integrator", "semi-implicit", "--models", "cc"),
    ("--step", "5"),
    ("--models", "nobody"),
    ("--edition", "none"),
    ("--variant", "nothing"),
)


def test_what_reference_drivers_do_is_frozen(adeye: Verb, folder: Path) -> None:
    """Scenes of a table by each model, by other rules, and what is wrong with questions."""
    (folder / "scenes.csv").write_text(SCENES, "utf-8")
    (folder / "few.csv").write_text("ego_speed_mps\n20\n", "utf-8")
    (folder / "beyond.csv").write_text(SCENES.replace("27.8", "900"), "utf-8")
    (folder / "words.csv").write_text(SCENES.replace("27.8", "fast"), "utf-8")
    (folder / "taken.csv").write_text(SCENES.replace("lateral_offset_m", "cc_contact"), "utf-8")
    parts: list[str] = []
    for name, options in (
        *(("scenes.csv", options) for options in REFERENCES),
        *(
            (name, ())
            for name in (
                "few.csv",
                "beyond.csv",
                "words.csv",
                "nowhere.csv",
                "taken.csv",
                "out0.csv",
            )
        ),
    ):
        told = adeye("reference", name, *options, "--output", f"out{len(parts)}.csv")
        out = as_json(thinned(json.loads(told.out)), folder) if "--json" in options else told.out
        parts.append(f"-- {name} {' '.join(options)}: {told.code}\n{out}{told.err}")
        written = folder / f"out{len(parts) - 1}.csv"
        if written.exists():
            parts[-1] += written.read_text("utf-8")
    assert_frozen("reference.txt", masked("\n".join(parts), folder))


def test_exported_tables_of_a_campaign_are_frozen(
    adeye: Verb, of_mini: tuple[str, str], mini: Executed, folder: Path
) -> None:
    """A row in seven of each table, and what stands beside them."""
    told = adeye("export", *of_mini, "--output", "out", "--format", "csv", "--quiet").ok
    parts = [f"{told.out}{told.err}"]
    for path in sorted((folder / "out").iterdir()):
        text = path.read_text("utf-8")
        if path.suffix == ".json":
            text = as_json(json.loads(text), folder)
        else:
            head, *lines = text.splitlines()
            text = "\n".join([head, *lines[::7]])
        # Sizes and hashes hang on digests.
        parts.append(f"-- {path.name}\n{text}")
    assert_frozen("exported.txt", masked("\n".join(parts), mini.project.folder, folder))
