"""Mathematical functions from + - * /, square root and bit operations, without libm.

IEEE 754 defines these operations completely. Libraries of different machines differ in the last
bit. These functions give the same bits on every CPU, on a GPU and in a browser, compiled or in
plain Python. `sigmoid` and `share_of_turn` work on float32, all others on one float64.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.simd import HALF, ONE, ZERO, Value, clamp, square_root

Coefficients = tuple[float, ...]
"""Coefficients of a polynomial, from the highest power."""

# sigmoid(z) = 1/2 + z P(z^2) / Q(z^2) on |z| <= SIGMOID_LIMIT, a minimax fit by
# iteratively reweighted least squares: within 2.4e-7 everywhere. The constant term of Q is 1.
SIGMOID_LIMIT = np.float32(15.5)
P0 = np.float32(0.25)
P1 = np.float32(0.008408601395785809)
P2 = np.float32(5.598329516942613e-05)
P3 = np.float32(8.632270720454471e-08)
P4 = np.float32(1.5195286001690178e-11)
Q1 = np.float32(0.11696771532297134)
Q2 = np.float32(0.0016379167791455984)
Q3 = np.float32(5.36017250851728e-06)
Q4 = np.float32(3.3775202634700463e-09)
QUARTER = np.float32(0.25)

# arctan(x) / x on [0, 1], in powers of x^2, within 2e-8. The constant term is 1.
ARCTAN_1 = np.float32(-0.3333314528)
ARCTAN_2 = np.float32(0.1999355085)
ARCTAN_3 = np.float32(-0.1420889944)
ARCTAN_4 = np.float32(0.1065626393)
ARCTAN_5 = np.float32(-0.07528964)
ARCTAN_6 = np.float32(0.0429096138)
ARCTAN_7 = np.float32(-0.0161657367)
ARCTAN_8 = np.float32(0.0028662257)
RADIANS_PER_TURN = np.float32(2 * math.pi)

# A float64 is sign, exponent and fraction.
FRACTION_BITS = np.int64(52)
EXPONENT_BIAS = np.int64(1023)
# Mask of the bits of a fraction, and the bits of the number 1.0.
FRACTION_MASK = np.int64(2**52 - 1)
BITS_OF_ONE = np.int64(1023 << 52)
# Exponent of the power of two that makes a subnormal number normal.
SUBNORMAL_SHIFT: Final = 54
# A constant, because compiled code would call `pow`.
SUBNORMAL_FACTOR: Final = 2.0**54
SQRT_2: Final = 1.4142135623730951
SMALLEST_NORMAL: Final = 2.0**-1022

# The logarithm: ln 2 as the sum of two numbers, for more digits, and a minimax polynomial.
LN2 = 6.93147180369123816490e-01
LN2_REST = 1.90821492927058770002e-10
LOGARITHM_COEFFICIENTS: Coefficients = (
    1.479819860511658591e-01,
    1.531383769920937332e-01,
    1.818357216161805012e-01,
    2.222219843214978396e-01,
    2.857142874366239149e-01,
    3.999999999940941908e-01,
    6.666666666666735130e-01,
)

# The power of ten: log2(10), log10(2) as the sum of two numbers, and the numerator and denominator
# of a rational approximation.
LOG2_10 = 3.32192809488736234787
LOG10_2 = 3.01025390625e-1
LOG10_2_REST = 4.60503898119521373889e-6
# The result is infinite or 0 beyond this exponent.
MAX_DECIMAL_EXPONENT: Final = 400.0
POWER_NUMERATOR: Coefficients = (
    4.09962519798587023075e-2,
    1.17452732554344059015e1,
    4.06717289936872725516e2,
    2.39423741207388267439e3,
)
POWER_DENOMINATOR: Coefficients = (
    1.0,
    8.50936160849306532625e1,
    1.27209271178345121210e3,
    2.07960819286001865907e3,
)

# The normal quantile: rational approximations in the middle, |p - 1/2| <= MIDDLE_HALF_WIDTH, in the
# tails, and in the far tails. With r = sqrt(-ln p), the variable of a tail is r - TAIL_ORIGIN. For
# r > FAR_TAIL_START, the variable is r - FAR_TAIL_START.
MIDDLE_HALF_WIDTH: Final = 0.425
MIDDLE_HALF_WIDTH_SQUARED: Final = 0.180625
TAIL_ORIGIN: Final = 1.6
FAR_TAIL_START: Final = 5.0
MIDDLE_NUMERATOR: Coefficients = (
    2.5090809287301226727e3,
    3.3430575583588128105e4,
    6.7265770927008700853e4,
    4.5921953931549871457e4,
    1.3731693765509461125e4,
    1.9715909503065514427e3,
    1.3314166789178437745e2,
    3.3871328727963666080,
)
MIDDLE_DENOMINATOR: Coefficients = (
    5.2264952788528545610e3,
    2.8729085735721942674e4,
    3.9307895800092710610e4,
    2.1213794301586595867e4,
    5.3941960214247511077e3,
    6.8718700749205790830e2,
    4.2313330701600911252e1,
    1.0,
)
TAIL_NUMERATOR: Coefficients = (
    7.74545014278341407640e-4,
    2.27238449892691845833e-2,
    2.41780725177450611770e-1,
    1.27045825245236838258,
    3.64784832476320460504,
    5.76949722146069140550,
    4.63033784615654529590,
    1.42343711074968357734,
)
TAIL_DENOMINATOR: Coefficients = (
    1.05075007164441684324e-9,
    5.47593808499534494600e-4,
    1.51986665636164571966e-2,
    1.48103976427480074590e-1,
    6.89767334985100004550e-1,
    1.67638483018380384940,
    2.05319162663775882187,
    1.0,
)
FAR_TAIL_NUMERATOR: Coefficients = (
    2.01033439929228813265e-7,
    2.71155556874348757815e-5,
    1.24266094738807843860e-3,
    2.65321895265761230930e-2,
    2.96560571828504891230e-1,
    1.78482653991729133580,
    5.46378491116411436990,
    6.65790464350110377720,
)
FAR_TAIL_DENOMINATOR: Coefficients = (
    2.04426310338993978564e-15,
    1.42151175831644588870e-7,
    1.84631831751005468180e-5,
    7.86869131145613259100e-4,
    1.48753612908506148525e-2,
    1.36929880922735805310e-1,
    5.99832206555887937690e-1,
    1.0,
)


@compiled
def sigmoid(z: Value) -> Value:
    """Return the logistic function 1 / (1 + exp(-z)), within 2.4e-7.

    Parameters
    ----------
    z : float32, or a SIMD block
        Any number. The function is constant below -15.5 and above 15.5.

    Returns
    -------
    float32, or a SIMD block
        A number in (0, 1).
    """
    z = clamp(z, SIGMOID_LIMIT)
    s = z * z
    p = P0 + s * (P1 + s * (P2 + s * (P3 + s * P4)))
    q = ONE + s * (Q1 + s * (Q2 + s * (Q3 + s * Q4)))
    return HALF + z * p / q


@compiled
def share_of_turn(u: np.float32, v: np.float32) -> np.float32:
    """Return the angle of (u, v) from the u axis toward the v axis, as a fraction of a full turn.

    Parameters
    ----------
    u, v : float32
        Coordinates.

    Returns
    -------
    float32
        The fraction in [0, 1], with an error below 1e-7: 0.25 for (0, 1), and 0 for (0, 0).

    References
    ----------
    M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions (1964), 4.4.49, by
    C. Hastings.
    """
    along = abs(u)
    across = abs(v)
    larger = max(along, across)
    if not larger > ZERO:
        return ZERO
    x = min(along, across) / larger
    s = x * x
    # Horner's rule, from the highest power.
    series = ARCTAN_7 + s * ARCTAN_8
    series = ARCTAN_6 + s * series
    series = ARCTAN_5 + s * series
    series = ARCTAN_4 + s * series
    series = ARCTAN_3 + s * series
    series = ARCTAN_2 + s * series
    series = ARCTAN_1 + s * series
    series = ONE + s * series
    # The series gives an angle of at most 1/8 turn. Reflections give the angle in the full turn.
    share = x * series / RADIANS_PER_TURN
    share = QUARTER - share if across > along else share
    share = HALF - share if u < ZERO else share
    return ONE - share if v < ZERO else share


@compiled
def polynomial(x: float, coefficients: Coefficients) -> float:
    """Evaluate a polynomial by Horner's rule."""
    total = 0.0
    for coefficient in coefficients:
        total = total * x + coefficient
    return total


