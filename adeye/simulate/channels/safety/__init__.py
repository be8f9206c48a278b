"""The safety channel: monitors and a safe stop, in lane or planned; or a supervisor's own ones.

Who acts is not decided here: a channel can only ask for it. Begin with ``in_lane``.
"""

from adeye.simulate.channels.safety.in_lane import SafetyChannel
from adeye.simulate.channels.safety.planned_stop import PlannedSafetyChannel
from adeye.simulate.channels.safety.supervisor import SupervisedSafetyChannel

__all__ = ["PlannedSafetyChannel", "SafetyChannel", "SupervisedSafetyChannel"]
