"""A Foxglove layout for a recording: plan, scan, path and outline, the states, the velocity.

The file is for Foxglove's "Import from file": the settings of each panel and how the panels share the window.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SHOWN: dict[str, dict[str, Any]] = {
    "nav_msgs/msg/OccupancyGrid": {"colorMode": "map"},
    "sensor_msgs/msg/LaserScan": {"colorMode": "flat", "flatColor": "#d62728", "pointSize": 4},
    "nav_msgs/msg/Path": {"gradient": ["#1f77b4", "#1f77b4"], "lineWidth": 0.03},
    "geometry_msgs/msg/PolygonStamped": {"color": "#2ca02c"},
}
"""Types whose topics the plan shows, with how."""
TWIST = "geometry_msgs/msg/Twist"
TEXT = "std_msgs/msg/String"


def layout(topics: Mapping[str, str]) -> dict[str, Any]:
    """A layout for a recording.

    Args:
        topics: the recording's topics with their ROS types.

    Returns:
        JSON values.
    """
    states = [topic for topic, kind in topics.items() if kind == TEXT and "/state/" in topic]
    commands = [topic for topic, kind in topics.items() if kind == TWIST]
    ticks = [topic for topic, kind in topics.items() if kind == TEXT and topic.endswith("/tick")]
    panels: dict[str, dict[str, Any]] = {
        "3D!plan": {
            "followMode": "follow-none",
            "followTf": "map" if "/map" in topics else "odom",
            "cameraState": {"perspective": False, "distance": 15, "phi": 0, "thetaOffset": 0},
            "topics": {topic: {"visible": True, **SHOWN[kind]} for topic, kind in topics.items() if kind in SHOWN},
        },
        "StateTransitions!states": {
            "isSynced": True,
            "paths": [{"value": f"{topic}.data", "timestampMethod": "receiveTime"} for topic in sorted(states)],
        },
        "Plot!velocity": {
            "isSynced": True,
            "showLegend": True,
            "paths": [
                {"value": f"{topic}.{part}", "enabled": True, "timestampMethod": "receiveTime"}
                for topic in commands
                for part in ("linear.x", "linear.y", "angular.z")
            ],
        },
        "RawMessages!tick": {"topicPath": f"{ticks[0]}.data" if ticks else "", "diffEnabled": False},
    }
    below = {"direction": "column", "first": "Plot!velocity", "second": "RawMessages!tick"}
    side = {"direction": "column", "first": "StateTransitions!states", "second": below, "splitPercentage": 30}
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"direction": "row", "first": "3D!plan", "second": side, "splitPercentage": 60},
    }
