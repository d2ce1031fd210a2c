"""The machine in the time domain, and the proof on runs left out.

Linear chains are stepped exactly (matrix exponential under a command that is cubic within a step); backlash and friction
follow the axis through its turning points. All circles of all folds move side by side: a row is one axis of one circle.
"""
import copy
from dataclasses import dataclass, field

import numpy as np
from circles import Response, fit_lag
from ledger import columns_of, prune, select, solve
from scipy.signal import lfilter

RUN_IN_TIME_CONSTANTS, RUN_IN_TURNS = 32.0, 0.75
# Pieces of a step in which friction turns its sign; travel back after which a reversal counts, m.
PIECES, REVERSAL_TRAVEL_M = 8, 1e-8
RESAMPLES = 1000
# Derivatives of a cubic in Hermite form at its start, from position and velocity (in steps) at both ends.
CUBIC = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [-6, -4, 6, -2], [12, 6, -12, 6]])


@dataclass
class Friction:
    peak_m: float = 0.0
    decay_s: float = 0.02
    rise_s: float = 0.0
    presliding_m: float = 0.0
    stick_slip_m: float = 0.0
    stick_travel_m: float = 1e-3
    stick_speed_m_s: float = 5e-3


def _zeros():
    return np.zeros(2)


@dataclass
class Machine:
    """Two axes; every element is off at first."""

    lag_s: np.ndarray = field(default_factory=_zeros)
    feed_forward: np.ndarray = field(default_factory=_zeros)
    # ωn and ζ of mechanics; ωn 0: none.
    omega_n: np.ndarray = field(default_factory=_zeros)
    zeta: np.ndarray = field(default_factory=lambda: np.ones(2))
    dead_time_s: np.ndarray = field(default_factory=_zeros)
    backlash_m: np.ndarray = field(default_factory=_zeros)
    lateral_play_m: np.ndarray = field(default_factory=_zeros)
    scale: np.ndarray = field(default_factory=_zeros)
    straightness_per_m: np.ndarray = field(default_factory=_zeros)
    friction: list = field(default_factory=lambda: [None, None])
    # Amplitude, pitch and phase.
    cyclic: list = field(default_factory=lambda: [None, None])
    squareness_rad: float = 0.0
    thermal_per_s: float = 0.0
    thermal_settling_s: float = 0.0
    cross_lag_s: float = 0.0
    radius_offset_m: float = 0.0
    centripetal_limit_m_s2: float = np.inf

    @staticmethod
    def of(response):
        """Elements whose cumulants are those of the response."""
        machine = Machine()
        a, b = response.a_s2, response.b_s4
        if a > 0:
            machine.lag_s[:] = np.sqrt(a)
            if b > 0:
                machine.lag_s[:] = 0
                machine.set_mechanics(b**-0.5, 0.5 + 0.25 * a * b**-0.5)
            elif b < 0:
                c2 = -b / a
                machine.lag_s[:], machine.feed_forward[:] = np.sqrt(a + c2), np.sqrt(c2 / (a + c2))
        elif a or b:
            k2, k4 = a, 6 * a * a - 12 * b
            if k4 < 3 * k2 * k2:
                machine.set_cumulants(k2, k4)
            else:
                p = (k2 + np.sqrt(2 * k4 - 2 * k2 * k2)) / 3
                machine.lag_s[:] = np.sqrt(p)
                machine.set_cumulants(k2 - p, k4 - 6 * p * p)
        return machine

    def set_mechanics(self, omega_n2, zeta2):
        self.omega_n[:], self.zeta[:] = np.sqrt(omega_n2), np.sqrt(max(zeta2, 1e-4))

    def set_cumulants(self, k2, k4):
        omega_n2 = np.sqrt(12 / (6 * k2 * k2 - k4))
        self.set_mechanics(omega_n2, 0.5 * (1 + 0.5 * k2 * omega_n2))

    def delay(self, delta_s):
        """Delays X by so much more than Y."""
        self.dead_time_s += np.maximum([delta_s, -delta_s], 0)

    def split_lag(self, delta_s):
        split = self.lag_s + [0.5 * delta_s, -0.5 * delta_s]
        if (self.lag_s > 0).all() and (split > 0).all():
            self.lag_s = split
        else:
            self.delay(delta_s)

    def split_bandwidth(self, delta_s2):
        """Gives X a second cumulant larger than Y's and the same delay."""
        delay = np.zeros(2)
        for axis, share in enumerate((0.5 * delta_s2, -0.5 * delta_s2)):
            lag, omega_n, zeta = self.lag_s[axis], self.omega_n[axis], self.zeta[axis]
            square = lag * lag + share
            if (square <= 0 or lag == 0) and omega_n:
                self.zeta[axis] = np.sqrt(max(zeta**2 + 0.25 * share * omega_n**2, 1e-4))
                delay[axis] = 2 * (self.zeta[axis] - zeta) / omega_n
            elif square > 0:
                self.lag_s[axis] = np.sqrt(square)
                delay[axis] = self.lag_s[axis] - lag
        self.delay(delay[1] - delay[0])

    def settling_s(self):
        """Slowest time constant of each axis."""
        root = np.sqrt(np.maximum(self.zeta**2 - 1, 0))
        slow = np.where(root > 0, self.zeta + root, 1 / self.zeta)
        return np.maximum(self.lag_s, np.where(self.omega_n > 0, slow / np.where(self.omega_n > 0, self.omega_n, 1), 0))

    def apply(self, kind, values, runs):
        """Puts an explanation of these amounts in."""
        name, axis, shape = kind
        value = values[0]
        if name == "radius_offset":
            self.radius_offset_m += 1e-3 * value
        elif name == "scale_error":
            self.scale += 1e-6 * value
        elif name == "scale_mismatch":
            self.scale += np.array([0.5e-6, -0.5e-6]) * value
        elif name == "squareness":
            self.squareness_rad += 1e-6 * value
        elif name == "servo_mismatch":
            self.split_lag(value) if shape[0] > 0.5 else self.delay(value)
        elif name == "bandwidth_mismatch":
            self.split_bandwidth(value)
        elif name == "backlash":
            self.backlash_m[axis] += 1e-3 * value
        elif name == "lateral_play":
            self.lateral_play_m[axis] += 1e-3 * value
        elif name == "reversal_spike":
            self.friction[axis] = Friction(1e-6 * value, *shape)
        elif name == "cyclic_error":
            self.cyclic[axis] = (1e-6 * np.hypot(*values), shape[0], np.arctan2(values[1], values[0]))
        elif name == "straightness":
            self.straightness_per_m[axis] += 1e-6 * value / runs.largest**2
        elif name == "thermal_drift":
            settling = 1 / shape[0] if shape[0] > 1e-3 else 0.0
            steeper = 1 / (settling * (1 - np.exp(-1 / settling))) if settling else 1.0
            self.thermal_per_s = 1e-6 * value * steeper / runs.campaign_s
            self.thermal_settling_s = settling * runs.campaign_s
        elif name == "joint_lag_mismatch":
            self.cross_lag_s += value

    def stick(self, teeth):
        friction = copy.copy(self.friction[teeth.axis] or Friction())
        friction.stick_slip_m += teeth.height_m
        # It stands still between slips.
        friction.stick_travel_m = max(abs(friction.stick_slip_m), 1e-7)
        friction.stick_speed_m_s = teeth.below_m_s
        self.friction[teeth.axis] = friction


