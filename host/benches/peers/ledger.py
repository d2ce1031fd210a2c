"""For every run the scalar products of all columns in play, small least-squares problems on their sums, and the search.

Two metrics are kept: `white` weighs by noise and scatter between runs (evidence), `plain` is the energy on the circle with
the centre free (misfit). Evidence of a set is what it takes off χ² less a price for each member; members enter one by one,
leave when others make them needless, and are exchanged for better ones until nothing improves.
"""
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from circles import COLUMNS, ORDER_OF, Column

# Scaled pivot below which columns are not independent; most members of a set.
DEPENDENT, MOST = 1e-9, 14
# More than the causes, the patterns and what six rounds may propose need, all of them and those with samples of their own.
MOST_COLUMNS, MOST_SAMPLED = 192, 64
# Root mean square below which an explanation is of no interest: share of the noise, and of all that is explained (causes,
# patterns).
SMALLEST_OF_NOISE, SMALLEST_OF_EXPLAINED = 0.12, (0.045, 0.07)


@dataclass
class Item:
    """An explanation that the search may choose, its columns in the ledger and beside which others its shape was fitted."""

    kind: object
    columns: list
    price: float
    fitted_beside: tuple | None = None


class Ledger:
    """Products of columns; column 0 is the data. A block is the columns of one explanation: their low coordinates
    (columns × runs × 17), and what they have outside (columns × runs × samples) or nothing."""

    def __init__(self, runs, spread, data):
        self.kept, self.noise_m2 = spread.kept(runs.visible), spread.noise_m2
        # The centre, order 1, is the operator's, not the machine's.
        weights = np.stack((self.kept / self.noise_m2, np.broadcast_to(ORDER_OF != 1, self.kept.shape)))
        self.weights = weights[:, :, None]
        self.size = self.slots = 0
        self.low = np.empty((MOST_COLUMNS, runs.count, COLUMNS))
        self.outside = np.empty((MOST_SAMPLED, runs.count, runs.samples))
        # Where the outside of a column is kept; −1: it has none.
        self.slot = np.full(MOST_COLUMNS, -1)
        self.products = np.zeros((2, runs.count, MOST_COLUMNS, MOST_COLUMNS))
        self.sums = np.zeros((2, MOST_COLUMNS, MOST_COLUMNS))
        self.push([(data.low[None], data.outside[None])])

    def push(self, blocks):
        """Adds blocks and gives the numbers of their columns."""
        numbers = []
        for low, outside in blocks:
            numbers.append(list(range(self.size, self.size + len(low))))
            self.size += len(low)
            held = 0 if outside is None else len(low)
            self.slot[numbers[-1]] = np.arange(self.slots, self.slots + held) if held else -1
            self.slots += held
        self.replace(numbers, blocks)
        return numbers

    def replace(self, numbers, blocks):
        """Writes blocks and their products with all columns."""
        at = np.concatenate(numbers)
        self.low[at] = low = np.concatenate([low for low, _ in blocks])
        every = self.low[: self.size].transpose(1, 2, 0)
        rows = (low.swapaxes(0, 1) * self.weights) @ every
        outside = [outside for _, outside in blocks if outside is not None]
        if outside:
            own, held = np.flatnonzero(self.slot[at] >= 0), np.flatnonzero(self.slot[: self.size] >= 0)
            outside = np.concatenate(outside)
            self.outside[self.slot[at[own]]] = outside
            beyond = outside.swapaxes(0, 1) @ self.outside[: self.slots].transpose(1, 2, 0)
            beyond = beyond[:, :, self.slot[held]]
            rows[:, :, own[:, None], held] += np.stack((beyond / self.noise_m2, beyond))
        self.products[:, :, at, : self.size] = rows
        self.products[:, :, : self.size, at] = rows.swapaxes(2, 3)
        rows = rows.sum(axis=1)
        self.sums[:, at, : self.size] = rows
        self.sums[:, : self.size, at] = rows.swapaxes(1, 2)

    def truncate(self, size):
        """Takes out all columns from number `size` on."""
        self.size, self.slots = size, 1 + self.slot[:size].max()

    def white(self, weights=None):
        """Evidence products, summed over runs with weights."""
        return self._sum(0, weights)

    def plain(self, weights=None):
        return self._sum(1, weights)

    def _sum(self, metric, weights):
        if weights is None:
            return self.sums[metric, : self.size, : self.size].copy()
        return np.tensordot(weights, self.products[metric, :, : self.size, : self.size], 1)

    def combine(self, columns, amounts):
        """A sum of columns, so many times each: low coordinates, and outside or nothing."""
        columns, amounts = np.array(columns, int), np.array(amounts)
        low = np.tensordot(amounts, self.low[columns], 1)
        held = self.slot[columns] >= 0
        outside = np.tensordot(amounts[held], self.outside[self.slot[columns[held]]], 1) if held.any() else None
        return low, outside


@dataclass
class Solution:
    coefficients: np.ndarray
    covariance: np.ndarray
    gain: float