@compiled
def bits_of(x: float) -> np.int64:
    """Return the bits of a float64 as an int64."""
    return np.float64(x).view(np.int64)


@compiled
def from_bits(bits: np.int64) -> np.float64:
    """Return the float64 with the given bits."""
    return np.int64(bits).view(np.float64)


@compiled
def power_of_two(exponent: np.int64) -> np.float64:
    """Return 2 to the power of an integer from -1022 to 1023."""
    return from_bits((exponent + EXPONENT_BIAS) << FRACTION_BITS)


@compiled
def logarithm(x: float) -> float:
    """Return the natural logarithm.

    Parameters
    ----------
    x : float64
        Any number.

    Returns
    -------
    float64
        The logarithm, within 1 ulp. It is -inf for 0, and NaN for negative numbers.

    References
    ----------
    e_log.c of FDLIBM, Sun Microsystems, 1993.
    """
    x = np.float64(x)
    exponent = np.int64(0)
    if x == 0:
        return -math.inf
    # Infinity is returned. NaN and negative numbers give NaN.
    if not 0 < x < math.inf:
        return x if x > 0 else math.nan
    if x < SMALLEST_NORMAL:
        x = x * SUBNORMAL_FACTOR
        exponent = np.int64(-SUBNORMAL_SHIFT)
    bits = bits_of(x)
    exponent += (bits >> FRACTION_BITS) - EXPONENT_BIAS
    mantissa = from_bits((bits & FRACTION_MASK) | BITS_OF_ONE)
    # The mantissa moves from [1, 2) to a range around 1, from sqrt(1/2) to sqrt(2).
    if mantissa > SQRT_2:
        mantissa = 0.5 * mantissa
        exponent = exponent + np.int64(1)
    f = mantissa - 1.0
    k = np.float64(exponent)
    s = f / (2.0 + f)
    half_square = 0.5 * f * f
    z = s * s
    rest = s * (half_square + z * polynomial(z, LOGARITHM_COEFFICIENTS)) + k * LN2_REST
    return k * LN2 - ((half_square - rest) - f)