def exponential(matrices):
    """Exponentials of a stack of small matrices, by scaling, a Taylor series and squaring."""
    halvings = max(int(np.ceil(np.log2(np.abs(matrices).sum(axis=2).max()))) + 2, 0)
    scaled = matrices / 2.0**halvings
    out = term = np.broadcast_to(np.eye(matrices.shape[1]), matrices.shape)
    for k in range(1, 15):
        term = term @ scaled / k
        out = out + term
    for _ in range(halvings):
        out = out @ out
    return out


def chains(lag_s, feed_forward, omega_n, zeta):
    """ẋ = A x + B u, y = C x + D u of loops and mechanics, states lag, position and velocity/ωn."""
    rows = len(lag_s)
    a, b, c = np.zeros((rows, 3, 3)), np.zeros((rows, 3)), np.zeros((rows, 3))
    d = np.ones(rows)
    lag = lag_s > 0
    k = 1 / lag_s[lag]
    a[lag, 0, 0], b[lag, 0] = -k, k
    c[lag, 0], d[lag] = 1 - feed_forward[lag], feed_forward[lag]
    m = omega_n > 0
    w = omega_n[m]
    a[m, 2, 0], b[m, 2] = w * c[m, 0], w * d[m]
    a[m, 1, 2], a[m, 2, 1], a[m, 2, 2] = w, -w, -2 * zeta[m] * w
    c[m], d[m] = [0, 1, 0], 0
    return a, b, c, d


