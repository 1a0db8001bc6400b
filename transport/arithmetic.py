"""Arithmetic whose last bit depends neither on the processor nor on the interpreter.

A run's trace is the same byte for byte wherever it is made. So code that decides must not use functions whose
instructions depend on the processor:

- BLAS and LAPACK (``@``, ``np.dot``, ``np.linalg``);
- the C library's functions: in some 7 of 10,000 cases glibc's sine rounds otherwise where the processor multiplies and
  adds at once;
- numpy's vectorised functions, its normal draws, and a sort that may swap equals.

It must not use what Python versions round differently either: ``sum`` of floats, ``math.hypot``, ``math.dist``. The
four operations and the square root are rounded correctly everywhere (IEEE 754); here the functions of a robot's
geometry are made of them.

Their reductions and polynomials are those of FreeBSD's msun (Sun Microsystems 1993, "fdlibm"), right to about one
unit in the last place.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from transport.compiled import compiled

Floats = NDArray[np.float64]
Number = TypeVar("Number", float, Floats)


def square(x: Number) -> Number:
    """The square of a number or of each of an array's; ``x**2`` is the C library's."""
    return x * x


def power(x: float, exponent: int) -> float:
    """A whole power, from zero up, of a number."""
    return math.prod([x] * exponent)


def norm(x: float, y: float) -> float:
    """The length of a vector in the plane."""
    return math.sqrt(x * x + y * y)


def distance_between(one: tuple[float, float], other: tuple[float, float]) -> float:
    """The distance of two points in the plane."""
    dx, dy = one[0] - other[0], one[1] - other[1]
    return math.sqrt(dx * dx + dy * dy)


def norms(x: Floats, y: Floats) -> Floats:
    """The lengths of vectors in the plane, of the shape that x and y have together."""
    squares: Floats = x * x + y * y
    return np.sqrt(squares, out=squares)


# pi/2 in two parts, the first of 33 bits, so that small multiples of it are exact.
_QUARTERS, _QUARTER, _QUARTER_REST = 2 / math.pi, 1.57079632673412561417e00, 6.07710050650619224932e-11
_FAR = 1e5
"""Beyond it an angle is first brought near zero by multiples of the float that is nearest to a full turn, rad."""
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


def _near_zero(near: Number, below: Number) -> tuple[Number, Number]:
    """The cosine and the sine of ``near - below``, at most an eighth of a turn; of floats and arrays the same bits."""
    x = near - below
    rest = (near - x) - below
    z = x * x
    v = z * x
    half = 0.5 * z
    about = 1.0 - half
    tail = z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
    cosine = about + (((1.0 - about) - half) + (z * tail - x * rest))
    tail = _S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))
    sine = x - ((z * (0.5 * rest - v * tail) - rest) - v * _S1)
    return cosine, sine


@compiled
def cos_sin(angle: float) -> tuple[float, float]:
    """The cosine and the sine of an angle in rad; NaN of NaN.

    Raises:
        ValueError: the angle is infinite.
    """
    if not -_FAR < angle < _FAR:
        if math.isnan(angle):
            return angle, angle
        angle = math.fmod(angle, math.tau)
    quarters = math.floor(angle * _QUARTERS + 0.5)
    cosine, sine = _near_zero(angle - quarters * _QUARTER, quarters * _QUARTER_REST)
    which = quarters & 3
    if which == 0:
        return cosine, sine
    if which == 1:
        return -sine, cosine
    return (-cosine, -sine) if which == 2 else (sine, -cosine)


def cos(angle: float) -> float:
    """The cosine of an angle in rad; see `cos_sin`."""
    return cos_sin(angle)[0]


def sin(angle: float) -> float:
    """The sine of an angle in rad; see `cos_sin`."""
    return cos_sin(angle)[1]


def chord_over_arc(half: float) -> float:
    """The length of a chord over that of its arc, which turns by twice this angle in rad."""
    return 1.0 if abs(half) < 1e-9 else cos_sin(half)[1] / half


def tan(angle: float) -> float:
    """The tangent of an angle in rad, right to some units in the last place; see `cos_sin`."""
    cosine, sine = cos_sin(angle)
    return sine / cosine


def cosines_and_sines(angles: Floats) -> tuple[Floats, Floats]:
    """Cosine and sine of each angle in rad, of the angles' shape; the same bits as those of `cos_sin`."""
    angles = np.where(np.abs(angles) < _FAR, angles, np.fmod(angles, math.tau))
    quarters = np.floor(angles * _QUARTERS + 0.5)
    cosine, sine = _near_zero(angles - quarters * _QUARTER, quarters * _QUARTER_REST)
    which = np.where(np.isfinite(quarters), quarters, 0.0).astype(np.int64) & 3
    return (
        np.choose(which, (cosine, -sine, -cosine, sine)),
        np.choose(which, (sine, cosine, -sine, -cosine)),
    )


