"""A folder with the files of the bench, edited, and what the production path makes of it.

Everything is good as it is written here: both campaigns end with exit code 0. A master is an edit
of these texts.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from adeye import api
from adeye.errors import AdeyeError
from adeye.selftest import parts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.summary import CampaignSummary

# --- The files of the bench: a lead that brakes, two architectures, their concepts and ODDs -------

SCENARIO: Final = "scenarios_db/closing.yaml"
CURVE: Final = "scenarios_db/closing_curve.yaml"
DRIVING: Final = "odd/driving.yaml"
HANDOVER: Final = "odd/handover.yaml"
BARE: Final = "odd/architectures/bare.yaml"
GUARDED: Final = "odd/architectures/guarded.yaml"
DRIVING_CONCEPT: Final = "odd/concepts/driving.yaml"
HANDOVER_CONCEPT: Final = "odd/concepts/handover.yaml"
PARTS: Final = ("odd/parts.py", "odd/architectures/parts.py")
"""Where the plug-ins are put: metrics beside the ODD, the others beside the architectures."""

_SCENARIO: Final = """\
scenario: closing
title: The vehicle ahead brakes to standstill
provenance: {source: written for the self-test}
parameters:
  ego_speed: {default: 20 m/s, range: [10 m/s, 30 m/s]}
  gap: {default: 60 m, range: [40 m, 80 m]}
world:
  road:
    kind: straight
    road_type: motorway
    length: 1000 m
    lanes: 3
    lane_width: 3.5 m
    shoulder: 3 m
    speed_limit: 130 km/h
environment: {rain: 0 mm/h, fog_visibility: 10 km, friction: 0.9, illumination: day}
ego: {lane: 1, s: 100 m, speed: ego_speed, desired_speed: ego_speed}
actors:
  lead:
    kind: car
    start: {lane: 1, ahead_of: ego, gap: gap, speed: ego_speed}
  neighbour:
    kind: car
    start: {lane: 2, ahead_of: ego, gap: 20 m, speed: ego_speed}
storyboard:
  brake:
    actor: lead
    when: time >= 3 s
    stop: {rate: 4 m/s^2, jerk: 12 m/s^3}
realised: [brake]
horizon: 10 s
tail: 5 s
"""

_CURVE: Final = """\
extends: closing
scenario: closing_curve
title: The same in a curve to the left
parameters:
  radius: {default: 400 m, range: [300 m, 600 m]}
world:
  road: {kind: curve, radius: radius}
"""

_VEHICLE: Final = """\
vehicle:
  length: 4.8 m
  width: 1.9 m
  height: 1.5 m
  wheelbase: 2.9 m
  max_acceleration: 3 m/s^2
  max_deceleration: 9 m/s^2
  max_steering_angle: 35 deg
  max_steering_rate: 30 deg/s
  acceleration_lag: 0.15 s
  steering_lag: 0.1 s
"""

_BARE: Final = f"""\
architecture: bare
title: One channel alone
{_VEHICLE}sensors:
  front:
    kind: radar
    mount: {{x: 2.3 m, y: 0 m, z: 0.5 m}}
    field_of_view: 120 deg
    range: 150 m
    rate: 20 Hz
    latency: 0.05 s
    realises: front_radar
  localisation: {{kind: localisation, rate: 20 Hz}}
channels:
  nominal:
    kind: ./parts.py:Car
    links: [localisation, front]
    rate: 20 Hz
    parameters: {{flaw: none}}
    realises: car
switch: {{policy: fixed_priority, priority: [nominal], default: nominal, staleness: 0.3 s}}
"""

_GUARDED: Final = f"""\
architecture: guarded
title: A channel and another that watches it
{_VEHICLE}sensors:
  truth: {{kind: ground_truth, rate: 20 Hz, latency: 0.05 s}}
channels:
  nominal: {{kind: nominal, links: [truth], rate: 20 Hz, realises: car}}
  safety: {{kind: safety, links: [truth, channels.nominal, switch], rate: 20 Hz}}
switch:
  policy: fixed_priority
  priority: [safety, nominal]
  default: nominal
  debounce: 0 s
  latch: true
  staleness: 0.3 s
"""

_HAZARDS: Final = """\
hazardous_events:
  - id: HE-01
    function: longitudinal control
    malfunction: too little braking
    situation: motorway, braking vehicle ahead
    severity: S3
    exposure: E4
    controllability: C3
    severity_rationale: Impact at high speed.
    exposure_rationale: Vehicles ahead are on every drive.
    controllability_rationale: The driver need not watch the road.
