"""All circles of a campaign at once: a row is a run, a column a sample.

A ballbar gives time, not angle: the recorded pattern is turned by the lag of the machine, which shows in the turn of the
first harmonic with speed. The low orders of a circle scatter between runs by more than the noise within a run tells, so
they are kept as coordinates in an orthonormal basis of each run, apart from what lies outside them.
"""
import copy
from dataclasses import dataclass

import numpy as np

ORDERS = 8
COLUMNS = 1 + 2 * ORDERS
ORDER_OF = (np.arange(COLUMNS) + 1) // 2
PLACES = 72
# Share of a circle that has to be seen for its harmonics to be read.
WHOLE = 0.7
# E[χ²₁ | χ²₁ below its 90 % point].
TRIMMED_MEAN_OF_CHI2 = 0.623015
# Ratio of measured to programmed feed below which a run counts as slowed.
SLOWED = 0.995
# Dead time that a servo may have on top of its own lag, s, and the eccentricity that shows its turn clearly, m.
UNSEEN_S, SMALLEST_OFFSET_M = 0.01, 3e-6


@dataclass
class Response:
    """(R/Rm)² = 1 + aω² + bω⁴."""

    a_s2: float
    b_s4: float = 0.0

    def gain(self, omega):
        w2 = omega * omega
        return 1 / np.sqrt(np.maximum(1 + self.a_s2 * w2 + self.b_s4 * w2 * w2, 1e-3))

    def own_lag(self):
        """Phase of the simplest chain with this gain, to third order in ω."""
        if self.b_s4 > 0:
            omega_n = self.b_s4**-0.25
            zeta = np.sqrt(max(0.5 + 0.25 * self.a_s2 * omega_n**2, 0))
            return Lag(2 * zeta / omega_n, (8 / 3 * zeta**3 - 2 * zeta) / omega_n**3, False, UNSEEN_S)
        tau_s = np.sqrt(max(self.a_s2, 0))
        return Lag(tau_s, tau_s**3 / 3, False, UNSEEN_S)


@dataclass
class Lag:
    """φ = τω − τ3ω³, whether the set-up offset shows it, and the standard error of τ."""

    tau_s: float
    tau3_s3: float
    measured: bool
    se_s: float

    def phase(self, omega):
        return omega * (self.tau_s - self.tau3_s3 * omega * omega)


@dataclass
class Column:
    """Vectors over all samples: coordinates in the low orders (runs × 17), and samples of what lies outside."""

    low: np.ndarray
    outside: np.ndarray

    def samples(self, runs):
        return self.outside + (self.low[:, None, :] @ runs.basis)[:, 0]


def packed(waves):
    """Complex waves c + is of the orders 0…8 as mean, cos, sin, cos, …."""
    out = np.empty((*waves.shape[:-1], COLUMNS))
    out[..., 0] = waves[..., 0].real
    out[..., 1::2], out[..., 2::2] = waves[..., 1:].real, waves[..., 1:].imag
    return out


def unpacked(low):
    out = np.empty((*low.shape[:-1], ORDERS + 1), complex)
    out[..., 0] = low[..., 0]
    out[..., 1:] = low[..., 1::2] + 1j * low[..., 2::2]
    return out


