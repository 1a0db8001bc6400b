"""From a scan and odometry to facts."""

from perception.facts import Facts, Perception
from perception.settings import PerceptionSettings
from perception.world import WorldModel

__all__ = ["Facts", "Perception", "PerceptionSettings", "WorldModel"]
