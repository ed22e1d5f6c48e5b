"""Fit the rational approximation of the logistic function in engine/arithmetic.py.

sigmoid(z) - 1/2 = z P(z^2) / Q(z^2) for |z| <= 15.5, with P and Q of degree 4 and Q(0) = 1. The
method is iteratively reweighted least squares, with Lawson's weights for the largest error and 1/Q
for the linearized denominator. The script prints the coefficients.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

MAX_Z = 15.5
DEGREE = 4
N_ROUNDS = 400
Row = npt.NDArray[np.float64]


def fit_sigmoid() -> tuple[float, Row, Row]:
    """Return the largest error, and the coefficients of P and Q."""
    z = np.cos(np.linspace(0, np.pi / 2, 4001))[:-1] * MAX_Z
    target = np.tanh(z / 2) / 2
    x = (z / MAX_Z) ** 2
    powers = x[:, None] ** np.arange(DEGREE + 1)
    matrix = np.hstack([powers * (z / MAX_Z)[:, None], -powers[:, 1:] * target[:, None]])
    denominator_weights = np.ones_like(z)
    lawson_weights = np.ones_like(z)
    best_fit = (np.inf, np.empty(0), np.empty(0))
    for _ in range(N_ROUNDS):
        weight = np.sqrt(lawson_weights) * denominator_weights
        solution = np.linalg.lstsq(matrix * weight[:, None], target * weight, rcond=None)[0]
        p = solution[: DEGREE + 1]
        q = np.append(1, solution[DEGREE + 1 :])
        error = np.abs((powers @ p) * (z / MAX_Z) / (powers @ q) - target)
        if error.max() < best_fit[0]:
            best_fit = (
                error.max(),
                p / MAX_Z ** (2 * np.arange(DEGREE + 1) + 1),
                q / MAX_Z ** (2 * np.arange(DEGREE + 1)),
            )
        denominator_weights = 1 / np.abs(powers @ q)
        lawson_weights *= error / error.max() + 1e-3
        lawson_weights /= lawson_weights.max()
    return best_fit


if __name__ == "__main__":
    largest, numerator, denominator = fit_sigmoid()
    print(f"largest error {largest:.2g}, before rounding to float32")
    print("P", [float(np.float32(c)) for c in numerator])
    print("Q", [float(np.float32(c)) for c in denominator])
