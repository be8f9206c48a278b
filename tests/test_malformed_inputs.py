"""Malformed inputs end with exit code 2, file, line and what to do; never with a traceback."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest

from adeye.cli import main

if TYPE_CHECKING:
    from pathlib import Path

ODD = """\
odd: small
attributes:
  scenery: {road_type: [motorway]}
  environment: {rain: {max: 10 mm/h}, friction: {min: 0.5}}
  dynamic_elements: {ego_speed: {max: 130 km/h}, actors: [car]}
scenarios:
  - use: follow
    faults: [camera_out, camera_late]
    sweep:
      design: full_factorial
      parameters:
        ego_speed: [80 km/h, 100 km/h]
        gap: {from: 30 m, to: 50 m, step: 10 m}
      where: ["gap >= ego_speed * 1 s"]
faults:
  - {id: camera_out, target: sensors.camera, model: drop_out, onset: {at: 2 s}, duration: 3 s}
  - {id: camera_late, target: sensors.camera, model: drop_out, onset: {when: lead.gap < 20 m}}
architectures: [architectures/one.yaml, architectures/two.yaml]
concept: concepts/small.yaml
gate: {architectures: [one]}
step: 0.05 s
seed: 7
replicates: 1
"""
SCENARIO = """\
scenario: follow
title: Follow a braking vehicle
provenance: {source: made for this test}
parameters:
  ego_speed: {default: 100 km/h, range: [60 km/h, 130 km/h]}
  gap: {default: 40 m, range: [20 m, 60 m]}
  rain: {default: 0 mm/h, range: [0 mm/h, 20 mm/h]}
world:
  road:
    kind: straight
    length: 1500 m
    lanes: 2
    lane_width: 3.5 m
    shoulder: 2.5 m
    speed_limit: 130 km/h
environment: {rain: rain, fog_visibility: 10 km, friction: 0.8}
ego: {lane: 0, s: 50 m, speed: ego_speed}
actors:
  lead:
    kind: car
    start: {lane: 0, ahead_of: ego, gap: gap, speed: ego_speed}
  next:
    kind: car
    start: {lane: 1, ahead_of: lead, gap: 30 m, speed: ego_speed}
storyboard:
  brakes:
    actor: lead
    when: time >= 2 s
    speed: {to: 10 m/s, rate: 4 m/s^2}
realised: [brakes]
horizon: 10 s
tail: 5 s
"""
ONE = """\
architecture: one
title: One camera
vehicle:
  length: 4.9 m
  width: 1.9 m
  height: 1.6 m
  wheelbase: 2.9 m
  max_acceleration: 3 m/s^2
  max_deceleration: 9 m/s^2
  max_steering_angle: 35 deg
  max_steering_rate: 30 deg/s
  acceleration_lag: 0.15 s
  steering_lag: 0.1 s
sensors:
  camera:
    kind: camera
    mount: {x: 1.5 m}
    field_of_view: 60 deg
    range: 120 m
    rate: 20 Hz
    latency: 0.1 s
  pose: {kind: localisation, rate: 20 Hz}
channels:
  nominal:
    kind: nominal
    links: [pose, camera]
    rate: 20 Hz
switch:
  policy: fixed_priority
  priority: [nominal]
  default: nominal
"""
TWO = """\
extends: one.yaml
architecture: two
title: Two channels
sensors:
  truth: {kind: ground_truth, rate: 20 Hz}
channels:
  safety:
    kind: safety
    links: [truth, channels.nominal, switch]
switch:
  priority: [safety, nominal]
"""
CONCEPT = """\
concept: small
title: A concept of two requirements
hazardous_events:
  - id: HE-1
    function: braking
    malfunction: no braking
    situation: motorway
    severity: S3
    exposure: E4
    controllability: C3
    severity_rationale: fatal
    exposure_rationale: daily
    controllability_rationale: nobody watches
safety_goals:
  - id: SG-1
    text: Do not hit the vehicle ahead.
    hazardous_events: [HE-1]
    safe_state: standstill
    ftti: 2 s
    ftti_rationale: time headway
elements:
  - {id: planner, kind: planner, text: drives, asil_capability: D}
requirements:
  - id: FSR-1
    goals: [SG-1]
    text: No contact.
    formula: always(not contact)
    threshold_source: SG-1
    asil: D
    allocation: [planner]
  - id: FSR-2
    goals: [SG-1]
    text: Brakes in time.
    bound: {metric: max_required_deceleration_mps2, at_most: 6.0}
    threshold_source: R157
    asil: D
    allocation: [planner]
assumptions:
  - {id: AS-1, text: dry, owner: me, valid_until: 2030-12-31}
"""
PLUGINS = """\
from adeye.ports import Parameters


class Planner:
    monitor_ids = ()

    class Parameters(Parameters):
        gain: float = 1.0

    def reset(self, context): ...

    def act(self, observation): ...


class Mute:
    def reset(self, context): ...


class Watchful(Planner):
    monitor_ids = 5


class Loose(Planner):
    Parameters = int