def circles(machines, runs, rows):
    """Deviation (m) over one lap in the steady state of machines on the circles of runs `rows`, sample by sample."""
    n, radius = runs.samples, runs.radius[rows]
    of = lambda name: np.array([getattr(machine, name) for machine in machines])
    feed = np.minimum(runs.programmed[rows], np.sqrt(of("centripetal_limit_m_s2") * radius))
    omega, turn_s = runs.sign[rows] * feed / radius, 2 * np.pi * radius / feed
    # X of every circle, then Y.
    axes = lambda values: np.concatenate((values[:, 0], values[:, 1]))
    both = lambda values: np.concatenate((values, values))
    way, omega, h = both(runs.sign[rows]), both(omega), both(turn_s / n)
    amplitude = both(radius * np.exp(1j * runs.theta[rows, 0])) * np.repeat([1, -1j], len(rows))
    dead_time_s = axes(of("dead_time_s"))
    settling_s = axes(np.array([machine.settling_s() for machine in machines]))
    run_in = np.ceil((dead_time_s + RUN_IN_TIME_CONSTANTS * settling_s) / h + RUN_IN_TURNS * n).astype(int)
    parameters = [axes(of(name)) for name in ("lag_s", "feed_forward", "omega_n", "zeta")]
    motion = Motion(parameters, h, omega, amplitude, way, run_in, n)
    late = dead_time_s / h
    friction = [machine.friction[axis] for axis in range(2) for machine in machines]
    backlash_m, lateral_m = axes(of("backlash_m")), axes(of("lateral_play_m"))
    cross_lag_s = of("cross_lag_s")
    remembers = (backlash_m != 0) | (lateral_m != 0) | np.array([one is not None for one in friction])
    position = motion.position()
    moving = remembers | (late > 0) | both(cross_lag_s != 0)
    velocity = motion.velocity(moving)
    # A sample lies so much of a step behind the beginning of the one before it, late by the dead time.
    whole = np.ceil(late).astype(int)
    share = (whole - late)[:, None]
    first = motion.longest - whole
    drive, speed = position[:, motion.longest : motion.longest + n].copy(), np.zeros((len(late), n))
    for row in np.flatnonzero(moving):
        p, v = (values[row, first[row] : first[row] + n + 1] for values in (position, velocity))
        drive[row], speed[row] = hermite(p[:-1], v[:-1], p[1:], v[1:], h[row], share[row])
    error, sign = np.zeros_like(drive), np.sign(speed)
    if remembers.any():
        at = np.flatnonzero(remembers)
        memory = Memory(position[at], velocity[at], h[at], share[at], first[at], drive[at])
        error[at] = memory.play(backlash_m[at])
        turn_m, late_turn = memory.reversal()
        sign[at] *= late_turn
        rubbing = [k for k, row in enumerate(at) if friction[row] is not None]
        if rubbing:
            rough, own = at[rubbing], [friction[at[k]] for k in rubbing]
            behind_m = sign[rough] * teeth(own, speed[rough], drive[rough] - turn_m[rubbing])
            error[rough] -= memory.pulses(rubbing, own) + behind_m
    (x, y), (ex, ey), (vx, vy), (sx, sy) = (np.split(values, 2) for values in (drive, error, speed, sign))
    time_s = runs.started[rows][:, None] + turn_s[:, None] / n * np.arange(n)
    slope, settling = of("thermal_per_s")[:, None], of("thermal_settling_s")[:, None]
    settled = np.where(settling > 0, settling, 1)
    growth = slope * np.where(settling > 0, settled * -np.expm1(-time_s / settled), time_s)
    scale, bow, shift = of("scale"), of("straightness_per_m"), of("lateral_play_m")
    shear, cross = 0.5 * of("squareness_rad")[:, None], 0.5 * cross_lag_s[:, None]
    tool_x = x + ex + x * (scale[:, :1] + growth) + y * shear + bow[:, 1:] * y * y - 0.5 * shift[:, 1:] * sy - cross * vy
    tool_y = y + ey + y * (scale[:, 1:] + growth) + x * shear + bow[:, :1] * x * x + 0.5 * shift[:, :1] * sx + cross * vx
    for axis, (tool, place) in enumerate(((tool_x, x), (tool_y, y))):
        for k, machine in enumerate(machines):
            if machine.cyclic[axis]:
                size_m, pitch_m, phase = machine.cyclic[axis]
                tool[k] += size_m * np.sin(2 * np.pi / pitch_m * place[k] + phase)
    return np.hypot(tool_x, tool_y) - radius[:, None] + of("radius_offset_m")[:, None]


