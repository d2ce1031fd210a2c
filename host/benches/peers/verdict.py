"""From the chosen explanations to findings: estimate, interval, probability, share, look-alikes; and the misfit by kind."""
from dataclasses import dataclass

import numpy as np
from circles import ORDERS, PLACES, WHOLE, Column
from ledger import look_alikes, select
from scipy.stats import t as student
from signatures import CAUSES, SHAPED

# No probability is certain; one of even odds, give or take rounding, is none.
HIGHEST, EVEN = 0.999, 0.5 - 1e-6
# So many patterns side by side are pieces of one thing that none of them describes; what a cause beside them, without and with
# shapes, must have of their rms.
PIECES, LARGER_THAN_PIECES = 3, (1 / 3, 3)
# Ratio of variances, by the runs and by the model, above which the former is believed.
ROBUST = 1.5
# Evidence within which another cause would explain the data nearly as well.
NEARLY = 6.0


@dataclass
class Finding:
    cause: str
    axis: int | None
    value: float
    half: float
    probability: float
    share_percent: float
    rms_um: float
    look_alikes: tuple = ()


def findings(found, clamp, clamp_energy_m2):
    """Largest share first."""
    products = found.ledger.white()
    each, _ = found.energies()
    tone_energies = [max(tone.energy_m2.sum(), 0) for tone in found.tones]
    teeth_energies = [teeth.energy_m2(found.runs) for teeth in found.teeth]
    total = each.sum() + sum(tone_energies) + sum(teeth_energies) + clamp_energy_m2
    share = lambda energy: 100 * energy / total if total > 0 else 0.0
    rms = lambda energy: 1e6 * np.sqrt(energy / found.samples)
    variances, t = coefficient_variances(found)
    _, best = select(products, found.nuisance, found.items, found.chosen)
    swapped, chosen = look_alikes(products, found.nuisance, found.items, found.chosen)
    out = []
    for at, item in enumerate(found.chosen):
        name, axis, _ = found.items[item].kind
        if name in CAUSES:
            value, half = estimate(found, found.items[item], variances, t)
            odds = best - evidence_without(found, products, at)
            close = [other.kind.name for other, worth in zip(found.items, swapped[at]) if worth > chosen - NEARLY]
            twins = tuple(dict.fromkeys(other for other in close if other in CAUSES and other != name))
            out.append(Finding(name, axis, value, half, sigmoid(0.5 * odds), share(each[at]), rms(each[at]), twins))
    patterns = [energy for item, energy in zip(found.chosen, each) if not found.items[item].kind.listed]
    pieces, unexplained = len(patterns), sum(patterns)

    def bent(finding):
        """Whether the best set does without it, or it may be a piece of something unlisted, or of teeth."""
        flexible = finding.cause in SHAPED or finding.cause == "lateral_play"
        piece = pieces >= PIECES and finding.rms_um < LARGER_THAN_PIECES[flexible] * rms(unexplained)
        smear = any(
            teeth.axis == finding.axis and finding.rms_um < 0.25 * rms(energy)
            for teeth, energy in zip(found.teeth, teeth_energies)
        )
        return finding.probability < EVEN or piece or (flexible and smear)

    out = joined([finding for finding in out if not bent(finding)])
    if clamp:
        limit, se = clamp
        energy = clamp_energy_m2
        out.append(Finding("feed_clamp", None, 1e3 * limit, 2e3 * se, HIGHEST, share(energy), rms(energy)))
    if pieces < PIECES or sum(tone_energies) >= 9 * unexplained:
        out += [tone_finding(tone, share(energy), rms(energy)) for tone, energy in zip(found.tones, tone_energies)]
    for teeth, energy in zip(found.teeth, teeth_energies):
        probability = sigmoid(0.5 * teeth.significance**2 - 14)
        value, half = 1e6 * teeth.height_m, 2e6 * teeth.se_m
        out.append(Finding("stick_slip", teeth.axis, value, half, probability, share(energy), rms(energy)))
    return sorted(out, key=lambda finding: -finding.share_percent)


def tone_finding(tone, share, rms):
    # The frequency is sharper than the model of it: a part in 1e5 for the clock of the instrument.
    se_hz = np.hypot(tone.se_hz, 1e-5 * tone.frequency_hz)
    probability = sigmoid(min(tone.law_evidence, 50))
    names = "interpolation_chord", "vibration"
    name, other = names if tone.centripetal else names[::-1]
    twins = (other,) if tone.law_evidence < 3 else ()
    if tone.centripetal:
        period = 1 / tone.frequency_hz
        return Finding(name, None, period, 2 * se_hz * period**2, probability, share, rms, twins)
    return Finding(name, tone.axis, tone.frequency_hz, 2 * se_hz, probability, share, rms, twins)


def sigmoid(log_odds):
    return min(1 / (1 + np.exp(-log_odds)), HIGHEST)


