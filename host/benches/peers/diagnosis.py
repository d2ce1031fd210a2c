"""A whole diagnosis of circular tests in NumPy and SciPy: the same work as giotto's own, by the same algorithm.

Basis of low orders, noise and scatter between runs, lag from the turning set-up offset, all causes and patterns as columns,
a search by evidence with pruning, shapes by scan, climb and simplex, tangents, proposals, tones and teeth, refinement of the
response until it settles; intervals, probabilities, look-alikes and misfit; folds by radius and by speed with a time-domain
simulation of each circle left out, and a bootstrap over runs. Left out are words, JSON and what plots draw, and what this
campaign is not: a model given as start, angles that were measured, runs of unequal length.
"""
import ctypes
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from circles import PLACES, Response, Runs, fit_lag, measure_lag, measure_spread
from ledger import SMALLEST_OF_EXPLAINED, SMALLEST_OF_NOISE, Found, prune, select
from machine import measure_gain
from ripples import find_teeth, find_tone
from shapes import finish, improve, polish
from signatures import BUMPS, CAUSES, HARMONICS, LAWS_AND_PARITIES, SIZES, Kind, columns_over, law_of, starting_shapes
from verdict import findings, misfit

PASSES, ROUNDS, TONES = 6, 6, 2
# Change of the response (shares of κ2 and b) and of the lag, s, that does not matter.
SETTLED, SETTLED_LAG_S = (1e-3, 1e-2), 2e-4
# How many of the most promising patterns join the search each time; fewest runs whose scatter says anything.
PROMISING, FEWEST_RUNS = 6, 6
# As tables: order, frame and law of the harmonics, laws of the bumps at each place, and the places.
ORDERS_FRAMES_LAWS = np.array(
    [(order, machine, LAWS_AND_PARITIES.index((law, odd))) for _, _, (order, law, odd, machine) in HARMONICS]
).T
LAWS_OF_BUMPS = [LAWS_AND_PARITIES.index(kind.shape[:2]) for kind in BUMPS if kind.shape[2:] == BUMPS[0].shape[2:]]
PLACES_OF_BUMPS = np.array([kind.shape[2:] for kind in BUMPS[:: len(LAWS_OF_BUMPS)]]).T


class Seen:
    """What is taken out of the samples before the search."""

    def __init__(self):
        self.tones, self.teeth = [], []
        # For how many tones teeth were looked for: a tone may cover them, and pose as them.
        self.looked_beside = None


def explain(survey, response):
    """From a campaign to the set of explanations: prepare, search, refine, and again about the better model."""
    seen, more_lag_s = Seen(), 0.0
    found, longer_s = one_pass(survey, response, more_lag_s, seen, [], None)
    # Scatter is measured well only beside a model, so there are two passes at least.
    known = None
    for _ in range(1, PASSES):
        tones, left = len(seen.tones), found.residual()
        if tones < TONES:
            tone = find_tone(found.runs, left.outside, found.spread.noise_m2)
            if tone and is_material(found, tone) and tone.is_new(seen.tones):
                seen.tones.append(tone)
        refined = refined_response(found, response)
        settled = (
            abs(refined.a_s2 - response.a_s2) <= SETTLED[0] * abs(response.a_s2)
            and abs(refined.b_s4 - response.b_s4) <= SETTLED[1] * abs(refined.b_s4)
            and abs(longer_s) < SETTLED_LAG_S
        )
        kinds = found.kinds
        if settled and tones == len(seen.tones) and known == len(kinds):
            break
        known, response, more_lag_s = len(kinds), refined, more_lag_s + longer_s
        found, longer_s = one_pass(survey, response, more_lag_s, seen, kinds, left.samples(found.runs))
    found.tones = seen.tones
    return found


def is_material(found, tone):
    """Whether a tone is large enough to be of interest; teeth and other tones, too, leave something of the kind."""
    explained = found.energies()[1] + found.apart_m2
    rms = np.sqrt(max(tone.energy_m2.sum(), 0) / found.samples)
    smallest = SMALLEST_OF_EXPLAINED[1] * np.sqrt(explained / found.samples)
    return rms > 2 * SMALLEST_OF_NOISE * np.sqrt(found.spread.noise_m2) and rms > smallest


def refined_response(found, response):
    """Response with the fitted correction of its own coefficient and of the fourth order."""
    amount = dict(zip(found.columns, found.solution.coefficients))
    refined = Response(response.a_s2 + amount[found.nuisance[0]], response.b_s4)
    for item in found.chosen:
        if found.items[item].kind.name == "higher_order_dynamics":
            refined.b_s4 = -2 * amount[found.items[item].columns[0]]
    w2 = found.runs.omega.max() ** 2
    # A response that would blow up within the measured range is no response.
    return refined if 1 + refined.a_s2 * w2 + refined.b_s4 * w2 * w2 > 0.1 else response


