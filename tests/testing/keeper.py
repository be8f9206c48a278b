"""One controller that is a policy when it is imported, and a program when it is executed."""

import json
import sys
from typing import Any


def drive(observation: Any) -> tuple[float, float]:
    ego, objects = observation["ego"], observation["objects"]
    return float(0.5 * (ego[8] - ego[0]) - 0.01 * objects[:, 0].sum()), float(-0.2 * ego[3])


def main() -> None:
    hello = json.loads(sys.stdin.readline())
    gain = hello["parameters"]["values"]["gain"]
    sys.stdout.write(json.dumps({"hello": hello["hello"]}) + "\n")
    sys.stdout.flush()
    for line in sys.stdin:
        seen = json.loads(line)
        speed = seen["sensors"]["localisation"]["estimate"][3]
        acceleration = gain * (hello["desired_speed"] - speed)
        answer = {"tick": seen["tick"], "acceleration": acceleration, "steering_angle": 0.0}
        sys.stdout.write(json.dumps(answer) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
