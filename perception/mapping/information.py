"""Symmetric matrices of three rows as six plain numbers: information and covariance of a pose.

Written out, because products and inverses of matrices in numpy go through BLAS and LAPACK, whose last bits differ from
processor to processor.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

from transport.arithmetic import atan2, cos_sin, norm, square


class Symmetric(NamedTuple):
    """A symmetric matrix: an information (inverse of a covariance) or a covariance, in m and rad."""

    xx: float = 0.0
    xy: float = 0.0
    xt: float = 0.0
    yy: float = 0.0
    yt: float = 0.0
    tt: float = 0.0

    def plus(self, other: Symmetric) -> Symmetric:
        """The sum."""
        return Symmetric(*(a + b for a, b in zip(self, other, strict=True)))

    def times(self, factor: float) -> Symmetric:
        """Every element multiplied."""
        return Symmetric(*(factor * a for a in self))

    def applied(self, x: float, y: float, t: float) -> tuple[float, float, float]:
        """The product with a vector."""
        return (
            self.xx * x + self.xy * y + self.xt * t,
            self.xy * x + self.yy * y + self.yt * t,
            self.xt * x + self.yt * y + self.tt * t,
        )

    def square(self, x: float, y: float, t: float) -> float:
        """The quadratic form of a vector."""
        a, b, c = self.applied(x, y, t)
        return a * x + b * y + c * t

    def turned(self, heading: float) -> Symmetric:
        """The same matrix in axes turned so that what points along x then points along ``heading``."""
        c, s = cos_sin(heading)
        return Symmetric(
            c * c * self.xx - 2 * c * s * self.xy + s * s * self.yy,
            c * s * (self.xx - self.yy) + (c * c - s * s) * self.xy,
            c * self.xt - s * self.yt,
            s * s * self.xx + 2 * c * s * self.xy + c * c * self.yy,
            s * self.xt + c * self.yt,
            self.tt,
        )

    @property
    def ellipse(self) -> tuple[float, float, float]:
        """The larger and the smaller standard deviation of a covariance in place, m, and the larger one's direction."""
        half, apart = (self.xx + self.yy) / 2, norm((self.xx - self.yy) / 2, self.xy)
        direction = atan2(2 * self.xy, self.xx - self.yy) / 2
        return math.sqrt(max(half + apart, 0.0)), math.sqrt(max(half - apart, 0.0)), direction

    @property
    def definite(self) -> bool:
        """Whether it is positive definite: all leading minors are positive (Sylvester's criterion)."""
        xx = self.yy * self.tt - self.yt * self.yt
        xy = self.xt * self.yt - self.xy * self.tt
        xt = self.xy * self.yt - self.xt * self.yy
        minor = self.xx * self.yy - self.xy * self.xy
        return self.xx > 0 and minor > 0 and self.xx * xx + self.xy * xy + self.xt * xt > 0

    def inverse(self) -> Symmetric:
        """The inverse, by cofactors; of a matrix that is positive definite."""
        xx = self.yy * self.tt - self.yt * self.yt
        xy = self.xt * self.yt - self.xy * self.tt
        xt = self.xy * self.yt - self.xt * self.yy
        determinant = self.xx * xx + self.xy * xy + self.xt * xt
        return Symmetric(
            xx / determinant,
            xy / determinant,
            xt / determinant,
            (self.xx * self.tt - self.xt * self.xt) / determinant,
            (self.xt * self.xy - self.xx * self.yt) / determinant,
            (self.xx * self.yy - self.xy * self.xy) / determinant,
        )

    def limited(self, deviation: float, lever: float) -> Symmetric:
        """The information left when an independent error is added: in place, and in heading that over a lever, m."""
        place, turn = deviation * deviation, square(deviation / lever)
        # (I^-1 + C)^-1 = C^-1 - C^-1 (I + C^-1)^-1 C^-1, which also holds where nothing is known along some axis.
        most = Symmetric.diagonal(1 / place, 1 / place, 1 / turn)
        rest = self.plus(most).inverse()
        a, c = most.xx, most.tt
        return Symmetric(
            a - a * a * rest.xx,
            -a * a * rest.xy,
            -a * c * rest.xt,
            a - a * a * rest.yy,
            -a * c * rest.yt,
            c - c * c * rest.tt,
        )

    @classmethod
    def diagonal(cls: type[Self], x: float, y: float, t: float) -> Self:
        """A diagonal matrix."""
        return cls(x, 0.0, 0.0, y, 0.0, t)
