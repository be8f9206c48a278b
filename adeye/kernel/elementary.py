"""Elementary functions with the same bits on every processor.

The mathematical library and NumPy choose their code by processor, so their last bit differs
between machines. These use only ``+ - * /``, ``sqrt``, comparisons and exact scaling, in a fixed
order. Error below one unit in the last place, 1.5 for ``atan2`` and 2 for ``tan``.

Source:
    Coefficients and reductions of fdlibm 5.3 (K. C. Ng, Sun Microsystems, 1993), as in ``s_sin.c``,
    ``s_atan.c``, ``e_asin.c``, ``e_exp.c`` and ``e_log.c``.
"""

from __future__ import annotations

import math
from decimal import Context, Decimal

import numpy as np

from adeye.kernel.jit import compiled, inlined

# --- Elementary functions with the same bits on every processor -----------------------------------

#: Largest angle [rad] whose reduction is exact; beyond it the circular functions return NaN.
LARGEST_ANGLE = 1.6e6
QUARTERS_PER_RADIAN = 6.36619772367581382433e-01
_FIRST_QUADRANT = 0.785
_ROOT_HALF = 0.70710678118654752440
# Scaling by a power of two is exact, whoever does it; a product is sooner done than a call.
_NEAR = 32
_POWERS_OF_TWO = np.ldexp(1.0, np.arange(-_NEAR, _NEAR + 1))
# Decimal numbers round alike everywhere.
_EXACT = Context(prec=30)
_LOGS = np.array([float(_EXACT.ln(Decimal(max(k, 1)) / 128)) for k in range(193)])
_INVERSES = np.array([128.0 / max(k, 1) for k in range(193)])
_ROOTS = np.array([float(_EXACT.power(Decimal(2), Decimal(j) / 32)) for j in range(32)])


@inlined
def _kernel_sin(x: float, rest: float) -> float:
    """Return sin(x + rest) for abs(x) <= pi/4."""
    z = x * x
    v = z * x
    r = 8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04
        + z
        * (
            2.75573137070700676789e-06
            + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
        )
    )
    return x - ((z * (0.5 * rest - v * r) - rest) - v * -1.66666666666666324348e-01)


@inlined
def _kernel_cos(x: float, rest: float) -> float:
    """Return cos(x + rest) for abs(x) <= pi/4."""
    z = x * x
    r = z * (
        4.16666666666666019037e-02
        + z
        * (
            -1.38888888888741095749e-03
            + z
            * (
                2.48015872894767294178e-05
                + z
                * (
                    -2.75573143513906633035e-07
                    + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
                )
            )
        )
    )
    half = 0.5 * z
    w = 1.0 - half
    return w + (((1.0 - w) - half) + (z * r - x * rest))


@inlined
def sin_cos_of_rest(angle: float, n: float) -> tuple[float, float]:
    """Return (sine, cosine) of what n quarter turns, the nearest, leave of an angle [rad]."""
    # pi/2 in three parts, of which n times the first two is exact.
    t = angle - n * 1.57079632673412561417e00
    w = n * 6.07710050630396597660e-11
    r = t - w
    w = n * 2.02226624879595063154e-21 - ((t - r) - w)
    x = r - w
    rest = (r - x) - w
    return _kernel_sin(x, rest), _kernel_cos(x, rest)


@compiled
def sin_cos(angle: float) -> tuple[float, float]:  # noqa: PLR0911 - one for each quadrant
    """Return (sine, cosine) of an angle [rad]; NaN beyond ``LARGEST_ANGLE``."""
    if angle == 0.0:
        return angle, 1.0
    if abs(angle) <= _FIRST_QUADRANT:
        # Nothing to take away; the same bits, sooner.
        return _kernel_sin(angle, 0.0), _kernel_cos(angle, 0.0)
    if not abs(angle) <= LARGEST_ANGLE:
        return math.nan, math.nan
    turns = math.floor(angle * QUARTERS_PER_RADIAN + 0.5)
    s, c = sin_cos_of_rest(angle, float(turns))
    quadrant = int(turns) & 3
    if quadrant == 0:
        return s, c
    if quadrant == 1:
        return c, -s
    if quadrant == 2:
        return -s, -c
    return -c, s


@inlined
def sin_cos_of_small(angle: float) -> tuple[float, float]:
    """Do what ``sin_cos`` does, in the caller's own code where the angle is small."""
    if abs(angle) <= _FIRST_QUADRANT:
        return _kernel_sin(angle, 0.0), _kernel_cos(angle, 0.0)
    return sin_cos(angle)


@compiled
def sin(angle: float) -> float:
    """Return the sine of an angle [rad]; NaN beyond ``LARGEST_ANGLE``."""
    if angle != 0.0 and abs(angle) <= _FIRST_QUADRANT:
        return _kernel_sin(angle, 0.0)
    return sin_cos(angle)[0]


@compiled
def cos(angle: float) -> float:
    """Return the cosine of an angle [rad]; NaN beyond ``LARGEST_ANGLE``."""
    return sin_cos(angle)[1]