"""
FILES = {
    "odd/small.yaml": ODD,
    "scenarios_db/follow.yaml": SCENARIO,
    "odd/architectures/one.yaml": ONE,
    "odd/architectures/two.yaml": TWO,
    "odd/concepts/small.yaml": CONCEPT,
    "odd/architectures/planners.py": PLUGINS,
    "odd/architectures/broken.py": "class Planner\n    pass\n",
    "odd/architectures/raising.py": "import math\nroot = math.sqrt(-1)\n",
    "odd/architectures/leaving.py": "import sys\nsys.exit(0)\n",
}
IN_ODD, IN_SCENARIO, IN_ONE, IN_TWO, IN_CONCEPT = list(FILES)[:5]

# Texts of the files that many rows replace.
SPEEDS = "ego_speed: [80 km/h, 100 km/h]"
GAPS = "gap: {from: 30 m, to: 50 m, step: 10 m}"
WHERE = 'where: ["gap >= ego_speed * 1 s"]'
SWEEP = (
    f"design: full_factorial\n      parameters:\n        {SPEEDS}\n        {GAPS}\n      {WHERE}"
)
NOMINAL = "    kind: nominal\n    links: [pose, camera]\n    rate: 20 Hz\n"
BOMB = "".join(f"x{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12))
THOUSAND = "{from: 0.001 m, to: 1 m, step: 0.001 m}"


@dataclass(frozen=True)
class Flaw:
    """One malformed input.

    Attributes:
        what: Its name.
        file: The file that is changed.
        old: Text that is replaced; None for the whole file.
        new: What takes its place.
        said: A distinctive part of the message.
        where: File and line that the message names; empty for the line of the change.
    """

    what: str
    file: str
    old: str | None
    new: str | bytes
    said: str
    where: str = ""


def plugin(what: str, kind: str, said: str, more: str = "", where: str = "") -> Flaw:
    new = f"    kind: {kind}\n    links: [pose, camera]\n    rate: 20 Hz\n{more}"
    return Flaw(what, IN_ONE, NOMINAL, new, said, where)


FLAWS = [
    Flaw(
        "unknown key",
        IN_ODD,
        "seed: 7",
        "sed: 7",
        "there is no key 'sed' here. Did you mean 'seed'?",
    ),
    Flaw(
        "unknown key of a sensor",
        IN_ONE,
        "    range: 120 m",
        "    rnage: 120 m",
        "Did you mean 'range'?",
    ),
    Flaw(
        "missing key",
        IN_ODD,
        "concept: concepts/small.yaml\n",
        "",
        "concept is missing. Add `concept:`",
        "odd/small.yaml:1:",
    ),
    Flaw(
        "duplicate key",
        IN_ODD,
        "seed: 7",
        "seed: 7\nseed: 8",
        "key 'seed' occurs twice, first in line 22",
        "odd/small.yaml:23:",
    ),
    Flaw(
        "wrong unit",
        IN_ONE,
        "range: 120 m",
        "range: 120 s",
        "'120 s' is not a length. Write a length like '15 m'",
    ),
    Flaw(
        "missing unit", IN_ONE, "range: 120 m", "range: 120", "120 has no unit. Write a length like"
    ),
    Flaw(
        "unit that does not exist",
        IN_ONE,
        "range: 120 m",
        "range: 120 metres",
        "'120 metres' is not a length",
    ),
    Flaw(
        "wrong unit on an axis",
        IN_ODD,
        SPEEDS,
        "ego_speed: [80 m]",
        "'80 m' is a length, not a speed. Write it like '100 km/h'",
    ),
    Flaw(
        "missing unit on an axis",
        IN_ODD,
        SPEEDS,
        "ego_speed: [80]",
        "80 is a plain number, not a speed",
    ),
    Flaw("NaN", IN_CONCEPT, "at_most: 6.0", "at_most: .nan", ".nan is not a finite number"),
    Flaw("infinity", IN_ODD, "seed: 7", "seed: .inf", ".inf is not a finite number"),
    Flaw("infinity on an axis", IN_ODD, SPEEDS, "ego_speed: [.inf]", ".inf is not a finite number"),
    Flaw("text for NaN", IN_ONE, "range: 120 m", "range: nan m", "'nan m' is not a quantity"),
    Flaw(
        "number that overflows",
        IN_ONE,
        "range: 120 m",
        "range: 1e400 m",
        "'1e400 m' is not a finite number",
    ),
    Flaw(
        "negative range",
        IN_ONE,
        "range: 120 m",
        "range: -120 m",
        "must be more than 0 m ('-120 m')",
    ),
    Flaw(
        "field of view beyond a circle",
        IN_ONE,
        "60 deg",
        "400 deg",
        "must be at most 360 deg ('400 deg')",
    ),
    Flaw("empty sweep", IN_ODD, SWEEP, "", "sweep: must be a mapping", "odd/small.yaml:9:"),
    Flaw(
        "empty axis",
        IN_ODD,
        SPEEDS,
        "ego_speed: []",
        "ego_speed: the axis has no values. List some",
    ),
    Flaw(
        "axis that runs backwards",
        IN_ODD,
        GAPS,
        "gap: {from: 50 m, to: 30 m, step: 10 m}",
        "`to` not below `from`",
    ),
    Flaw(
        "axis with step zero",
        IN_ODD,
        GAPS,
        "gap: {from: 30 m, to: 50 m, step: 0 m}",
        "The step must be positive",
    ),
    Flaw(
        "axis that misses its end",
        IN_ODD,
        GAPS,
        "gap: {from: 30 m, to: 50 m, step: 7 m}",
        "The nearest ends are 44 m and 51 m",
    ),
    Flaw(
        "axis of mixed units",
        IN_ODD,
        GAPS,
        "gap: {from: 30 m, to: 0.05 km, step: 10 m}",
        "Write all three in one unit",
    ),
    Flaw(
        "axis with a tiny step",
        IN_ODD,
        GAPS,
        "gap: {from: 30 m, to: 50 m, step: 1e-300 m}",
        "more than 1,000,000 values",
    ),
    Flaw(
        "value twice on an axis",
        IN_ODD,
        SPEEDS,
        "ego_speed: [80 km/h, 80 km/h]",
        "a value occurs twice",
    ),
    Flaw(
        "value out of the scenario's range",
        IN_ODD,
        SPEEDS,
        "ego_speed: [160 km/h]",
        "outside the scenario's range [60 km/h, 130 km/h]",
    ),
    Flaw(
        "bool on an axis",
        IN_ODD,
        SPEEDS,
        "ego_speed: [true]",
        "ego_speed: true is not a quantity like '100 km/h'",
    ),
    Flaw(
        "list on an axis of a quantity",
        IN_ODD,
        SPEEDS,
        "ego_speed: [[80 km/h, 100 km/h]]",
        "ego_speed: [80 km/h, 100 km/h] is not a quantity like '100 km/h'",
    ),
    Flaw(
        "mapping on an axis",
        IN_ODD,
        SPEEDS,
        "ego_speed: [{a: b}]",
        "must be",
    ),
    Flaw(
        "unknown sensor in a swept list of links",
        IN_ODD,
        SPEEDS,
        "architecture.channels.nominal.links: [[pose], [pose, sonar]]",
        "with channels.nominal.links = [pose, sonar]: channels.nominal.links.1: "
        "channel 'nominal' links 'sonar', which is none of camera, pose,",
    ),
    Flaw(
        "sensor twice in a swept list of links",
        IN_ODD,
        SPEEDS,
        "architecture.channels.nominal.links: [[pose, pose]]",
        "channel 'nominal' links 'pose' twice",
    ),
    Flaw(
        "infeasible where",
        IN_ODD,
        WHERE,
        'where: ["gap > 1 km"]',
        "none of 6 combinations fulfils gap > 1 km",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "where naming an unknown parameter",
        IN_ODD,
        WHERE,
        'where: ["gapp > 10 m"]',
        "names 'gapp', which the sweep does not have. Did you mean 'gap'?",
    ),
    Flaw(
        "where of mixed dimensions",
        IN_ODD,
        WHERE,
        'where: ["gap > 10 s"]',
        "puts a length and a time together",
    ),
    Flaw(
        "where without a unit",
        IN_ODD,
        WHERE,
        'where: ["gap > 10"]',
        "puts a length and a plain number together",
    ),
    Flaw(
        "where that is no relation",
        IN_ODD,
        WHERE,
        'where: ["gap"]',
        "'gap' is neither true nor false",
    ),
    Flaw(
        "where that does not parse",
        IN_ODD,
        WHERE,
        'where: ["gap >"]',
        "character 6: a number, a name or '(' is missing",
    ),
    Flaw(
        "where with code",
        IN_ODD,
        WHERE,
        "where: [\"__import__('os').getcwd() == 0\"]",
        "cannot be read here",
    ),
    Flaw(
        "where that is no list", IN_ODD, WHERE, 'where: "gap > 10 m"', "must be a list, like [a, b]"
    ),
    Flaw("unknown parameter", IN_ODD, SPEEDS, "ego_sped: [80 km/h]", "Did you mean 'ego_speed'?"),
    Flaw(
        "unknown path of an architecture",
        IN_ODD,
        SPEEDS,
        "architecture.sensors.lidar.range: [80 m]",
        "no architecture has this path. There are: camera, pose, truth",
    ),
    Flaw(
        "unknown path of a scenario",
        IN_ODD,
        SPEEDS,
        "scenario.world.rod: [80 m]",
        "There are: road, objects",
    ),
    Flaw(
        "unknown path of a fault",
        IN_ODD,
        SPEEDS,
        "faults.camera_out.length: [1 s]",
        "a fault has no length. There are: id, target",
    ),
    Flaw(
        "path to an unknown fault",
        IN_ODD,
        SPEEDS,
        "faults.camera_ou.duration: [1 s]",
        "Did you mean 'camera_out'?",
    ),
    Flaw("swept id", IN_ODD, SPEEDS, "architecture.architecture: [a, b]", "cannot vary"),
    Flaw(
        "swept target of a fault",
        IN_ODD,
        SPEEDS,
        "faults.camera_out.target: [channels.nominal]",
        "cannot vary",
    ),
    Flaw(
        "swept value of a wrong unit",
        IN_ODD,
        SPEEDS,
        "architecture.sensors.camera.range: [80 s]",
        "with sensors.camera.range = 80 s: sensors.camera.range: '80 s' is not a length",
    ),
    Flaw(
        "swept word that is not allowed",
        IN_ODD,
        SPEEDS,
        "architecture.switch.policy: [nobody]",
        "must be 'fixed_priority', 'hysteresis', 'voting' or 'stuck'",
    ),
    Flaw(
        "swept rate that does not divide the clock",
        IN_ODD,
        SPEEDS,
        "architecture.sensors.camera.rate: [7 Hz]",
        "The nearest that do are 6.66667 Hz and 10 Hz",
    ),
    Flaw(
        "swept horizon that does not fit the clock",
        IN_ODD,
        SPEEDS,
        "scenario.horizon: [10.01 s]",
        "The nearest are 10 s and 10.05 s",
    ),
    Flaw(
        "swept reference",
        IN_ODD,
        SPEEDS,
        "scenario.actors.lead.start.ahead_of: [nobody]",
        "there is no actor 'nobody'",
    ),
    Flaw(
        "swept formula",
        IN_ODD,
        SPEEDS,
        "scenario.actors.lead.start.gap: [gp]",
        "'gp' uses 'gp', which does not exist",
    ),
    Flaw(
        "swept friction of zero",
        IN_ODD,
        SPEEDS,
        "scenario.environment.friction: [0]",
        "friction: 0 is below the ODD's minimum 0.5",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "a billion combinations",
        IN_ODD,
        SPEEDS,
        "\n        ".join(f"architecture.sensors.camera.mount.{k}: {THOUSAND}" for k in "xyz"),
        "has 3,000,000,000 combinations",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "too many test cases",
        IN_ODD,
        "replicates: 1",
        "replicates: 1000000000",
        "36,000,000,000 test cases, above the limit of 100,000",
        "odd/small.yaml:7:",
    ),
    Flaw(
        "more test cases than the ODD's own limit",
        IN_ODD,
        "seed: 7",
        "seed: 7\nmax_test_cases: 35",
        "36 test cases, above the limit of 35",
        "odd/small.yaml:7:",
    ),
    Flaw(
        "unknown design",
        IN_ODD,
        "full_factorial",
        "full_factorail",
        "Did you mean 'full_factorial'?",
    ),
    Flaw(
        "zip of unequal lengths",
        IN_ODD,
        "full_factorial",
        "zip",
        "needs axes of one length, these have ego_speed (2), gap (3)",
    ),
    Flaw("list without points", IN_ODD, "full_factorial", "list", "design: list needs points"),
    Flaw(
        "random without samples", IN_ODD, "full_factorial", "random", "design: random needs samples"
    ),
    Flaw(
        "samples without random",
        IN_ODD,
        "full_factorial",
        "full_factorial\n      samples: 3",
        "samples belong to design: random",
    ),
    Flaw(
        "more samples than test cases",
        IN_ODD,
        "full_factorial",
        "random\n      samples: 1000000000000",
        "1,000,000,000,000 samples are above the limit",
    ),
    Flaw(
        "random that never fits",
        IN_ODD,
        SWEEP,
        SWEEP.replace("full_factorial", "random\n      samples: 9").replace(
            WHERE, 'where: ["gap > 1 km"]'
        ),
        "only 0 of 9,000 draws fulfil gap > 1 km",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "ragged list",
        IN_ODD,
        SWEEP,
        "design: list\n      points: [{gap: 30 m}, {ego_speed: 80 km/h}]",
        "point 1 has no ego_speed",
        "odd/small.yaml:11:",
    ),
    Flaw(
        "outside the ODD",
        IN_ODD,
        "ego_speed: {max: 130 km/h}",
        "ego_speed: {max: 90 km/h}",
        "ego_speed: 100 km/h is above the ODD's maximum 90 km/h",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "road type outside the ODD",
        IN_ODD,
        "[motorway]",
        "[urban]",
        "road type motorway, the ODD has urban",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "actor outside the ODD",
        IN_ODD,
        "actors: [car]",
        "actors: [truck]",
        "actor lead is a car, the ODD has truck",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "unknown kind of actor in the ODD",
        IN_ODD,
        "actors: [car]",
        "actors: [car, tuck]",
        "Did you mean 'truck'?",
    ),
    Flaw(
        "lanes from more to fewer",
        IN_ODD,
        "[motorway]",
        "[motorway], lanes: {min: 3, max: 2}",
        "from 3 to 2 lanes is empty",
    ),
    Flaw("unknown scenario", IN_ODD, "use: follow", "use: folow", "there is no scenario 'folow'"),
    Flaw("scenario by path", IN_ODD, "use: follow", "use: ../follow", "must be lower case letters"),
    Flaw(
        "scenario twice",
        IN_ODD,
        "faults:\n  - {id",
        "  - use: follow\nfaults:\n  - {id",
        "scenario 'follow' occurs twice",
        "odd/small.yaml:15:",
    ),
    Flaw(
        "no scenarios",
        IN_ODD,
        ODD[ODD.index("  - use") : ODD.index("faults:\n  - {id")],
        "",
        "scenarios:",
        "odd/small.yaml:6:",
    ),
    Flaw(
        "scenario in two files",
        "scenarios_db/old/follow.yaml",
        None,
        "scenario: follow\n",
        "is in another file, too",
        "scenarios_db/old/follow.yaml:1:",
    ),
    Flaw(
        "scenario named unlike its file",
        IN_SCENARIO,
        "scenario: follow",
        "scenario: other",
        "the scenario is named 'other', its file 'follow'",
    ),
    Flaw(
        "unknown architecture file",
        IN_ODD,
        "architectures/two.yaml",
        "architectures/tow.yaml",
        "'architectures/tow.yaml' is not a file",
    ),
    Flaw(
        "folder for an architecture",
        IN_ODD,
        "architectures/two.yaml",
        "architectures",
        "'architectures' is not a file",
    ),
    Flaw(
        "architecture twice",
        IN_ODD,
        "architectures/two.yaml",
        "architectures/one.yaml",
        "architecture 'one' is listed twice",
    ),
    Flaw(
        "unknown concept file",
        IN_ODD,
        "concepts/small.yaml",
        "concepts/smal.yaml",
        "'concepts/smal.yaml' is not a file",
    ),
    Flaw("path that is too long", IN_ODD, "concepts/small.yaml", "c" * 3000, "is not a file"),
    Flaw("path with a null character", IN_ODD, "concepts/small.yaml", '"a\\0b"', "is not a file"),
    Flaw(
        "unknown catalogue",
        IN_ODD,
        "seed: 7",
        "seed: 7\ncatalogue: ../nowhere",
        "catalogue '../nowhere' is not a folder",
        "odd/small.yaml:23:",
    ),
    Flaw(
        "recursive alias",
        IN_ODD,
        "faults:\n  - {id",
        "faults: &f\n  - *f\n  - {id",
        "alias *f contains itself",
        "odd/small.yaml:16:",
    ),
    Flaw("undefined alias", IN_ODD, "seed: 7", "seed: *s", "undefined alias"),
    Flaw(
        "alias bomb",
        IN_ODD,
        "odd: small\n",
        f"odd: small\nx0: &a0 [x, x]\n{BOMB}",
        "more than 100,000 values, aliases included",
        "odd/small.yaml:7:",
    ),
    Flaw("nesting bomb", IN_ODD, "seed: 7", f"seed: {'[' * 3000}", "nested more than 50 deep"),
    Flaw("merge key", IN_ODD, "seed: 7", "<<: {seed: 7}", "merge keys are not read"),
    Flaw(
        "tag that makes an object",
        IN_ODD,
        "seed: 7",
        "seed: !!python/object/apply:os.getcwd []",
        "is not read",
    ),
    Flaw("second document", IN_ODD, "seed: 7", "---\nseed: 7", "a second document begins here"),
    Flaw(
        "tab indentation", IN_ODD, "      design: full", "\tdesign: full", "cannot start any token"
    ),
    Flaw(
        "unclosed bracket",
        IN_ODD,
        "seed: 7",
        "seed: [7",
        "did not find expected",
        "odd/small.yaml:23:",
    ),
    Flaw(
        "not UTF-8",
        IN_ODD,
        "seed: 7",
        b"title: \xff\nseed: 7",
        "byte 0xff is not UTF-8. Save the file as UTF-8",
    ),
    Flaw(
        "control character",
        IN_ODD,
        "odd: small",
        'odd: small\ntitle: "a\x00b"',
        "character U+0000 cannot stand in YAML",
        "odd/small.yaml:2:",
    ),
    Flaw("YAML 1.1", IN_ODD, None, "%YAML 1.1\n---\nodd: small\n", "this is YAML 1.1"),
    Flaw("empty file", IN_ODD, None, "", "the document is empty. Write a mapping"),
    Flaw("file of comments", IN_CONCEPT, None, "# nothing yet\n", "the document is empty"),
    Flaw("list for a file", IN_ODD, None, "- a\n", "must be a mapping"),
    Flaw(
        "file that is too large",
        IN_ODD,
        None,
        f"odd: small\n# {'x' * 1_000_000}\n",
        "more than 1,000,000 bytes",
    ),
    Flaw(
        "cyclic extends",
        IN_ONE,
        "architecture: one",
        "extends: two.yaml\narchitecture: one",
        "extends is cyclic: one → two → one",
        "odd/architectures/two.yaml:1:",
    ),
    Flaw("extends of a missing file", IN_TWO, "one.yaml", "oen.yaml", "'oen.yaml' is not a file"),
    Flaw("extends of two files", IN_TWO, "extends: one.yaml", "extends: [one.yaml]", "is no name"),
    Flaw(
        "key removed by an extending file",
        IN_TWO,
        "  truth:",
        "  camera: {range: null}\n  truth:",
        "sensors.camera.range is missing",
    ),
    Flaw(
        "cyclic ahead_of",
        IN_SCENARIO,
        "ahead_of: ego",
        "ahead_of: next",
        "the starts form a circle: lead → next → lead",
    ),
    Flaw(
        "unknown ahead_of",
        IN_SCENARIO,
        "ahead_of: lead",
        "ahead_of: leader",
        "there is no actor 'leader'. Did you mean 'lead'?",
    ),
    Flaw(
        "unknown actor in the storyboard",
        IN_SCENARIO,
        "actor: lead",
        "actor: leader",
        "there is no actor 'leader'. Did you mean 'lead'?",
    ),
    Flaw(
        "unknown event in realised",
        IN_SCENARIO,
        "[brakes]",
        "[brake]",
        "there is no event 'brake'. Did you mean 'brakes'?",
    ),
    Flaw(
        "unknown name in a trigger",
        IN_SCENARIO,
        "when: time",
        "when: tme",
        "'tme', which does not exist. Did you mean 'time'?",
    ),
    Flaw(
        "event without an action",
        IN_SCENARIO,
        "    speed: {to: 10 m/s, rate: 4 m/s^2}\n",
        "",
        "an event has exactly one of",
        "scenarios_db/follow.yaml:27:",
    ),
    Flaw(
        "event with two actions",
        IN_SCENARIO,
        "    speed: {to",
        "    stop: {rate: 3 m/s^2}\n    speed: {to",
        "an event has exactly one of",
        "scenarios_db/follow.yaml:27:",
    ),
    Flaw(
        "lane beyond the road",
        IN_SCENARIO,
        "start: {lane: 1,",
        "start: {lane: 2,",
        "2 is no lane of a road with lanes 0 to 1",
    ),
    Flaw(
        "curve without radius",
        IN_SCENARIO,
        "kind: straight",
        "kind: curve",
        "a curve road takes a radius",
    ),
    Flaw(
        "straight with radius",
        IN_SCENARIO,
        "kind: straight",
        "kind: straight\n    radius: 100 m",
        "a straight road takes no radius",
    ),
    Flaw(
        "road of negative length",
        IN_SCENARIO,
        "length: 1500 m",
        "length: -1500 m",
        "world.road.length: -1500 m is not above 0 m",
    ),
    Flaw(
        "unknown kind of actor",
        IN_SCENARIO,
        "  next:\n    kind: car",
        "  next:\n    kind: tank",
        "must be 'car', 'van'",
        "scenarios_db/follow.yaml:23:",
    ),
    Flaw(
        "formula of a wrong dimension",
        IN_SCENARIO,
        "gap: gap,",
        "gap: ego_speed,",
        "'ego_speed' is a speed, not a length",
    ),
    Flaw("formula of text", IN_SCENARIO, "gap: gap,", "gap: \"'near'\",", "uses text"),
    Flaw(
        "default outside its range",
        IN_SCENARIO,
        "default: 40 m",
        "default: 70 m",
        "70 m is outside the range [20 m, 60 m]",
    ),
    Flaw(
        "default that is no quantity",
        IN_SCENARIO,
        "default: 40 m",
        "default: near",
        "'near' is not a quantity",
    ),
    Flaw(
        "range of another unit",
        IN_SCENARIO,
        "[20 m, 60 m]",
        "[20 s, 60 s]",
        "'20 s' is a time, the default '40 m' is a length",
    ),
    Flaw(
        "range that runs backwards",
        IN_SCENARIO,
        "[20 m, 60 m]",
        "[60 m, 20 m]",
        "the range from 60 m to 20 m is empty",
    ),
    Flaw("horizon of zero", IN_SCENARIO, "horizon: 10 s", "horizon: 0 s", "must be more than 0 s"),
    Flaw(
        "horizon that does not fit the clock",
        IN_SCENARIO,
        "horizon: 10 s",
        "horizon: 10.01 s",
        "The nearest are 10 s and 10.05 s",
    ),
    Flaw(
        "horizon of a year",
        IN_SCENARIO,
        "horizon: 10 s",
        "horizon: 8760 h",
        "horizon: 31536000 s is not plausible; time is from -86400 s to 86400 s",
    ),
    Flaw("negative tail", IN_SCENARIO, "tail: 5 s", "tail: -5 s", "must be at least 0 s"),
    Flaw(
        "constraint that never holds",
        IN_SCENARIO,
        "world:",
        "constraints: [gap > 100 m]\nworld:",
        "none of 6 combinations fulfils",
        "odd/small.yaml:10:",
    ),
    Flaw(
        "FSR naming an unknown signal",
        IN_CONCEPT,
        "not contact",
        "not contacts",
        "Did you mean 'contact'?",
    ),
    Flaw(
        "unknown metric",
        IN_CONCEPT,
        "max_required_deceleration_mps2",
        "max_required_deceleration",
        "Did you mean 'max_required_deceleration_mps2'?",
    ),
    Flaw(
        "formula that does not parse",
        IN_CONCEPT,
        "(not contact)",
        "(not contact",
        "')' is expected",
    ),
    Flaw(
        "FSR of mixed dimensions",
        IN_CONCEPT,
        "not contact",
        "ego.speed < 10 m",
        "'ego.speed' is a speed, '10 m' is a length",
    ),
    Flaw(
        "FSR without a unit",
        IN_CONCEPT,
        "not contact",
        "ego.speed < 10",
        "Give the number its unit",
    ),
    Flaw(
        "window exceeding the tail",
        IN_CONCEPT,
        "not contact",
        "contact implies eventually[0 s, 20 s](standstill)",
        "Give the scenario a tail of 20 s or shorten the window",
    ),
    Flaw(
        "unbounded inner window",
        IN_CONCEPT,
        "not contact",
        "contact implies eventually(standstill)",
        "Give it a window",
    ),
    Flaw(
        "window that ends before it begins",
        IN_CONCEPT,
        "not contact",
        "contact implies eventually[2 s, 1 s](standstill)",
        "is empty or begins below 0 s",
    ),
    Flaw(
        "status that does not exist",
        IN_CONCEPT,
        "not contact",
        "channel.nominal.status == asleep",
        "It is one of ok, degraded",
    ),
    Flaw(
        "FSR without a measure",
        IN_CONCEPT,
        "    formula: always(not contact)\n",
        "",
        "give either a formula or a bound",
        "odd/concepts/small.yaml:24:",
    ),
    Flaw(
        "FSR with an unknown goal",
        IN_CONCEPT,
        "    goals: [SG-1]\n    text: No",
        "    goals: [SG-2]\n    text: No",
        "'SG-2' is none of SG-1",
        "odd/concepts/small.yaml:25:",
    ),
    Flaw(
        "FSR with an unknown allocation",
        IN_CONCEPT,
        "allocation: [planner]\n  - id",
        "allocation: [plnner]\n  - id",
        "'plnner' is none of planner",
        "odd/concepts/small.yaml:30:",
    ),
    Flaw(
        "FSR for an unknown scenario",
        IN_CONCEPT,
        "threshold_source: SG-1",
        "threshold_source: SG-1\n    scenarios: [folow]",
        "Did you mean 'follow'?",
        "odd/concepts/small.yaml:29:",
    ),
    Flaw(
        "ASIL below the goal's",
        IN_CONCEPT,
        "SG-1\n    asil: D",
        "SG-1\n    asil: B",
        "ASIL B, below D of SG-1. Set it to D",
        "odd/concepts/small.yaml:29:",
    ),
    Flaw(
        "ASIL that does not exist",
        IN_CONCEPT,
        "SG-1\n    asil: D",
        "SG-1\n    asil: E",
        "must be 'QM', 'A', 'B', 'C', 'D', 'QM(A)'",
        "odd/concepts/small.yaml:29:",
    ),
    Flaw(
        "ASIL of a decomposition that there is not",
        IN_CONCEPT,
        "SG-1\n    asil: D",
        "SG-1\n    asil: B(D)",
        "FSR-1 has ASIL B(D) and comes of no decomposition. Write B, or list it",
        "odd/concepts/small.yaml:29:",
    ),
    Flaw(
        "decomposition into what there is not",
        IN_CONCEPT,
        "assumptions:",
        "decompositions:\n  - {requirement: FSR-1, into: [FSR-2, FSR-3], independence: x}\n"
        "assumptions:",
        "there is no requirement 'FSR-3'. Did you mean",
        "odd/concepts/small.yaml:39:",
    ),
    Flaw(
        "record of the DFA over what there is not",
        IN_CONCEPT,
        "assumptions:",
        "dependent_failures:\n  - id: DFA-1\n    covers: [plnner]\n    argument: x\n"
        "    owner: me\n    valid_until: 2030-12-31\nassumptions:",
        "there is no resource, software, supplier or element 'plnner'. Did you mean 'planner'?",
        "odd/concepts/small.yaml:40:",
    ),
    Flaw(
        "consumed and provided by nobody",
        IN_CONCEPT,
        "asil_capability: D}",
        "asil_capability: D, consumes: [map]}",
        "nobody provides 'map'. Nothing is",
        "odd/concepts/small.yaml:22:",
    ),
    Flaw(
        "emergency operation without its tolerance time",
        IN_CONCEPT,
        "    ftti_rationale: time headway\n",
        "    ftti_rationale: time headway\n    emergency_operation: slowly\n",
        "give emergency_operation, eotti and eotti_rationale together, or none of them",
        "odd/concepts/small.yaml:15:",
    ),
    Flaw("FSR twice", IN_CONCEPT, "FSR-2", "FSR-1", "'FSR-1' is defined twice"),
    Flaw(
        "text where a date is expected",
        IN_CONCEPT,
        "2030-12-31",
        "someday",
        "'someday' is not a date, like 2027-12-31",
    ),
    Flaw("day that does not exist", IN_CONCEPT, "2030-12-31", "2030-02-30", "must be a date"),
    Flaw(
        "gate naming an unknown architecture",
        IN_ODD,
        "[one]",
        "[oen]",
        "gate names 'oen', not one of the ODD's architectures",
    ),
    Flaw(
        "gate without the signal of an FSR",
        IN_CONCEPT,
        "not contact",
        "not authority.safety",
        "architecture 'one' is in the gate",
    ),
    Flaw(
        "fault with an unknown target",
        IN_ODD,
        "camera_out, target: sensors.camera",
        "camera_out, target: sensors.camra",
        "no architecture has sensors.camra. There are: sensors.",
    ),
    Flaw(
        "fault of another kind of target",
        IN_ODD,
        "camera_out, target: sensors.camera",
        "camera_out, target: wheels.left",
        "must be sensors.<id>, channels.<id>, hooks.<channel>, links.<channel>.<link>,",
    ),
    Flaw(
        "fault model that does not fit",
        IN_ODD,
        "model: drop_out, onset: {at",
        "model: silent, onset: {at",
        "silent is a fault of channels",
    ),
    Flaw(
        "unknown fault model",
        IN_ODD,
        "model: drop_out, onset: {at",
        "model: dropout, onset: {at",
        "Did you mean 'drop_out'?",
    ),
    Flaw(
        "unknown fault in an entry",
        IN_ODD,
        "[camera_out,",
        "[camera_oot,",
        "Did you mean 'camera_out'?",
    ),
    Flaw(
        "none in a double fault",
        IN_ODD,
        "[camera_out, camera_late]",
        "[[none, camera_out]]",
        "names fault 'none', which is not there",
    ),
    Flaw(
        "onset with an unknown name",
        IN_ODD,
        "lead.gap < 20 m",
        "leader.gap < 20 m",
        "nothing named 'leader.gap'. Did you mean 'lead.gap'?",
    ),
    Flaw(
        "onset of mixed dimensions",
        IN_ODD,
        "lead.gap < 20 m",
        "lead.gap < 20 s",
        "puts a length and a time together",
    ),
    Flaw(
        "onset that is no condition",
        IN_ODD,
        "lead.gap < 20 m",
        "lead.gap",
        "'lead.gap' is neither true nor false",
    ),
    Flaw(
        "onset that compares text",
        IN_ODD,
        "lead.gap < 20 m",
        "lead.gap == 'a'",
        "uses text, which is not known during a run",
    ),
    Flaw(
        "two onsets",
        IN_ODD,
        "{at: 2 s}",
        "{at: 2 s, when: time > 1 s}",
        "give one of at, when and between",
    ),
    Flaw(
        "onset before the start", IN_ODD, "{at: 2 s}", "{at: -2 s}", "must be at least 0 s ('-2 s')"
    ),
    Flaw(
        "negative duration",
        IN_ODD,
        "duration: 3 s",
        "duration: -3 s",
        "must be at least 0 s ('-3 s')",
    ),
    Flaw(
        "rate that does not divide the clock",
        IN_ONE,
        "range: 120 m\n    rate: 20 Hz",
        "range: 120 m\n    rate: 7 Hz",
        "The nearest that do are 6.66667 Hz and 10 Hz",
        "odd/architectures/one.yaml:20:",
    ),
    Flaw(
        "rate below every horizon",
        IN_ONE,
        "range: 120 m\n    rate: 20 Hz",
        "range: 120 m\n    rate: 1e-300 Hz",
        "more than 1,000,000 steps",
        "odd/architectures/one.yaml:20:",
    ),
    Flaw(
        "latency that is no multiple of the step",
        IN_ONE,
        "latency: 0.1 s",
        "latency: 0.12 s",
        "The nearest are 0.1 s and 0.15 s",
    ),
    Flaw(
        "link to an unknown sensor",
        IN_ONE,
        "[pose, camera]",
        "[pose, camra]",
        "links 'camra', which is none of camera, pose, channels.nominal, switch",
    ),
    Flaw("link twice", IN_ONE, "[pose, camera]", "[pose, camera, camera]", "links 'camera' twice"),
    Flaw(
        "switch naming an unknown channel",
        IN_TWO,
        "[safety, nominal]",
        "[safty, nominal]",
        "'safty' is no channel of this architecture",
    ),
    Flaw(
        "default that is not in the priority",
        IN_ONE,
        "default: nominal",
        "default: safety",
        "'safety' is not in priority: nominal",
    ),
    Flaw(
        "unknown kind of sensor",
        IN_ONE,
        "kind: camera",
        "kind: camra",
        "Did you mean 'camera'?",
        "odd/architectures/one.yaml:16:",
    ),
    Flaw("step of zero", IN_ODD, "step: 0.05 s", "step: 0 s", "must be more than 0 s"),
    Flaw("step that is too long", IN_ODD, "step: 0.05 s", "step: 2 s", "must be at most 1 s"),
    Flaw(
        "step that is too short",
        IN_ODD,
        "step: 0.05 s",
        "step: 1e-300 s",
        "more than 1,000,000 steps",
        "odd/architectures/one.yaml:20:",
    ),
    Flaw("negative seed", IN_ODD, "seed: 7", "seed: -1", "must be at least 0 (-1)"),
    Flaw(
        "seed of 70 bits",
        IN_ODD,
        "seed: 7",
        "seed: 1180591620717411303424",
        "does not fit into 64 bits",
    ),
    Flaw("seed of 64 bits", IN_ODD, "seed: 7", "seed: 9223372036854775808", "must be at most"),
    Flaw("text for a number", IN_ODD, "seed: 7", "seed: '7'", "must be a whole number ('7')"),
    Flaw(
        "fraction of a replicate",
        IN_ODD,
        "replicates: 1",
        "replicates: 1.5",
        "must be a whole number (1.5)",
    ),
    Flaw("bool as a number", IN_ONE, "range: 120 m", "range: true", "True is not a quantity"),
    Flaw(
        "list where a mapping is expected",
        IN_ODD,
        "attributes:",
        "attributes: [a]\ntext:",
        "attributes: must be a mapping",
        "odd/small.yaml:2:",
    ),
    Flaw(
        "mapping where a list is expected",
        IN_ODD,
        "[architectures/one.yaml, architectures/two.yaml]",
        "{a: architectures/one.yaml}",
        "must be a list",
    ),
    Flaw(
        "text where a list is expected",
        IN_ODD,
        "[architectures/one.yaml, architectures/two.yaml]",
        "architectures/one.yaml",
        "must be a list",
    ),
    Flaw(
        "id with blanks",
        IN_ODD,
        "odd: small",
        "odd: Small ODD",
        "must be lower case letters, digits and underscores",
    ),
    Flaw("number for an id", IN_ONE, "  pose:", "  1:", "must be lower case letters"),
    plugin("plug-in file that is missing", "./nowhere.py:Planner", "there is no file"),
    plugin("plug-in class that is missing", "./planners.py:Planer", "Did you mean 'Planner'?"),
    plugin("plug-in that is not named", "./planners.py", "is not one of 'nominal', 'safety'"),
    plugin(
        "plug-in module that is missing",
        "no_such_module_here:Planner",
        "there is no module 'no_such_module_here'",
    ),
    plugin(
        "plug-in with a syntax error",
        "./broken.py:Planner",
        "Correct the plug-in",
        where="odd/architectures/broken.py:1:",
    ),
    plugin(
        "plug-in that raises",
        "./raising.py:Planner",
        "math domain error",
        where="odd/architectures/raising.py:2:",
    ),
    plugin(
        "plug-in that leaves",
        "./leaving.py:Planner",
        "SystemExit",
        where="odd/architectures/leaving.py:2:",
    ),
    plugin("plug-in without act", "./planners.py:Mute", "has no act(), so it is no channel"),
    plugin(
        "plug-in with a number for monitors",
        "./planners.py:Watchful",
        "monitor_ids is no tuple of names",
    ),
    plugin(
        "plug-in without a parameter model",
        "./planners.py:Loose",
        "Derive it from adeye.ports.Parameters",
    ),
    plugin(
        "unknown parameter of a plug-in",
        "./planners.py:Planner",
        "there is no parameter 'gian'. Did you mean 'gain'?",
        more="    parameters: {gian: 2}\n",
        where="odd/architectures/one.yaml:28:",
    ),
    plugin(
        "parameter of a plug-in of a wrong type",
        "./planners.py:Planner",
        "must be a valid number",
        more="    parameters: {gain: fast}\n",
        where="odd/architectures/one.yaml:28:",
    ),
]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write the files that have no flaw, and work in their folder."""
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ADEYE_DEBUG", raising=False)
    return tmp_path


