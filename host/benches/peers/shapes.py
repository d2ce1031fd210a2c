"""Fitting what bends a signature: pitch, time constants, play; and what a shape or the lag may still be off by.

A coarse scan on a stratified part of the runs, then along tangents to the nearest best, or by a simplex where there is no
slope; each trial costs one column, not one refit of everything. Tangents fitted beside the chosen columns move their
shapes to the best beside each other, and intervals count them in.
"""
from dataclasses import dataclass

import numpy as np
from circles import Column
from ledger import DEPENDENT, Solution, columns_of, factor_of, solve
from scipy.fft import rfft
from signatures import SHAPED, SMOOTH, Kind, columns_over, finest_wave_per_m, samples, starting_shapes, step_of, tidy, waves

# Runs of the coarse scan; share of its price above which a scan is worth refining.
SCAN_RUNS, PROMISING = 16, 0.6
# χ² within which a simplex has arrived, and for which a move along tangents is worth while.
CLOSE, WORTH = 0.5, 0.3
# Most moves of a climb, and of a polish; longest move of a shape at once, in steps.
CLIMBS, POLISHES, LONGEST = 6, 4, 8.0
# Standard deviation of a shape about where it is, in steps; of a choice, whose other value is one step away.
PRIOR, PRIOR_OF_CHOICE = 20.0, 0.6
LAG_STEP_S, LONGEST_LAG_S = 1e-4, 5e-3
SHARES = (1.0, 0.4, 0.1)
# Bins to the shortest wave, and points of the spectrum to one wave more or less over the longest travel.
BINS, FINENESS = 12.0, 4.0


class Beside:
    """What trial columns take off χ² beside some columns of the ledger, over all runs or those of a part."""

    def __init__(self, found, columns, part=None):
        ledger, base = found.ledger, np.array([0, *columns])
        rows, self.runs = part or (slice(None), found.runs)
        self.kept, self.basis, self.noise_m2 = ledger.kept[rows], self.runs.basis.swapaxes(1, 2), ledger.noise_m2
        self.low = (ledger.low[base][:, rows] * self.kept).reshape(len(base), -1)
        self.held = np.flatnonzero(ledger.slot[base] >= 0)
        self.outside = ledger.outside[ledger.slot[base[self.held]]][:, rows].reshape(len(self.held), -1)
        self.gram = ledger.products[0][rows][:, base][:, :, base].sum(axis=0)
        self.factor = factor_of(self.gram, list(range(1, len(base))))
        if self.factor:
            self.inverse, self.scale = self.factor
            self.forward = self.inverse @ (self.gram[1:, 0] / self.scale)

    def products(self, name, axis, shapes):
        """White products of trial columns with the base and with each other."""
        known = [waves(Kind(name, axis, shape), self.runs) for shape in shapes]
        if known[0] is not None:
            low = self.runs.low_of(np.concatenate(known))
            flat = low.reshape(len(low), -1)
            cross, own = flat @ self.low.T, (low * self.kept).reshape(len(low), -1) @ flat.T
            return cross / self.noise_m2, own / self.noise_m2
        trial = samples(name, axis, shapes, self.runs)
        if self.runs.hidden is not None:
            trial *= ~self.runs.hidden
        low = (trial.swapaxes(0, 1) @ self.basis).swapaxes(0, 1)
        # The samples still hold their low orders: what they are multiplied with outside has none.
        trial, flat = trial.reshape(len(low), -1), low.reshape(len(low), -1)
        cross = flat @ self.low.T
        cross[:, self.held] += trial @ self.outside.T
        own = trial @ trial.T - (low * (1 - self.kept)).reshape(len(low), -1) @ flat.T
        return cross / self.noise_m2, own / self.noise_m2

    def gains(self, name, axis, shapes):
        """What each shape takes off χ²; 0 where it is not independent of the base."""
        wide = Kind(name).columns
        if not self.factor:
            return np.zeros(len(shapes))
        cross, own = self.products(name, axis, shapes)
        length = np.sqrt(np.maximum(np.diagonal(own), 1e-300))
        rows = self.inverse @ (cross[:, 1:] / self.scale).T / length
        left = cross[:, 0] / length - self.forward @ rows
        own = own / np.multiply.outer(length, length) - rows.T @ rows
        first = np.arange(0, len(length), wide)
        pivot = np.diagonal(own)[first]
        gain, independent = left[first] ** 2 / pivot, pivot >= DEPENDENT
        if wide == 2:
            across = own[first, first + 1]
            pivot = np.diagonal(own)[first + 1] - across**2 / np.diagonal(own)[first]
            gain = gain + (left[first + 1] - across * left[first] / np.diagonal(own)[first]) ** 2 / pivot
            independent &= pivot >= DEPENDENT
        return np.where(independent, gain, 0)

    def slope(self, name, axis, shape, steps):
        """The gain of a shape, what tangents promise to add to it, and how many steps they lead along each parameter."""
        wide, known = Kind(name).columns, len(self.gram)
        moved = [tuple(v + (k == which) * step for k, v in enumerate(shape)) for which, step in enumerate(steps)]
        cross, own = self.products(name, axis, [shape, *moved])
        products = np.block([[self.gram, cross.T], [cross, own]])
        plain = list(range(1, known + wide))
        fitted = solve(products, plain) if self.factor else None
        if fitted is None:
            return None
        amounts = fitted.coefficients[known - 1 :]
        # A tangent is what its moved columns do beyond those here, at the amounts fitted here.
        size = known + wide + len(steps)
        parts = np.zeros((size, len(products)))
        parts[: known + wide, : known + wide] = np.eye(known + wide)
        for which in range(len(steps)):
            parts[known + wide + which, known : known + wide] = -amounts
            at = known + (which + 1) * wide
            parts[known + wide + which, at : at + wide] = amounts
        along = parts @ products @ parts.T
        tangents = np.arange(known + wide, size)
        along[tangents, tangents] += PRIOR**-2
        climbed = solve(along, list(range(1, size)))
        if climbed is None:
            return None
        gain = fitted.gain - self.forward @ self.forward
        return gain, climbed.gain - fitted.gain, climbed.coefficients[known + wide - 1 :]


