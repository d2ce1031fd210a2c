"""What may be found: the listed causes and patterns without a name, each with what it does to every circle.

A kind is a name, an axis (0: X, 1: Y) and the parameters that bend it. What is a mean and a few waves of the machine angle
is known by their coefficients; everything else by its samples.
"""
from typing import NamedTuple

import numpy as np
from circles import ORDERS

BOTH, WHOLE_MACHINE = (0, 1), (None,)
# Steps of the tabulated pulse of a reversal, and the decay a step up to which e^{decay·steps} does not overflow.
STEPS, GENTLE = 300, 2.0
# Price of one listed column; further prices of a second column and of a pattern.
PRICE, PRICE_OF_PHASE, PRICE_OF_PATTERN = 14.0, 5.0, 14.0
# f^a·R^b about 0.3 m/s and 0.15 m.
LAWS = [(0, 0), (1, 0), (2, -1), (0, 1), (0, 2), (2, 0), (1, -1), (1, 1)]
LAWS_AND_PARITIES = [(law, odd) for law in LAWS for odd in (False, True)]
# Widths of a bump beyond which it is nothing.
FAR = 9.0
# Most time constants of a drift to a campaign.
SETTLED = 5.0


class Kind(NamedTuple):
    name: str
    axis: int | None = None
    # Shape of a cause; law and parity of a pattern.
    shape: tuple = ()

    @property
    def listed(self):
        return self.name in CAUSES

    @property
    def columns(self):
        return 2 if self.name in ("cyclic_error", "harmonic") else 1

    def price(self, shapes=1):
        """What it has to take off χ², chosen from so many starting shapes."""
        phase = PRICE_OF_PHASE * (self.columns - 1)
        return PRICE + phase + (2 * np.log(max(shapes, 1)) if self.listed else PRICE_OF_PATTERN)


# Causes with the same deviation at the same place of every run: where they sit and the doubt of their closed form.
CAUSES = {
    "higher_order_dynamics": (WHOLE_MACHINE, 0.002),
    "radius_offset": (WHOLE_MACHINE, 0.002),
    "scale_error": (WHOLE_MACHINE, 0.002),
    "scale_mismatch": (WHOLE_MACHINE, 0.002),
    "squareness": (WHOLE_MACHINE, 0.002),
    "servo_mismatch": (WHOLE_MACHINE, 0.002),
    "bandwidth_mismatch": (WHOLE_MACHINE, 0.002),
    "backlash": (BOTH, 0.004),
    "lateral_play": (BOTH, 0.002),
    "reversal_spike": (BOTH, 0.02),
    "cyclic_error": (BOTH, 0.002),
    "straightness": (BOTH, 0.002),
    "thermal_drift": (WHOLE_MACHINE, 0.002),
    "joint_lag_mismatch": (WHOLE_MACHINE, 0.002),
}
SHAPED = {"servo_mismatch", "backlash", "reversal_spike", "cyclic_error", "thermal_drift"}
# Shapes that move smoothly and have a slope to climb; the servo's is a choice, the play's moves in jerks.
SMOOTH = {"reversal_spike", "cyclic_error", "thermal_drift"}


def finest_wave_per_m(runs):
    return 1 / max(2 * runs.largest / 300, 1e-3)


def starting_shapes(name, runs):
    if name == "servo_mismatch":
        return [(1.0,), (0.0,)]
    if name == "backlash":
        return [(0.0,), (5e-6,), (20e-6,), (60e-6,)]
    if name == "reversal_spike":
        return [(d, r * d, x) for d in (0.006, 0.015, 0.04, 0.1) for r in (0.15, 0.6) for x in (2e-6, 3e-5)]
    if name == "cyclic_error":
        travel = 2 * runs.largest
        coarsest = 1 / max(0.5 * travel, 1e-3)
        return [(1 / wave,) for wave in np.arange(coarsest, finest_wave_per_m(runs), 0.35 / travel)]
    if name == "thermal_drift":
        return [(0.0,), (2.0,), (5.0,)] if np.ptp(runs.elapsed) > 1e-9 else []
    return [()]


def step_of(name, value, travel_m):
    """A step that changes the signature by a few percent."""
    if name == "reversal_spike":
        return 0.05 * value
    return 0.1 if name == "thermal_drift" else 0.01 * value * value / travel_m


def tidy(name, shape):
    if name == "reversal_spike":
        return tuple(abs(value) for value in shape)
    if name == "thermal_drift":
        return tuple(min(max(value, 0.0), SETTLED) for value in shape)
    return tuple(shape)


def law_of(runs, law):
    return (runs.feed / 0.3) ** law[0] * (runs.radius / 0.15) ** law[1]