def hermite(p0, v0, p1, v1, h, s):
    """Position and velocity of a cubic at share s of the way."""
    m0, m1 = v0 * h, v1 * h
    a, b = 3 * (p1 - p0) - 2 * m0 - m1, 2 * (p0 - p1) + m0 + m1
    return p0 + s * (m0 + s * (a + s * b)), (m0 + s * (2 * a + 3 * s * b)) / h


class Motion:
    """The linear part of every axis, stepped exactly, as a difference equation of its output.

    The command is cubic within a step, through position and velocity of the circle at both ends; over the steps it is one
    complex input. The axis starts from rest at the origin; the columns are steps, the lap begins at `longest`.
    """

    def __init__(self, parameters, h, omega, amplitude, way, run_in, n):
        a, b, self.c, self.d = chains(*parameters)
        self.run_in, self.longest, self.way = run_in, run_in.max(), way
        augmented = np.zeros((len(a), 7, 7))
        augmented[:, :3, :3], augmented[:, :3, 3] = a * h[:, None, None], b * h[:, None]
        augmented[:, [3, 4, 5], [4, 5, 6]] = 1
        stepped = exponential(augmented)
        # States that are not used stay zero.
        used = np.diagonal(a, axis1=1, axis2=2) != 0
        used[:, 1] = used[:, 2]
        self.order = used.sum(axis=1)
        phi = stepped[:, :3, :3] * used[:, None, :]
        turn = np.exp(1j * omega * h)[:, None]
        rate = 1j * (omega * h)[:, None]
        ends = np.concatenate((np.ones_like(turn), rate, turn, rate * turn), axis=1)
        drive = ((stepped[:, :3, 3:] @ CUBIC) @ ends[:, :, None]) * amplitude[:, None, None]
        # Faddeev and LeVerrier: det(z − Φ) and adj(z − Φ)·drive, on the input of the step.
        adjoint, self.poles, self.input = np.broadcast_to(np.eye(3), phi.shape), [np.ones(len(a))], 0
        for k in range(1, 4):
            self.input = self.input + (adjoint @ drive)[:, :, 0] * turn**-k
            adjoint = phi @ adjoint
            self.poles.append(-np.trace(adjoint, axis1=1, axis2=2) / k)
            adjoint = adjoint + self.poles[-1][:, None, None] * np.eye(3)
        self.poles = np.stack(self.poles, axis=1)
        # Rows of the same chain and step go together.
        _, self.group = np.unique(np.column_stack((self.poles, run_in)), axis=0, return_inverse=True)
        self.turns = np.exp(2j * np.pi / n * np.arange(-self.longest, n + 1))
        self.command, self.rates = amplitude, (1j * omega * amplitude)
        self.slopes = np.einsum("rji,rj->ri", a, self.c)
        self.through = (self.c * b).sum(axis=1)

    def position(self):
        return self._output(self.c, self.d * self.command, slice(None))

    def velocity(self, rows):
        """Of some rows; 0 of the others."""
        return self._output(self.slopes, self.through * self.command + self.d * self.rates, np.flatnonzero(rows))

    def _output(self, weights, direct, rows):
        wave = lambda of, rows: np.multiply.outer(of.real[rows], self.turns.real) - np.multiply.outer(
            (self.way * of.imag)[rows], self.turns.imag
        )
        out = np.zeros((len(self.c), len(self.turns)))
        out[rows] = wave((weights * self.input).sum(axis=1), rows)
        chosen = np.arange(len(out))[rows]
        for group in np.unique(self.group[chosen]):
            own = chosen[self.group[chosen] == group]
            poles = self.poles[own[0], : 1 + self.order[own[0]]]
            begin = self.longest - self.run_in[own[0]]
            out[own, :begin] = 0
            out[own, begin:] = lfilter([1.0], poles, out[own, begin:], axis=1)
        direct_rows = chosen[direct[chosen] != 0]
        out[direct_rows] += wave(direct, direct_rows)
        return out


