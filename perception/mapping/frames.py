"""Poses as frames: one pose seen from another, and clouds of points moved between them.

All sums are written out: products of matrices go through BLAS, whose last bits differ from processor to processor.
"""

from __future__ import annotations

from perception.sweep import Floats
from transport.arithmetic import cos_sin
from transport.messages import Pose, wrap_angle


def compose(frame: Pose, inner: Pose) -> Pose:
    """A pose given in ``frame``, in the frame that ``frame`` itself is given in."""
    cosine, sine = cos_sin(frame.heading)
    return Pose(
        frame.x + inner.x * cosine - inner.y * sine,
        frame.y + inner.x * sine + inner.y * cosine,
        wrap_angle(frame.heading + inner.heading),
    )


def between(frame: Pose, outer: Pose) -> Pose:
    """``outer`` seen from ``frame``; the inverse of `compose`."""
    cosine, sine = cos_sin(frame.heading)
    dx, dy = outer.x - frame.x, outer.y - frame.y
    return Pose(dx * cosine + dy * sine, dy * cosine - dx * sine, wrap_angle(outer.heading - frame.heading))


def turned(vectors: Floats, heading: float) -> Floats:
    """Vectors turned counter-clockwise, shape (2, n)."""
    cosine, sine = cos_sin(heading)
    out = vectors * cosine
    out[0] -= sine * vectors[1]
    out[1] += sine * vectors[0]
    return out


def placed(points: Floats, pose: Pose) -> Floats:
    """Points given in the frame of ``pose``, in the frame that the pose is given in, m, shape (2, n)."""
    out = turned(points, pose.heading)
    out[0] += pose.x
    out[1] += pose.y
    return out