def factor_of(products, columns):
    """Inverse Cholesky factor of the scaled normal matrix, and the scale; nothing where columns are not independent."""
    gram = products[columns][:, columns]
    own = gram.diagonal()
    if not (own > 0).all():
        return None
    scale = np.sqrt(own)
    try:
        lower = np.linalg.cholesky(gram / (scale[:, None] * scale))
    except np.linalg.LinAlgError:
        return None
    return (np.linalg.inv(lower), scale) if (lower.diagonal() ** 2 >= DEPENDENT).all() else None


def solve(products, columns):
    """Least squares of the data on columns; nothing where they are not independent."""
    factor = factor_of(products, columns)
    if factor is None:
        return None
    inverse, scale = factor
    forward = inverse @ (products[columns, 0] / scale)
    unscaled = inverse / scale
    return Solution(forward @ unscaled, unscaled.T @ unscaled, forward @ forward)


def columns_of(nuisance, items, chosen):
    return [*nuisance, *(column for item in chosen for column in items[item].columns)]


class Bases(NamedTuple):
    """Sets to which items may be added: evidence, forward solution, rows that take a set out of every column, members."""

    worth: np.ndarray
    forward: np.ndarray
    rows: np.ndarray
    members: np.ndarray


class Field:
    """Everything that competes, on one sum of products: scaled, with a blank column where an item has only one."""

    def __init__(self, products, items):
        size = len(products)
        own = products.diagonal()
        self.gram = np.eye(size + 2)
        # A column that is nothing in these runs gains nothing.
        scale = np.where(own > 0, 1 / np.sqrt(np.where(own > 0, own, 1)), 0)
        self.gram[:size, :size] = products * scale[:, None] * scale
        self.right = np.append(products[0] * scale, [0, 0])
        self.first = np.array([item.columns[0] for item in items])
        self.second = np.array([item.columns[1] if len(item.columns) > 1 else size for item in items])
        self.single = self.second == size
        self.price = np.array([item.price for item in items])
        self.listed = np.array([item.kind.listed for item in items])

    def bases(self, nuisance, chosen):
        """The set without each member, and whole."""
        size = len(self.gram) - 2
        pairs = np.column_stack((self.first[chosen], self.second[chosen]))
        columns = np.concatenate((nuisance, pairs.ravel())).astype(int)
        owners = np.concatenate((np.full(len(nuisance), -1), np.repeat(np.arange(len(chosen)), 2)))
        columns, owners = columns[columns < size], owners[columns < size]
        kept = owners != np.arange(len(chosen) + 1)[:, None]
        own = np.where(kept[:, :, None] & kept[:, None, :], self.gram[columns][:, columns], np.eye(len(columns)))
        inverse = np.linalg.inv(np.linalg.cholesky(own))
        forward = (inverse @ (kept * self.right[columns])[:, :, None])[:, :, 0]
        rows = inverse @ (self.gram[columns] * kept[:, :, None])
        prices = self.price[chosen]
        worth = (forward**2).sum(axis=1) - np.append(prices.sum() - prices, prices.sum())
        return Bases(worth, forward, rows, np.append(np.full(len(chosen), len(chosen) - 1), len(chosen)))

    def singles(self, bases):
        """Evidence of each base with each item; −∞ where it is not independent of it."""
        rows, a, b = bases.rows, self.first, self.second
        left = self.right - (bases.forward[:, None, :] @ rows)[:, 0]
        own = 1 - np.einsum("bmi,bmi->bi", rows, rows)
        first, second = own[:, a], own[:, b]
        twice = ~self.single
        across = np.zeros_like(first)
        across[:, twice] = self.gram[a, b][twice] - np.einsum("bmi,bmi->bi", rows[:, :, a[twice]], rows[:, :, b[twice]])
        with np.errstate(divide="ignore", invalid="ignore"):
            pivot = second - across**2 / first
            gain = left[:, a] ** 2 / first + (left[:, b] - across * left[:, a] / first) ** 2 / pivot
        value = gain + bases.worth[:, None] - self.price
        return np.where((first >= DEPENDENT) & (pivot >= DEPENDENT), value, -np.inf)

    def pairs(self, bases, one, other):
        """Evidence of each base with each pair of items."""
        # Of two blanks the other one, so that they are independent.
        blank = self.second[other] + self.single[other]
        columns = np.stack((self.first[one], self.second[one], self.first[other], blank))
        every, at = np.unique(columns, return_inverse=True)
        at = at.reshape(columns.shape)
        rows = bases.rows[:, :, every]
        left = (self.right[every] - (bases.forward[:, None, :] @ rows)[:, 0])[:, at]
        own = (self.gram[every][:, every] - rows.swapaxes(1, 2) @ rows)[:, at[:, None], at[None, :]]
        gain, independent = 0, True
        with np.errstate(divide="ignore", invalid="ignore"):
            for k in range(4):
                pivot = own[:, k, k]
                independent &= pivot >= DEPENDENT
                gain = gain + left[:, k] ** 2 / pivot
                along = own[:, k + 1 :, k] / pivot[:, None]
                left[:, k + 1 :] -= along * left[:, k, None]
                own[:, k + 1 :, k + 1 :] -= along[:, :, None] * own[:, k, None, k + 1 :]
        value = gain + bases.worth[:, None] - (self.price[one] + self.price[other])
        return np.where(independent, value, -np.inf)


