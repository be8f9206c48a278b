"""README, guide and references say what is true: blocks run, snippets plan, tables are fresh."""

import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

from adeye.campaign.plan import make_plan
from adeye.cli.doctor import Status, capabilities
from adeye.judge.metrics import METRICS
from adeye.judge.series import SERIES
from adeye.judge.verdict import ExitCode
from adeye.simulate.world.check import check_scenario
from adeye.spec.load import load_scenario, merge
from adeye.store.read.query import run_query
from adeye.store.views import view_ddl
from docs import generate, served, walk
from tests.postgres import Server

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
STATUS = ROOT / "docs" / "reference" / "status.md"
GUIDE = sorted((ROOT / "docs" / "guide").glob("*.md"))
COOKBOOK = ROOT / "docs" / "cookbook.md"
PAGES = [
    README,
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
QUESTIONS = ROOT / "docs" / "questions.md"
WALKED = [README, *GUIDE, COOKBOOK, QUESTIONS]
ALONE = [
    ROOT / "docs" / "guide" / f"{name}.md"
    for name in (
        *("channel-tiers", "channels", "ci", "concepts-and-fsrs", "coverage", "decomposition"),
        *("evidence", "fitting-together"),
        *(
            "gymnasium",
            "odd",
            "one-run",
            "middleware",
            "preventability",
            "process-channels",
            "reference-drivers",
        ),
        *("results-and-sql", "scale", "scenarios", "security", "selftest", "staleness"),
        *("team-database", "temporal-logic", "viewers"),
    )
] + [QUESTIONS]
"""Pages that use files of other pages at most, no campaign: they are walked beside the others."""
ODD = "odd/motorway_chauffeur.yaml"

Walks = tuple[Path, list[walk.Walked]]
"""A scratch project, and the pages walked in it."""

_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
_CODE = re.compile(r"^```.*?^```$|`[^`\n]+`", re.MULTILINE | re.DOTALL)
_PATCH = re.compile(r"^<!-- patch (\S+) -->\n```yaml\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_SQL = re.compile(r"^```sql\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_RUN = " run: "
_YAML = re.compile(r"(?P<before>.*)\n```yaml\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)


def text_of(page: Path) -> str:
    return page.read_text("utf-8")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a scratch project with the files of every page, none of them executed."""
    scratch = walk.Walk(tmp_path)
    for page in WALKED:
        scratch.write(walk.files_of(text_of(page)))
    return scratch.project


# --- commands -------------------------------------------------------------------------------------


def walked_of(pages: Sequence[Path], folder: Path) -> Iterator[Walks]:
    yield folder / "project", walk.walk(pages, folder, beside=WALKED)
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Walks]:
    """Pages about the campaign that the README executes."""
    pages = [page for page in WALKED if page not in ALONE]
    yield from walked_of(pages, tmp_path_factory.mktemp("walk"))


@pytest.fixture(scope="module")
def walked_alone(tmp_path_factory: pytest.TempPathFactory, server: Server) -> Iterator[Walks]:
    """Pages that need no other."""
    # The page about teams leaves server and user to the environment.
    server.execute("CREATE DATABASE team TEMPLATE template0")
    server.execute("CREATE ROLE ada LOGIN")
    with pytest.MonkeyPatch.context() as patch:
        for name, value in server.environment.items():
            patch.setenv(name, value)
        yield from walked_of(ALONE, tmp_path_factory.mktemp("alone"))


def require_as_shown(walks: Walks) -> None:
    differences = [
        f"{name_of(item.page)}: {difference}"
        for item in walks[1]
        for difference in item.differences()
    ]
    assert not differences, "\n\n".join(
        [
            *differences,
            "Renew them: python -m docs.walk --update README.md docs/guide/*.md docs/cookbook.md",
        ]
    )


def require_answers(database: Path) -> None:
    queries = [match[1] for page in GUIDE for match in _SQL.finditer(text_of(page))]
    assert len(queries) >= 8
    for query in queries:
        assert run_query(database, query).rows, query


# Two tests, so that two processes walk at the same time.
@pytest.mark.slow
def test_blocks_print_what_the_pages_show_and_ready_queries_answer(walked: Walks) -> None:
    require_as_shown(walked)
    require_answers(walked[0] / ".adeye" / "adeye.db")


@pytest.mark.slow
def test_blocks_of_other_pages_print_what_they_show(walked_alone: Walks) -> None:
    require_as_shown(walked_alone)


@pytest.mark.slow
def test_served_verb_has_folder_environment_and_files_of_who_calls_it(tmp_path: Path) -> None:
    scratch = walk.Walk(tmp_path)
    with served.serving(tmp_path) as command:

        def say(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
            return subprocess.run(
                [*shlex.split(command), *words],
                cwd=scratch.project,
                env=scratch.environment | environment,
                capture_output=True,
                text=True,
                check=False,
            )

        planned = say("plan", ODD)
        assert (planned.returncode, planned.stderr) == (0, "")
        assert "Test cases: " in planned.stdout
        refused = say("query", "failing-fsrs", ADEYE_DB="elsewhere.db")
        assert (refused.returncode, refused.stdout) == (2, "")
        assert "elsewhere.db" in refused.stderr
        assert "elsewhere.db" not in say("query", "failing-fsrs").stderr


def test_readme_begins_with_the_two_commands_and_make_knows_them() -> None:
    assert text_of(README).startswith("# adeye\n\n```sh\nmake demo ")
    commands = re.findall(r"^make (\w+)", text_of(README), re.MULTILINE)
    assert commands[:2] == ["demo", "test"]
    for target in commands:
        subprocess.run(["make", "-n", target], cwd=ROOT, check=True, capture_output=True)


def test_every_page_that_is_shown_a_command_in_is_walked() -> None:
    others = [page for page in PAGES if page not in WALKED]
    assert [name_of(page) for page in others if "```console" in text_of(page)] == []


def test_steps_for_a_workflow_are_commands_with_options_that_exist() -> None:
    known, page = generate.commands(), text_of(ROOT / "docs" / "guide" / "ci.md")
    (steps,) = [
        yaml.safe_load(match["text"]) for match in _YAML.finditer(page) if _RUN in match["text"]
    ]
    words = [step["run"].split() for step in steps]
    assert words
    assert {line[0] for line in words} == {"adeye"}
    for line in words:
        verb = next(name for name in known if line[1 : name.count(" ") + 2] == name.split())
        options = {option for item in known[verb].params for option in getattr(item, "opts", ())}
        assert {word for word in line if word.startswith("-")} <= options


# --- files and snippets ---------------------------------------------------------------------------


@pytest.mark.slow
def test_files_of_the_pages_are_valid(project: Path) -> None:
    names = [name for page in WALKED for name in walk.files_of(text_of(page))]
    shown = {Path(name).parent.name for name in names}
    assert {"motorway", "odd", "concepts", "architectures"} <= shown
    # The page about FMUs copies it.
    model = project / "odd" / "architectures" / "fmus" / "follow_and_keep.fmu"
    shutil.copy(model, project / "scenarios_db" / "motorway")
    for name in names:
        path = project / name
        if path.parent.name == "motorway":
            loaded = load_scenario(path)
            assert list(check_scenario(loaded.spec)) == [], name
        elif path.parent == project / "odd":
            assert make_plan(path).expansion.count > 0, name


def patches() -> list[Any]:
    return [
        pytest.param(match[1], match[2], id=f"{page.stem}-{number}")
        for page in WALKED
        for number, match in enumerate(_PATCH.finditer(text_of(page)))
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("target", "snippet"), patches())
def test_snippet_is_accepted_in_the_shipped_file(project: Path, target: str, snippet: str) -> None:
    path = project / target
    whole = merge(yaml.safe_load(text_of(path)), yaml.safe_load(snippet))
    path.write_text(yaml.safe_dump(whole, sort_keys=False, allow_unicode=True), "utf-8")
    assert make_plan(project / ODD).expansion.count > 0


@pytest.mark.slow
def test_every_yaml_block_is_checked_by_one_of_the_tests() -> None:
    for page in WALKED:
        for match in _YAML.finditer(text_of(page)):
            marked = match["before"].splitlines()[-1].startswith(("<!-- file ", "<!-- patch "))
            assert marked or _RUN in match["text"], f"{name_of(page)}:\n{match['text']}"


# --- references -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_generated_pages_are_fresh() -> None:
    assert generate.stale() == [], "run python docs/generate.py"


def test_every_command_has_help_an_example_and_its_place_in_the_reference() -> None:
    page = text_of(ROOT / "docs" / "reference" / "cli.md")
    commands = generate.commands()
    assert {"plan", "run", "db verify", "new channel", "scenario lint"} <= set(commands)
    for words, command in commands.items():
        assert command.help, words
        assert (command.epilog or "").startswith("Examples:"), words
        assert f"## adeye {words}\n" in page
        for item in command.params:
            if item.name != "help":
                assert item.help, f"{words} {item.name}"
                assert item.opts[-1] in page or item.metavar in page


def test_every_option_is_a_variable_too() -> None:
    for words, command in generate.commands().items():
        options = [item for item in command.params if item.param_type_name == "option"]
        for item in options:
            assert item.name == "help" or item.envvar.startswith("ADEYE_"), f"{words} {item.name}"


def test_every_metric_and_series_is_in_the_reference() -> None:
    page = text_of(ROOT / "docs" / "reference" / "metrics.md")
    for metric in METRICS.values():
        if metric.uid.startswith("adeye:"):
            assert f"| `{metric.column}` |" in page
            assert f"`{metric.uid}`" in page
            assert metric.source
    for name in SERIES:
        assert f"| `{name}` |" in page


def test_every_view_is_explained() -> None:
    page = text_of(ROOT / "docs" / "guide" / "results-and-sql.md")
    rules = text_of(ROOT / "docs" / "guide" / "fitting-together.md")
    for view in view_ddl():
        rule = view.removeprefix("v_check_")
        assert f"`{view}`" in page if rule == view else f"| `{rule}` |" in rules


def test_readme_lists_every_exit_code() -> None:
    table = text_of(README).partition("## Exit codes")[2].partition("\n## ")[0]
    listed = {
        int(code) for row in re.findall(r"^\| ([\d, ]+) \|", table, re.M) for code in row.split(",")
    }
    assert listed == {int(code) for code in ExitCode}


def test_status_table_claims_nothing_without_a_proof() -> None:
    assert [item.id for item in capabilities()] == [f"R{number}" for number in range(1, 24)]
    rows = re.findall(r"^\| (R\d+) \| .*? \| (proven|partly|not yet) \|", text_of(STATUS), re.M)
    assert rows == [(item.id, item.status.value) for item in capabilities()]
    for item in capabilities():
        if item.status is not Status.NOT_YET:
            assert re.fullmatch(rf"tests/requirements/test_r0?{item.id[1:]}_\w+\.py", item.proof)
            assert (ROOT / item.proof).is_file()


# --- links, words, pictures -----------------------------------------------------------------------


def anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.+)$", text_of(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    for target in _LINK.findall(_CODE.sub("", text_of(page))):
        if target.startswith("https://"):
            continue
        path, _, anchor = target.partition("#")
        found = (page.parent / path).resolve() if path else page
        assert found.exists(), f"{name_of(page)}: {target}"
        if anchor:
            assert anchor in anchors(found), f"{name_of(page)}: {target}"


def test_index_leads_to_every_page() -> None:
    index = text_of(ROOT / "docs" / "index.md")
    linked = {(ROOT / "docs" / target).resolve() for target in _LINK.findall(index)}
    pages = {page for page in (ROOT / "docs").rglob("*.md") if page.name != "index.md"}
    assert pages <= linked


def test_files_that_the_pages_name_exist() -> None:
    for page in PAGES:
        for name in re.findall(r"`((?:adeye|tests|odd|docs)/[\w/.]+\.\w+)`", text_of(page)):
            assert (ROOT / name).is_file() or "walk" in name, f"{name_of(page)}: {name}"


def test_picture_is_a_small_png() -> None:
    content = (ROOT / "docs" / "images" / "report.png").read_bytes()
    assert content.startswith(b"\x89PNG")
    assert len(content) < 400_000


# --- the walk itself ------------------------------------------------------------------------------


def command(shown: str, printed: str) -> walk.Command:
    return walk.Command(("say",), tuple(shown.splitlines()), tuple(printed.splitlines()))


def test_shown_output_agrees() -> None:
    for shown, printed in (
        ("a\nb", "a\nb"),
        ("a\n…\nd", "a\nb\nc\nd"),
        ("…\nd", "a\nd"),
        ("a\n…", "a\nb"),
        ("run 0123456789ab", "run ba9876543210"),
        ("", ""),
    ):
        assert command(shown, printed).differs() == ""


def test_shown_output_differs() -> None:
    for shown, printed in (
        ("a", "b"),
        ("a", "a\nb"),
        ("a\nb", "a"),
        ("a\n…\nd", "a\nb\nc"),
        ("b\n…", "a\nb"),
        ("5 runs", "6 runs"),
        ("", "a"),
    ):
        assert command(shown, printed).differs()


def test_renewing_keeps_what_was_left_out() -> None:
    assert list(command("a\n…\nz", "1\n2\n3\n4").renewed()) == ["$ say", "1", "…", "4"]