Run = Callable[..., tuple[int, str]]


@pytest.fixture
def plan(project: Path, capfd: pytest.CaptureFixture[str]) -> Run:
    """Return a function that plans as the console script does: exit code and standard error."""
    assert project.is_dir()

    def call(odd: str = IN_ODD) -> tuple[int, str]:
        code = main(["plan", odd])
        return code, capfd.readouterr().err

    return call


def put_in(project: Path, flaw: Flaw) -> int:
    """Write a flaw into its file and return its line."""
    path = project / flaw.file
    new = flaw.new if isinstance(flaw.new, bytes) else flaw.new.encode()
    if flaw.old is None:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(new)
        return 1
    before, found, after = path.read_text("utf-8").partition(flaw.old)
    assert found, f"{flaw.file} has no {flaw.old!r}"
    path.write_bytes(before.encode() + new + after.encode())
    return before.count("\n") + 1


def assert_refused(code: int, message: str) -> None:
    """Check what holds of every refusal."""
    assert code == 2, message
    assert "Traceback" not in message
    assert "defect of adeye" not in message
    assert "pydantic" not in message
    assert re.match(r"[A-Z][A-Za-z]*Error: ", message)


def test_files_without_a_flaw_are_planned(plan: Run) -> None:
    assert plan() == (0, "")