def select(products, nuisance, items, start, barred=()):
    """The best set, starting from `start` and without the `barred`, and its evidence (−∞ where none can be told)."""
    chosen = list(start)
    # A start that these runs cannot tell apart is no start.
    if factor_of(products, columns_of(nuisance, items, chosen)) is None:
        chosen = []
        if factor_of(products, nuisance) is None:
            return chosen, -np.inf
    field = Field(products, items)
    for _ in range(4 * MOST):
        bases = field.bases(nuisance, chosen)
        worth = bases.worth
        outside = np.ones(len(items), bool)
        outside[[*chosen, *barred]] = False
        singles = field.singles(bases)
        singles[:, ~outside] = -np.inf
        singles[bases.members >= MOST] = -np.inf
        values = np.column_stack((worth, singles))
        at, which = np.unravel_index(np.argmax(values), values.shape)
        further = [which - 1] if which else []
        if values[at, which] <= worth[-1] + 1e-6:
            # Two that nearly cancel show only together; looked at where one alone no longer helps.
            listed = np.flatnonzero(outside & field.listed)
            i, j = np.triu_indices(len(listed), 1)
            one, other = listed[i], listed[j]
            values = field.pairs(bases, one, other)
            values[bases.members + 2 > MOST] = -np.inf
            at, which = np.unravel_index(np.argmax(values), values.shape)
            if values[at, which] <= worth[-1] + 1e-6:
                break
            further = [one[which], other[which]]
        chosen = [item for k, item in enumerate(chosen) if k != at] + [int(item) for item in further]
    return chosen, worth[-1]


def look_alikes(products, nuisance, items, chosen):
    """Evidence of the set with each member exchanged for each item, members × items, and of the set itself."""
    field = Field(products, items)
    bases = field.bases(nuisance, chosen)
    return field.singles(bases)[:-1], bases.worth[-1]


def energies(products, nuisance, items, chosen):
    """Energy (m²) that each of a set alone accounts for, and all of them."""
    solution = solve(products, columns_of(nuisance, items, chosen))
    if solution is None:
        return np.zeros(len(chosen)), 0.0
    # What leaving out columns costs, by their coefficients and covariance.
    first = len(nuisance) + np.cumsum([0, *(len(items[item].columns) for item in chosen)])[:-1]
    each = solution.coefficients[first] ** 2 / solution.covariance[first, first]
    for k in (k for k, item in enumerate(chosen) if len(items[item].columns) > 1):
        own = slice(first[k], first[k] + 2)
        pair = solution.coefficients[own]
        each[k] = pair @ np.linalg.solve(solution.covariance[own, own], pair)
    return each, max(solution.gain - solve(products, nuisance).gain, 0)


def prune(found, products, samples, share_of_runs, chosen, barred):
    """Drops what is real perhaps but of no interest, the smallest first, and bars it from coming back."""
    chosen = list(chosen)
    while chosen:
        each, whole = energies(products, found.nuisance, found.items, chosen)
        # Beside what was taken out before, too, the search's own may be the error of another's form.
        whole += found.apart_m2 * share_of_runs
        rms = np.sqrt(each / samples)
        share = np.array([SMALLEST_OF_EXPLAINED[not found.items[item].kind.listed] for item in chosen])
        small = (rms < SMALLEST_OF_NOISE * np.sqrt(found.spread.noise_m2)) | (rms < share * np.sqrt(whole / samples))
        if not small.any():
            break
        barred.append(chosen.pop(np.argmin(np.where(small, each, np.inf))))
    return chosen


class Found:
    """What the search found, with all that is needed to refit it."""

    def __init__(self, runs, response, lag, more_lag_s, spread, data, tones, teeth):
        self.runs, self.response, self.lag, self.more_lag_s = runs, response, lag, more_lag_s
        self.spread, self.tones, self.teeth = spread, list(tones), list(teeth)
        # Energy of what was taken out before the search, m².
        self.apart_m2 = sum(tone.energy_m2.sum() for tone in tones) + sum(one.energy_m2(runs) for one in teeth)
        self.ledger = Ledger(runs, spread, data)
        self.nuisance, self.items, self.chosen = [], [], []
        self.solution = self.tangents = None
        self.samples = runs.count * runs.samples

    def add(self, kinds, prices, blocks):
        """Enters explanations."""
        self.items += map(Item, kinds, self.ledger.push(blocks), prices)

    @property
    def columns(self):
        """Columns of nuisance and chosen."""
        return columns_of(self.nuisance, self.items, self.chosen)

    @property
    def kinds(self):
        return [self.items[item].kind for item in self.chosen]

    def residual(self):
        """What nuisance and chosen explanations leave."""
        return Column(*self.ledger.combine([0, *self.columns], [1, *-self.solution.coefficients]))

    def refit(self):
        self.solution = solve(self.ledger.white(), self.columns) or self.solution

    def energies(self):
        return energies(self.ledger.plain(), self.nuisance, self.items, self.chosen)