class Runs:
    """The motion and the readings of every run."""

    def __init__(self, radius_m, feed_m_s, sign, started_s, time_s, theta_rad, deviation_m):
        self.count, self.samples = theta_rad.shape
        self.radius, self.programmed, self.sign = radius_m, feed_m_s, sign
        # The feed as the turn shows it, where that says clearly otherwise.
        turn_s = (time_s[:, -1] - time_s[:, 0]) * self.samples / (self.samples - 1)
        measured = 2 * np.pi * radius_m / turn_s
        kept = (measured / feed_m_s >= SLOWED) & (measured / feed_m_s <= 1 / SLOWED)
        self.feed = np.where(kept, feed_m_s, measured)
        self.omega = self.feed / radius_m
        self.half_turn_s = np.pi / self.omega
        self.started = started_s - started_s.min()
        span = self.started.max()
        self.campaign_s = span if span > 0 else 3600.0
        # What a run shows of a drift is that of its middle.
        self.elapsed = (self.started + self.half_turn_s) / span if span > 0 else np.zeros(self.count)
        self.largest = radius_m.max()
        self.theta, self.deviation = theta_rad, deviation_m
        self.cos_theta, self.sin_theta = np.cos(theta_rad), np.sin(theta_rad)
        self.hidden = None
        self.visible = np.full(self.count, self.samples)
        self._orthonormal(self._waves())
        self.whole_basis = self.basis
        self.first = self.harmonics_of(self.coordinates(deviation_m))[:, 1]
        self.gain = np.ones(self.count)
        self.turned = self.lag = np.zeros(self.count)

    def _waves(self):
        waves = np.empty((self.count, COLUMNS, self.samples))
        waves[:, 0] = 1
        turn = self.cos_theta + 1j * self.sin_theta
        power = turn
        for order in range(1, ORDERS + 1):
            waves[:, 2 * order - 1], waves[:, 2 * order] = power.real, power.imag
            power = power * turn
        return waves

    def _orthonormal(self, waves):
        if self.hidden is None:
            # Waves over a whole turn are nearly orthogonal already: Cholesky loses nothing and is the fastest.
            lower = np.linalg.cholesky(waves @ waves.swapaxes(1, 2))
            self.basis, self.triangle = np.linalg.inv(lower) @ waves, lower.swapaxes(1, 2)
        else:
            # Gram–Schmidt, twice; columns that the earlier ones span over what is seen are left out.
            self.basis, self.triangle = waves * ~self.hidden[:, None, :], np.zeros((self.count, COLUMNS, COLUMNS))
            for k in range(COLUMNS):
                earlier, column = self.basis[:, :k], self.basis[:, k]
                length = np.linalg.norm(column, axis=1)
                for _ in range(2):
                    along = (earlier @ column[:, :, None])[:, :, 0]
                    column -= (along[:, None, :] @ earlier)[:, 0]
                    self.triangle[:, :k, k] += along
                left = np.linalg.norm(column, axis=1)
                left[left <= 1e-9 * length] = 0
                self.triangle[:, k, k] = left
                column *= np.where(left > 0, 1 / np.where(left > 0, left, 1), 0)[:, None]
        regular = self.triangle.copy()
        diagonal = np.diagonal(regular, axis1=1, axis2=2)
        run, column = np.nonzero(diagonal == 0)
        regular[run, column, column] = 1
        self.inverse = np.linalg.inv(regular)

    def about(self, response, lag):
        """The same runs about another guess of the response and its lag."""
        out = copy.copy(self)
        out.gain = response.gain(self.omega)
        return out.turn_to(lag.phase(self.omega))

    def turn_to(self, lag_rad):
        """Takes the recorded pattern as one that runs ahead of the machine by this lag."""
        out = copy.copy(self)
        out.lag, out.turned = lag_rad, self.sign * lag_rad
        cos, sin = np.cos(out.turned)[:, None], np.sin(out.turned)[:, None]
        out.psi = self.theta - out.turned[:, None]
        # Direction cosines of X and Y.
        out.direction = (
            self.cos_theta * cos + self.sin_theta * sin,
            self.sin_theta * cos - self.cos_theta * sin,
        )
        out.ahead = np.exp(1j * np.arange(ORDERS + 1) * out.turned[:, None])
        out._strokes, out._bins = {}, None
        return out

    def take(self, rows):
        """Some of the runs."""
        out = copy.copy(self)
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                setattr(out, name, value[rows])
        out.count, out.direction = len(rows), tuple(along[rows] for along in self.direction)
        out._strokes, out._bins = {}, None
        return out

    def hide(self, hidden):
        """Hides samples from every product."""
        self.hidden = hidden
        self.visible = self.samples - hidden.sum(axis=1)
        self._orthonormal(self._waves())
        self.deviation = self.deviation * ~hidden

    def stroke(self, axis):
        """Share of the half turn since an axis last reversed; its direction cosine, positive where it has just turned."""
        if axis not in self._strokes:
            halves = self.sign[:, None] * (self.psi - axis * np.pi / 2) / np.pi
            share = halves - np.floor(halves)
            across = np.abs(self.direction[axis])
            self._strokes[axis] = share, np.where(share < 0.5, across, -across)
        return self._strokes[axis]

    def coordinates(self, samples):
        """Coordinates of samples in the low orders."""
        return (self.basis @ samples[:, :, None])[:, :, 0]

    def low_of(self, waves):
        """Coordinates of waves of the machine angle, columns × runs × orders."""
        recorded = packed(waves * self.ahead).swapaxes(0, 1)
        return (recorded @ self.triangle.swapaxes(1, 2)).swapaxes(0, 1)

    def harmonics_of(self, low):
        """Waves of the recorded angle, from coordinates."""
        return unpacked((self.inverse @ low[:, :, None])[:, :, 0])

    def split(self, samples):
        """Coordinates of columns (columns × runs × samples) and what they have outside; what is hidden does not count."""
        if self.hidden is not None:
            samples = samples * ~self.hidden
        low = samples.swapaxes(0, 1) @ self.basis.swapaxes(1, 2)
        return low.swapaxes(0, 1), samples - (low @ self.basis).swapaxes(0, 1)

    def misfit(self):
        """What the baseline leaves."""
        low, outside = self.split((self.deviation - (self.radius * (self.gain - 1))[:, None])[None])
        return Column(low[0], outside[0])

    def place_means(self, column):
        """Mean in each bin of the machine angle, with the mean and the centre of each run taken off."""
        if self._bins is None:
            turns = self.psi / (2 * np.pi)
            at = np.minimum(((turns - np.floor(turns)) * PLACES).astype(int), PLACES - 1)
            at += PLACES * np.arange(self.count)[:, None]
            counts = np.bincount(at.ravel(), minlength=PLACES * self.count)
            self._bins = at.ravel(), np.maximum(counts, 1)
        at, counts = self._bins
        low = column.low.copy()
        low[:, :3] = 0
        clean = Column(low, column.outside).samples(self)
        means = np.bincount(at, clean.ravel(), PLACES * self.count) / counts
        return means.reshape(self.count, PLACES)


