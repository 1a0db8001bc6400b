"""The pose graph: a chain of poses, linked by steps, and loops that link poses at the same place.

Gauss-Newton, where the unknowns are not the poses but the corrections of the steps between them. A pose's correction
is then a sum over all steps before it, and conjugate gradients, preconditioned by the steps' own information, need
about as many steps as there are independent loops. It uses only cumulative and plain sums, no matrix products: the same
bits on every processor.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from perception.mapping.frames import between, compose
from perception.mapping.information import Symmetric
from perception.mapping.settings import GraphSettings
from perception.sweep import Floats
from transport.arithmetic import cos_sin, square
from transport.messages import Pose, wrap_angle


@dataclass(frozen=True, slots=True)
class Link:
    """A measurement of one pose seen from another.

    Attributes:
        first: number of the pose from which it is seen.
        second: number of the pose that is seen.
        measured: the second pose in the frame of the first.
        information: of the measurement, with axes of the second pose's frame.
    """

    first: int
    second: int
    measured: Pose
    information: Symmetric

    @property
    def covariance(self) -> Symmetric:
        """The inverse of the information."""
        return self.information.inverse()


SLICE = 8
"""Conjugate-gradient steps between two pauses."""


@dataclass(slots=True)
class PoseGraph:
    """Poses with their links.

    Attributes:
        settings: when to stop, which loops to doubt.
        poses: in one frame; the first one stays where it is.
        steps: the link from each pose to the next.
        loops: the other links.
    """

    settings: GraphSettings
    poses: list[Pose] = field(default_factory=list)
    steps: list[Link] = field(default_factory=list)
    loops: list[Link] = field(default_factory=list)

    def add(self, measured: Pose, information: Symmetric) -> int:
        """Append a pose, seen from the last one; the very first is put where ``measured`` says. Returns its number."""
        if not self.poses:
            self.poses.append(measured)
            return 0
        last = len(self.poses) - 1
        self.poses.append(compose(self.poses[last], measured))
        self.steps.append(Link(last, last + 1, measured, information))
        return last + 1

    def close(self, loop: Link) -> None:
        """Add a loop."""
        self.loops.append(loop)

    def optimise(self) -> Iterator[None]:
        """Optimise the poses, in small pieces of work.

        Poses and loops may be added at a pause: such poses are carried along, such loops wait for the next time.
        """
        loops = list(self.loops)
        if not loops:
            return
        doubtful = self.settings.doubtful * 64.0
        for _ in range(self.settings.rounds):
            problem = Linearised.of(self.poses, self.steps, loops)
            yield
            moves = problem.moved((yield from problem.solved(problem.weights(doubtful), self.settings)))
            self._move(moves)
            yield
            if float(np.max(np.abs(moves))) < self.settings.settled and doubtful == self.settings.doubtful:
                break
            doubtful = max(doubtful / 4.0, self.settings.doubtful)

    def _move(self, moves: Floats) -> None:
        """Move the poses; later ones move along with the last one."""
        count = moves.shape[1]
        last = self.poses[count - 1]
        moved = [
            Pose(pose.x + dx, pose.y + dy, wrap_angle(pose.heading + turn))
            for pose, (dx, dy, turn) in zip(self.poses[:count], moves.T.tolist(), strict=True)
        ]
        self.poses = moved + [compose(moved[-1], between(last, pose)) for pose in self.poses[count:]]

    def deviations(self) -> list[float]:
        """The squared deviation of each loop, in standard deviations."""
        return Linearised.of(self.poses, self.steps, self.loops).squares().tolist() if self.loops else []


Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class Terms:
    """Links with their residuals, in the frames of their second poses.

    Attributes:
        first: numbers of the first poses, shape (n,).
        second: numbers of the second poses, shape (n,).
        off: residuals, shape (3, n).
        cosine: of the second poses' headings, shape (n,).
        sine: of the same.
        information: rows xx, xy, xt, yy, yt, tt, shape (6, n).
    """

    first: Numbers
    second: Numbers
    off: Floats
    cosine: Floats
    sine: Floats
    information: Floats

    @classmethod
    def of(cls, links: list[Link], poses: list[Pose]) -> Terms:
        """Evaluate links at the poses.

        The residual is the second pose seen from where the link says that it should be.
        """
        off = np.empty((3, len(links)))
        headings = np.empty((2, len(links)))
        for index, link in enumerate(links):
            expected = compose(poses[link.first], link.measured)
            actual = poses[link.second]
            away = between(expected, actual)
            off[:, index] = away.x, away.y, away.heading
            headings[:, index] = cos_sin(expected.heading)
        return cls(
            np.array([link.first for link in links], dtype=np.intp),
            np.array([link.second for link in links], dtype=np.intp),
            off,
            headings[0],
            headings[1],
            np.array([link.information for link in links]).T.reshape(6, len(links)),
        )


def weighed(information: Floats, vectors: Floats) -> Floats:
    """Symmetric matrices, shape (6, n), times vectors, shape (3, n)."""
    xx, xy, xt, yy, yt, tt = information
    x, y, t = vectors
    return np.stack([xx * x + xy * y + xt * t, xy * x + yy * y + yt * t, xt * x + yt * y + tt * t])


@dataclass(frozen=True, eq=False, slots=True)
class Linearised:
    """The graph near its present poses.

    A step's correction u changes its residual by just u. With the residual in the frame of where the second pose is
    expected, x_k+1 changes by R u + J (t_k+1 - t_k) times the turn of all poses before, R the heading expected there.
    """

    places: Floats
    steps: Terms
    loops: Terms
    covariance: Floats
    levers: Floats

    @classmethod
    def of(cls, poses: list[Pose], steps: list[Link], loops: list[Link]) -> Linearised:
        """Linearise a graph at its poses."""
        covariance = np.array([link.covariance for link in steps]).T
        places = np.array([(pose.x, pose.y) for pose in poses]).T
        ahead = places[:, 1:] - places[:, :-1]
        return cls(places, Terms.of(steps, poses), Terms.of(loops, poses), covariance, np.stack([-ahead[1], ahead[0]]))

    def squares(self) -> Floats:
        """The squared deviation of each loop, in standard deviations, shape (n,)."""
        off = self.loops.off
        squares: Floats = np.sum(off * weighed(self.loops.information, off), axis=0)
        return squares

    def weights(self, doubtful: float) -> Floats:
        """The loops' weights by Geman and McClure: a loop with a very large deviation has no weight."""
        share = doubtful / (doubtful + self.squares())
        return share * share

    def moved(self, corrections: Floats) -> Floats:
        """How the poses move when the steps are corrected, shape (3, poses), in the graph's frame."""
        cosine, sine = self.steps.cosine, self.steps.sine
        x, y, t = corrections
        turns = np.concatenate([[0.0], np.cumsum(t)])
        dx = cosine * x - sine * y + turns[:-1] * self.levers[0]
        dy = sine * x + cosine * y + turns[:-1] * self.levers[1]
        return np.stack([np.concatenate([[0.0], np.cumsum(dx)]), np.concatenate([[0.0], np.cumsum(dy)]), turns])

    def _pulled(self, pulls: Floats) -> Floats:
        """The transpose of `moved`: pulls at the poses as pulls at the steps."""
        (sx, sy, _), (_, _, heading) = np.cumsum(pulls[:, ::-1], axis=1)[:, ::-1][:, 1:], pulls.copy()
        heading[:-1] += self.levers[0] * sx + self.levers[1] * sy
        turn = np.cumsum(heading[::-1])[::-1][1:]
        cosine, sine = self.steps.cosine, self.steps.sine
        return np.stack([cosine * sx + sine * sy, cosine * sy - sine * sx, turn])

    def _across(self, moves: Floats) -> Floats:
        """How the loops' residuals change when the poses move, shape (3, loops)."""
        loops = self.loops
        (x1, y1, turn1), (x2, y2, turn2) = moves[:, loops.first], moves[:, loops.second]
        ahead = self.places[:, loops.second] - self.places[:, loops.first]
        dx = x2 - x1 + turn1 * ahead[1]
        dy = y2 - y1 - turn1 * ahead[0]
        return np.stack([loops.cosine * dx + loops.sine * dy, loops.cosine * dy - loops.sine * dx, turn2 - turn1])

    def _back(self, pulls: Floats) -> Floats:
        """The transpose of `_across`: pulls at the loops as pulls at the poses."""
        loops, count = self.loops, self.places.shape[1]
        ahead = self.places[:, loops.second] - self.places[:, loops.first]
        x, y, turn = pulls
        px = loops.cosine * x - loops.sine * y
        py = loops.sine * x + loops.cosine * y
        at_first = np.stack([-px, -py, px * ahead[1] - py * ahead[0] - turn])
        at_second = np.stack([px, py, turn])
        return np.stack(
            [
                np.bincount(loops.first, at_first[row], count) + np.bincount(loops.second, at_second[row], count)
                for row in range(3)
            ]
        )

    def solved(self, weights: Floats, settings: GraphSettings) -> Generator[None, None, Floats]:
        """The corrections of the steps that satisfy the normal equations, shape (3, steps)."""
        information = self.loops.information * weights

        def loops_of(corrections: Floats) -> Floats:
            return weighed(information, self._across(self.moved(corrections)))

        right = -weighed(self.steps.information, self.steps.off)
        right -= self._pulled(self._back(weighed(information, self.loops.off)))
        found = np.zeros_like(right)
        rest = right
        ahead = along = weighed(self.covariance, rest)
        measure = float(np.sum(rest * along))
        enough = measure * square(settings.tolerance)
        for number in range(settings.most_steps):
            if measure <= enough or measure == 0.0:
                break
            image = weighed(self.steps.information, ahead) + self._pulled(self._back(loops_of(ahead)))
            stride = measure / float(np.sum(ahead * image))
            found = found + stride * ahead
            rest = rest - stride * image
            along = weighed(self.covariance, rest)
            before, measure = measure, float(np.sum(rest * along))
            ahead = along + (measure / before) * ahead
            if number % SLICE == SLICE - 1:
                yield
        return found