def _mean(name, axis, shape, runs):
    r, w = runs.radius, runs.omega
    if name == "own":  # ∂ΔR/∂a about the response
        return -0.5 * r * w**2 * runs.gain**3
    if name == "higher_order_dynamics":
        return r * w**4 * runs.gain**3
    if name == "radius_offset":
        return np.full(runs.count, 1e-3)
    if name == "scale_error":
        return 1e-6 * r
    if name == "joint_lag_mismatch":
        return -0.5 * runs.feed * runs.sign
    if name == "thermal_drift":
        curvature = shape[0]
        settled = curvature > 1e-3
        return 1e-6 * r * (np.expm1(-curvature * runs.elapsed) / np.expm1(-curvature) if settled else runs.elapsed)
    if name == "size":
        law, odd = shape
        return 1e-6 * law_of(runs, law) * (runs.sign if odd else 1)
    if name == "time":
        law, step = shape
        return 1e-6 * law_of(runs, law) * (runs.elapsed if step is None else runs.elapsed > step)
    return None


def waves(kind, runs):
    """Complex waves c + is of the machine angle, columns × runs × orders; nothing where that is not all."""
    name, axis, shape = kind
    out = np.zeros((kind.columns, runs.count, ORDERS + 1), complex)
    mean = _mean(name, axis, shape, runs)
    if mean is not None:
        out[0, :, 0] = mean
    elif name == "scale_mismatch":
        out[0, :, 2] = 0.5e-6 * runs.radius
    elif name == "squareness":
        out[0, :, 2] = 0.5e-6j * runs.radius
    elif name == "servo_mismatch":
        turned = shape[0]
        size = 0.5 * runs.sign * runs.feed * (1 + turned * (runs.gain**2 - 1))
        out[0, :, 2] = 1j * size * np.exp(1j * turned * runs.sign * runs.lag)
    elif name == "bandwidth_mismatch":
        out[0, :, 2] = -0.25 * runs.radius * runs.omega**2 * runs.gain
    elif name == "straightness":
        bow = 0.25e-6 * (runs.radius / runs.largest) ** 2
        out[0, :, 1], out[0, :, 3] = (1j * bow, 1j * bow) if axis == 0 else (bow, -bow)
    elif name == "harmonic":
        order, law, odd, machine = shape
        size = 1e-6 * law_of(runs, law) * (runs.sign if odd else 1)
        # Waves of the clock are waves of the recorded angle.
        out[:, :, order] = np.multiply.outer([1, 1j], size if machine else size * runs.ahead[:, order].conj())
    else:
        return None
    return out


def samples(name, axis, shapes, runs):
    """Samples of a kind, for each shape: (shapes × columns) × runs × samples."""
    if name == "backlash":
        facing = runs.stroke(axis)[1]
        back_m = runs.radius[:, None] * (1 - facing)
        out = np.empty((len(shapes), *facing.shape))
        for (play_m,), column in zip(shapes, out):
            # The play is crossed while the axis comes back by as much.
            crossed = np.minimum(back_m / play_m, 1) if play_m > 0 else 1.0
            np.multiply(facing, 1e-3 * crossed - 0.5e-3, out=column)
        return out
    if name == "lateral_play":
        return (-0.5e-3 * runs.sign[:, None] * np.abs(runs.direction[1 - axis]))[None]
    if name == "reversal_spike":
        return pulses(axis, np.array(shapes), runs)
    if name == "cyclic_error":
        along = runs.direction[axis]
        out = np.empty((2 * len(shapes), *along.shape))
        scaled = 1e-6 * along
        for k, (pitch_m,) in enumerate(shapes):
            phase = (2 * np.pi / pitch_m * runs.radius)[:, None] * along
            np.multiply(scaled, np.sin(phase), out=out[2 * k])
            np.multiply(scaled, np.cos(phase), out=out[2 * k + 1])
        return out
    law, odd, centre_rad, width_rad = shapes[0]
    size = (1e-6 * law_of(runs, law) * (runs.sign if odd else 1))[:, None]
    turns = (runs.psi - centre_rad) / (2 * np.pi)
    off = 2 * np.pi / width_rad * (turns - np.rint(turns))
    return (size * np.where(np.abs(off) < FAR, np.exp(-0.5 * off * off), 0))[None]


