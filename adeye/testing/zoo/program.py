"""The zoo as a program: a channel of kind process that misbehaves as it is told.

It is executed by name and knows nothing of the package. ``values.animal`` says which one it is,
``values.from_tick`` since when; before, and if no animal is named, it keeps its speed.
"""

import ctypes
import json
import math
import os
import re
import signal
import sys
import time
from pathlib import Path
from typing import Any

_HELLO: dict[str, Any] = {}
"""The first line that it was sent."""
_KEPT: list[Any] = []


def _say(text: str) -> None:
    """Write and do not wait in a buffer."""
    sys.stdout.write(text)
    sys.stdout.flush()


def _answer(seen: dict[str, Any], **changes: Any) -> None:
    """Answer an observation, with changes."""
    command = {"tick": seen["tick"], "acceleration": 0.1, "steering_angle": 0.0, "status": "ok"}
    _say(json.dumps({**command, **changes}) + "\n")


def _raises(_: Any) -> None:
    msg = "no track"
    raise RuntimeError(msg)


def _segfaults(_: Any) -> None:
    ctypes.string_at(0)


def _aborts(_: Any) -> None:
    os.abort()


def _leaves(_: Any) -> None:
    sys.exit(0)


def _hangs_in_python(_: Any) -> None:
    while True:
        pass


def _hangs_in_c(_: Any) -> None:
    re.match(r"(a+)+$", "a" * 64 + "b")


def _sleeps(_: Any) -> None:
    time.sleep(3600)


def _stops_itself(_: Any) -> None:
    os.kill(os.getpid(), signal.SIGSTOP)


def _ignores_sigterm(_: Any) -> None:
    for name in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(name, signal.SIG_IGN)
    while True:
        time.sleep(3600)


def _kills_its_group(_: Any) -> None:
    os.killpg(0, signal.SIGKILL)


def _forks(_: Any) -> None:
    for _ in range(300):
        if os.fork() == 0:
            time.sleep(3600)
        time.sleep(0.002)
    time.sleep(3600)


def _leaves_a_daemon(seen: Any) -> None:
    if seen["tick"] == _HELLO["parameters"]["values"]["from_tick"] and os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            time.sleep(3600)
        os._exit(0)
    _answer(seen)


def _leaks_memory(_: Any) -> None:
    while True:
        _KEPT.append(bytearray(1 << 24))


def _opens_files(_: Any) -> None:
    while True:
        _KEPT.append(os.open(os.devnull, os.O_RDONLY))


def _fills_the_disk(_: Any) -> None:
    with Path("big").open("wb") as stream:
        while True:
            stream.write(bytes(1 << 20))


def _fills_its_output(_: Any) -> None:
    while True:
        _say("x" * 4096)


def _talks_without_end(seen: Any) -> None:
    while True:
        _answer(seen)


def _fills_its_error_output(seen: Any) -> None:
    sys.stderr.write("y" * (1 << 20))
    _answer(seen)


def _burns_the_processor(_: Any) -> None:
    while True:
        math.sqrt(2.0)


def _says_too_large_a_number(seen: Any) -> None:
    _say(f'{{"tick":{seen["tick"]},"acceleration":1e999,"steering_angle":0}}\n')


def _answers_the_future(seen: Any) -> None:
    _answer(seen, tick=seen["tick"] + 1)


def _answers_the_past(seen: Any) -> None:
    _answer(seen, tick=seen["tick"] - 3)


def _answers_without_tick(seen: Any) -> None:
    _say(json.dumps({"acceleration": 0.1, "steering_angle": 0.0, "seen": seen["tick"]}) + "\n")


def _answers_twice(seen: Any) -> None:
    _answer(seen)
    _answer(seen)


def _answers_ahead(seen: Any) -> None:
    command = {"acceleration": 0.1, "steering_angle": 0.0}
    ticks = (seen["tick"], seen["tick"] + 1)
    _say("".join(json.dumps({"tick": tick, **command}) + "\n" for tick in ticks))


