"""What a diagnosis takes in NumPy and SciPy: the same regressions, folds, simulations and bootstrap, vectorised where NumPy
can be. It is shorter than giotto's own: no search for teeth at low speed, no duration of turns, no verdict in words.
"""
import time

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lsim
from scipy.stats import f as fisher

ORDERS = 16
PITCHES = np.geomspace(1e-3, 4e-2, 48)
DECAYS = np.geomspace(5e-3, 0.3, 12)
FREQUENCIES = np.linspace(2.0, 60.0, 64)
RESAMPLES = 1000
ALPHA = 0.05


def second_order(b1, b2):
    """ωn and ζ of the element whose circles shrink by β1, β2."""
    k2, k4 = -2 * b1, 24 * b2 - 3 * (2 * b1) ** 2
    # κ2 = −2(1−2ζ²)/ωn², κ4 = 12(8ζ⁴−8ζ²+1)/ωn⁴
    ratio = k4 / k2**2
    fit = least_squares(lambda z: 3 * (8 * z**4 - 8 * z**2 + 1) / (1 - 2 * z**2) ** 2 - ratio, 0.72, bounds=(0.708, 5))
    zeta = fit.x[0]
    return np.sqrt(max(-2 * (1 - 2 * zeta**2) / k2, 1e-9)), zeta


def profile(theta, runs, lag, extra=()):
    """Columns of all causes at all samples, one a cause and axis."""
    radius, feed, sign, started = (runs[k][:, None] for k in ("radius", "feed", "sign", "started"))
    at = theta - sign * feed / radius * lag
    c, s = np.cos(at), np.sin(at)
    one = np.ones_like(theta)
    columns = {
        "size f2_r": one * feed**2 / radius,
        "radius_offset": one,
        "scale_error": one * radius,
        "higher_order_dynamics": one * feed**4 / radius**3,
        "thermal_drift": one * radius * started,
        "joint_lag_mismatch": -0.5 * one * feed * sign,
        "scale_mismatch": 0.5 * radius * (c * c - s * s),
        "squareness": radius * s * c,
        "servo_mismatch": sign * feed * s * c,
        "bandwidth_mismatch": -0.25 * feed**2 / radius * (c * c - s * s),
        "backlash x": 0.5 * sign * np.sign(s) * c,
        "backlash y": -0.5 * sign * np.sign(c) * s,
        "lateral_play x": -0.5 * sign * np.abs(s),
        "lateral_play y": -0.5 * sign * np.abs(c),
        "straightness x": 0.25 * radius**2 * (s + np.sin(3 * at)),
        "straightness y": 0.25 * radius**2 * (c - np.cos(3 * at)),
    }
    for kind, axis, value in extra:
        name = f"{kind} {axis}"
        if kind == "reversal_spike":
            since = np.mod(sign * (at if axis == "x" else at - np.pi / 2), np.pi) * radius / feed
            columns[name] = np.exp(-since / value)
        elif kind == "cyclic_error":
            place = radius * (c if axis == "x" else s)
            columns[name] = (c if axis == "x" else s) * np.sin(2 * np.pi * place / value)
        else:
            columns[name] = np.cos(2 * np.pi * value * runs["time"])
    return columns


def without_centre(values, basis):
    """Takes off what a set-up offset does, run by run; basis is orthonormal, runs × samples × 2."""
    along = np.einsum("rsk,rs...->rk...", basis, values)
    return values - np.einsum("rsk,rk...->rs...", basis, along)


def gram(columns, misfit, basis):
    stack = without_centre(np.stack([misfit, *columns.values()], axis=2), basis)
    return np.einsum("rsi,rsj->rij", stack, stack)


def solve(g, chosen):
    a = g[np.ix_(chosen, chosen)]
    scale = np.sqrt(np.diag(a))
    b = np.linalg.solve(a / np.outer(scale, scale), g[chosen, 0] / scale)
    return b / scale, g[0, 0] - (b / scale) @ g[chosen, 0]


def stepwise(g, terms, samples, runs):
    chosen = [1]
    _, rss = solve(g, chosen)
    while len(chosen) < terms:
        best = (rss, None)
        for k in range(1, terms + 1):
            if k in chosen:
                continue
            try:
                _, trial = solve(g, chosen + [k])
            except np.linalg.LinAlgError:
                continue
            best = min(best, (trial, k), key=lambda pair: pair[0])
        free = runs - len(chosen) - 1
        # The run is the unit of replication.
        gained = (rss - best[0]) / (best[0] / free)
        if best[1] is None or gained < fisher.ppf(1 - ALPHA / terms, 1, free):
            break
        chosen, rss = chosen + [best[1]], best[0]
    return chosen, solve(g, chosen)[0]