def prepare(survey, response, more_lag_s, seen):
    """The runs ready: tones taken out, teeth hidden; and whether what was found before is not to be trusted."""
    lag = measure_lag(survey, response)
    lag.tau_s += more_lag_s
    runs, afresh = survey.about(response, lag), False
    for tone in seen.tones:
        runs.deviation = tone.removed_from(runs, runs.deviation)
    data = runs.misfit()
    if seen.looked_beside != len(seen.tones):
        # Before anything is believed: teeth look like everything.
        whole_m = data.samples(runs)
        seen.teeth = find_teeth(runs, whole_m, measure_spread(runs, whole_m).noise_m2)
        # What was found with a tone or teeth in sight is not to be trusted.
        afresh = seen.looked_beside is not None
        seen.looked_beside = len(seen.tones)
    if seen.teeth:
        runs.hide(np.any([teeth.covers(runs) for teeth in seen.teeth], axis=0))
        data = runs.misfit()
    return runs, lag, data, afresh


def one_pass(survey, response, more_lag_s, seen, kinds, left_m):
    """`kinds` and `left_m`: what the pass before has chosen, and what that left."""
    runs, lag, data, afresh = prepare(survey, response, more_lag_s, seen)
    if afresh:
        kinds, left_m = [], None
    # Once there is a model, what it leaves shows the scatter better than the data do.
    spread = measure_spread(runs, data.samples(runs) if left_m is None else left_m)
    found = Found(runs, response, lag, more_lag_s, spread, data, seen.tones, seen.teeth)
    enter(found, kinds)
    barred, polished = [], []
    for _ in range(ROUNDS):
        before = found.kinds
        found.refit()
        improve(found)
        found.refit()
        if before != polished:
            polish(found)
            polished = found.kinds
        propose(found)
        found.chosen, _ = select(found.ledger.white(), found.nuisance, found.items, found.chosen, barred)
        found.chosen = prune(found, found.ledger.plain(), found.samples, 1.0, found.chosen, barred)
        if found.kinds == before:
            break
    found.refit()
    if found.kinds != polished:
        polish(found)
    return found, finish(found)


def enter(found, kinds):
    """Enters the columns of the model itself, of what was chosen before, and of everything that may compete."""
    runs = found.runs
    own, higher = columns_over([Kind("own"), Kind("higher_order_dynamics")], runs)
    if found.response.b_s4 != 0:
        # The response holds a fourth-order part that the search may still reject: it is given back to the data, to first
        # order exactly as its column would take it.
        ledger = found.ledger
        ledger.replace([[0]], [(ledger.low[:1] - 0.5 * found.response.b_s4 * higher[0], ledger.outside[:1].copy())])
    found.nuisance = found.ledger.push([own])[0]
    entered = [(kind, len(starting_shapes(kind.name, runs)) if kind.listed else 1) for kind in kinds]
    known = {(kind.name, kind.axis) for kind in kinds if kind.listed}
    for name, (axes, _) in CAUSES.items():
        shapes = starting_shapes(name, runs)
        for axis in axes:
            if shapes and (name, axis) not in known:
                entered.append((Kind(name, axis, shapes[0]), len(shapes)))
    entered += [(kind, 1) for kind in SIZES if kind not in kinds]
    every = [kind for kind, _ in entered]
    found.add(every, [kind.price(shapes) for kind, shapes in entered], columns_over(every, runs))
    found.chosen = list(range(len(kinds)))


def propose(found):
    """Looks at what is left of the harmonics and of the places, and lets the best patterns compete."""
    left = found.residual()
    sizes = np.array([law_of(found.runs, law) * (found.runs.sign if odd else 1) for law, odd in LAWS_AND_PARITIES])
    # Of what is left, and also beside each chosen cause as if it were not there: a pattern may describe its data better.
    amount = dict(zip(found.columns, found.solution.coefficients))
    lows = [left.low]
    for item in (found.items[item] for item in found.chosen):
        if item.kind.listed:
            lows.append(left.low + np.tensordot([amount[c] for c in item.columns], found.ledger.low[item.columns], 1))
    offers = [*(harmonics_offered(found, low, sizes) for low in lows), bumps_offered(found, left, sizes)]
    # What each would take off χ² and of the energy, m²; what is dear or small is no offer.
    gains, energies = (np.concatenate([offer[k] for offer in offers]) for k in range(2))
    kinds = [HARMONICS] * len(lows) + [BUMPS]
    prices = np.repeat([of[0].price() for of in kinds], [len(of) for of in kinds])
    smallest_m = 0.3 * SMALLEST_OF_NOISE * np.sqrt(found.spread.noise_m2)
    promising = np.flatnonzero((gains > prices) & (np.sqrt(energies / found.samples) > smallest_m))
    kinds, known, new = sum(kinds, []), {item.kind for item in found.items}, []
    for kind in (kinds[at] for at in promising[np.argsort(-gains[promising], kind="stable")]):
        if len(new) < PROMISING and kind not in known:
            known.add(kind)
            new.append(kind)
    if new:
        found.add(new, [kind.price() for kind in new], columns_over(new, found.runs))


def harmonics_offered(found, low, sizes):
    runs, (orders, machine, rows) = found.runs, ORDERS_FRAMES_LAWS
    by_clock = runs.harmonics_of(low)
    pulls = np.stack([sizes @ by_clock, sizes @ (by_clock * runs.ahead.conj())])
    power, own = np.abs(pulls[machine, rows, orders]) ** 2, (sizes**2).sum(axis=1)[rows]
    variance = found.spread.order_m2 + 2 * found.spread.noise_m2 / runs.samples
    return power / (own * variance[orders]), 0.5 * runs.samples * power / own