def measure_lag(runs, response):
    """Fits z = E·e^{idφ(ω)} to the first harmonics z = c + is of all runs."""
    unmeasured = response.own_lag()
    fastest, slowest = runs.omega.max(), runs.omega.min()
    if runs.count < 3 or fastest - slowest < 0.2 * fastest:
        return unmeasured
    rates = 1j * runs.sign * np.stack((-runs.omega, runs.omega**3))
    power = np.mean(np.abs(runs.first) ** 2)

    def cost(at):
        """What is left of the mean square, for rows of τ and τ3."""
        mean = np.exp(at @ rates) @ runs.first / runs.count
        return power - mean.real**2 - mean.imag**2

    # A phase beyond ±π at the fastest run would be another branch.
    widest = min(np.pi / fastest, 0.2)
    grid = np.zeros((81, 2))
    grid[:, 0] = -0.1 * widest + 1.1 * widest * np.arange(81) / 80
    at = grid[np.argmin(cost(grid))]
    steps = np.diag([widest / 80, 0.2 * max(abs(at[0]), 1e-3) / fastest**2])
    ways = np.array([-1.0, 0.0, 1.0])[:, None]
    for _ in range(60):
        for step in steps:
            low, mid, high = cost(at + ways * step)
            bend = low - 2 * mid + high
            if bend > 0:
                moved = at + min(max(0.5 * (low - high) / bend, -1), 1) * step
                if cost(moved) <= mid:
                    at = moved
        steps *= 0.85
    left = max(cost(at), 0)
    eccentricity = np.sqrt(power - left)
    # Standard error of the phase at the fastest run, rad.
    se = np.sqrt(left / runs.count) / max(eccentricity, 1e-12)
    if eccentricity < SMALLEST_OFFSET_M or se > 0.02:
        return unmeasured
    # τ and τ3 share what the fastest runs tell.
    return Lag(at[0], at[1], True, 2 * se / fastest)