class Task:
    """A shape to be fitted beside the other chosen explanations."""

    def __init__(self, found, item):
        self.item = found.items[item]
        self.name, self.axis, self.shape = self.item.kind
        self.chosen = item in found.chosen
        self.columns = tuple(columns_of(found.nuisance, found.items, [i for i in found.chosen if i != item]))

    @staticmethod
    def of(found, item):
        """Nothing: it has no shape, or none that is to be fitted here and now."""
        name = found.items[item].kind.name
        # What is chosen and has a slope is climbed beside all others.
        if name not in SHAPED or (item in found.chosen and name in SMOOTH):
            return None
        task = Task(found, item)
        if task.item.fitted_beside == task.columns:
            return None
        task.item.fitted_beside = task.columns
        return task

    def best(self, found, part, pulls):
        """The best shape; the one it has if there is none that promises anything. `part`: what to scan on."""
        name, axis, runs, start = self.name, self.axis, found.runs, self.shape
        shapes = starting_shapes(name, runs)
        if not self.chosen:
            # A scan of a part of the runs sees that part of the gain.
            share = runs.count / min(SCAN_RUNS, runs.count)
            if name == "cyclic_error":
                gain, start = scan_pitches(found, pulls, axis)
            else:
                gains = part.gains(name, axis, shapes)
                gain, start = share * gains.max(), shapes[np.argmax(gains)]
            if gain <= PROMISING * self.item.price:
                return self.shape
        if name == "servo_mismatch":
            return shapes[np.argmax(Beside(found, self.columns).gains(name, axis, shapes))]
        if name in SMOOTH:
            return tidy(name, self._climb(found, part, start))
        shape = simplex(start, 0.15, 40, lambda trials: part.gains(name, axis, trials))
        if self.chosen:
            whole = Beside(found, self.columns)
            shape = simplex(shape, 0.03, 20, lambda trials: whole.gains(name, axis, trials))
        return shape

    def _climb(self, found, part, shape):
        """From a shape to the nearest best one along its tangents, over the runs of the scan."""
        for _ in range(CLIMBS):
            steps = np.array([step_of(self.name, value, 2 * found.runs.largest) for value in shape])
            slope = part.slope(self.name, self.axis, shape, steps)
            if slope is None or slope[1] < WORTH:
                break
            gain, _, ways = slope
            moves = np.clip(ways, -LONGEST, LONGEST) * steps
            for share in SHARES:
                moved = tidy(self.name, np.array(shape) + share * moves)
                if part.gains(self.name, self.axis, [moved])[0] > gain + 0.1 * WORTH:
                    shape = moved
                    break
            else:
                break
        return shape


def settle(found, tasks, shapes):
    """Takes the shapes over."""
    changed = [(task.item, shape) for task, shape in zip(tasks, shapes) if shape != task.shape]
    for item, shape in changed:
        item.kind = item.kind._replace(shape=shape)
    relay(found, [item for item, _ in changed])