def test_at_least_forty_five_flaws_are_listed_and_differ() -> None:
    assert len(FLAWS) >= 45
    assert len({flaw.what for flaw in FLAWS}) == len(FLAWS)
    assert len({(flaw.file, flaw.old, flaw.new) for flaw in FLAWS}) == len(FLAWS)


@pytest.mark.parametrize(
    "flaw",
    [
        # Each plans a project anew; a third of them is tried at every change.
        pytest.param(flaw, id=flaw.what, marks=() if number % 3 == 0 else pytest.mark.slow)
        for number, flaw in enumerate(FLAWS)
    ],
)
def test_flaw_is_refused_at_its_line_with_a_remedy(flaw: Flaw, project: Path, plan: Run) -> None:
    line = put_in(project, flaw)
    begin = time.process_time()
    code, message = plan()
    assert_refused(code, message)
    assert flaw.said in message
    assert (flaw.where or f"{flaw.file}:{line}:") in message
    assert time.process_time() - begin < 10.0


@pytest.mark.parametrize(
    ("odd", "said"),
    [
        ("odd/nowhere.yaml", "odd/nowhere.yaml:1:1: there is no such file. Check the path."),
        ("odd", "odd:1:1: this is a folder, not a file. Name a file."),
        ("/dev/zero", "/dev/zero:1:1: this is not a regular file. Name a file."),
        ("odd/architectures/one.yaml", "odd/architectures/one.yaml:1:1: architecture: there is no"),
        ("scenarios_db/follow.yaml", "scenarios_db/follow.yaml:"),
    ],
)
def test_what_is_no_odd_is_refused(plan: Run, odd: str, said: str) -> None:
    code, message = plan(odd)
    assert_refused(code, message)
    assert said in message


