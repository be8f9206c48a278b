"""Messages of ROS 2 for nodes without ROS 2: its types and quality of service on Cyclone DDS."""

from adeye.simulate.bridges.ros2_peer import QOS, Messages

__all__ = ["QOS", "Messages"]