def _says_a_key_twice(seen: Any) -> None:
    command = f'"tick": {seen["tick"]}, "acceleration": 99, "acceleration": 0.1'
    _say("{" + command + ', "steering_angle": 0.0}\n')


def _answers_late(seen: Any) -> None:
    time.sleep(0.02)
    _answer(seen)


def _says_no_json(_: Any) -> None:
    _say("turn left\n")


def _says_a_nest(_: Any) -> None:
    _say("[" * 60_000 + "\n")


def _says_half_a_line(seen: Any) -> None:
    _say(f'{{"tick": {seen["tick"]}, "accel')
    sys.exit(0)


def _says_half_a_line_and_waits(seen: Any) -> None:
    _say(f'{{"tick": {seen["tick"]}, "accel')
    time.sleep(3600)


def _closes_its_output(_: Any) -> None:
    os.close(1)
    time.sleep(3600)


def _snoops(seen: Any) -> None:
    allowed = {"PATH", "LANG", "LC_ALL", "LC_CTYPE", "TZ", "HOME", "TMPDIR"}
    # A launcher on the path may be a shell script, as that of pyenv is, and adds its own.
    added = {"PWD", "OLDPWD", "SHLVL", "_"}
    loot: list[str] = sorted(
        name
        for name in set(os.environ) - allowed - added
        if not name.lstrip("_").startswith("PYENV_")
    )
    loot += [f"descriptor {fd}" for fd in range(3, 64) if _is_open(fd)]
    loot += [entry.name for entry in Path.cwd().iterdir()]
    loot += sorted(set(seen["sensors"]) - set(_HELLO["links"]))
    if loot:
        msg = f"found {', '.join(loot)}"
        raise RuntimeError(msg)
    _answer(seen)


def _is_open(fd: int) -> bool:
    try:
        os.fstat(fd)
    except OSError:
        return False
    return True


def _reads_the_clock(seen: Any) -> None:
    _answer(seen, acceleration=1e-9 * (time.monotonic_ns() % 1_000_000))


def _never_says_hello() -> None:
    time.sleep(3600)


def _says_another_version() -> None:
    _say('{"hello": "adeye/channel@0"}\n')


def _fails_at_once() -> None:
    sys.exit("no licence")


ANSWERS: dict[str, dict[str, Any]] = {
    "says_nan": {"acceleration": math.nan},
    "says_infinity": {"steering_angle": -math.inf},
    "says_minus_zero": {"acceleration": -0.0, "steering_angle": -0.0},
    "says_a_list": {"acceleration": [0.1, 0.1]},
    "says_a_text": {"acceleration": "0.1"},
    "says_degrees": {"steering_angle": 20.0},
    "says_too_much": {"acceleration": -1e6},
    "says_unknown_status": {"status": "fine"},
    "claims_a_safe_state": {"safe_state": True},
    "answers_for_another_channel": {"channel": "nominal"},
    "freezes": {"acceleration": 0.1, "steering_angle": 0.0},
}
"""What animals that answer otherwise change in their answers."""


def main() -> None:
    """Drive, and misbehave as told."""
    _HELLO.update(json.loads(sys.stdin.readline()))
    values = _HELLO["parameters"]["values"]
    name, from_tick = values.get("animal", ""), values.get("from_tick", 0)
    if name in {"never_says_hello", "says_another_version", "fails_at_once"}:
        globals()[f"_{name}"]()
    said = {"hello": _HELLO["hello"]}
    if "version" in _HELLO["parameters"]:
        said["version"] = "zoo"
    _say(json.dumps(said) + "\n")
    for line in sys.stdin:
        seen = json.loads(line)
        if not name or seen["tick"] < from_tick:
            _answer(seen)
        elif name in ANSWERS:
            _answer(seen, **ANSWERS[name])
        else:
            globals()[f"_{name}"](seen)


if __name__ == "__main__":
    main()