class Memory:
    """What axes remember of their way, through their turning points."""

    def __init__(self, position, velocity, h, share, first, drive):
        self.position, self.velocity, self.h, self.share, self.first = position, velocity, h, share, first
        self.drive, self.window = drive, first[:, None] + np.arange(drive.shape[1])
        # The extreme within a step, or its beginning; the share of the step at which it lies.
        self.extreme = position[:, :-1].copy()
        self.turn = np.full(self.extreme.shape, np.inf)
        row, k = np.nonzero(velocity[:, :-1] * velocity[:, 1:] < 0)
        p0, p1, m0, m1 = position[row, k], position[row, k + 1], velocity[row, k] * h[row], velocity[row, k + 1] * h[row]
        a, b = 3 * (p1 - p0) - 2 * m0 - m1, 2 * (p0 - p1) + m0 + m1
        # Velocity·h = c + 2a·s + 3b·s², of which one root lies within.
        q = -(a + np.copysign(np.sqrt(np.maximum(a * a - 3 * b * m0, 0)), a))
        with np.errstate(divide="ignore", invalid="ignore"):
            s, other = m0 / q, q / (3 * b)
        s = np.where((s >= 0) & (s <= 1), s, other)
        self.turn[row, k] = s
        self.extreme[row, k] = p0 + s * (m0 + s * (a + s * b))
        # Whether the samples lie behind a turning point of their step.
        self.turned = np.take_along_axis(self.turn, self.window, axis=1) <= share

    def play(self, backlash_m):
        """What backlash adds at the samples."""
        gap = 0.5 * np.abs(backlash_m)
        loads = np.empty((self.extreme.shape[1], len(gap)))
        load = self.position[:, 0].copy()
        steps = zip(loads, (self.extreme - gap[:, None]).T.copy(), (self.extreme + gap[:, None]).T.copy())
        ends = zip((self.position[:, 1:] - gap[:, None]).T.copy(), (self.position[:, 1:] + gap[:, None]).T.copy())
        for (before, low, high), (end_low, end_high) in zip(steps, ends):
            before[:] = load
            np.minimum(np.maximum(load, low, out=load), high, out=load)
            np.minimum(np.maximum(load, end_low, out=load), end_high, out=load)
        load = np.take_along_axis(loads.T, self.window, axis=1)
        extreme = np.take_along_axis(self.extreme, self.window, axis=1)
        gap = gap[:, None]
        load = np.where(self.turned, np.clip(load, extreme - gap, extreme + gap), load)
        load = np.clip(load, self.drive - gap, self.drive + gap)
        return (load - self.drive) * np.where(backlash_m < 0, -1, 1)[:, None]

    def reversal(self):
        """Where the axis last reversed before each sample, and −1 where it turns but has not come back far enough to count."""
        turns = np.isfinite(self.turn)
        number = np.cumsum(turns, axis=1)
        places = np.zeros((len(turns), number.max() + 2))
        places[:, 0] = self.position[:, 0]
        row, k = np.nonzero(turns)
        places[row, number[row, k]] = self.extreme[row, k]
        last = np.take_along_axis(number, self.window - 1, axis=1) + self.turned
        place = np.take_along_axis(places, last, axis=1)
        close = np.abs(self.drive - place) <= REVERSAL_TRAVEL_M
        before = np.take_along_axis(places, np.maximum(last - 1, 0), axis=1)
        return np.where(close, before, place), np.where(close, -1, 1)

    def pulses(self, rows, friction):
        """What friction takes away at the samples after reversals."""
        peak_m, decay_s, rise_s, presliding_m = (
            np.array([getattr(one, name) for one in friction]) for name in ("peak_m", "decay_s", "rise_s", "presliding_m")
        )
        rub = Rub(presliding_m, decay_s, rise_s, self.position[rows, 0])
        position, velocity, turn = self.position[rows].T, self.velocity[rows].T, self.turn[rows].T
        share, h, first = self.share[rows, 0], self.h[rows], self.first[rows]
        answers, columns = np.empty_like(self.drive[rows]), np.arange(len(rows))
        for k in range(len(turn)):
            cubic = position[k], velocity[k], position[k + 1], velocity[k + 1]
            rub.follow(cubic, h, np.zeros_like(share), share, turn[k])
            sample = k - first
            inside = (sample >= 0) & (sample < answers.shape[1])
            answers[columns[inside], sample[inside]] = (rub.answers[0] - rub.answers[1])[inside]
            rub.follow(cubic, h, share, np.ones_like(share), turn[k])
        # Peak of e^{−t/decay} − e^{−t/rise}; 1 where it rises at once.
        sudden = rise_s <= 0
        rise_s = np.where(sudden, 0.5, np.minimum(rise_s / decay_s, 0.95)) * decay_s
        peak_s = np.log(decay_s / rise_s) * decay_s * rise_s / (decay_s - rise_s)
        highest = np.where(sudden, 1, np.exp(-peak_s / decay_s) - np.exp(-peak_s / rise_s))
        return answers * (0.5 * peak_m / highest)[:, None]