def simulate(runs, index, theta, wn, zeta):
    """Size of a circle on the machine, in the time domain: run-in and one lap, both axes."""
    radius, feed = runs["radius"][index], runs["feed"][index]
    omega = runs["sign"][index] * feed / radius
    step = 2 * np.pi / abs(omega) / theta.shape[1]
    before = int(np.ceil(8 / (wn * min(zeta, 1.0)) / step))
    times = np.arange(-before, theta.shape[1]) * step
    a, b, c = [[0, 1], [-wn * wn, -2 * zeta * wn]], [[0], [wn * wn]], [[1, 0]]
    axes = []
    for command in (radius * np.cos(omega * times), radius * np.sin(omega * times)):
        _, y, _ = lsim((a, b, c, 0), command, times - times[0], X0=[command[0], 0.0])
        axes.append(y[before:])
    return np.hypot(*axes) - radius


def diagnose(runs, theta, deviation):
    count, samples = theta.shape
    one = np.ones_like(theta)
    for r in range(count):  # circles and harmonics of each run
        k = np.arange(1, ORDERS + 1)
        waves = np.hstack((one[r][:, None], np.cos(np.outer(theta[r], k)), np.sin(np.outer(theta[r], k))))
        np.linalg.lstsq(waves, deviation[r], rcond=None)
    basis = np.stack((np.cos(theta), np.sin(theta)), axis=2)
    basis, _ = np.linalg.qr(basis)
    size = deviation.mean(axis=1)
    omega2 = (runs["feed"] / runs["radius"]) ** 2
    lag = least_squares(lambda p: runs["radius"] * (1 / np.sqrt(1 + p[0] * 1e-6 * omega2) - 1) - size, [100.0]).x[0] * 1e-6
    base = runs["radius"] * (1 / np.sqrt(1 + lag * omega2) - 1)
    design = np.stack((omega2 * runs["radius"], omega2**2 * runs["radius"]), axis=1)
    b1, b2 = np.linalg.lstsq(design, size, rcond=None)[0]
    wn, zeta = second_order(b1, b2)
    delay = 2 * zeta / wn
    misfit = deviation - base[:, None]
    plain = profile(theta, runs, delay)
    names = list(plain)
    rough = gram(plain, misfit, basis)
    chosen, sizes = stepwise(rough.sum(axis=0), len(names), samples, count)
    left = misfit - sum(size * plain[names[k - 1]] for k, size in zip(chosen, sizes))
    left = without_centre(left, basis)
    extra = []
    shapes = [("reversal_spike", axis, DECAYS) for axis in "xy"] + [("cyclic_error", axis, PITCHES) for axis in "xy"]
    for kind, axis, values in shapes + [("vibration", "-", FREQUENCIES)]:  # the shape that fits what is left best
        gains = []
        for value in values:
            column = without_centre(list(profile(theta, runs, delay, [(kind, axis, value)]).values())[-1], basis)
            gains.append((column * left).sum() ** 2 / (column**2).sum())
        extra.append((kind, axis, values[int(np.argmax(gains))]))
    columns = profile(theta, runs, delay, extra)
    names = list(columns)
    grams = gram(columns, misfit, basis)
    whole = grams.sum(axis=0)
    chosen, sizes = stepwise(whole, len(names), samples, count)
    found = {names[k - 1]: size for k, size in zip(chosen, sizes)}
    errors = np.full((count, 2), np.nan)
    folds = 0
    for key in ("radius", "feed"):
        for value in np.unique(runs[key]):
            out = np.flatnonzero(runs[key] == value)
            kept = np.setdiff1d(np.arange(count), out)
            inside, fold = stepwise(grams[kept].sum(axis=0), len(names), samples, len(kept))
            fb = np.linalg.lstsq(design[kept], size[kept], rcond=None)[0]
            fwn, fzeta = second_order(*fb)
            for r in out:
                pure = simulate(runs, r, theta, fwn, fzeta)
                named = [(k, v) for k, v in zip(inside, fold) if names[k - 1] not in ("size f2_r", "higher_order_dynamics")]
                extended = pure + sum(v * columns[names[k - 1]][r] for k, v in named)
                for column, model in enumerate((np.full(samples, base[r]), extended)):
                    rest = without_centre((deviation[r] - model)[None], basis[r : r + 1])
                    errors[r, column] = np.nanmean([errors[r, column], (rest**2).mean()])
            folds += 1
    draws = np.random.default_rng(1).integers(0, count, (RESAMPLES, count))
    gains = 100 * (1 - np.sqrt(errors[draws, 1].mean(axis=1) / errors[draws, 0].mean(axis=1)))
    return found, folds, np.percentile(gains, [2.5, 97.5])


def run(data):
    from_file = lambda name: np.fromfile(data[name])
    runs = {name: from_file(name) for name in ("radius", "feed", "sign", "started")}
    count = len(runs["radius"])
    theta, deviation = from_file("theta").reshape(count, -1), from_file("deviation").reshape(count, -1)
    start = time.perf_counter()
    period = 2 * np.pi * runs["radius"] / runs["feed"]
    runs["time"] = runs["started"][:, None] + period[:, None] * np.linspace(0, 1, theta.shape[1], endpoint=False)
    found, folds, interval = diagnose(runs, theta, deviation)
    seconds = time.perf_counter() - start
    wanted = [found.get(name, 0.0) for name in ("squareness", "scale_mismatch", "backlash x")]
    return seconds, [*map(float, wanted), float(folds), *map(float, interval), float(len(found))]