def halfway(x: float, y: float) -> tuple[float, float]:
    """The cosine and the sine of half the direction of a vector in the plane; of zero's as of one along x."""
    length = norm(x, y)
    if length == 0.0:
        return 1.0, 0.0
    if x >= 0:
        cosine = math.sqrt((length + x) / (2.0 * length))
        return cosine, y / (2.0 * length * cosine)
    sine = math.copysign(math.sqrt((length - x) / (2.0 * length)), y)
    return y / (2.0 * length * sine), sine


# atan of 1/2, 1, 3/2 and infinity, each in two parts
_AT_HALF = 4.63647609000806093515e-01, 2.26987774529616870924e-17
_AT_ONE = 7.85398163397448278999e-01, 3.06161699786838301793e-17
_AT_MORE = 9.82793723247329054082e-01, 1.39033110312309984516e-17
_AT_END = 1.57079632679489655800e00, 6.12323399573676603587e-17
_A0, _A1, _A2 = 3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01
_A3, _A4, _A5 = -1.11111104054623557880e-01, 9.09088713343650656196e-02, -7.69187620504482999495e-02
_A6, _A7, _A8 = 6.66107313738753120669e-02, -5.83357013379057348645e-02, 4.97687799461593236017e-02
_A9, _A10 = -3.65315727442169155270e-02, 1.62858201153657823623e-02


def _atan(x: float) -> float:
    """The arc tangent of a number of zero or more, rad."""
    at, rest = 0.0, 0.0
    if x >= 0.4375:
        if x < 0.6875:
            x, (at, rest) = (2.0 * x - 1.0) / (2.0 + x), _AT_HALF
        elif x < 1.1875:
            x, (at, rest) = (x - 1.0) / (x + 1.0), _AT_ONE
        elif x < 2.4375:
            x, (at, rest) = (x - 1.5) / (1.0 + 1.5 * x), _AT_MORE
        else:
            x, (at, rest) = -1.0 / x, _AT_END
    z = x * x
    w = z * z
    odd = z * (_A0 + w * (_A2 + w * (_A4 + w * (_A6 + w * (_A8 + w * _A10)))))
    even = w * (_A1 + w * (_A3 + w * (_A5 + w * (_A7 + w * _A9))))
    return at - ((x * (odd + even) - rest) - x)


@compiled
def atan2(y: float, x: float) -> float:
    """The direction of a vector in the plane in rad, from -pi to pi.

    Two units in the last place at most; of two infinite coordinates as of two that are equal.
    """
    along, across = abs(x), abs(y)
    if across == 0.0:
        angle = 0.0
    elif along == 0.0 or across > along * 1e18:
        angle = math.pi / 2
    elif across == along:
        angle = math.pi / 4
    else:
        angle = _atan(across / along)
    if math.copysign(1.0, x) < 0:
        angle = (_AT_END[1] * 2 - angle) + math.pi
    return math.copysign(angle, y) if not (math.isnan(x) or math.isnan(y)) else math.nan


_LN2, _LN2_REST = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_P1, _P2, _P3 = 1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05
_P4, _P5 = -1.65339022054652515390e-06, 4.13813679705723846039e-08


def exp(x: float) -> float:
    """The exponential function, between -700 and 700.

    Raises:
        ValueError: the number is outside.
    """
    if not -700.0 <= x <= 700.0:
        raise ValueError("the exponential function is computed between -700 and 700")
    twos = math.floor(x * 1.44269504088896338700 + 0.5)
    high, low = x - twos * _LN2, twos * _LN2_REST
    r = high - low
    z = r * r
    c = r - z * (_P1 + z * (_P2 + z * (_P3 + z * (_P4 + z * _P5))))
    return math.ldexp(1.0 - ((low - (r * c) / (2.0 - c)) - high), twos)


_L1, _L2, _L3 = 6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01
_L4, _L5, _L6 = 2.222219843214978396e-01, 1.818357216161805012e-01, 1.531383769920937332e-01
_L7 = 1.479819860511658591e-01