safety_goals:
  - id: SG-01
    text: The vehicle shall not hit a vehicle ahead.
    hazardous_events: [HE-01]
    safe_state: standstill in the lane
    ftti: 1.5 s
    ftti_rationale: Time gap less the time that full braking needs to take effect.
elements:
  - {id: front_radar, kind: sensor, text: radar, asil_capability: D}
  - {id: car, kind: planner, text: performs the driving task, asil_capability: D}
"""


def _requirement(fsr: str, text: str, rule: str, more: str = "") -> str:
    return (
        f"  - id: {fsr}\n    goals: [SG-01]\n    text: {text}\n    {rule}\n"
        "    threshold_source: written for the self-test\n    asil: D\n    allocation: [car]\n"
        f"{more}"
    )


_DRIVING_CONCEPT: Final = (
    "concept: driving\ntitle: Drive behind a vehicle\n"
    + _HAZARDS
    + "requirements:\n"
    + _requirement(
        "FSR-01",
        "No contact.",
        "formula: always(not contact)",
        "    min_exercised: 1\n    on_contact: fail\n",
    )
    + _requirement(
        "FSR-02", "No hard braking.", "bound: {metric: max_deceleration_mps2, at_most: 6.0}"
    )
    + _requirement("FSR-03", "Keep the lane.", "formula: always(abs(ego.lane_offset) <= 0.6 m)")
    + _requirement(
        "FSR-04", "Steer little.", "formula: always(abs(ego.steering_angle) <= 0.03 rad)"
    )
    + _requirement(
        "FSR-05",
        "See the vehicle ahead.",
        "formula: always((time >= 0.5 s and actor.lead.gap <= 100 m) "
        "implies sensor.front.detects.lead)",
    )
    + _requirement(
        "FSR-06",
        "See it now.",
        "formula: always(time >= 0.5 s implies sensor.front.age <= 0.3 s)",
    )
    + _requirement(
        "FSR-07",
        "No braking without a reason.",
        "formula: always(time <= 3 s implies ego.acceleration >= -1 m/s^2)",
    )
)

_HANDOVER_CONCEPT: Final = (
    "concept: handover\ntitle: Take over from a silent channel\n"
    + _HAZARDS
    + "requirements:\n"
    + _requirement("FSR-11", "No contact.", "formula: always(not contact)")
    + _requirement(
        "FSR-12",
        "Take over within 0.5 s.",
        "formula: always(rise(channel.nominal.status == silent) "
        "implies eventually[0 s, 0.5 s](authority.safety))",
    )
    + _requirement(
        "FSR-13",
        "Who has taken over keeps authority.",
        "formula: always(rise(authority.safety) implies always[0 s, 3 s](authority.safety))",
    )
    + _requirement(
        "FSR-14",
        "Notice it within 0.4 s.",
        "formula: always(rise(channel.nominal.status == silent) "
        "implies eventually[0 s, 0.4 s](monitor.nominal_silent.confirmed))",
    )
    + _requirement(
        "FSR-15",
        "No takeover without a fault.",
        "formula: always(not faulted implies not authority.safety)",
    )
)


def _odd(name: str, architecture: str, faults: str, entries: str) -> str:
    return f"""\
odd: {name}
title: Self-test, {name}
attributes:
  scenery: {{road_type: [motorway], lanes: {{min: 2, max: 4}}}}
  environment: {{rain: {{max: 7.5 mm/h}}, friction: {{min: 0.5}}, illumination: [day]}}
  dynamic_elements: {{ego_speed: {{max: 130 km/h}}}}
scenarios:
  - use: closing
    faults: {entries}
    sweep:
      parameters:
        ego_speed: [20 m/s, 25 m/s]