def teeth(friction, speed, since_m):
    """How far axes fall behind while they are slow, so far from their last reversal."""
    height_m, travel_m, speed_m_s = (
        np.array([getattr(one, name) for one in friction])[:, None]
        for name in ("stick_slip_m", "stick_travel_m", "stick_speed_m_s")
    )
    travel = np.abs(since_m) / travel_m
    return height_m * np.exp(-((speed / speed_m_s) ** 2)) * (travel - np.floor(travel))


class Rub:
    """Friction follows the travel, the loop follows the friction."""

    def __init__(self, presliding_m, decay_s, rise_s, position_m):
        self.presliding_m, self.time_s = presliding_m, np.stack((decay_s, rise_s))
        self.slide, self.answers, self.last = np.zeros_like(decay_s), np.zeros((2, len(decay_s))), position_m.copy()

    def follow(self, cubic, h, begin, end, turn):
        """Goes along a step, by way of its turning point and, while friction is turning its sign, in pieces."""
        turning = (self.presliding_m > 0) & (np.abs(self.slide) < 0.999)
        here = (turn > begin) & (turn <= end)
        if here.any():
            rows = np.flatnonzero(here)
            self._visit(rows, cubic, h, begin, np.where(here, turn, begin))
            begin, turning = np.where(here, turn, begin), turning | here
        straight = np.flatnonzero(~turning)
        self._visit(straight, cubic, h, begin, end)
        rows = np.flatnonzero(turning)
        for piece in range(PIECES if len(rows) else 0):
            self._visit(rows, cubic, h, begin + (end - begin) * piece / PIECES, begin + (end - begin) * (piece + 1) / PIECES)

    def _visit(self, rows, cubic, h, begin, end):
        x = hermite(*(values[rows] for values in cubic), h[rows], end[rows])[0]
        step_s = (h * (end - begin))[rows]
        travel, before = x - self.last[rows], self.slide[rows]
        self.last[rows] = x
        turned = np.where(travel == 0, before, np.sign(travel))
        presliding_m = self.presliding_m[rows]
        stay = np.where(presliding_m > 0, np.exp(-np.abs(travel) / np.where(presliding_m > 0, presliding_m, 1)), 0)
        after = turned + (before - turned) * stay
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = step_s / self.time_s[:, rows]
            keep = np.exp(-ratio)
            # A change spread evenly over the step, or with it all at its beginning.
            take = np.where(stay == 0, keep, np.where(ratio > 1e-9, (1 - keep) / ratio, 1))
        gone = self.time_s[:, rows] == 0
        keep, take = np.where(gone, 0, keep), np.where(gone, 0, take)
        self.answers[:, rows] = keep * self.answers[:, rows] + take * (after - before)
        self.slide[rows] = after


