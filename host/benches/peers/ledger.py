"""For every run the scalar products of all columns in play, small least-squares problems on their sums, and the search.

Two metrics are kept: `white` weighs by noise and scatter between runs (evidence), `plain` is the energy on the circle with
the centre free (misfit). Evidence of a set is what it takes off χ² less a price for each member; members enter one by one,
leave when others make them needless, and are exchanged for better ones until nothing improves.
"""
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from circles import COLUMNS, ORDER_OF, Column

# Scaled pivot below which columns are not independent.
DEPENDENT = 1e-9
# Most members of a set.
MOST = 14
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
    """Products of columns; column 0 is the data."""

    def __init__(self, runs, spread, data):
        self.kept, self.noise_m2 = spread.kept(runs.visible), spread.noise_m2
        # The centre, order 1, is the operator's, not the machine's.
        weights = np.stack((self.kept / self.noise_m2, np.broadcast_to(ORDER_OF != 1, self.kept.shape)))
        self.weights = weights[:, :, None]
        self.size = self.slots = 0
        count, samples = data.outside.shape
        self.low = np.empty((128, count, COLUMNS))
        self.outside = np.empty((32, count, samples))
        self.slot = np.full(128, -1)
        self.products, self.sums = np.zeros((2, count, 128, 128)), np.zeros((2, 128, 128))
        self.push(data.low[None], data.outside[None])

    def push(self, low, outside=None):
        """Adds columns (columns × runs × …) and gives their numbers."""
        at = np.arange(self.size, self.size + len(low))
        if at[-1] >= len(self.low):
            more = len(self.low)
            self.low = np.concatenate((self.low, np.empty_like(self.low)))
            self.slot = np.concatenate((self.slot, np.full(more, -1)))
            self.products = np.pad(self.products, ((0, 0), (0, 0), (0, more), (0, more)))
            self.sums = np.pad(self.sums, ((0, 0), (0, more), (0, more)))
        self.slot[at] = -1
        if outside is not None:
            slots = np.arange(self.slots, self.slots + len(outside))
            if slots[-1] >= len(self.outside):
                self.outside = np.concatenate((self.outside, np.empty_like(self.outside)))
            self.slot[at] = slots
            self.slots += len(outside)
        self.size += len(low)
        self.replace(at, low, outside)
        return list(at)

    def replace(self, at, low, outside=None):
        """Writes columns and their products with all columns."""
        at = np.asarray(at)
        self.low[at] = low
        own, every = low.swapaxes(0, 1), self.low[: self.size].swapaxes(0, 1)
        rows = (own * self.weights) @ every.swapaxes(1, 2)
        if outside is not None:
            self.outside[self.slot[at]] = outside
            beyond = outside.swapaxes(0, 1) @ self.outside[: self.slots].transpose(1, 2, 0)
            held = np.flatnonzero(self.slot[: self.size] >= 0)
            beyond = beyond[:, :, self.slot[held]]
            rows[0][:, :, held] += beyond / self.noise_m2
            rows[1][:, :, held] += beyond
        self.products[:, :, at, : self.size] = rows
        self.products[:, :, : self.size, at] = rows.swapaxes(2, 3)
        rows = rows.sum(axis=1)
        self.sums[:, at, : self.size] = rows
        self.sums[:, : self.size, at] = rows.swapaxes(1, 2)

    def truncate(self, size):
        """Takes out all columns from number `size` on."""
        self.slots = 1 + max(self.slot[:size], default=-1)
        self.size = size

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
        """Low coordinates and outside (or nothing) of a sum of columns, so many times each."""
        columns, amounts = np.asarray(columns, int), np.asarray(amounts)
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
    """Inverse of the Cholesky factor of the scaled normal matrix, and the scale; nothing where columns are not independent."""
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


def gain_of(products, columns):
    """What columns take off the sum of squares; nothing where they are not independent."""
    factor = factor_of(products, columns)
    if factor is None:
        return None
    inverse, scale = factor
    forward = inverse @ (products[columns, 0] / scale)
    return forward @ forward


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
        # A column that is nothing in these runs spoils no other: it becomes one that is taken out already.
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
        # The second blank, so that two blanks are independent.
        columns = np.stack((self.first[one], self.second[one], self.first[other], self.second[other] + self.single[other]))
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
        if factor_of(products, list(nuisance)) is None:
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
    each, at = np.empty(len(chosen)), len(nuisance)
    for k, item in enumerate(chosen):
        own = slice(at, at + len(items[item].columns))
        at = own.stop
        # What leaving out some columns costs, by their coefficients and covariance.
        left_out = solution.coefficients[own]
        each[k] = left_out @ np.linalg.solve(solution.covariance[own, own], left_out)
    return each, max(solution.gain - gain_of(products, list(nuisance)), 0)


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

    def add(self, kinds, prices, lows, outsides):
        """Enters explanations; their places among the items."""
        first = len(self.items)
        order = [k for k, out in enumerate(outsides) if out is None], [k for k, out in enumerate(outsides) if out is not None]
        columns = {}
        for group, parts in zip(order, (lambda k: None, lambda k: outsides[k])):
            if group:
                outside = None if parts(group[0]) is None else np.concatenate([parts(k) for k in group])
                numbers = iter(self.ledger.push(np.concatenate([lows[k] for k in group]), outside))
                columns |= {k: [next(numbers) for _ in lows[k]] for k in group}
        self.items += [Item(kind, columns[k], price) for k, (kind, price) in enumerate(zip(kinds, prices))]
        return range(first, len(self.items))

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
