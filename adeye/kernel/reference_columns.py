"""What reference drivers see, what they remember and by which numbers they act: array columns."""

from __future__ import annotations

from typing import Final

CC: Final = 0
FSM: Final = 1
RSS: Final = 2
REG157: Final = 3

# What a driver sees, one number each.
EGO_SPEED: Final = 0
"""Of the ego along its lane, >= 0 [m/s]."""
EGO_ACCELERATION: Final = 1
"""Of the ego, as it was over the last tick [m/s^2]."""
OTHER_SPEED: Final = 2
"""Of the other along the ego's lane, >= 0 [m/s]."""
OTHER_ACCELERATION: Final = 3
"""Of the other along the ego's lane [m/s^2]."""
GAP: Final = 4
"""From the ego's front to the other's rear along the lane, negative beside each other [m]."""
LENGTHS: Final = 5
"""Length of the ego plus length of the other [m]."""
LATERAL_GAP: Final = 6
"""Sideways from edge to edge [m]; <= 0 where the other is in the ego's path."""
LATERAL_SPEED: Final = 7
"""Of the other towards the ego's path, negative away from it [m/s]."""
CUE: Final = 8
"""How far the vehicle whose change of lane brings the conflict is off its lane's centre [m].

That of the other towards the ego's lane for a cut-in, that of the leaving lead, either way, for a
cut-out; 0 without one."""
INTRUSION: Final = 9
"""How far the other's nearest edge is inside the ego's lane, negative outside [m]."""
OVERLAP: Final = 10
"""Common width of both over the smaller of their widths, 0 to 1."""
VIEW_SIZE: Final = 11

# What a driver remembers.
PERCEIVED: Final = 0
"""For how long it has evaluated the risk [s]."""
DELAYED: Final = 1
"""How much of its delay has passed [s]."""
DECELERATION: Final = 2
"""How much it brakes [m/s^2]."""
REACTING: Final = 3
"""1 from the decision to brake until the conflict is over."""
EMERGENCY: Final = 4
"""How much the automatic emergency braking brakes [m/s^2]."""
CAME_FROM_SIDE: Final = 5
"""1 while the other is a vehicle that cuts in."""
STATE_SIZE: Final = 6

# Parameters that all have at the same place.
BESIDE: Final = 0
"""Up to which share of both lengths the other may be beside the ego and still be ahead."""
DELAY: Final = 1
"""From the decision to the brake [s]."""
COASTING: Final = 2
"""Deceleration during the delay [m/s^2]."""
JERK: Final = 3
"""Growth of the deceleration [m/s^3]."""
MOST: Final = 4
"""Full deceleration [m/s^2]."""

CC_WANDERING: Final = 5
CC_PERCEPTION: Final = 6
CC_CRITICAL_TTC: Final = 7
CC_HEADWAY: Final = 8
CC_LEAD_BRAKING: Final = 9
CC_EMERGENCY_JERK: Final = 10
CC_EMERGENCY_BRAKING: Final = 11
CC_FULL_OVERLAP: Final = 12
CC_PERCEPTION_WAY: Final = 13
"""Sideways way by which a cut-in is perceived, in place of a time [m]; infinity: by the time."""
CC_LEAD_AT_ONCE: Final = 14
"""1 if any lead that closes in is answered at once, to standstill."""

FSM_COMFORTABLE: Final = 5
FSM_LEAD_BRAKING: Final = 6
FSM_MARGIN: Final = 7
FSM_LATERAL_GUARD: Final = 8
FSM_RAW_ACCELERATION: Final = 9

RSS_ACCELERATION: Final = 5
RSS_LEAST_BRAKING: Final = 6
RSS_MOST_BRAKING: Final = 7
RSS_LATERAL_ACCELERATION: Final = 8
RSS_LATERAL_BRAKING: Final = 9
RSS_FLUCTUATION: Final = 10
RSS_OTHER_ONLY: Final = 11
RSS_LEAD_BRAKES: Final = 12
"""For how long a lead may brake before the distance to follow it is the safe one [s]."""

REG157_INTRUSION: Final = 5
REG157_LATERAL_GAP: Final = 6
REG157_GUARD: Final = 7
REG157_LEAD_BRAKING: Final = 8
REG157_LOOKS_AHEAD: Final = 9
REG157_RESERVE: Final = 10
"""In the threshold [s]; as long as the delay of the driver, unless that has none."""
REG157_RELEASES: Final = 11
"""1 if it brakes only as long as the TTC is below the threshold."""
REG157_LEAD_AT_ONCE: Final = 12
"""1 if any lead that closes in is answered at once, to standstill."""
REG157_HEADWAY: Final = 13
"""With which it follows [s]; infinity: at the distances of paragraph 5.2.3.3."""

PARAMETER_SIZE: Final = 15

CUT_IN: Final = 0
CUT_OUT: Final = 1
BRAKING_LEAD: Final = 2

EXACT: Final = 0
"""Constant acceleration over the step, standstill within it."""
SEMI_IMPLICIT: Final = 1
"""New speed first, then the way at the new speed, as in the published code."""

# What a scene is, one number each.
S_EGO_SPEED: Final = 0
"""[m/s]."""
S_OTHER_SPEED: Final = 1
"""Of the vehicle that cuts in, cuts out or brakes [m/s]."""
S_GAP: Final = 2
"""From the ego's front to that vehicle's rear [m]; NaN: what the driver keeps when it follows."""
S_LATERAL_SPEED: Final = 3
"""Of the change of lane [m/s]."""
S_LATERAL_OFFSET: Final = 4
"""From the ego's centre line to that of the vehicle that cuts in, at the beginning [m]."""
S_FRONT_GAP: Final = 5
"""From the front of the vehicle that cuts out to the rear of the standing one [m]."""
S_BRAKING: Final = 6
"""Full deceleration of the lead [m/s^2]."""
S_BRAKING_JERK: Final = 7
"""Growth of the lead's deceleration [m/s^3]; infinity: at once."""
S_EGO_LENGTH: Final = 8
S_EGO_WIDTH: Final = 9
S_OTHER_LENGTH: Final = 10
S_OTHER_WIDTH: Final = 11
S_LANE_WIDTH: Final = 12
S_LATERAL_ACCELERATION: Final = 13
"""With which the sideways speed of a cut-in grows before the gap is as given, > 0 [m/s^2];
infinity or 0: it has that speed at once."""
SCENE_SIZE: Final = 14

# What comes out.
R_CONTACT: Final = 0
"""1 with contact, 0 without, NaN if it is undecided after ``LONGEST`` or something is unknown."""
R_IMPACT_SPEED: Final = 1
"""Speed at which the gap closed at the contact [m/s]; NaN without one."""
R_MIN_GAP: Final = 2
"""Least gap to a vehicle in the ego's path [m], 0 with contact, infinity without such a one."""
R_BRAKING_TIME: Final = 3
"""When the ego first slowed down [s]; NaN if it never did."""
RESULT_SIZE: Final = 4