@compiled
def tan(angle: float) -> float:
    """Return the tangent of an angle [rad]; NaN beyond ``LARGEST_ANGLE``."""
    s, c = sin_cos(angle)
    return s / c


@compiled
def _atan_reduced(x: float) -> tuple[float, float, float]:
    """Return (reduced argument, high and low part of the angle taken away) for x >= 0.4375."""
    if x < 0.6875:
        return (2.0 * x - 1.0) / (2.0 + x), 4.63647609000806093515e-01, 2.26987774529616870924e-17
    if x < 1.1875:
        return (x - 1.0) / (x + 1.0), 7.85398163397448278999e-01, 3.06161699786838301793e-17
    if x < 2.4375:
        return (x - 1.5) / (1.0 + 1.5 * x), 9.82793723247329054082e-01, 1.39033110312309984516e-17
    return -1.0 / x, 1.57079632679489655800e00, 6.12323399573676603587e-17


@compiled
def atan(x: float) -> float:
    """Return the arc tangent [rad], in [-pi/2, pi/2]."""
    size = abs(x)
    high = 0.0
    low = 0.0
    if size >= 0.4375:
        size, high, low = _atan_reduced(size)
    z = size * size
    w = z * z
    odd = z * (
        3.33333333333329318027e-01
        + w
        * (
            1.42857142725034663711e-01
            + w
            * (
                9.09088713343650656196e-02
                + w
                * (
                    6.66107313738753120669e-02
                    + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)
                )
            )
        )
    )
    even = w * (
        -1.99999999998764832476e-01
        + w
        * (
            -1.11111104054623557880e-01
            + w
            * (
                -7.69187620504482999495e-02
                + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02)
            )
        )
    )
    angle = high - ((size * (odd + even) - low) - size)
    return -angle if x < 0.0 else angle


@compiled
def atan2(y: float, x: float) -> float:
    """Return the direction [rad] of the vector (x, y), in (-pi, pi]; 0 for the null vector.

    A negative zero counts as zero. Two infinite components give NaN.
    """
    if x == 0.0:
        if y == 0.0:
            return 0.0
        if math.isnan(y):
            return math.nan
        return 0.5 * math.pi if y > 0.0 else -0.5 * math.pi
    angle = atan(abs(y / x))
    if x < 0.0:
        angle = math.pi - (angle - 1.2246467991473531772e-16)
    return -angle if y < 0.0 else angle


@inlined
def _asin_half(x: float) -> float:
    """Return the arc sine of abs(x) <= 0.5 [rad]."""
    z = x * x
    if z <= 0.00390625:
        # The series ends sooner than a division.
        w = z * z
        tail = (1.0 / 6.0 + z * 0.075) + w * (
            (15.0 / 336.0 + z * (105.0 / 3456.0)) + w * (945.0 / 42240.0 + z * (10395.0 / 599040.0))
        )
        return x + x * (z * tail)
    p = z * (
        1.66666666666666657415e-01
        + z
        * (
            -3.25565818622400915405e-01
            + z
            * (
                2.01212532134862925881e-01
                + z
                * (
                    -4.00555345006794114027e-02
                    + z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)
                )
            )
        )
    )
    q = 1.0 + z * (
        -2.40339491173441421878e00
        + z
        * (
            2.02094576023350569471e00
            + z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)
        )
    )
    return x + x * (p / q)


@inlined
def asin(x: float) -> float:
    """Return the arc sine [rad]; NaN outside [-1, 1]."""
    if abs(x) <= 0.5:
        return _asin_half(x)
    return _asin_steep(x)


@compiled
def _asin_steep(x: float) -> float:
    if not abs(x) <= 1.0:
        return math.nan
    return atan2(x, math.sqrt((1.0 - x) * (1.0 + x)))


@compiled
def exp(x: float) -> float:
    """Return e to the power x; 0 and infinity where the result is too small or too large."""
    if math.isnan(x):
        return math.nan
    if x > 7.09782712893383973096e02:
        return math.inf
    if x < -7.45133219101941108420e02:
        return 0.0
    power_of_two = math.floor(1.44269504088896338700e00 * x + 0.5)
    k = float(power_of_two)
    high = x - k * 6.93147180369123816490e-01
    low = k * 1.90821492927058770002e-10
    r = high - low
    t = r * r
    c = r - t * (
        1.66666666666666019037e-01
        + t
        * (
            -2.77777777770155933842e-03
            + t
            * (
                6.61375632143793436117e-05
                + t * (-1.65339022054652515390e-06 + t * 4.13813679705723846039e-08)
            )
        )
    )
    y = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    if abs(k) <= _NEAR:
        return y * _POWERS_OF_TWO[int(power_of_two) + _NEAR]
    return math.ldexp(y, int(power_of_two))


@inlined
def log_of_parts(mantissa: float, k: float) -> float:
    """Return the logarithm of ``mantissa * 2**k``, the mantissa between the roots of 1/2 and 2."""
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (
        3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01)
    )
    odd = z * (
        6.666666666666735130e-01
        + w
        * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01))
    )
    half = 0.5 * f * f
    return k * 6.93147180369123816490e-01 - (
        (half - (s * (half + (odd + even)) + k * 1.90821492927058770002e-10)) - f
    )


