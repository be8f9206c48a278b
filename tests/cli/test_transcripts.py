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
        assert_frozen(f"verb_{name}.json", masked(as_json(thinned(json.loads(told.out))), *folders))
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
        parts.append(as_json(thinned(document)))
    adeye("map", "export", path, "--lanes", "lanes.csv", "--step", "9").ok  # noqa: B018 - is checked
    lines = (folder / "lanes.csv").read_text("utf-8").splitlines()
    parts.append("\n".join([lines[0], *lines[1::5]]))
    adeye("map", "export", path, "--xodr", "again.xodr").ok  # noqa: B018 - is checked
    parts.append((folder / "again.xodr").read_text("utf-8"))
    assert_frozen(f"map_verbs_{name}.txt", masked("\n".join(parts), ROOT, folder))
