"""The rate filter as a plain numpy loop, and the Rauch–Tung–Striebel smoother by the book: the compiled ones must
agree with them. No rest, no faults, even sampling, a six-point stencil throughout."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from gfimu.rate import ChannelTables


def centred_weights(points=6):
    """Integral over each interval of the polynomial through even nodes."""
    table = np.empty((points - 1, points))
    for j in range(points):
        others = [i for i in range(points) if i != j]
        basis = np.poly(others) / np.prod([j - i for i in others])
        integral = np.polyint(basis)
        table[:, j] = np.diff(np.polyval(integral, np.arange(points)))
    return table


def products(omega):
    x, y, z = omega
    return np.array([x * x, y * y, z * z, x * y, x * z, y * z])


def slopes(omega):
    x, y, z = omega
    return np.array([[2 * x, 0, 0], [0, 2 * y, 0], [0, 0, 2 * z], [y, x, 0], [z, 0, x], [0, z, y]])


def probable(omega, spread, p, z, sensitivity):
    """Most probable rate by its prediction and a sample whose biases are free, and its covariance."""
    d = len(z)
    gain = np.linalg.solve(spread, p[:3, 6 : 6 + d]).T
    noise = p[6 : 6 + d, 6 : 6 + d] + np.eye(d) - gain @ p[:3, 6 : 6 + d]
    white, prior = (np.linalg.inv(np.linalg.cholesky(one)) for one in (noise, spread))

    def misfit(w):
        return np.concatenate([prior @ (w - omega), white @ (z - sensitivity @ products(w) - gain @ (w - omega))])

    def slope_of(w):
        return np.vstack([prior, -white @ (sensitivity @ slopes(w) + gain)])

    xx, yy, zz, xy, xz, yz = np.linalg.pinv(sensitivity) @ z
    size, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    single = axes[:, 2] * np.sqrt(max(size[2], 0))
    fits = (least_squares(misfit, w, slope_of, method="lm", xtol=1e-13, ftol=1e-13) for w in (omega, single, -single))
    best = min(fits, key=lambda one: one.cost)
    at = best.x
    bends = np.array([[[2 * m[0], m[3], m[4]], [m[3], 2 * m[1], m[5]], [m[4], m[5], 2 * m[2]]] for m in sensitivity])
    for _ in range(3):  # Newton's, to rounding
        jacobian, off = slope_of(at), misfit(at)
        bent = np.einsum("i,iab->ab", white.T @ off[3:], bends)
        at = at - np.linalg.solve(jacobian.T @ jacobian - bent, jacobian.T @ off)
    slope = sensitivity @ slopes(at) + gain
    return at, np.linalg.inv(np.linalg.inv(spread) + slope.T @ np.linalg.solve(noise, slope))


def reference_filter(array, t, readings, errors, *, start_std=1e-3, keep=False):
    """ω (n, 3), covariance (n, 3, 3) and NIS (n,); with ``keep`` also predicted and filtered states and transitions."""
    tables = ChannelTables(array, errors)
    rows, sensitivity, noise = tables.null_rows[0], tables.null_sensitivity[0], tables.alpha_noise[0]
    d = len(rows)
    n = 9 + d
    alpha, z = readings @ tables.alpha_rows[0].T, readings @ rows.T
    weights = centred_weights()
    ringing = 2 * np.sum(weights[2] ** 2) - 1
    forms = [
        np.array([[m[0], m[3] / 2, m[4] / 2], [m[3] / 2, m[1], m[5] / 2], [m[4] / 2, m[5] / 2, m[2]]])
        for m in sensitivity
    ]
    period = t[1] - t[0]
    x, p = np.zeros(n), np.zeros((n, n))
    p[:3, :3] = np.eye(3) * start_std**2
    p[3 : 6 + d, 3 : 6 + d] = tables.bias_covariance(errors.bias_std)
    out = []
    for k in range(len(t)):
        half = period / 2 if k else 0.0
        f = np.eye(n)
        f[-3:, -3:] = -ringing * np.eye(3)
        g = (1 + ringing) * np.vstack([half * np.eye(3), np.zeros((n - 6, 3)), np.eye(3)])
        if k:
            f[:3, 3:6] = -period * np.eye(3)
            f[:3, -3:] = half * (1 - ringing) * np.eye(3)
            first = min(max(k - 3, 0), len(t) - 6)
            x = f @ x
            x[:3] += period * weights[k - 1 - first] @ alpha[first : first + 6]
            p = f @ p @ f.T
        else:
            g /= np.sqrt(1 - ringing**2)
        p = p + g @ noise @ g.T
        predicted = (x.copy(), p.copy())
        size = np.sum(sensitivity**2)
        trace = np.trace(p[:3, :3])
        curved = trace > 1e-3 * x[:3] @ x[:3] and trace**2 * size > 1e-4
        broad = trace > 0.02 * x[:3] @ x[:3] and trace**2 * size > 1.0
        if broad:  # no rate is larger than the products allow
            inverse = np.linalg.pinv(sensitivity)
            seen = inverse @ (z[k] - x[6 : 6 + d])
            unsure = inverse @ (p[6 : 6 + d, 6 : 6 + d] + np.eye(d)) @ inverse.T
            for a in range(3):
                most = max(seen[a], 0) + 2 * np.sqrt(unsure[a, a])
                if p[a, a] > most:
                    variance = most * p[a, a] / (p[a, a] - most)
                    gain = p[a] / (p[a, a] + variance)
                    x, p = x - gain * x[a], p - np.outer(gain, p[a])
        omega, spread = x[:3].copy(), p[:3, :3]
        at, wide = omega, spread
        if broad:
            at, wide = probable(omega, spread, p, z[k] - x[6 : 6 + d], sensitivity)
        h = np.zeros((d, n))
        h[:, :3] = sensitivity @ slopes(at)
        h[:, 6 : 6 + d] = np.eye(d)
        expected = sensitivity @ products(at) + h[:, :3] @ (omega - at) + x[6 : 6 + d]
        r = np.ones(d)
        wider = np.array([2 * np.trace(b @ wide @ b @ wide) for b in forms])
        if broad:
            r += wider
            if np.max(wider) > 1 and 9 * np.trace(wide) > at @ at:  # not used
                out.append((x[:3].copy(), p[:3, :3].copy(), 0.0, predicted, (x.copy(), p.copy()), f))
                continue
        elif curved:
            expected += [np.trace(b @ spread) for b in forms]
            r += wider
        s = h @ p @ h.T + np.diag(r)
        gain = np.linalg.solve(s, h @ p).T
        e = z[k] - expected
        x = x + gain @ e
        p = p - gain @ s @ gain.T
        out.append((x[:3].copy(), p[:3, :3].copy(), e @ np.linalg.solve(s, e), predicted, (x.copy(), p.copy()), f))
    omega, covariance, nis, predicted, filtered, transitions = (list(column) for column in zip(*out, strict=True))
    result = np.array(omega), np.array(covariance), np.array(nis)
    return (*result, predicted, filtered, transitions) if keep else result


def reference_smoother(predicted, filtered, transitions):
    """Rauch–Tung–Striebel with the full state, backwards."""
    x, p = filtered[-1]
    omega, covariance = [x[:3]], [p[:3, :3]]
    for k in range(len(filtered) - 2, -1, -1):
        before, spread = filtered[k]
        ahead, ahead_spread = predicted[k + 1]
        gain = np.linalg.solve(ahead_spread, transitions[k + 1] @ spread).T
        x = before + gain @ (x - ahead)
        p = spread + gain @ (p - ahead_spread) @ gain.T
        omega.append(x[:3])
        covariance.append(p[:3, :3])
    return np.array(omega[::-1]), np.array(covariance[::-1])
