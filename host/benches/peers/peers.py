"""What people would otherwise use, timed on the same data: one request a line on stdin, one answer a line on stdout.

Request: {"peer": NAME, "times": N, "data": {...}}; answer: {"seconds": S, "value": [...]}, S the mean of the N times in a
row. Loading the data is not timed, except where reading is the work. Each peer is given what makes it fast: analytic
Jacobians, contiguous arrays, all cores.
"""
import glob
import json
import sys
import time
from importlib.metadata import version

import circle_fit
import numpy as np
import pandas as pd
import polars as pl
import statsmodels.api as sm
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.signal import lsim

loaded = {}


def array(path):
    if path not in loaded:
        if len(loaded) > 8:
            loaded.clear()
        loaded[path] = np.fromfile(path)
    return loaded[path]


def circle_scipy(data):
    x, y = array(data["x"]), array(data["y"])
    start = time.perf_counter()
    centre = np.array([x.mean(), y.mean()])
    radius = np.hypot(x - centre[0], y - centre[1]).mean()

    def residuals(p):
        return np.hypot(x - p[0], y - p[1]) - p[2]

    def jacobian(p):
        u, v = x - p[0], y - p[1]
        d = np.hypot(u, v)
        return np.column_stack((-u / d, -v / d, np.full_like(d, -1.0)))

    fit = least_squares(residuals, [*centre, radius], jac=jacobian, method="lm", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    return time.perf_counter() - start, list(fit.x)


def circle_circle_fit(data):
    points = np.column_stack((array(data["x"]), array(data["y"])))
    start = time.perf_counter()
    # Its geometric fit needs a start; its own fast algebraic circle gives it.
    x, y, r, _ = circle_fit.taubinSVD(points)
    x, y, r, _ = circle_fit.lm(points, np.array([x, y, r]))
    return time.perf_counter() - start, [float(x), float(y), float(r)]


def stepwise_statsmodels(data):
    """Selection by partial F, intervals of both terms and of κ4/κ2² = 6β2/β1² − 3, and the scatter."""
    feed, radius, y = array(data["feed"]), array(data["radius"]), array(data["error"])
    start = time.perf_counter()
    columns = {"f2_r": feed**2 / radius, "f4_r3": feed**4 / radius**3}
    one = np.ones_like(y)
    design = lambda names: np.column_stack([one] + [columns[n] for n in names])
    inside, fit = [], sm.OLS(y, one).fit()
    while True:
        trials = {n: sm.OLS(y, design(inside + [n])).fit() for n in columns if n not in inside}
        if not trials:
            break
        gain = {n: trial.compare_f_test(fit) for n, trial in trials.items()}
        best = max(gain, key=lambda n: gain[n][0])
        if gain[best][1] > 0.05:
            break
        inside, fit = inside + [best], trials[best]
        weakest = min(inside, key=lambda n: abs(fit.tvalues[1 + inside.index(n)]))
        if fit.pvalues[1 + inside.index(weakest)] > 0.05:
            inside = [n for n in inside if n != weakest]
            fit = sm.OLS(y, design(inside)).fit()
    interval = fit.conf_int(0.05)
    value = []
    for name in columns:
        at = 1 + inside.index(name)
        value += [fit.params[at], interval[at][0], interval[at][1]]
    places = [1 + inside.index(name) for name in columns]
    b1, b2 = fit.params[places]
    slope = np.array([-12 * b2 / b1**3, 6 / b1**2])
    t = (interval[places[0]][1] - b1) / fit.bse[places[0]]
    half = t * np.sqrt(slope @ fit.cov_params()[np.ix_(places, places)] @ slope)
    ratio = 6 * b2 / b1**2 - 3
    offset = fit.params[0]
    rms = np.sqrt(fit.ssr / len(y))
    value += [ratio - half, ratio + half, offset, np.sqrt(fit.scale), rms]
    return time.perf_counter() - start, [float(v) for v in value]


def csv_pandas(data):
    start = time.perf_counter()
    # The whole campaign is kept, as the others keep it.
    frames = [pd.read_csv(file) for file in sorted(glob.glob(data["directory"] + "/*.csv"))]
    total = sum(frame["deviation_um"].to_numpy()[-1] for frame in frames)
    rows = sum(len(frame) for frame in frames)
    return time.perf_counter() - start, [rows, float(total)]


def csv_polars(data):
    start = time.perf_counter()
    files = sorted(glob.glob(data["directory"] + "/*.csv"))
    frames = pl.collect_all([pl.scan_csv(file) for file in files])
    total = sum(frame["deviation_um"][-1] for frame in frames)
    rows = sum(frame.height for frame in frames)
    return time.perf_counter() - start, [rows, float(total)]


def plant(data):
    """Both axes of a position loop with second-order mechanics, as one state space; command and run-in of ten lags."""
    kv, wn, zeta = data["kv"], data["omega_n"], data["zeta"]
    n, radius, feed = data["samples"], data["radius"], data["feed"]
    a = np.array([[-kv, 0, 0], [0, 0, wn], [wn, -wn, -2 * zeta * wn]])
    b, c = np.array([kv, 0, 0]), np.array([0, 1.0, 0])
    turn = 2 * np.pi * radius / feed
    step = turn / n
    before = int(np.ceil(10 / kv / step))
    times = np.arange(-before, n) * step
    phase = feed / radius * times
    return a, b, c, times, before, radius, phase


def plant_lsim(data):
    start = time.perf_counter()
    a, b, c, times, before, radius, phase = plant(data)
    system = (a, b[:, None], c[None, :], np.zeros((1, 1)))
    axes = []
    for command in (radius * np.cos(phase), radius * np.sin(phase)):
        rest = np.array([command[0], command[0], 0.0])
        _, y, _ = lsim(system, command, times - times[0], X0=rest)
        axes.append(y[before:])
    deviation = np.hypot(*axes) - radius
    return time.perf_counter() - start, [float(deviation.mean())]


def plant_solve_ivp(data):
    start = time.perf_counter()
    a, b, c, times, before, radius, phase = plant(data)
    rate = phase[1] / times[1] if times[1] else phase[0] / times[0]
    axes = []
    for wave in (np.cos, np.sin):
        rest = radius * wave(phase[0])
        right = lambda t, x: a @ x + b * (radius * wave(rate * t))
        solved = solve_ivp(
            right, (times[0], times[-1]), [rest, rest, 0.0], method="DOP853", t_eval=times[before:], rtol=1e-8, atol=1e-9
        )
        axes.append(solved.y[1])
    deviation = np.hypot(*axes) - radius
    return time.perf_counter() - start, [float(deviation.mean())]


PEERS = {
    "lsim": plant_lsim,
    "solve_ivp": plant_solve_ivp,
    "scipy": circle_scipy,
    "circle-fit": circle_circle_fit,
    "statsmodels": stepwise_statsmodels,
    "pandas": csv_pandas,
    "polars": csv_polars,
}


def versions():
    names = ["numpy", "scipy", "statsmodels", "circle-fit", "pandas", "polars"]
    return {"python": sys.version.split()[0], **{name: version(name) for name in names}}


print(json.dumps({"versions": versions()}), flush=True)
for line in sys.stdin:
    request = json.loads(line)
    answers = [PEERS[request["peer"]](request["data"]) for _ in range(request["times"])]
    seconds, value = sum(seconds for seconds, _ in answers) / len(answers), answers[-1][1]
    print(json.dumps({"seconds": seconds, "value": value}), flush=True)