@compiled
def log(x: float) -> float:
    """Return the natural logarithm; minus infinity at 0, NaN below."""
    if not x > 0.0:
        return -math.inf if x == 0.0 else math.nan
    if x == math.inf:
        return math.inf
    mantissa, power_of_two = x, 0
    if 0.02 < x < 2.0 * _ROOT_HALF:
        while mantissa < _ROOT_HALF:
            mantissa *= 2.0
            power_of_two -= 1
    else:
        mantissa, power_of_two = math.frexp(x)
        if mantissa < _ROOT_HALF:
            mantissa *= 2.0
            power_of_two -= 1
    return log_of_parts(mantissa, float(power_of_two))


@inlined
def near_power(base: float, exponent: float) -> float:
    """Return a base in [0.25, 1.5] to a power in [-16, 16], with no division.

    The logarithm goes on from that of the nearest 128th, the exponential from the nearest 32nd
    part of a power of two; both rests are below a 64th, where short series do.
    """
    k = int(base * 128.0 + 0.5)
    f = (base - k * 0.0078125) * _INVERSES[k]
    z = f * f
    w = z * z
    tail = (f * (1.0 / 3.0) - 0.5) + z * (f * 0.2 - 0.25)
    tail += w * ((f * (1.0 / 7.0) - 1.0 / 6.0) - z * 0.125)
    y = exponent * (_LOGS[k] + (f + z * tail))
    n = math.floor(y * 4.61662413084468283841e01 + 0.5)
    # A 32nd of log(2) in two parts, of which n times the first is exact.
    r = (y - float(n) * 2.16608493865351192653e-02) - float(n) * 5.96317165397058692545e-12
    z = r * r
    series = (0.5 + r * (1.0 / 6.0)) + z * ((1.0 / 24.0 + r * (1.0 / 120.0)) + z * (1.0 / 720.0))
    whole = int(n)
    root = _ROOTS[whole & 31]
    return (root + root * (r + z * series)) * _POWERS_OF_TWO[(whole >> 5) + _NEAR]


@compiled
def power(base: float, exponent: float) -> float:
    """Return a base >= 0 to a power; NaN for a negative base with a broken exponent.

    Whole exponents up to 16 are products, others ``exp(exponent * log(base))`` with a relative
    error below 1e-14 for results between 1e-30 and 1e30.
    """
    size = abs(exponent)
    if size <= 16.0 and size == math.floor(size):
        result = 1.0
        for _ in range(int(size)):
            result *= base
        if exponent >= 0.0:
            return result
        return np.inf if result == 0.0 else 1.0 / result
    if size <= 16.0 and 0.25 <= base <= 1.5:
        return near_power(base, exponent)
    if base == 0.0:
        return 0.0 if exponent > 0.0 else np.inf
    return exp(exponent * log(base))


# --- Elementary functions without a jump, so that loops over many numbers are vectorised ----------

_MANTISSA = 0xFFFFFFFFFFFFF
_HALF_BITS = 0x3FE0000000000000


@inlined
def log_of_fraction(x: float) -> float:
    """Return ``elementary.log`` of a number in (0, 1), bit for bit."""
    bits = np.float64(x).view(np.int64)
    mantissa = np.int64((bits & _MANTISSA) | _HALF_BITS).view(np.float64)
    is_low = mantissa < _ROOT_HALF
    power = (bits >> 52) - (1023 if is_low else 1022)
    return log_of_parts(2.0 * mantissa if is_low else mantissa, float(power))


@inlined
def sin_cos_of_turn(angle: float) -> tuple[float, float]:
    """Return ``elementary.sin_cos`` of an angle in (0, 2 pi), bit for bit."""
    turns = int(angle * QUARTERS_PER_RADIAN + 0.5)
    s, c = sin_cos_of_rest(angle, float(turns))
    is_odd = turns & 1 != 0
    # Negative in quadrants 2 and 3, and in 1 and 2.
    sine = (1.0 - float(turns & 2)) * (c if is_odd else s)
    return sine, (1.0 - float((turns + 1) & 2)) * (s if is_odd else c)


@inlined
def sin_cos_of_any(angle: float) -> tuple[float, float]:
    """Return ``elementary.sin_cos`` of an angle [rad], bit for bit."""
    is_known = abs(angle) <= LARGEST_ANGLE
    turned = angle if is_known else 0.0
    turns = np.floor(turned * QUARTERS_PER_RADIAN + 0.5)
    s, c = sin_cos_of_rest(turned, turns)
    quadrant = turns - 4.0 * np.floor(0.25 * turns)
    is_odd = (quadrant == 1.0) | (quadrant == 3.0)
    sine, cosine = (c if is_odd else s), (s if is_odd else c)
    sine = -sine if quadrant >= 2.0 else sine
    cosine = -cosine if (quadrant == 1.0) | (quadrant == 2.0) else cosine
    sine = angle if angle == 0.0 else sine
    return (sine if is_known else math.nan), (cosine if is_known else math.nan)