@dataclass
class Gain:
    """Root mean squares over runs left out, µm, and what they say, %."""

    extended_rms_um: float
    baseline_rms_um: float
    beta_rms_um: float
    no_model_rms_um: float
    floor_rms_um: float
    percent: float
    ci95_percent: np.ndarray
    of_perfect_percent: float
    folds: tuple


def fitted(found, weights, chosen):
    """The machine that a set gives when it is fitted on some runs only."""
    columns = columns_of(found.nuisance, found.items, chosen)
    solution = solve(found.ledger.white(weights), columns)
    if solution is None:
        return None
    amount = dict(zip(columns, solution.coefficients))
    response = Response(found.response.a_s2 + amount[found.nuisance[0]])
    kinds = [(found.items[item].kind, [amount[column] for column in found.items[item].columns]) for item in chosen]
    for kind, values in kinds:
        if kind.name == "higher_order_dynamics":
            response.b_s4 = -2 * values[0]
    machine = Machine.of(response)
    if found.lag.measured:
        # What the recording shows of delay beyond that of the response is dead time.
        own = machine.lag_s[0] * (1 - machine.feed_forward[0])
        own += 2 * machine.zeta[0] / machine.omega_n[0] if machine.omega_n[0] else 0
        machine.dead_time_s[:] = max(found.lag.tau_s - own, 0)
    for kind, values in kinds:
        machine.apply(kind, values, found.runs)
    for teeth in found.teeth:
        machine.stick(teeth)
    return machine