def bumps_offered(found, left, sizes):
    sizes, weights = sizes[LAWS_OF_BUMPS], bump_weights(*PLACES_OF_BUMPS)
    pulls = (sizes @ found.runs.place_means(left)) @ weights.T
    own = np.multiply.outer((sizes**2).sum(axis=1), (weights**2).sum(axis=1))
    gain = pulls**2 / own * (found.runs.samples / (found.spread.noise_m2 * PLACES))
    # What takes χ² off white samples takes noise²·χ² of energy.
    return gain.T.ravel(), found.spread.noise_m2 * gain.T.ravel()


def bump_weights(centre_rad, width_rad):
    """Bumps over the places, free of mean and first harmonic."""
    angle = 2 * np.pi * (np.arange(PLACES) + 0.5) / PLACES
    off = (angle - centre_rad[:, None] + np.pi) % (2 * np.pi) - np.pi
    weights = np.exp(-0.5 * (off / width_rad[:, None]) ** 2)
    waves = np.stack((np.full(PLACES, np.sqrt(0.5)), np.cos(angle), np.sin(angle)))
    return weights - 2 / PLACES * (weights @ waves.T) @ waves


def read_durations(runs):
    """Limit and standard error of a clamp of the centripetal acceleration (m/s²), and how many turns were odd otherwise."""
    ratio, reached, wanted = runs.feed / runs.programmed, runs.feed**2 / runs.radius, runs.programmed**2 / runs.radius
    slowed, odd = ratio < 1, (ratio != 1).sum()
    if not odd:
        return None, 0
    n = max(slowed.sum(), 1)
    limit = reached[slowed].sum() / n
    scatter = np.sqrt(((reached[slowed] - limit) ** 2).sum() / n)
    # All at one acceleration, none below it, and nothing above it left at full speed.
    one_limit = slowed.sum() >= 2 and slowed.sum() == odd and scatter < 0.02 * limit
    if one_limit and ((slowed == (wanted > 1.01 * limit)) | (np.abs(wanted / limit - 1) < 0.03)).all():
        # A turn is timed to about a sample in a thousand.
        return (limit, max(scatter / np.sqrt(n), 2e-4 * limit)), 0
    return None, odd


def diagnose(survey, seed=1):
    size_m = survey.deviation.mean(axis=1)
    baseline = Response(fit_lag(size_m, survey.radius, survey.omega, np.ones((1, survey.count)))[0])
    clamp, odd = read_durations(survey)
    found = explain(survey, baseline)
    # Labels that the clock contradicts, and not as a clamp would: nothing that depends on them can be believed.
    if survey.count < FEWEST_RUNS or 4 * odd > survey.count:
        return [], None, misfit(found), found
    clamp_energy_m2 = 0.0
    if clamp:
        programmed = survey.programmed / survey.radius
        off = survey.radius * (found.response.gain(programmed) - found.response.gain(survey.omega))
        clamp_energy_m2 = survey.samples * (off**2).sum()
    stated = findings(found, clamp, clamp_energy_m2)
    gain = measure_gain(found, survey.deviation, clamp[0] if clamp else None, seed)
    return stated, gain, misfit(found), found


# In the order of giotto's list.
NAMES = [
    *("higher_order_dynamics", "radius_offset", "scale_error", "scale_mismatch", "squareness", "servo_mismatch"),
    *("bandwidth_mismatch", "backlash", "lateral_play", "reversal_spike", "cyclic_error", "straightness", "vibration"),
    *("interpolation_chord", "feed_clamp", "thermal_drift", "stick_slip", "joint_lag_mismatch", "joint_reversal"),
]


@contextmanager
def one_blas_thread():
    """Products here are small: a second thread would be woken for each, spin in between, and save nothing."""
    libraries = [ctypes.CDLL(str(path)) for path in Path(np.__file__).parents[1].glob("numpy.libs/*openblas64*")]
    before = [library.scipy_openblas_get_num_threads64_() for library in libraries]
    for library in libraries:
        library.scipy_openblas_set_num_threads64_(1)
    try:
        yield
    finally:
        for library, threads in zip(libraries, before):
            library.scipy_openblas_set_num_threads64_(threads)


def run(data):
    from_file = lambda name: np.fromfile(data[name])
    runs = [from_file(name) for name in ("radius", "feed", "sign", "started")]
    samples = [from_file(name).reshape(len(runs[0]), -1) for name in ("time", "theta", "deviation")]
    with one_blas_thread():
        start = time.perf_counter()
        stated, gain, _, _ = diagnose(Runs(*runs, *samples))
        seconds = time.perf_counter() - start
    value = [gain.percent, *gain.ci95_percent, *gain.folds]
    for finding in stated:
        axis = -1 if finding.axis is None else finding.axis
        value += [NAMES.index(finding.cause), axis, finding.value, finding.half]
    return seconds, [float(number) for number in value]