def fit_lag(error_m, radius, omega, weights):
    """κ2 of the lag that fits the sizes best, for each row of weights; negative where circles grow with speed."""

    def cost(a):
        left = error_m - radius * (1 / np.sqrt(np.maximum(1 + a[..., None] * omega**2, 1e-3)) - 1)
        return (weights * left**2).sum(axis=-1)

    x = -0.5 * radius * omega**2
    down = weights @ (x * x)
    a = np.where(down > 0, weights @ (x * error_m) / down, 0.0)
    step = np.maximum(0.2 * np.abs(a), 1e-9)
    for _ in range(60):
        low, mid, high = cost(np.stack((a - step, a, a + step)))
        bend = low - 2 * mid + high
        moved = a + np.clip(0.5 * step * (low - high) / np.where(bend > 0, bend, np.inf), -step, step)
        a = np.where(cost(moved) <= mid, moved, a)
        step = 0.7 * step
    return a


@dataclass
class Spread:
    """Variance of one sample, and between runs that of the mean (order 0) and of each coefficient of the orders 2…, m²."""

    noise_m2: float
    order_m2: np.ndarray

    def kept(self, visible):
        """Share of each low coordinate that scatter between runs leaves."""
        weight = visible[:, None] * np.where(ORDER_OF == 0, 1.0, 0.5)
        kept = self.noise_m2 / (self.order_m2[ORDER_OF] * weight + self.noise_m2)
        kept[:, ORDER_OF == 1] = 0
        return kept


def measure_spread(runs, left_m):
    """Noise from second differences, scatter from what no function of radius, direction, speed and time explains."""
    squares = np.diff(left_m, 2, axis=1) ** 2 / 6
    keep = squares.shape[1] * 9 // 10
    # Smaller nine tenths: robust to steps and spikes; the median over the runs ignores those that shake.
    squares = np.partition(squares, keep, axis=1)[:, :keep]
    noise_m2 = max(np.sort(squares.mean(axis=1))[runs.count // 2] / TRIMMED_MEAN_OF_CHI2, 1e-15)
    seen = runs.visible > WHOLE * runs.samples
    # Waves of the machine angle, as the signatures are.
    waves = packed(runs.harmonics_of(runs.coordinates(left_m)) * runs.ahead.conj())[seen]
    total = pure_error(runs, waves, seen)
    total = np.array([total[0], 0, *(0.5 * (total[3::2] + total[4::2]))])
    within = noise_m2 * np.mean(1 / np.maximum(runs.visible[seen], 1)) if seen.any() else 0.0
    scatter = np.maximum(total - within * np.where(np.arange(ORDERS + 1) == 0, 1, 2), 0)
    scatter[1] = 0
    return Spread(noise_m2, scatter)


def pure_error(runs, values, seen):
    """Residual variance of each column of values."""
    radius, feed, sign, elapsed = (of[seen] for of in (runs.radius, runs.feed, runs.sign, runs.elapsed))
    x = feed**2 / radius
    columns = [np.ones_like(x), x, sign * feed, sign, feed, x * x / radius, elapsed * radius, feed / radius, sign * x]
    for other in np.unique(np.round(radius, 9))[1:6]:
        here = (np.abs(radius - other) < 1e-6 * other).astype(float)
        columns += [here, here * sign]
    basis = np.empty((0, len(x)))
    for column in columns[: max(len(x) // 3, 1)]:
        rest = column
        for _ in range(2):
            rest = rest - basis.T @ (basis @ rest)
        length = np.linalg.norm(rest)
        if length > 1e-8 * np.linalg.norm(column):
            basis = np.vstack((basis, rest / length))
    for _ in range(2):
        values = values - basis.T @ (basis @ values)
    degrees = len(x) - len(basis)
    return (values**2).sum(axis=0) / degrees if degrees else np.zeros(values.shape[1])
