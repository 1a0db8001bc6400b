"""Driving a machine on a robot: the loop, missions, traces and replays."""
