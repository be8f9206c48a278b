"""A channel that keeps to the protocol and has one flaw that only one case shows.

It is executed as a program and told which flaw, by its argument or by ``values``.
"""

import json
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

FLAWS = {
    "counts_its_fellows": ("several", "acceleration"),
    "sulks": ("pause", "watchdog: nobody asks"),
    "forgets_in_a_pause": ("pause", "acceleration"),
    "needs_an_object": ("no_object", "IndexError"),
    "has_room_for_four": ("many_objects", "too many objects"),
    "trusts_its_sensors": ("dead_sensors", "lost"),
    "tires": ("long", "stack overflow"),
    "knows_beforehand": ("in_step", "before it is asked"),
    "lurches": ("long", "acceleration -50 m/s²"),
    "has_the_last_word": ("ends", "it wrote more at the end of its input"),
    "fails_at_the_end": ("ends", "it ended with code 3 at the end of its input"),
    "stays": ("ends", "it goes on for 2 s after the end of its input"),
    "crashes_at_the_end": ("ends", "it ended by SIGABRT"),
}
"""The case that a flaw fails, and words of the reason."""


def say(**content: Any) -> None:
    sys.stdout.write(json.dumps(content) + "\n")
    sys.stdout.flush()


def fellows(folder: str) -> int:
    """Count the others that run at the same time."""
    found = 0
    for path in Path(folder, "pids").iterdir():
        with suppress(OSError):
            os.kill(int(path.name), 0)
            found += 1
    return found - 1


def look(flaw: str, seen: dict[str, Any], gap: float) -> None:
    """Fail at what the flaw does not bear."""
    found = [row for item in seen["sensors"].values() for row in item["detections"]]
    is_alive = seen["sensors"]["localisation"]["alive"]
    if flaw == "needs_an_object" and is_alive and seen["tick"] > 20:
        found[0]
    if flaw == "has_room_for_four" and len(found) > 4:
        sys.exit("too many objects")
    if flaw == "trusts_its_sensors" and not is_alive:
        sys.exit("lost")
    if flaw == "tires" and seen["tick"] > 500:
        sys.exit("stack overflow")
    if flaw == "sulks" and gap > 0.5:
        sys.exit("watchdog: nobody asks")


def end(flaw: str, tick: int) -> None:
    """Do what the flaw does at the end of its input."""
    if flaw == "has_the_last_word":
        say(tick=tick + 1, acceleration=0.0, steering_angle=0.0)
    if flaw == "fails_at_the_end":
        sys.exit(3)
    if flaw == "stays":
        time.sleep(60)
    if flaw == "crashes_at_the_end":
        os.abort()


def main() -> None:
    hello = json.loads(sys.stdin.readline())
    values = hello["parameters"]["values"]
    flaw = values["flaw"] if values else sys.argv[1]
    if flaw == "counts_its_fellows":
        place = Path(values["folder"], "pids")
        place.mkdir(exist_ok=True)
        (place / str(os.getpid())).touch()
    say(hello=hello["hello"])
    ahead = int(flaw == "knows_beforehand")
    if ahead:
        say(tick=0, acceleration=0.0, steering_angle=0.0)
    answered, extra = time.monotonic(), 0.0
    for line in sys.stdin:
        seen, gap = json.loads(line), time.monotonic() - answered
        look(flaw, seen, gap)
        if flaw == "counts_its_fellows":
            extra = 0.1 * fellows(values["folder"])
        if flaw == "forgets_in_a_pause" and gap > 0.5:
            extra = 0.1
        if flaw == "lurches" and seen["tick"] == 500:
            extra = -50.0
        say(tick=seen["tick"] + ahead, acceleration=extra, steering_angle=0.0)
        answered = time.monotonic()
    end(flaw, seen["tick"])


if __name__ == "__main__":
    main()
