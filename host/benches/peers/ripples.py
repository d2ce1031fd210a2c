"""What has no fixed place on the circle: tones in time, and teeth where an axis is slow.

Each run of a tone has a phase of its own, so power is added, not amplitude; a run counts for at most `CAP`, so that the
sharp harmonics of a few runs cannot pose as a tone that all share. Teeth are looked for in second differences of
neighbouring samples, over bins of the speed of one axis.
"""
from dataclasses import dataclass, field

import numpy as np
from scipy.fft import rfft

# Largest power that one run may add, χ²₂; longest turn used, s; fewest waves in a turn.
CAP, LONGEST_TURN_S, FEWEST_WAVES = 40.0, 12.0, 9.5
# Power that counts as loud; standard errors above both noise and floor that make a tone.
LOUD, SIGNIFICANT = 14.0, 8.0
# Share of the runs that is nearly every one; waves a turn to the side of a tone where nothing of it is left.
NEARLY_EVERY, ASIDE_WAVES = 0.8, 4.0
# Padding of the transforms; share of a frequency within which it is the same, or a whole multiple.
PAD, SAME = 4, 0.03
MOST_POINTS = 200_000

# Bins of axis speed: edges 0.25 mm/s · 2^(k/2).
BINS, FIRST_EDGE_M_S = 18, 2.5e-4
# Left out after a reversal, s, and on both sides of it, rad.
SPIKE_S, BESIDE_RAD = 0.25, 0.07
# Variance ratios: rough above, smooth below, rough in part above; of slow parts of runs that have fast parts too.
ROUGH, SMOOTH, PARTLY, CONTRAST = 1.6, 1.3, 1.15, 1.25


@dataclass
class Tone:
    """A tone shared by the runs; along an axis, or along the radius."""

    frequency_hz: float
    se_hz: float
    axis: int | None
    # Amplitude ∝ f²/R: the height of a chord's arc, an interpolator.
    centripetal: bool
    amplitude_m: float
    # Log-evidence for the law of the amplitude against the other.
    law_evidence: float
    # Energy that it takes off each run, m².
    energy_m2: np.ndarray = field(default=None)

    def removed_from(self, runs, samples):
        """Samples of all runs without the tone."""
        n, turn_s = runs.samples, 2 * np.pi / runs.omega
        swing = 1 if self.axis is None else runs.direction[self.axis]
        for overtone in (1, 2, 3) if self.centripetal else (1,):
            phase = np.multiply.outer(2 * np.pi * self.frequency_hz * overtone * turn_s / n, np.arange(n))
            cos, sin = runs.split(np.stack((swing * np.cos(phase), swing * np.sin(phase))))[1]
            length = (cos * cos).sum(axis=1)
            usable = length >= 0.05 * n
            with np.errstate(invalid="ignore"):
                sin -= ((cos * sin).sum(axis=1) / np.where(usable, length, np.inf))[:, None] * cos
            for column in (cos, sin):
                own = (column * column).sum(axis=1)
                along = (column * samples).sum(axis=1) / np.where(usable & (own > 0.05 * n), own, np.inf)
                samples = samples - along[:, None] * column
        return samples

    def is_new(self, others):
        """Whether it is none of the others, nor an overtone of one."""
        waves = np.array([self.frequency_hz / other.frequency_hz for other in others])
        return (np.abs(waves / np.maximum(np.round(waves), 1) - 1) > SAME).all()


