"""A plug-in may end the process that it is in, but never with an exit code of its choice."""

import ctypes
import os
import platform
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from adeye import supervision
from adeye.errors import Interrupted, PluginError, SpecError, Terminated, UsageError
from adeye.selftest.bench import BARE, DRIVING, Bench, Edit
from adeye.supervision import guest, is_asked
from tests.processes import started, wait_for_the_end
from tests.refusals import refused
from tests.stored import known, stored

PROGRAM = """
import atexit, ctypes, os, signal, sys, threading, time
from adeye.cli.progress import raising_on_sigterm
from adeye.supervision import guest, note_end, supervise

ended = supervise()
if ended is not None:
    print(ended.text)
    sys.exit(ended.code)
with guest("./part.py:Part"):
    {act}
note_end({code})
{after}
sys.exit({code})
"""
LEAVING = {
    "os._exit": "os._exit(0)",
    "exit of a library": "ctypes.CDLL(None).exit(0)",
    "after closing": "os.closerange(3, 256); os._exit(0)",
    "after output": "print('all good', flush=True); os._exit(0)",
    "another program": "os.execv('/bin/true', ['true'])",
    "killed": "os.kill(os.getpid(), signal.SIGKILL)",
    "with another code": "os._exit(7)",
    "in a thread": "threading.Thread(target=os._exit, args=(0,)).start(); time.sleep(60)",
    "SystemExit": "sys.exit(0)",
}


def ended(
    act: str, code: int = 0, after: str = "", *, by_guest: bool = True
) -> tuple[int, str, str]:
    """Let a supervised process do something; return its exit code and what it said."""
    program = PROGRAM if by_guest else PROGRAM.replace('with guest("./part.py:Part"):', "if True:")
    process = started("-c", program.format(act=act, code=code, after=after))
    out, err = process.communicate(timeout=60)
    assert wait_for_the_end(process.pid) == []
    return process.returncode, out, err


@pytest.mark.parametrize("act", LEAVING.values(), ids=LEAVING)
def test_process_that_did_not_see_its_end_is_incomplete(act: str) -> None:
    code, out, _ = ended(act)
    assert (code, "./part.py:Part" in out) == (3, True), out


LIMIT = "import resource; resource.setrlimit(resource.RLIMIT_CPU, (1, 9)); any(iter(lambda: 0, 1))"


@pytest.mark.parametrize("act", [LIMIT, LEAVING["killed"], LEAVING["os._exit"]])
def test_end_without_a_plugin_is_not_called_that_of_one(act: str) -> None:
    code, out, _ = ended(act, by_guest=False)
    assert code == 3
    assert "No plug-in was there. The system may have ended it, for a limit" in out
    assert "never ends" not in out


def test_limit_of_the_system_is_named_where_a_plugin_was_at_work() -> None:
    code, out, _ = ended(LIMIT)
    assert code == 3
    assert f"signal {int(signal.SIGXCPU)}" in out
    assert "./part.py:Part" in out
    assert "The system may have ended it, for a limit" in out
    assert "No plug-in" not in out


def test_exit_code_is_the_one_of_the_explicit_end() -> None:
    for told, after, code in (
        (0, "", 0),
        (1, "", 1),
        (256, "", 3),
        (1, "os._exit(0)", 1),
        (1, "atexit.register(os._exit, 0)", 1),
        (0, "os._exit(7)", 7),
        (0, "os.kill(os.getpid(), signal.SIGKILL)", 3),
        (141, "", 141),
    ):
        assert ended("pass", told, after)[0] == code


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_signal_that_nobody_took_is_an_interruption(name: str, code: int) -> None:
    act = f"signal.signal(signal.{name}, signal.SIG_DFL); os.kill(os.getpid(), signal.{name})"
    assert ended(act)[0] == code


def test_fork_that_comes_back_is_ended_and_the_run_goes_on_once() -> None:
    code, out, err = ended("os.fork()", after="print('went on', flush=True)")
    assert (code, out.count("went on")) == (0, 1)
    assert "./part.py:Part had forked came back" in err


HEARING = """
import signal, sys
from adeye.supervision import note_end, note_signal, supervise

heard = []


def hear(number, _):
    note_signal(number)
    heard.append(number)
    print("heard", flush=True)
    if number == signal.SIGTERM:
        note_end(len(heard))
        sys.exit(9)


ended = supervise()
if ended is not None:
    sys.exit(ended.code)
signal.signal(signal.SIGINT, hear)
signal.signal(signal.SIGTERM, hear)
print("ready", flush=True)
while True:
    signal.pause()
"""