def coefficient_variances(found):
    """Variances of the coefficients of nuisance, chosen and tangents, and Student's t of their intervals."""
    tangents = found.tangents
    columns = np.array(tangents.columns if tangents else found.columns)
    solution = tangents.solution if tangents else found.solution
    runs, n = found.runs.count, len(columns)
    # By the scatter of the runs' pulls, with the run as the cluster.
    white = found.ledger.products[0][:, columns]
    pulls = white[:, :, 0] - white[:, :, columns] @ solution.coefficients
    small = runs / max(runs - n, 1)
    robust = np.diagonal(solution.covariance @ (pulls.T @ pulls) @ solution.covariance) * small
    model = np.diagonal(solution.covariance)
    # That scatter is itself uncertain by a quarter or so: it counts where it says clearly more.
    variances = dict(zip(columns, np.where(robust > ROBUST * model, robust, model)))
    return variances, student.ppf(0.975, max(runs - len(found.columns), 1))


def estimate(found, item, variances, t):
    """Value and half-width of its 95 % interval."""
    amount = dict(zip(found.columns, found.solution.coefficients))
    values = np.array([amount[column] for column in item.columns])
    own = np.array([variances[column] for column in item.columns])
    _, doubt = CAUSES[item.kind.name]
    if len(values) == 1:
        value, se = values[0], np.sqrt(own[0])
    else:
        value = max(np.hypot(*values), 1e-300)
        se = np.sqrt(((values / value) ** 2) @ own)
    return value, np.hypot(t * se, 1.96 * doubt * value)


def evidence_without(found, products, at):
    """Evidence of the best set that does without a cause; it may take in what is too small to be stated."""
    name = found.items[found.chosen[at]].kind.name
    barred = [k for k, item in enumerate(found.items) if item.kind.name == name]
    rest = [item for k, item in enumerate(found.chosen) if k != at]
    return select(products, found.nuisance, found.items, rest, barred)[1]


def joined(findings):
    """One finding where both axes show the same cause of the same size."""
    out = []
    for finding in findings:
        same = [other for other in out if other.cause == finding.cause and None not in (other.axis, finding.axis)]
        twin = same[0] if same else None
        off = abs(twin.value - finding.value) if twin else np.inf
        if twin and (off < 2 * (twin.half + finding.half) or off < 0.1 * abs(twin.value)):
            twin.axis = None
            twin.value, twin.half = 0.5 * (twin.value + finding.value), 0.5 * np.hypot(twin.half, finding.half)
            twin.share_percent += finding.share_percent
            twin.rms_um = np.hypot(twin.rms_um, finding.rms_um)
            twin.probability = max(twin.probability, finding.probability)
        else:
            out.append(finding)
    return out


def misfit(found):
    """What the baseline leaves, µm: all, size, drift, harmonics even and odd, localised, periodic, the rest."""
    runs, ledger = found.runs, found.ledger
    data, own = Column(ledger.low[0], ledger.outside[0]), ledger.low[found.nuisance[0]]
    amount = (data.low * own).sum() / (own * own).sum()
    left = Column(data.low - amount * own, data.outside)
    centred = np.delete(left.low, [1, 2], axis=1)
    whole = (centred**2).sum() + (left.outside**2).sum()
    # Of a circle that teeth hide for the most part no harmonics are read.
    seen = (runs.visible > WHOLE * runs.samples)[:, None]
    waves = np.where(seen, runs.harmonics_of(left.low), 0)
    sizes = waves[:, 0].real
    size = runs.samples * (sizes**2).sum()
    even, odd = parity(runs, waves[:, 2:])
    places = localised(runs.place_means(left).mean(axis=0)) * found.samples / PLACES
    tone = max(sum(tone.energy_m2.sum() for tone in found.tones), 0)
    teeth = sum(teeth.energy_m2(runs) for teeth in found.teeth)
    time = runs.elapsed - runs.elapsed.mean()
    along = time @ (sizes - sizes.mean())
    drift = along**2 / max(time @ time, 1e-300) / runs.count
    energies = [whole + tone + teeth, size, drift * found.samples, even, odd, places + teeth, tone]
    energies.append(whole - size - even - odd - places)
    return 1e6 * np.sqrt(np.maximum(energies, 0) / found.samples)


def parity(runs, waves):
    """Energy that is the same in both directions, and that flips, by pairs of one radius and speed; a run without a twin
    counts half to each."""
    same = lambda of: np.abs(np.divide.outer(of, of) - 1) < 1e-6
    twins = same(runs.radius) & same(runs.programmed) & (np.multiply.outer(runs.sign, runs.sign) < 0)
    has, twin = twins.any(axis=1), twins.argmax(axis=1)
    here, there = (np.abs(0.5 * (waves + way * waves[twin])) ** 2 for way in (1, -1))
    alone = 0.5 * np.abs(waves) ** 2
    return [0.5 * runs.samples * np.where(has[:, None], of, alone).sum() for of in (here, there)]


def localised(mean):
    """Sum of squares over the places beyond the eighth harmonic."""
    angle = 2 * np.pi * (np.arange(PLACES) + 0.5) / PLACES
    waves = np.exp(-1j * np.multiply.outer(np.arange(1, ORDERS + 1), angle))
    return ((mean - 2 / PLACES * ((waves @ mean) @ waves.conj()).real) ** 2).sum()