def measure_gain(found, deviation_m, clamp_m_s2, seed):
    """Leaves out each radius once, then each speed; the causes are chosen again on the runs that are left, with their sizes."""
    runs = found.runs
    groups = [[np.abs(of - value) < 1e-9 * value for value in np.unique(of)] for of in (runs.radius, runs.programmed)]
    groups = [of if len(of) > 1 else [] for of in groups]
    left_out = np.array(groups[0] + groups[1])
    if not len(left_out):
        return None
    weights = (~left_out).astype(float)
    size_m, omega = deviation_m.mean(axis=1), runs.programmed / runs.radius
    lags = fit_lag(size_m, runs.radius, omega, weights)
    betas = fit_beta(size_m, runs.radius, omega, weights)
    machines, extended = [Machine.of(Response(a)) for a in lags], []
    for weight in weights:
        barred = []
        chosen, _ = select(found.ledger.white(weight), found.nuisance, found.items, found.chosen)
        samples = weight.sum() * runs.samples
        chosen = prune(found, found.ledger.plain(weight), samples, weight.mean(), chosen, barred)
        # A pattern without a name has no place in the simulation, but it must not bend the causes.
        nothing_new = clamp_m_s2 is None and not found.teeth and not any(found.items[i].kind.listed for i in chosen)
        machine = None if nothing_new else fitted(found, weight, sorted(chosen))
        if machine and clamp_m_s2 is not None:
            machine.centripetal_limit_m_s2 = clamp_m_s2
        extended.append(machine)
    fold, run = np.nonzero(left_out)
    anew = np.array([extended[k] is not None for k in fold])
    simulated = circles(
        [machines[k] for k in fold] + [extended[k] for k in fold[anew]], runs, np.concatenate((run, run[anew]))
    )
    basis, samples = runs.whole_basis[run][:, 1:3], runs.samples

    def left(prediction_m):
        # The centre is the operator's.
        rest = deviation_m[run] - prediction_m
        centre = (basis @ rest[:, :, None])[:, :, 0]
        return np.maximum((rest * rest).sum(axis=1) - (centre * centre).sum(axis=1), 0) / samples

    baseline = left(simulated[: len(run)])
    predicted = simulated[: len(run)].copy()
    predicted[anew] = simulated[len(run) :]
    better = left(predicted)
    x = runs.programmed**2 / runs.radius
    flat = betas[fold, 0] * x[run] + betas[fold, 1] * (x * x / runs.radius)[run]
    scatter = found.spread.noise_m2 + found.spread.order_m2.sum()
    # The phase of a tone is new in each run: no model could foretell it.
    tone = sum((np.maximum(tone.energy_m2, 0) for tone in found.tones), np.zeros(runs.count)) / samples
    floor = (scatter + tone[run]).mean()
    percent = lambda new, old: 100 * (1 - np.sqrt(new / np.where(old > 0, old, 1))) * (old > 0)
    # Runs, not samples, are drawn again: both folds of a run go together.
    sums = np.stack([np.bincount(run, errors, runs.count) for errors in (better, baseline)])
    draws = np.random.default_rng(seed).integers(0, runs.count, (RESAMPLES, runs.count))
    totals = sums[:, draws].sum(axis=2)
    drawn = np.sort(percent(*totals))
    new, old = better.mean(), baseline.mean()
    of_perfect = 100 * (old - new) / (old - floor) if old - floor > 0.3 * floor else 100.0
    rms = [1e6 * np.sqrt(value) for value in (new, old, left(flat[:, None]).mean(), left(0.0).mean(), floor)]
    interval = drawn[[RESAMPLES // 40, RESAMPLES - 1 - RESAMPLES // 40]]
    return Gain(*rms, float(percent(new, old)), interval, of_perfect, tuple(map(len, groups)))


def fit_beta(size_m, radius, omega, weights):
    """β1, β2 by least squares on the sizes, for each row of weights."""
    x, y = omega**2 * radius, omega**4 * radius
    xx, xy, yy, xe, ye = (weights @ (a * b) for a, b in ((x, x), (x, y), (y, y), (x, size_m), (y, size_m)))
    determinant = xx * yy - xy * xy
    regular = np.abs(determinant) > 1e-12 * xx * yy
    divisor = np.where(regular, determinant, 1)
    first = np.where(regular, (xe * yy - ye * xy) / divisor, xe / np.where(xx > 0, xx, np.inf))
    return np.stack((first, np.where(regular, (ye * xx - xe * xy) / divisor, 0)), axis=1)