def test_each_signal_is_heard_once_whoever_it_was_sent_to() -> None:
    with started("-c", HEARING) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        process.stdout.readline()
        os.killpg(process.pid, signal.SIGINT)
        process.stdout.readline()
        process.send_signal(signal.SIGTERM)
    assert process.returncode == 3


def test_killed_parent_leaves_no_child() -> None:
    with started("-c", HEARING) as process:
        known(process.stdout).readline()
        process.kill()
    assert wait_for_the_end(process.pid) == []


def in_a_thread(question: Callable[[], bool]) -> bool:
    """Ask in another thread than the main one."""
    answers: list[bool] = []
    thread = threading.Thread(target=lambda: answers.append(question()))
    thread.start()
    thread.join()
    return answers[0]


def test_only_who_may_have_heard_a_signal_may_have_been_asked_to_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for handler, is_heard in ((signal.default_int_handler, True), (signal.SIG_IGN, False),
                              (print, False)):  # fmt: skip
        monkeypatch.setattr(signal, "getsignal", lambda _, handler=handler: handler)
        assert is_asked(KeyboardInterrupt()) is is_heard
        assert not in_a_thread(lambda: is_asked(KeyboardInterrupt()))
        assert not is_asked(GeneratorExit())
    assert is_asked(Interrupted())
    assert is_asked(Terminated())


def test_guest_that_takes_the_working_folder_away_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    gone = pytest.raises(PluginError, match=r"part\.py:Part left a working folder that is gone")
    with gone, guest("part.py:Part"):
        os.chdir(tmp_path)
        (tmp_path / "work").rmdir()


@pytest.mark.parametrize("error", [SystemExit(0), GeneratorExit(), ValueError("no")])
def test_what_a_guest_raises_where_nothing_contains_it_names_it(error: BaseException) -> None:
    named = pytest.raises(PluginError, match=r"the sensor \./s\.py:S raised")
    with named, guest("./s.py:S", "sensor"):
        raise error


def test_errors_of_adeye_pass_through_a_guest() -> None:
    with pytest.raises(UsageError), guest("./s.py:S", "sensor"):
        raise UsageError("its column is taken")


PART: str = stored("plugins")["leaving"]
PLACES = ("at_import", "in_channel", "in_sensor", "in_metric", "in_executor")


def ran(folder: Path, place: str, act: str, *options: str) -> tuple[int, str]:
    """Run the bench with a part that leaves, as a shell does."""
    kinds = {"in_channel": Edit(BARE, "./parts.py:Car", "./part.py:Channel")}
    kinds["in_sensor"] = Edit(
        BARE,
        "kind: radar\n    mount: {x: 2.3 m, y: 0 m, z: 0.5 m}\n    field_of_view: 120 deg\n"
        "    range: 150 m\n",
        "kind: ./part.py:Sensor\n    mount: {x: 2.3 m, y: 0 m, z: 0.5 m}\n",
    )
    metric = Edit(DRIVING, "plugins: []", "plugins: [./part.py:Metric]")
    bench = Bench(folder).settle([kinds.get(place, metric)])
    text = PART.format(**{**dict.fromkeys(PLACES, "pass"), place: act})
    for name in ("odd", "odd/architectures"):
        head = f"import sys; sys.path.insert(0, {str(bench / name)!r})\n"
        head += "adeye_files = ['parts.py']\n" if (bench / name / "parts.py").is_file() else ""
        (bench / name / "part.py").write_text(f"{head}{text}")
    executor = ["--executor", "./odd/part.py:Executor"] * (place == "in_executor")
    program = "import sys; from adeye.cli import main; sys.exit(main())"
    options = (*options, "--junit", "junit.xml", "--db", "x.db", "--quiet", *executor)
    process = started("-c", program, "run", DRIVING, *options, cwd=bench)
    out, err = process.communicate(timeout=300)
    assert wait_for_the_end(process.pid) == []
    assert (process.returncode != 0) or (bench / "junit.xml").exists()
    return process.returncode, out + err