faults: {faults}
architectures: [architectures/{architecture}.yaml]
concept: concepts/{name}.yaml
gate: {{architectures: [{architecture}]}}
plugins: []
step: 0.05 s
seed: 7
"""


_SILENT: Final = "[{id: nominal_silent, target: channels.nominal, model: silent, onset: {at: 2 s}}]"

FILES: Final[dict[str, str]] = {
    SCENARIO: _SCENARIO,
    CURVE: _CURVE,
    BARE: _BARE,
    GUARDED: _GUARDED,
    DRIVING_CONCEPT: _DRIVING_CONCEPT,
    HANDOVER_CONCEPT: _HANDOVER_CONCEPT,
    DRIVING: _odd("driving", "bare", "[]", "[none]"),
    HANDOVER: _odd("handover", "guarded", _SILENT, "[nominal_silent]"),
}
"""Every file of the bench beside the plug-ins, by its path."""


# --- A folder with the files of the bench, edited, and what the production path makes of it -------

DB: Final = "selftest.db"


@dataclass(frozen=True, slots=True)
class Edit:
    """A part of a file that is replaced, once.

    Attributes:
        file: Path in the bench.
        old: What is replaced; must be there exactly once.
        new: By what.
    """

    file: str
    old: str
    new: str


@dataclass(frozen=True, slots=True)
class Seen:
    """What came of something that was tried.

    Attributes:
        exit_code: That the command would end with.
        text: Verdicts, findings or the error, as people read them.
    """

    exit_code: int
    text: str


class Bench:
    """A folder of its own; nothing outside of it is read or written."""

    def __init__(self, folder: Path) -> None:
        """Take an empty folder."""
        self.folder = folder
        self._seen: dict[tuple[str, str], Seen] = {}

    def settle(self, edits: Sequence[Edit]) -> Path:
        """Write the files with the edits.

        Args:
            edits: Applied in their order.

        Returns:
            The folder; the same for the same edits.

        Raises:
            ValueError: What an edit replaces is not there exactly once.
        """
        contents = dict(FILES)
        for edit in edits:
            text = contents[edit.file]
            if text.count(edit.old) != 1:
                msg = f"{edit.file} has {edit.old!r} {text.count(edit.old)} times, not once"
                raise ValueError(msg)
            contents[edit.file] = text.replace(edit.old, edit.new)
        digest = hashlib.sha256(repr(sorted(contents.items())).encode()).hexdigest()[:12]
        folder = self.folder / digest
        source = Path(parts.__file__).read_text("utf-8")
        for name, text in {**contents, **dict.fromkeys(PARTS, source)}.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return folder

    def run(self, edits: Sequence[Edit], odd: str = DRIVING) -> Seen:
        """Plan, run, judge and store the edited bench, and say what ``adeye run`` would say."""
        folder = self.settle(edits)
        key = (folder.name, odd)
        if key not in self._seen:
            try:
                summary = api.run(folder / odd, db=folder / DB)
            except AdeyeError as error:
                self._seen[key] = Seen(error.exit_code, str(error))
            else:
                self._seen[key] = Seen(int(summary.exit_code), told(summary))
        return self._seen[key]


def told(summary: CampaignSummary) -> str:
    """Write the verdicts of a campaign and its message."""
    lines = [f"{line.fsr} {line.verdict or 'not applicable'}" for line in summary.verdicts]
    return "\n".join([*lines, summary.message])


# --- A known-bad master: what is wrong, what has to find it, how that shows; and its good twin ----

Group = Literal[
    "channel", "sensor", "switch", "monitor", "threshold", "file", "metric", "database", "report"
]
GROUPS: Final[tuple[Group, ...]] = (
    *("channel", "sensor", "switch", "monitor"),
    *("threshold", "file", "metric", "database", "report"),
)
Examine = Callable[[Bench], Seen]


@dataclass(frozen=True, slots=True)
class Master:
    """A small deliberate defect that a working tool detects.

    Attributes:
        name: Its name.
        group: Where the defect is.
        wrong: What is wrong.
        finder: The mechanism that must find it.
        exit_code: That it must show by.
        words: What the verdicts, findings or the error must say.
        examine: Takes the defect through the production path.
        twin: The same without the defect, which must end with 0.
    """

    name: str
    group: Group
    wrong: str
    finder: str
    exit_code: int
    words: str
    examine: Examine
    twin: Examine

    def is_detected(self, seen: Seen) -> bool:
        """Tell whether what was seen shows the defect, in the way that it must."""
        return seen.exit_code == self.exit_code and self.words in seen.text


def is_good(seen: Seen) -> bool:
    """Tell whether a twin was taken for what it is."""
    return seen.exit_code == 0


def running(*edits: Edit, odd: str = DRIVING) -> Examine:
    """Take the bench with some edits through plan, run, judge, store and exit code."""
    return lambda bench: bench.run(edits, odd)