def relay(found, items):
    """Brings the columns of items up to date."""
    if items:
        found.ledger.replace([item.columns for item in items], columns_over([item.kind for item in items], found.runs))


def improve(found):
    """Gives every shaped cause its best shape beside the other chosen explanations: those that are chosen one after the
    other, each beside what those before it have become, then all others at once."""
    rows = stratified(found.runs)
    part = rows, found.runs.take(rows)
    for item in sorted(found.chosen):
        task = Task.of(found, item)
        if task:
            settle(found, [task], [task.best(found, Beside(found, task.columns, part), None)])
    tasks = [Task.of(found, item) for item in range(len(found.items)) if item not in found.chosen]
    tasks = [task for task in tasks if task]
    if tasks:
        beside, ledger = Beside(found, tasks[0].columns, part), found.ledger
        # V⁻¹ times what the chosen explanations leave: its product with a column is that column's pull.
        left = found.residual()
        pulls = Column(left.low * ledger.kept, left.outside).samples(found.runs) / ledger.noise_m2
        settle(found, tasks, [task.best(found, beside, pulls) for task in tasks])


def stratified(runs):
    """Every so many runs in the order of radius and feed."""
    order = np.lexsort((runs.sign, runs.feed, runs.radius))
    count = min(SCAN_RUNS, runs.count)
    step = max(runs.count / SCAN_RUNS, 1.0)
    return order[((np.arange(count) + 0.5) * step).astype(int) % runs.count]