@pytest.mark.parametrize(
    ("place", "act", "options"),
    [
        ("at_import", "os._exit(0)", ()),
        ("in_metric", "os._exit(0)", ("--workers", "1")),
        pytest.param("in_metric", "os._exit(0)", ("--workers", "2"), marks=pytest.mark.slow),
        pytest.param("in_channel", "os._exit(0)", ("--threads", "2"), marks=pytest.mark.slow),
        pytest.param("in_channel", "os._exit(0)", (), marks=pytest.mark.slow),
        pytest.param("in_sensor", "os._exit(0)", ("--threads", "1"), marks=pytest.mark.slow),
        pytest.param("in_sensor", "raise typer.Exit(0)", (), marks=pytest.mark.slow),
        pytest.param("in_executor", "os._exit(0)", (), marks=pytest.mark.slow),
        pytest.param("in_executor", "sys.exit(0)", (), marks=pytest.mark.slow),
        pytest.param("in_executor", "raise typer.Exit(0)", (), marks=pytest.mark.slow),
    ],
)
def test_plugin_that_leaves_is_never_good_and_is_named(
    tmp_path: Path, place: str, act: str, options: tuple[str, ...]
) -> None:
    code, said = ran(tmp_path, place, act, *options)
    assert code == 3, said
    assert "part.py:" in said
    assert "Traceback" not in said


@pytest.mark.slow
@pytest.mark.parametrize("options", [("--workers", "1"), ("--workers", "2")])
def test_interruption_that_a_plugin_raises_is_as_any_other_exception(
    tmp_path: Path, options: tuple[str, ...]
) -> None:
    code, said = ran(tmp_path, "in_sensor", "raise KeyboardInterrupt", *options)
    assert (code, "Traceback" in said) == (3, False), said
    assert "the sensor ./part.py:Sensor raised KeyboardInterrupt" in said


def test_whatever_an_import_raises_is_an_error_of_the_plugin(tmp_path: Path) -> None:
    for error in ("GeneratorExit", "SystemExit(0)", "asyncio.CancelledError"):
        from adeye.plugins import load_part

        (tmp_path / "part.py").write_text(f"import asyncio\nraise {error}\n")
        raised = refused(SpecError, load_part, "./part.py:Part", tmp_path, says=r"part\.py:2:1")
        assert not isinstance(raised.__cause__, Exception)


def test_program_that_is_left_by_a_stray_exit_is_not_good(monkeypatch: pytest.MonkeyPatch) -> None:
    from adeye.cli import app as entry

    def leave(*_: Any) -> None:
        raise SystemExit(0)

    monkeypatch.setattr(entry, "_run", leave)
    with guest("./part.py:Part"):
        pass
    assert entry.main(["plan"]) == 3


def test_working_folder_is_what_it_was_before_any_guest_came(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "elsewhere").mkdir()
    entered, left = threading.Event(), threading.Event()

    def other() -> None:
        with guest("other.py:Part"):
            entered.set()
            left.wait(10)

    thread = threading.Thread(target=other)
    with guest("part.py:Part"):
        os.chdir("elsewhere")
        with guest("inner.py:Part"):
            thread.start()
            entered.wait(10)
    assert Path.cwd() == tmp_path
    os.chdir("elsewhere")
    left.set()
    thread.join()
    assert Path.cwd() == tmp_path
    # Whoever calls from elsewhere the next time finds that again.
    os.chdir("elsewhere")
    with guest("part.py:Part"):
        os.chdir("/")
    assert Path.cwd() == tmp_path / "elsewhere"


@pytest.mark.skipif(platform.machine() != "x86_64", reason="other processors have another word")
def test_numbers_are_rounded_as_before_any_guest_came() -> None:
    upwards, library = 0x800, ctypes.CDLL("libm.so.6")
    with guest("part.py:Part"):
        assert library.fesetround(upwards) == 0
        assert library.fegetround() == upwards
    assert library.fegetround() == 0


def test_who_comes_while_another_leaves_does_not_take_its_folder_for_the_usual(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, back = Path.cwd(), supervision._return_to_folder

    def visit() -> None:
        with guest("other"):
            pass

    def visited(name: str) -> None:
        monkeypatch.setattr(supervision, "_return_to_folder", back)
        other = threading.Thread(target=visit)
        other.start()
        other.join()
        back(name)

    monkeypatch.chdir(home)
    monkeypatch.setattr(supervision, "_return_to_folder", visited)
    with guest("one"):
        os.chdir(tmp_path)
    assert Path.cwd() == home


def test_threads_that_come_at_once_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    class Slow(dict[int, int]):
        def __len__(self) -> int:
            count = super().__len__()
            time.sleep(0.02)
            return count

    slots, begin = Slow(), threading.Barrier(3)
    monkeypatch.setattr(supervision, "_slots", slots)

    def visit() -> None:
        begin.wait()
        with guest("one"):
            begin.wait()

    threads = [threading.Thread(target=visit) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(slots.values())) == 3