@compiled
def power_of_ten(x: float) -> float:
    """Return 10 to the power x.

    Parameters
    ----------
    x : float64
        Exponent.

    Returns
    -------
    float64
        The power, within 2 ulp.

    References
    ----------
    exp10.c of Cephes: S. L. Moshier, Methods and Programs for Mathematical Functions, 1989.
    """
    x = np.float64(x)
    if x >= MAX_DECIMAL_EXPONENT:
        return math.inf
    # `not >` is also true for NaN, which is returned.
    if not x > -MAX_DECIMAL_EXPONENT:
        return 0.0 if x < 0 else x
    # 10**x is 2**exponent * 10**rest, with an integer `exponent` and a small `rest`.
    doublings = x * LOG2_10
    exponent = np.int64(doublings + (0.5 if doublings > 0 else -0.5))
    rest = x - np.float64(exponent) * LOG10_2 - np.float64(exponent) * LOG10_2_REST
    square = rest * rest
    numerator = rest * polynomial(square, POWER_NUMERATOR)
    denominator = polynomial(square, POWER_DENOMINATOR) - numerator
    ratio = 1.0 + 2.0 * (numerator / denominator)
    half_exponent = exponent >> np.int64(1)
    # 2**exponent may be outside the range of float64. Each of these two factors is inside.
    return ratio * power_of_two(half_exponent) * power_of_two(exponent - half_exponent)


@compiled
def normal_quantile(p: float) -> float:
    """Return the quantile of the standard normal distribution, with a relative error below 1e-15.

    The result is NaN for p outside [0, 1].

    References
    ----------
    Algorithm AS 241 (PPND16) of M. J. Wichura, Applied Statistics 37 (1988).
    """
    if p == 0.0:
        return -math.inf
    if p == 1.0:
        return math.inf
    if not 0.0 < p < 1.0:
        return math.nan
    q = p - 0.5
    if abs(q) <= MIDDLE_HALF_WIDTH:
        r = MIDDLE_HALF_WIDTH_SQUARED - q * q
        return q * polynomial(r, MIDDLE_NUMERATOR) / polynomial(r, MIDDLE_DENOMINATOR)
    tail_probability = p if q < 0.0 else 1.0 - p
    r = square_root(-logarithm(tail_probability))
    if r <= FAR_TAIL_START:
        x = r - TAIL_ORIGIN
        distance = polynomial(x, TAIL_NUMERATOR) / polynomial(x, TAIL_DENOMINATOR)
    else:
        x = r - FAR_TAIL_START
        distance = polynomial(x, FAR_TAIL_NUMERATOR) / polynomial(x, FAR_TAIL_DENOMINATOR)
    return -distance if q < 0.0 else distance