def logs(x: Floats) -> Floats:
    """The natural logarithm of each number above zero, of the numbers' shape."""
    fraction, twos = np.frexp(x)
    small = fraction < math.sqrt(0.5)
    fraction, k = np.where(small, 2.0 * fraction, fraction), np.where(small, twos - 1, twos).astype(np.float64)
    f = fraction - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    odd = w * (_L2 + w * (_L4 + w * _L6))
    even = z * (_L1 + w * (_L3 + w * (_L5 + w * _L7)))
    half = 0.5 * f * f
    found: Floats = k * _LN2 - ((half - (s * (half + (odd + even)) + k * _LN2_REST)) - f)
    return found


# The rational functions of AS 241: numerator and denominator, the highest power first.
_MIDDLE = (
    (2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4, 4.5921953931549871457e4,
     1.3731693765509461125e4, 1.9715909503065514427e3, 1.3314166789178437745e2, 3.3871328727963666080e0),
    (5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4, 2.1213794301586595867e4,
     5.3941960214247511077e3, 6.8718700749205790830e2, 4.2313330701600911252e1, 1.0),
)  # fmt: skip
_NEAR = (
    (7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1, 1.27045825245236838258e0,
     3.64784832476320460504e0, 5.76949722146069140550e0, 4.63033784615654529590e0, 1.42343711074968357734e0),
    (1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2, 1.48103976427480074590e-1,
     6.89767334985100004550e-1, 1.67638483018380384940e0, 2.05319162663775882187e0, 1.0),
)  # fmt: skip
_FAR_OUT = (
    (2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3, 2.65321895265761230930e-2,
     2.96560571828504891230e-1, 1.78482653991729133580e0, 5.46378491116411436990e0, 6.65790464350110377720e0),
    (2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5, 7.86869131145613259100e-4,
     1.48753612908506148525e-2, 1.36929880922735805310e-1, 5.99832206555887937690e-1, 1.0),
)  # fmt: skip


_HALF_STEP = 1.0 / 2**54
"""Half of what two neighbouring uniform draws differ by; added, no draw is 0 or 1."""


def normals(generator: np.random.Generator, count: int) -> Floats:
    """Numbers drawn from the normal distribution with mean 0 and deviation 1, shape (count,).

    Each is the quantile of a uniform draw (Wichura 1988, algorithm AS 241, right to 1e-16).
    """
    share = generator.random(count)
    off = share - 0.5 + _HALF_STEP
    found = off * _ratio(_MIDDLE, 0.180625 - off * off)
    (tails,) = np.nonzero(np.abs(off) > 0.425)
    if len(tails):
        outer = share[tails]
        r = np.sqrt(-logs(np.where(outer < 0.5, outer + _HALF_STEP, 1.0 - outer - _HALF_STEP)))
        beyond = np.where(r <= 5.0, _ratio(_NEAR, r - 1.6), _ratio(_FAR_OUT, r - 5.0))
        found[tails] = np.copysign(beyond, off[tails])
    return found


def _ratio(coefficients: tuple[tuple[float, ...], tuple[float, ...]], x: Floats) -> Floats:
    """A polynomial divided by another."""
    above, below = np.full_like(x, coefficients[0][0]), np.full_like(x, coefficients[1][0])
    for one, other in zip(coefficients[0][1:], coefficients[1][1:], strict=True):
        above, below = above * x + one, below * x + other
    return above / below


_ARCTAN = (0.0028662257, -0.0161657367, 0.0429096138, -0.07528964, 0.1065626393, -0.1420889944, 0.1999355085)
_THIRD = -0.3333314528


def directions(x: Floats, y: Floats) -> Floats:
    """The direction of each vector in the plane in rad, from -pi to pi, of the shape that x and y have together.

    By a polynomial of the four operations alone (Abramowitz and Stegun 1964, 4.4.49), right to 2e-8 rad.
    """
    along, across = np.abs(x), np.abs(y)
    larger = np.maximum(along, across)
    ratio = np.minimum(along, across) / np.where(larger > 0, larger, 1.0)
    square = ratio * ratio
    series = np.zeros_like(square)
    for coefficient in (*_ARCTAN, _THIRD, 1.0):
        series = series * square + coefficient
    angle = ratio * series
    angle = np.where(across > along, math.pi / 2 - angle, angle)
    angle = np.where(x < 0, math.pi - angle, angle)
    return np.copysign(angle, y)