def find_tone(runs, outside, noise_m2):
    """Looks for a tone in what the other explanations leave outside the low orders."""
    turn_s, n = 2 * np.pi / runs.omega, runs.samples
    used = np.flatnonzero(turn_s <= LONGEST_TURN_S)
    if len(used) < 4 or n < 64:
        return None
    turn_s = turn_s[used]
    length = 1 << (PAD * n - 1).bit_length()
    # A Hann window, mean square 3/2: or a loud tone hides in its own leakage.
    hann = 1 - np.cos(2 * np.pi / n * (np.arange(n) + 0.5))
    power = np.abs(rfft(outside[used] * hann, length, axis=1)) ** 2 * (2 / (1.5 * n * noise_m2))
    nyquist_hz, step_hz = 0.5 * n / turn_s, 0.25 / turn_s.max()
    points = min(int(nyquist_hz.max() / step_hz), MOST_POINTS)
    total, count, loud = np.zeros(points), np.zeros(points), np.zeros(points)
    lowest = np.floor(FEWEST_WAVES / turn_s / step_hz).astype(int) + 1
    highest = np.minimum(np.ceil(0.95 * nyquist_hz / step_hz).astype(int), points)
    for spectrum, turn, low, high in zip(power, turn_s, lowest, highest):
        at = np.rint(np.arange(low, high) * (step_hz * turn * length / n)).astype(int)
        here = spectrum[at]
        total[low:high] += np.minimum(here, CAP)
        count[low:high] += 1
        loud[low:high] += here > LOUD
    grid = np.flatnonzero(count[1:] >= 4) + 1
    if len(grid) < 100:
        return None
    count, loud = count[grid], loud[grid]
    mean = total[grid] / count
    levels = np.partition(mean, [len(mean) // 2, len(mean) * 84 // 100])
    floor = levels[len(mean) // 2]
    width = max(levels[len(mean) * 84 // 100] - floor, 1e-9)
    clear = ((mean - 2) * np.sqrt(count) / 2 > SIGNIFICANT) & (loud >= np.maximum(4, count // 6))
    high = (mean - floor) / width > SIGNIFICANT
    # Where much else is rough, a capped mean is never far above it: a tone that nearly every run shows is one all the same.
    for at in np.flatnonzero(clear & ~high & (mean > NEARLY_EVERY * CAP)):
        hz = grid[at] * step_hz
        sees = (hz < 0.95 * nyquist_hz) & (hz * turn_s > FEWEST_WAVES)
        lines = np.rint((hz * turn_s + ASIDE_WAVES * np.array([[-1], [0], [1]])) * (length / n)).astype(int)
        low, here, up = power[np.arange(len(power)), lines % power.shape[1]]
        high[at] = (sees & (here > 4 * (1 + low + up))).sum() > NEARLY_EVERY * count[at]
    clear &= high
    if not clear.any():
        return None
    best = np.argmax(np.where(clear, mean * np.sqrt(count), -np.inf))
    return _refined(runs, outside, noise_m2, used, grid[best] * step_hz, step_hz)


def _refined(runs, outside, noise_m2, used, start_hz, step_hz):
    n = runs.samples
    turn_s = 2 * np.pi / runs.omega[used]
    used = used[(start_hz < 0.47 * n / turn_s) & (start_hz * turn_s > FEWEST_WAVES)]
    turn_s = 2 * np.pi / runs.omega[used]

    # e^{iωk} as a product of a coarse and a fine step: two small tables instead of one of all samples.
    fine = 1 << (int(np.sqrt(n)) - 1).bit_length()
    padded = np.zeros((3, len(used), -(-n // fine) * fine))
    padded[:, :, :n] = outside[used] * np.stack((np.ones_like(outside[used]), *(of[used] for of in runs.direction)))
    padded = padded.reshape(3, len(used), -1, fine).transpose(1, 0, 2, 3)
    # Mean square of a swing along an axis is half of that along the radius.
    scale = np.array([1, 2, 2])[:, None] * 2 / (n * noise_m2)

    def powers(ways, frequencies_hz):
        """Power at frequencies, χ²₂, of some ways to swing (along the radius, X, Y): runs × ways × frequencies."""
        turn = 2j * np.pi / n * np.multiply.outer(turn_s, frequencies_hz)[:, None, :]
        own = padded[:, ways]
        sums = (own.reshape(len(used), -1, fine) @ rising(turn, fine)).reshape(*own.shape[:3], -1)
        sums = (sums * rising(fine * turn, padded.shape[2])[:, None]).sum(axis=2)
        return np.abs(sums) ** 2 * scale[ways]

    # A swing along an axis shows on the circle as two sidebands, one turn below and above.
    near = start_hz + 0.5 * step_hz * np.arange(-48, 49)
    sums = powers([0, 1, 2], near).sum(axis=0)
    way, at = np.unravel_index(np.argmax(sums), sums.shape)
    axis, centre, half = (None, 0, 1)[way], near[at], step_hz
    total = lambda frequencies_hz: powers([way], frequencies_hz)[:, 0]
    for _ in range(12):
        near = centre + half * np.arange(-3, 4) / 3
        centre = near[np.argmax(total(near).sum(axis=0))]
        half *= 0.5
    h = 0.02 * step_hz
    above, here, below = total(np.array([centre + h, centre, centre - h])).T
    bend = (above.sum() - 2 * here.sum() + below.sum()) / (h * h)
    se_hz = np.sqrt(2 / -bend) if bend < 0 else step_hz
    # χ²₂ with non-centrality n·A²/(2σ²).
    unit = n / (2 * noise_m2 * (1 if axis is None else 2))

    def law(weight):
        lengths = unit * weight**2 * np.ones(len(used))
        start = np.sqrt(np.maximum(here - 2, 0).sum() / lengths.sum())
        scales = start * np.append(1.0, 1.05 ** np.arange(-40.0, 41.0))
        return rice_deviance(here, np.multiply.outer(scales**2, lengths)).sum(axis=1).min()

    constant, centripetal = law(1.0), law(runs.feed[used] ** 2 / runs.radius[used])
    amplitude_m = np.sqrt(max(((here - 2) / unit).mean(), 0))
    tone = Tone(centre, se_hz, axis, constant > centripetal, amplitude_m, 0.5 * abs(constant - centripetal))
    # A tone without its low orders takes nothing from the low orders.
    tone.energy_m2 = (outside**2).sum(axis=1) - (tone.removed_from(runs, outside) ** 2).sum(axis=1)
    return tone


def rising(exponent, count):
    """e^{k·exponent} for k = 0, 1, … along axis 1."""
    out = np.repeat(np.exp(exponent), count, axis=1)
    out[:, 0] = 1
    return np.cumprod(out, axis=1, out=out)


def rice_deviance(power, noncentral):
    """−2·log-likelihood of a χ²₂ power, its amplitude taken as Gaussian; a floor keeps one odd run from deciding."""
    # Amplitudes of real tones vary by some percent from run to run.
    variance = 1 + 0.01 * noncentral
    return np.minimum((np.sqrt(power) - np.sqrt(noncentral + 1)) ** 2 / variance, 50) + np.log(variance)


@dataclass
class Teeth:
    """Stick–slip of an axis below a speed."""

    axis: int
    below_m_s: float
    height_m: float
    se_m: float
    significance: float

    def covers(self, runs):
        """Samples in which the axis may stick: a little more than the zone itself."""
        return axis_speed(runs, self.axis) < 1.2 * self.below_m_s

    def energy_m2(self, runs):
        # A ramp from nothing to the height, seen along the radius.
        return self.covers(runs).sum() * self.height_m**2 / 3 * 0.5


def axis_speed(runs, axis):
    return runs.feed[:, None] * np.abs(runs.direction[1 - axis])


def find_teeth(runs, left_m, noise_m2):
    """Looks for teeth on both axes in what is left of the samples."""
    squares = np.zeros_like(left_m)
    # Clipped: a few wild samples are not roughness.
    squares[:, 1:-1] = np.minimum(np.diff(left_m, 2, axis=1) ** 2 / 6, 400 * noise_m2)
    both = [teeth_on(axis, runs, left_m, squares, noise_m2) for axis in range(2)]
    found = [teeth for teeth in both if teeth]
    if len(found) == 2:
        # One axis's teeth lie where the other is fast: hide them before the other is believed.
        first = max(reversed(found), key=lambda teeth: teeth.significance)
        other = teeth_on(1 - first.axis, runs, left_m, squares, noise_m2, ~first.covers(runs))
        found = [first, other] if other else [first]
    return found


def teeth_on(axis, runs, left_m, squares, noise_m2, uncovered=True):
    speed, across = axis_speed(runs, axis), np.abs(runs.direction[axis])
    share, _ = runs.stroke(axis)
    # A step at the reversal itself shows beside it, if the lag is off.
    used = (share * runs.half_turn_s[:, None] >= SPIKE_S) & (np.minimum(share, 1 - share) * np.pi >= BESIDE_RAD)
    used &= (across >= 0.3) & uncovered
    used[:, [0, -1]] = False
    edges = FIRST_EDGE_M_S * 2 ** (0.5 * np.arange(1, BINS + 1))
    bins = np.searchsorted(edges, speed[used], side="right")
    counts = np.bincount(bins, minlength=BINS)[:BINS]
    sums = np.bincount(bins, squares[used], BINS)[:BINS]
    # Second differences are correlated: about a third of the samples count.
    ratio = sums / np.maximum(counts * noise_m2, 1e-300)
    sigmas = (ratio - 1) * np.sqrt(counts / 6)
    rough = np.flatnonzero((counts >= 20) & (ratio > ROUGH) & (sigmas > SIGNIFICANT))
    if not len(rough):
        return None
    # Rough up to a speed, which lies within the bin above the last rough one, and smooth beyond it; else it is something else.
    highest, lowest = rough[-1], rough[0]
    above = np.arange(BINS) >= highest + 2
    above &= counts >= 50
    if not above.any() or highest - lowest + 1 > len(rough) + 2 or (ratio[above] > SMOOTH).any():
        return None
    reached = highest + 1 + (counts[highest + 1] >= 20 and ratio[highest + 1] > PARTLY)
    below_m_s = FIRST_EDGE_M_S * 2 ** (0.5 * reached)
    if not has_contrast(speed, squares, below_m_s, noise_m2):
        return None
    # Height from each run with enough of the zone; its mean and centre are not of it.
    low = runs.coordinates(left_m)
    low[:, 3:] = 0
    clean = left_m - (low[:, None, :] @ runs.basis)[:, 0]
    zone = (speed < 0.6 * below_m_s) & (across > 0.3)
    counts = zone.sum(axis=1)
    power = (np.where(zone, clean / np.where(zone, across, 1), 0) ** 2).sum(axis=1)
    enough = counts >= 30
    if enough.sum() < 2:
        return None
    weight = counts[enough]
    heights = np.sqrt(3 * np.maximum(power[enough] / weight - noise_m2, 0))
    height_m = np.average(heights, weights=weight)
    variance = np.average((heights - height_m) ** 2, weights=weight)
    se_m = max(np.sqrt(variance / (enough.sum() - 1)), 0.07 * height_m)
    return Teeth(axis, below_m_s, height_m, se_m, sigmas[rough].max())


def has_contrast(speed, squares, below_m_s, noise_m2):
    """Runs in which the axis is both slow and fast have to be rough where it is slow and smooth where it is fast."""
    inner = np.zeros(speed.shape, bool)
    inner[:, 1:-1] = True
    slow = inner & (speed < 0.6 * below_m_s)
    fast = inner & (speed >= 1.5 * below_m_s)
    both = (slow.sum(axis=1) >= 20) & (fast.sum(axis=1) >= 20)
    counts = [part[both].sum() for part in (slow, fast)]
    slow_ratio, fast_ratio = (
        squares[both][part[both]].sum() / max(count * noise_m2, 1e-300) for part, count in zip((slow, fast), counts)
    )
    return counts[0] >= 50 and slow_ratio > CONTRAST and slow_ratio - 1 > 2 * max(fast_ratio - 1, 0)