def pulses(axis, shapes, runs):
    """Friction turns over a presliding travel as 1 − 2e^{−x/x0}; the loop answers a step with e^{−t/decay} − e^{−t/rise}."""
    decay_s = np.maximum(np.abs(shapes[:, 0]), 1e-4)[:, None]
    rise_s = np.clip(np.abs(shapes[:, 1])[:, None], 1e-5, 0.95 * decay_s)
    presliding_m = np.maximum(np.abs(shapes[:, 2]), 1e-8)[:, None]
    # Time to slide five presliding lengths: x = ½(f²/R)t².
    slide_s = np.sqrt(10 * presliding_m * runs.radius) / runs.feed
    end_s = np.minimum(14 * decay_s + slide_s, runs.half_turn_s)
    step_s = end_s / STEPS
    peak_s = np.log(decay_s / rise_s) * decay_s * rise_s / (decay_s - rise_s)
    peak = np.exp(-peak_s / decay_s) - np.exp(-peak_s / rise_s)
    # Shapes × runs × steps; a change of friction is spread evenly over a step.
    travel = (runs.radius / presliding_m)[..., None] * (1 - stepped(1j * runs.omega * step_s, STEPS + 1).real)
    change = np.diff(-2 * np.exp(-travel))
    overlap = end_s >= runs.half_turn_s
    table = np.zeros((*step_s.shape, STEPS + 2))
    for way, tau_s in ((1, decay_s), (-1, rise_s)):
        ratio = step_s / tau_s
        keep = np.exp(-ratio)
        answer = kept_sum((way * 0.5 / peak * (1 - keep) / ratio)[..., None] * change, ratio)
        table[..., 1:-1] += answer
        if overlap.any():
            # The two pulses before are still dying away, with the other sign and its opposite.
            faded = keep**STEPS
            before = np.where(overlap, (faded - 1) * answer[..., -1], 0)
            table[..., :-1] += before[..., None] * stepped(-ratio, STEPS + 1)
    share, facing = runs.stroke(axis)
    out = np.zeros((len(shapes), share.size))
    for values, steps_a_half_turn, column in zip(table.reshape(len(shapes), -1), runs.half_turn_s / step_s, out):
        steps = (share * steps_a_half_turn[:, None]).ravel()
        # Most of a slow circle lies beyond the pulse.
        within = np.flatnonzero(steps < STEPS)
        steps = steps[within]
        whole = steps.astype(int)
        steps -= whole
        whole += (STEPS + 2) * (within // share.shape[1])
        this = values[whole]
        column[within] = facing.ravel()[within] * (this + steps * (values[whole + 1] - this))
    out *= 1e-6
    return out.reshape(len(shapes), *share.shape)


def stepped(exponent, count):
    """e^{exponent·k} for k = 0, 1, …, as coarse steps times fine ones."""
    fine = 1 << (int(np.sqrt(count)) - 1).bit_length()
    coarse = np.exp(exponent[..., None] * np.arange(0, count, fine))
    out = coarse[..., :, None] * np.exp(exponent[..., None] * np.arange(fine))[..., None, :]
    return out.reshape(*exponent.shape, -1)[..., :count]


def kept_sum(values, ratio):
    """Running sums along the last axis in which every step leaves e^{−ratio} of what was before."""
    if ratio.max() < GENTLE:
        growth = stepped(ratio, values.shape[-1])
        return np.cumsum(values * growth, axis=-1) / growth
    width = 1
    while width < values.shape[-1]:
        values[..., width:] += np.exp(-width * ratio)[..., None] * values[..., :-width]
        width *= 2
    return values


def columns_over(kinds, runs):
    """Blocks of kinds for the ledger."""
    known = [waves(kind, runs) for kind in kinds]
    few = [of for of in known if of is not None]
    rest = [samples(*kind[:2], [kind.shape], runs) for kind, of in zip(kinds, known) if of is None]
    lows = iter(runs.low_of(np.concatenate(few)) if few else ())
    parts = zip(*runs.split(np.concatenate(rest))) if rest else iter(())
    blocks = []
    for kind, of in zip(kinds, known):
        if of is not None:
            blocks.append((np.stack([next(lows) for _ in of]), None))
        else:
            low, outside = zip(*(next(parts) for _ in range(kind.columns)))
            blocks.append((np.stack(low), np.stack(outside)))
    return blocks


def _sizes():
    """Patterns of the mean radius that no cause covers."""
    out = []
    for law in LAWS:
        if law not in ((0, 0), (0, 1), (2, -1)):
            out.append(Kind("size", None, (law, False)))
        if law != (1, 0):
            out.append(Kind("size", None, (law, True)))
    out += [Kind("time", None, (law, None)) for law in ((0, 0), (1, 0))]
    return out + [Kind("time", None, (law, tenth / 10)) for tenth in range(1, 10) for law in ((0, 0), (0, 1))]


def _harmonics():
    """Order, law, parity and frame (machine or clock) of the harmonics that no cause covers."""
    covered = {(2, (0, 1), False), (2, (2, -1), False), (2, (1, 0), True), (3, (0, 2), False)}
    free = [
        (order, law, odd)
        for order in range(2, ORDERS + 1)
        for law in LAWS
        for odd in (False, True)
        if (order, law, odd) not in covered
    ]
    return [Kind("harmonic", None, (*pattern, machine)) for pattern in free for machine in (True, False)]


SIZES, HARMONICS = _sizes(), _harmonics()
# Law, parity, centre and width, rad.
BUMPS = [
    Kind("bump", None, (law, odd, 2 * np.pi * place / places, np.radians(width_deg)))
    for places, width_deg in ((72, 3.0), (36, 8.0), (18, 16.0))
    for place in range(places)
    for law in ((0, 0), (1, 0), (0, 1))
    for odd in (False, True)
]
