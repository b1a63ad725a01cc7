"""Speed of attitude integration against the same algorithms as Python loops.

Run ``python benchmarks/attitude.py [SAMPLES]``. Three loops over the same tumble: NumPy calls on each sample, as one
would write it down first; plain floats from lists, fourth-order rotation vector and Runge-Kutta, as fast as Python
gets. Loop and library are timed back to back, both in CPU time of their one thread, and the ratio is taken pair by
pair, so that other load on the machine does not decide.
"""

from __future__ import annotations

import math
import sys
import time

import numpy as np

from gfimu.motion.attitude import integrate_attitude

PAIRS = 7
LOOP_SAMPLES = 20_000


def main() -> None:
    samples = int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000
    t = np.arange(samples) * 1e-3
    omega = np.column_stack([3 * np.sin(2 * t), 2 * np.cos(3 * t), 5 + np.sin(t)])
    alpha = np.column_stack([6 * np.cos(2 * t), -6 * np.sin(3 * t), np.cos(t)])
    few = slice(0, LOOP_SAMPLES)
    arrays = (t[few], omega[few], alpha[few])
    lists = tuple(values.tolist() for values in arrays)
    print(f"{samples:,} samples, median of {PAIRS} pairs")
    for name, method, loop, data in (
        ("NumPy per sample", "fourth_order", numpy_loop, arrays),
        ("plain Python", "runge_kutta", runge_kutta_loop, lists),
        ("plain Python", "fourth_order", fourth_order_loop, lists),
    ):
        difference = np.abs(integrate_attitude(*arrays, method=method) - loop(*data)).max()
        slow, fast = [], []
        for _ in range(PAIRS):
            slow.append(LOOP_SAMPLES / _seconds(loop, *data))
            fast.append(samples / _seconds(integrate_attitude, t, omega, alpha, method=method))
        ratio = np.array(fast) / slow
        print(
            f"{method:13s} {np.median(fast) / 1e6:6.1f} M samples/s = {np.median(ratio):5.0f} × {name} "
            f"({np.median(slow) / 1e6:.3f} M samples/s); least ratio {ratio.min():.0f}, difference {difference:.0e}"
        )


def fourth_order_loop(t, omega, alpha):
    """Rotation vector of fourth order, plain floats."""
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    result = [(w, x, y, z)]
    for i in range(len(t) - 1):
        h = t[i + 1] - t[i]
        (ax, ay, az), (bx, by, bz) = omega[i], omega[i + 1]
        (cx, cy, cz), (dx, dy, dz) = alpha[i], alpha[i + 1]
        k = h * h / 12
        px = h / 2 * (ax + bx) + k * (ay * bz - az * by + cx - dx)
        py = h / 2 * (ay + by) + k * (az * bx - ax * bz + cy - dy)
        pz = h / 2 * (az + bz) + k * (ax * by - ay * bx + cz - dz)
        angle = math.sqrt(px * px + py * py + pz * pz)
        s = math.sin(angle / 2) / angle if angle else 0.5
        c = math.cos(angle / 2)
        px, py, pz = s * px, s * py, s * pz
        w, x, y, z = (
            w * c - x * px - y * py - z * pz,
            w * px + x * c + y * pz - z * py,
            w * py - x * pz + y * c + z * px,
            w * pz + x * py - y * px + z * c,
        )
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w / norm, x / norm, y / norm, z / norm
        result.append((w, x, y, z))
    return np.array(result)


def runge_kutta_loop(t, omega, alpha):
    """Classical Runge-Kutta step with the rate interpolated linearly, plain floats."""

    def slope(w, x, y, z, p, q, r):
        return (
            0.5 * (-x * p - y * q - z * r),
            0.5 * (w * p + y * r - z * q),
            0.5 * (w * q - x * r + z * p),
            0.5 * (w * r + x * q - y * p),
        )

    q = (1.0, 0.0, 0.0, 0.0)
    result = [q]
    for i in range(len(t) - 1):
        h = t[i + 1] - t[i]
        first, last = omega[i], omega[i + 1]
        middle = [(a + b) / 2 for a, b in zip(first, last, strict=True)]
        k1 = slope(*q, *first)
        k2 = slope(*(a + h / 2 * k for a, k in zip(q, k1, strict=True)), *middle)
        k3 = slope(*(a + h / 2 * k for a, k in zip(q, k2, strict=True)), *middle)
        k4 = slope(*(a + h * k for a, k in zip(q, k3, strict=True)), *last)
        q = [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(q, k1, k2, k3, k4, strict=True)]
        norm = math.hypot(*q)
        q = tuple(a / norm for a in q)
        result.append(q)
    return np.array(result)


def numpy_loop(t, omega, alpha):
    """Rotation vector of fourth order, NumPy calls on each sample."""
    q = np.array([1.0, 0.0, 0.0, 0.0])
    result = np.empty((len(t), 4))
    result[0] = q
    for i in range(len(t) - 1):
        h = t[i + 1] - t[i]
        phi = h / 2 * (omega[i] + omega[i + 1])
        phi += h**2 / 12 * (np.cross(omega[i], omega[i + 1]) + alpha[i] - alpha[i + 1])
        angle = np.linalg.norm(phi)
        v = phi * (np.sin(angle / 2) / angle if angle else 0.5)
        s = np.cos(angle / 2)
        q = np.concatenate([[q[0] * s - q[1:] @ v], q[0] * v + s * q[1:] + np.cross(q[1:], v)])
        q /= np.linalg.norm(q)
        result[i + 1] = q
    return result


def _seconds(call, *arguments, **keywords) -> float:
    start = time.process_time()
    call(*arguments, **keywords)
    return time.process_time() - start


if __name__ == "__main__":
    main()
