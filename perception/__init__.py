"""From a scan and odometry to facts."""