def test_several_flaws_are_listed_together(project: Path, plan: Run) -> None:
    for flaw in (
        Flaw("seed", IN_ODD, "seed: 7", "sed: 7", ""),
        Flaw("step", IN_ODD, "step: 0.05 s", "step: fast", ""),
        Flaw("fault", IN_ODD, "model: drop_out", "model: dropout", ""),
    ):
        put_in(project, flaw)
    code, message = plan()
    assert_refused(code, message)
    lines = [int(found) for found in re.findall(r"odd/small.yaml:([0-9]+):", message)]
    assert lines == [16, 21, 22]
    assert message.splitlines()[-1] == "3 errors."


def test_flaw_in_a_swept_parameter_of_a_plugin_is_found(project: Path, plan: Run) -> None:
    kind = "./planners.py:Planner"
    put_in(project, plugin("", kind, "", more="    parameters: {gain: 2}\n"))
    path = "architecture.channels.nominal.parameters.gain"
    put_in(project, Flaw("", IN_ODD, SPEEDS, f"{path}: [2, fast]", ""))
    code, message = plan()
    assert_refused(code, message)
    assert "odd/small.yaml:10:" in message
    assert "channels.nominal.parameters.gain: must be a valid number" in message


@pytest.mark.slow
def test_swept_values_that_fit_are_planned(project: Path, plan: Run) -> None:
    axes = (
        "architecture.sensors.camera.range: [80 m, 120 m]\n"
        "        scenario.world.road.lanes: [2, 3]\n"
        "        architecture.channels.nominal.parameters.confirm_hits: {from: 2, to: 4, step: 1}\n"
        "        faults.camera_out.duration: [1 s, 2 s]"
    )
    put_in(project, Flaw("", IN_ODD, SPEEDS, axes, ""))
    assert plan() == (0, "")
