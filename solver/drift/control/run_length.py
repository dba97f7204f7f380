"""Average run length of a control chart: how many values, on average, until it signals, counted from a fresh start.

The values are independent and normal, with a mean `shift` from the centre in true standard deviations σ; where the
chart's own limits lie is given, in σ as well, by what the baseline took σ and µ for. All functions take q such cases
at once. Nothing is simulated:

- run rules of zones: the chart's memory as states of a Markov chain, C. W. Champ and W. H. Woodall, Technometrics 29
  (1987) 393-399; the states are made from the rules and equivalent ones merged. ``L = 1 + Q·L``.
- trends and alternations: from the ranks alone, so whatever the baseline and the distribution; by counting
  permutations.
- EWMA: ``L(s) = 1 + ∫ L(y)·φ((y − (1 − λ)·s)/λ − δ)/λ dy`` over what lies within the limits, S. V. Crowder,
  Technometrics 29 (1987) 401-407; limits that vary in the first steps by going back through them, S. Knoth,
  Sequential Analysis 22 (2003) 241-255.
- CUSUM: ``L(s) = 1 + L(0)·F(k − s) + ∫₀ʰ L(y)·f(y − s + k) dy`` for each side, E. S. Page, Biometrika 41 (1954)
  100-115; both together ``1/L = 1/L⁺ + 1/L⁻``.

Integrals are Gauss and Legendre's sums (Nyström's method, as L. C. Vance, J. Quality Technology 18, 1986, 189-193).
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse, special
from scipy.sparse import linalg

from solver.drift.control.run_rules import RULES, Rule, known
from solver.records import Array

Map = Callable[[Array], Array]

_ZONED: Final = ("beyond", "apart", "within")
_NODES: Final = 64
_FAR: Final = 9.0
"""Limits beyond so many standard deviations of an average are as good as there."""
_GOING: Final = 1.0 - 1e-13
"""Every value ends the run with this little: a run that nothing else ends has a length too."""
_STEADY: Final = 1e-12
"""Change of the probability of going on for another value, when it has become constant."""


def of_rules(names: Sequence[str], edge: Callable[[float], Array], shift: Array) -> Array:
    """Average run length of those of the rules that look at zones, (q,); infinite where there is none.

    Parameters
    ----------
    names
        Codes of `solver.drift.control.run_rules.RULES`.
    edge
        For a width in standard deviations of the chart, the distance of that line from the centre in σ, (q,).
    shift : (q,) array
        Of the mean from the centre, σ.
    """
    zoned = tuple(sorted({name for name in names if known(name).pattern in _ZONED}))
    if not zoned:
        return np.full(len(shift), np.inf)
    widths, table = _automaton(zoned)
    lines = [edge(width) for width in widths]
    both = np.stack([-line for line in reversed(lines) if line.any()] + lines) - shift
    below = np.concatenate((np.zeros((1, len(shift))), special.ndtr(both), np.ones((1, len(shift)))))
    probability = np.diff(below, axis=0)
    count = len(table)
    going = table < count
    row, column = np.nonzero(going)[0], table[going]
    found = np.empty(len(shift))
    for case in range(len(shift)):
        chance = np.broadcast_to(_GOING * probability[:, case], table.shape)[going]
        stay = sparse.csc_array((chance, (row, column)), shape=(count, count))
        found[case] = linalg.splu(sparse.eye_array(count, format="csc") - stay).solve(np.ones(count))[0]
    return found


@lru_cache(maxsize=64)
def _automaton(names: tuple[str, ...]) -> tuple[tuple[float, ...], NDArray[np.int64]]:
    """Lines between zones, and by state and zone (lowest first) the next state; as many as there are: a signal."""
    rules = [RULES[name] for name in names]
    widths = tuple(sorted({rule.width for rule in rules}))
    edges = [-width for width in reversed(widths) if width > 0.0] + list(widths)
    middles = [edges[0] - 1.0, *((low + high) / 2.0 for low, high in pairwise(edges)), edges[-1] + 1.0]
    start = tuple((0,) * (rule.window - 1 if rule.needed < rule.window else 1) for rule in rules)
    number, queue, moves = {start: 0}, [start], []
    for state in queue:  # grows as states are met
        row = []
        for z in middles:
            after = tuple(_next(rule, memory, z) for rule, memory in zip(rules, state, strict=True))
            reached = tuple(memory for memory in after if memory is not None)
            if len(reached) < len(rules):
                row.append(-1)
                continue
            if reached not in number:
                number[reached] = len(number)
                queue.append(reached)
            row.append(number[reached])
        moves.append(row)
    return widths, _merged(np.array(moves))


def _next(rule: Rule, memory: tuple[int, ...], z: float) -> tuple[int, ...] | None:
    """What a rule remembers after a value, None when it is met."""
    if rule.pattern == "within":
        mark = int(abs(z) < rule.width)
    elif rule.pattern == "apart":
        mark = int(abs(z) > rule.width)
    else:
        mark = (z > rule.width) - (z < -rule.width)
    if rule.needed == rule.window:
        run = memory[0] + mark if mark * memory[0] > 0 else mark
        return None if abs(run) >= rule.window else (run,)
    if mark and (*memory, mark).count(mark) >= rule.needed:
        return None
    return (*memory[1:], mark)


def _merged(moves: NDArray[np.int64]) -> NDArray[np.int64]:
    """Merge states that no future tells apart (E. F. Moore); a signal gets the number of states."""
    kind = np.zeros(len(moves) + 1, np.int64)
    kind[-1] = 1
    while True:
        seen = np.column_stack((kind[:-1], kind[moves]))
        _, first, label = np.unique(seen, axis=0, return_index=True, return_inverse=True)
        if len(first) == len(np.unique(kind[:-1])):
            break
        kind = np.append(label, len(first))
    # The state of a fresh start first.
    order = np.argsort(first)
    rank = np.empty(len(order) + 1, np.int64)
    rank[order], rank[-1] = np.arange(len(order)), len(order)
    return np.asarray(rank[np.append(label, len(first))[moves[first[order]]]], np.int64)


@lru_cache(maxsize=4)
def of_orders(names: tuple[str, ...]) -> float:
    """Average run length of those of the rules that look at the order of values only: trends, alternations."""
    steps = min((RULES[name].window - 1 for name in names if known(name).pattern == "trend"), default=0)
    turns = min((RULES[name].window - 2 for name in names if known(name).pattern == "alternating"), default=0)
    if not (steps or turns):
        return float("inf")
    # By the last step's direction, by memory (turns just made: 0, 1, …; then same steps just made: 2, 3, …), and by
    # the rank of the last among n values.
    ones = max(turns, 1)
    alive = np.zeros((2, ones + max(steps - 2, 1), 2))
    alive[0, 0, 0] = alive[1, 0, 1] = 0.5
    total, survived, last = 2.0, 1.0, 0.0
    while True:
        ratio = float(alive.sum()) / survived
        survived *= ratio
        if alive.shape[2] > 2 * (steps + turns) and abs(ratio - last) < _STEADY:
            return total + survived / (1.0 - ratio)
        total, last = total + survived, ratio
        alive = _with_one_more(alive, ones, turns > 0, steps > 0)


def _with_one_more(alive: Array, ones: int, turns: bool, steps: bool) -> Array:
    """The orders of n + 1 values without a pattern, from those of n; as probabilities."""
    n = alive.shape[2]
    below = np.concatenate((np.zeros((*alive.shape[:2], 1)), np.cumsum(alive, axis=2)), axis=2)
    stepped = np.stack((below[:, :, -1:] - below, below)) / (n + 1.0)
    after = np.zeros((2, alive.shape[1], n + 1))
    for way in (0, 1):
        same, other = stepped[way, way], stepped[way, 1 - way]
        if turns:
            after[way, 1:ones] = other[: ones - 1]
            after[way, 1] += other[ones:].sum(axis=0)
        else:
            after[way, 0] = other.sum(axis=0)
        after[way, ones] = same[:ones].sum(axis=0)
        if steps:
            after[way, ones + 1 :] = same[ones:-1]
        else:
            after[way, ones] += same[ones:].sum(axis=0)
    return after


def of_ewma(weight: float, limits: Array, shift: Array) -> Array:
    """Average run length of an exponentially weighted moving average, (q,).

    Parameters
    ----------
    weight
        λ.
    limits : (t, q) array
        Distance of the limits from the centre after 1, 2, … values, σ; the last one holds for all that follow.
    shift : (q,) array
        Of the mean from the centre, σ.
    """
    spread = np.sqrt(weight / (2.0 - weight))
    reach = np.minimum(limits, _FAR * spread + np.abs(shift))
    count = max(_NODES // 2, int(np.ceil(3.0 * reach.max() / weight)))
    nodes, weights = np.polynomial.legendre.leggauss(min(count, 4 * _NODES))

    def kernel(starts: Array, ends: Array) -> Array:
        away = (ends[:, None, :] - (1.0 - weight) * starts[:, :, None]) / weight - shift[:, None, None]
        return np.asarray(np.exp(-np.square(away) / 2.0) / (weight * np.sqrt(2.0 * np.pi)))

    last = reach[-1][:, None]
    chance = kernel(last * nodes, last * nodes) * (last * weights)[:, None, :]
    length = np.linalg.solve(np.eye(len(nodes)) - _GOING * chance, np.ones((*chance.shape[:2], 1)))[:, :, 0]
    for step in range(len(reach) - 1, -1, -1):
        after = reach[step][:, None]
        before = reach[step - 1][:, None] * nodes if step else np.zeros((len(shift), 1))
        length = 1.0 + np.einsum("qij,qj->qi", kernel(before, after * nodes), length * after * weights)
    return np.asarray(length[:, 0])


def of_cusum(allowance: float, decision: float, value: Map, slope: Map, shift: Array) -> Array:
    """Average run length of a two-sided CUSUM, (q,).

    Parameters
    ----------
    allowance, decision
        k and h.
    value, slope
        From a standardised value z, (…, 1), the distance from the centre that has it, σ, and its derivative, (…, q).
    shift : (q,) array
        Of the mean from the centre, σ.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    at = np.append(0.0, decision / 2.0 * (nodes + 1.0))
    step = at[None, 1:] - at[:, None] + allowance
    rate = np.zeros(len(shift))
    for side in (1.0, -1.0):
        down = special.ndtr(value(allowance - at[:, None]) - side * shift)
        away = value(step[:, :, None]) - side * shift
        density = np.exp(-np.square(away) / 2.0) / np.sqrt(2.0 * np.pi) * slope(step[:, :, None])
        chance = np.concatenate((down[:, None, :], density * (decision / 2.0 * weights)[:, None]), axis=1)
        length = np.linalg.solve(
            np.eye(len(at)) - _GOING * chance.transpose(2, 0, 1), np.ones((len(shift), len(at), 1))
        )
        rate += 1.0 / length[:, 0, 0]
    return 1.0 / rate