def scan_pitches(found, pulls, axis):
    """Gain and pitch of the best periodic error. r = A·cosψ·sin(w·x + φ), x = R·cosψ, is one frequency over x, whatever the
    radius: what pulls at each place, folded into fine bins, holds every pitch in one transform."""
    runs, noise_m2 = found.runs, found.ledger.noise_m2
    finest_per_m = finest_wave_per_m(runs)
    bins_per_m = BINS * finest_per_m
    # The energy is read at twice the frequency.
    length = 1 << int(FINENESS * 2 * runs.largest * bins_per_m).bit_length()
    along = runs.direction[axis]
    seen = 1 if runs.hidden is None else ~runs.hidden
    place = ((runs.largest + runs.radius[:, None] * along) * bins_per_m).astype(int).ravel()
    pull = rfft(np.bincount(place, (along * pulls * seen).ravel(), length))
    own = rfft(np.bincount(place, (along * along * seen).ravel(), length))
    step_per_m = bins_per_m / length
    whole = own[0].real
    lowest = max(int(np.ceil(1 / (runs.largest * step_per_m))), 1)
    highest = min(int(finest_per_m / step_per_m), length // 4)
    k = np.arange(lowest, highest + 1)
    # From the first bin to the middle of the travel, where x = 0.
    turn = np.exp(2j * np.pi * k * ((runs.largest * bins_per_m - 0.5) / length))
    pull, doubled = pull[k] * turn, (own[2 * k] * turn * turn).real
    energy = 0.5 * np.stack((whole + doubled, whole - doubled))
    power = np.stack((pull.real, pull.imag)) ** 2
    gains = noise_m2 * np.where(energy > 1e-6 * whole, power / energy, 0).sum(axis=0)
    best = np.argmax(gains)
    return gains[best], (1 / (k[best] * step_per_m),)


def simplex(start, first_step, most, scores):
    """Nelder–Mead upwards; each parameter first moves by a share of itself, or by 1 ms (or mm) from zero."""
    score = lambda point: scores([tuple(point)])[0]
    points = [np.array(start)]
    for axis, value in enumerate(start):
        points.append(points[0].copy())
        points[-1][axis] += first_step * value if abs(value) > 1e-9 else 1e-3
    points = [(score(point), point) for point in points]
    for _ in range(most):
        points.sort(key=lambda point: -point[0])
        worst, best = points[-1], points[0]
        centre = np.mean([point for _, point in points[:-1]], axis=0)

        def towards(factor):
            point = centre + factor * (worst[1] - centre)
            return score(point), point

        reflected = towards(-1.0)
        if reflected[0] > best[0]:
            expanded = towards(-2.0)
            points[-1] = expanded if expanded[0] > reflected[0] else reflected
        elif reflected[0] > points[-2][0]:
            points[-1] = reflected
        else:
            drawn = towards(0.5)
            if drawn[0] > worst[0]:
                points[-1] = drawn
            else:
                shrunk = [0.5 * (point + best[1]) for _, point in points[1:]]
                points[1:] = [(score(point), point) for point in shrunk]
        values = [value for value, _ in points]
        if max(values) - min(values) < CLOSE:
            break
    # Of points that are equal the last.
    return tuple(float(value) for value in max(reversed(points), key=lambda point: point[0])[1])


@dataclass
class Tangents:
    """Nuisance, chosen, and what shapes (item, parameter, step) and the lag may be off by, fitted together."""

    shapes: list
    lag: bool
    columns: list
    solution: Solution


def lay(found, whole):
    """Lays tangents into the ledger, behind the columns that are there: of the amounts, or of choices and the lag, too."""
    runs, ledger = found.runs, found.ledger
    travel_m = 2 * max(runs.largest, 1e-3)
    columns, shapes, moved, priors = found.columns, [], [], []
    amount = dict(zip(columns, found.solution.coefficients))
    items = [found.items[item] for item in found.chosen]
    for item in items:
        name, axis, shape = item.kind
        for which, value in enumerate(shape if name in SMOOTH or (whole and name == "servo_mismatch") else ()):
            step = step_of(name, value, travel_m) if name in SMOOTH else 1 - 2 * value
            priors.append(PRIOR if name in SMOOTH else PRIOR_OF_CHOICE)
            shapes.append((item, which, step))
            moved.append(Kind(name, axis, (*shape[:which], value + step, *shape[which + 1 :])))
    # Angles that were measured hold no lag.
    lag = whole and runs.turned.any() and found.lag.se_s > 0
    if not shapes and not lag:
        return None
    if moved:
        for (item, *_), block in zip(shapes, columns_over(moved, runs)):
            columns.append(push_tangent(found, [item], [block], amount))
    if lag:
        late = columns_over([item.kind for item in items], runs.turn_to(runs.lag + LAG_STEP_S * runs.omega))
        columns.append(push_tangent(found, items, late, amount))
    products = ledger.white()
    at = np.array(columns[len(columns) - len(shapes) - lag :])
    for column, prior in zip(at, priors):
        products[column, column] += prior**-2
    if lag:
        # About what the set-up offset says.
        stiff = (LAG_STEP_S / found.lag.se_s) ** 2
        products[at[-1], at[-1]] += stiff
        products[at[-1], 0] -= stiff * found.more_lag_s / LAG_STEP_S
    solution = solve(products, columns)
    return solution and Tangents(shapes, lag, columns, solution)


def push_tangent(found, items, moved, amount):
    """The column of what items do as moved, beyond what they do now, at their present amounts."""
    now = [column for item in items for column in item.columns]
    low, outside = found.ledger.combine(now, [-amount[column] for column in now])
    for item, (lows, outsides) in zip(items, moved):
        amounts = [amount[column] for column in item.columns]
        low += np.tensordot(amounts, lows, 1)
        if outsides is not None:
            outside += np.tensordot(amounts, outsides, 1)
    return found.ledger.push([(low[None], None if outside is None else outside[None])])[0][0]


def polish(found):
    """Moves the shapes of the chosen explanations to their best beside each other."""
    for _ in range(POLISHES):
        size = found.ledger.size
        tangents = lay(found, False)
        found.ledger.truncate(size)
        if tangents is None or tangents.solution.gain - found.solution.gain < WORTH or not step(found, tangents):
            return


def step(found, tangents):
    """One move along the tangents, shortened until it gains; whether there is one."""
    first = len(tangents.columns) - len(tangents.shapes)
    ways = np.clip(tangents.solution.coefficients[first:], -LONGEST, LONGEST)
    items = list({id(item): item for item, *_ in tangents.shapes}.values())
    before, solution = [item.kind for item in items], found.solution
    for share in SHARES:
        for item, kind in zip(items, before):
            shape = np.array(kind.shape)
            for (owner, which, size), way in zip(tangents.shapes, ways):
                if owner is item:
                    shape[which] += share * way * size
            item.kind = kind._replace(shape=tuple(float(value) for value in tidy(kind.name, shape)))
        relay(found, items)
        found.refit()
        if found.solution.gain > solution.gain + 0.1 * WORTH:
            return True
    for item, kind in zip(items, before):
        item.kind = kind
    relay(found, items)
    found.solution = solution
    return False


def finish(found):
    """Lays the tangents for good, so that intervals count them in; how much longer the lag ought to be, s."""
    found.tangents = lay(found, True)
    if found.tangents is None or not found.tangents.lag:
        return 0.0
    return float(np.clip(LAG_STEP_S * found.tangents.solution.coefficients[-1], -LONGEST_LAG_S, LONGEST_LAG_S))
