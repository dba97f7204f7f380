"""What the drift history finds in simulated laboratories whose truth is known.

Run as ``OPENBLAS_NUM_THREADS=1 python -m tests.benchmarks.drift_findings [--laboratories 30]``. A laboratory:
twenty gyros on three stands, five years of monthly sessions of sixteen positions, 0.005 °/h of noise per position,
biases that scatter by 0.02 °/h from start to start. Means come from `simdevice.laboratory_life` (orientations and
currents of the simulator), the solver solves every session. Each line states what is asked for, the share found, its
binomial standard deviation and the number of cases. The exit code is 1 when a line misses its bound by more than two
of these standard deviations.

- step: one bias of one gyro steps by five of its standard deviations from session to session (scatter of starts and
  noise) at a session between the 7th and the 54th; dated right when the course has the one step there.
- forecast: a bias that drifts by 0.02 to 0.2 °/h a year, described from its first 36, 42, 48 and 54 sessions; the next
  value outside the 95 % band for it.
- stand: azimuth, level about north or about east turned by 1′ between the 6th and the 54th month.
- gyro: every gyro changes by itself, a step of 1 to 30 scatters in one parameter or all, or a drift; how many of these
  are called the stand's, looking at the whole history. Early: looked at when the change is three months old.
- nothing: stands on which nothing changes, looked at after every sixth session for five years; how many are
  ever said to have moved, against the bound of `solver.drift.stands.belief`.
- detectable: turns of the computed size, in the middle of the history, that are found.
- chart: values beyond 3 standard deviations of a baseline of the first 20, beside the stated rate.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import repeat

import numpy as np

from simdevice.fleet import YEAR, Jump
from simdevice.laboratory_life import LaboratoryLife, Move, draw_laboratory
from solver.drift.control.baseline import freeze
from solver.drift.control.charts import individuals
from solver.drift.control.false_alarms import expected
from solver.drift.courses.course import describe
from solver.drift.courses.forecast import predict
from solver.drift.history import History
from solver.drift.stands.attribution import StandHistory, attribute
from solver.drift.stands.belief import Belief
from solver.drift.stands.detectability import detectable
from solver.units import rad_per_s_from_deg_per_h
from tests.solver.drift.laboratories import ARCMIN, stand_histories, with_changing_gyros

YEARS = 5.0
BASELINE = 20
W0X = 4
KNOWN = (36, 42, 48, 54)
"""Sessions from which a forecast is made."""
DIRECTIONS = ("level-east", "level-north", "azimuth")
SESSION_SCATTER = float(np.hypot(rad_per_s_from_deg_per_h(0.02), rad_per_s_from_deg_per_h(0.0016)))
"""Of a bias from session to session: starts, and the noise of sixteen positions."""

Counts = Counter[str]
"""``name`` hits and ``name/of`` cases."""


def bias(history: StandHistory, gyro: int) -> History:
    """A gyro's ω0x over time."""
    mine = history.gyro == gyro
    return History.sorted_from(
        history.time[mine], history.value[mine, W0X], history.u[mine, W0X], history.start[mine]
    )


def gyros_of(laboratory: LaboratoryLife) -> Iterator[tuple[int, History]]:
    """Every gyro's number and its ω0x."""
    for history in stand_histories(laboratory):
        for gyro in np.unique(history.gyro).tolist():
            yield gyro, bias(history, gyro)


def steps(seed: int) -> Counts:
    """One step in every gyro's ω0x."""
    laboratory, rng = draw_laboratory(seed), np.random.default_rng(seed)
    gyros, places = [], []
    for gyro in laboratory.gyros:
        month = int(rng.integers(6, 54))
        size = 5.0 * SESSION_SCATTER * float(rng.choice([-1.0, 1.0]))
        gyros.append(replace(gyro, jumps=(Jump(month * YEAR / 12, {"w0x": size}),)))
        places.append(month)
    told: Counts = Counter()
    for gyro, history in gyros_of(replace(laboratory, gyros=tuple(gyros))):
        changes = describe(history).changes
        told["step dated to its session"] += [change.index for change in changes] == [places[gyro]]
        told["step dated to its session/of"] += 1
        told["step found, other changes beside it allowed"] += places[gyro] in [
            item.index for item in changes
        ]
        told["step found, other changes beside it allowed/of"] += 1
    return told


def forecasts(seed: int) -> Counts:
    """The value after a stretch of a drifting ω0x."""
    laboratory, rng = draw_laboratory(seed), np.random.default_rng(seed)
    slopes = rad_per_s_from_deg_per_h(rng.uniform(0.02, 0.2, len(laboratory.gyros))) / YEAR
    gyros = [
        replace(gyro, drift={"w0x": slope}) for gyro, slope in zip(laboratory.gyros, slopes, strict=True)
    ]
    told: Counts = Counter()
    for _, history in gyros_of(replace(laboratory, gyros=tuple(gyros))):
        for known in KNOWN:
            band = predict(describe(history[:known]), history.time[known], history.u[known])
            within = band.low[0] <= history.value[known] <= band.high[0]
            told["drift: next value outside the 95 % band"] += not within
            told["drift: next value outside the 95 % band/of"] += 1
    return told


def moved_stands(seed: int) -> Counts:
    """Each stand turns by 1′ about one axis."""
    rng, told, moves = np.random.default_rng(seed), Counter[str](), {}
    for number in range(3):
        turn = [0.0, 0.0, 0.0]
        turn[(number + seed) % 3] = ARCMIN * float(rng.choice([-1.0, 1.0]))
        when = float(rng.uniform(0.1, 0.9)) * YEARS * YEAR
        moves[number] = [Move(when, (turn[0], turn[1], turn[2]))]
    for number, history in enumerate(stand_histories(draw_laboratory(seed, moves=moves))):
        axis = DIRECTIONS[(number + seed) % 3]
        findings = [finding for finding in attribute(history) if finding.verdict == "stand"]
        told[f"stand: {axis} 1′ attributed to the stand"] += bool(findings)
        told[f"stand: {axis} 1′ attributed to the stand/of"] += 1
        told[f"stand: {axis} 1′, and to this axis"] += {finding.direction for finding in findings} == {axis}
        told[f"stand: {axis} 1′, and to this axis/of"] += 1
        true = int(np.searchsorted(history.time, moves[number][0].time))
        dated = any(true in [session for session, _ in finding.dates] for finding in findings)
        told[f"stand: {axis} 1′, its date among those told"] += dated
        told[f"stand: {axis} 1′, its date among those told/of"] += 1
    return told


def own_changes(seed: int) -> Counts:
    """Every gyro changes by itself."""
    rng = np.random.default_rng(seed)
    laboratory = with_changing_gyros(draw_laboratory(seed), rng)
    told: Counts = Counter()
    for history in stand_histories(laboratory):
        here = np.unique(history.gyro)
        wrong = sum(finding.verdict == "stand" for finding in attribute(history))
        told["gyro: own change called the stand's"] += wrong
        told["gyro: own change called the stand's/of"] += len(here)
        for gyro in here.tolist():
            jumps = laboratory.gyros[gyro].jumps
            if not jumps:
                continue
            early = until(history, jumps[0].time + 0.25 * YEAR)
            early_wrong = any(finding.verdict == "stand" for finding in attribute(early))
            told["gyro: called the stand's when three months old"] += early_wrong
            told["gyro: called the stand's when three months old/of"] += 1
    return told


def until(history: StandHistory, time: float) -> StandHistory:
    """The history as it was then."""
    last = int(np.searchsorted(history.time, time))
    return StandHistory(*(getattr(history, name)[:last] for name in history.__slots__))


def still_stands(seed: int) -> Counts:
    """Nothing changes, and is looked at again and again."""
    told: Counts = Counter()
    for history in stand_histories(draw_laboratory(seed)):
        looks = (attribute(until(history, history.time[last])) for last in range(1, len(history.time), 6))
        ever = {finding.direction for look in looks for finding in look if finding.verdict == "stand"}
        told["nothing: azimuth or level about north ever found"] += bool(ever & {"azimuth", "level-north"})
        told["nothing: azimuth or level about north ever found/of"] += 1
        told["nothing: level about east ever found"] += "level-east" in ever
        told["nothing: level about east ever found/of"] += 1
    return told


def detectable_turns(seed: int) -> Counts:
    """Each stand turns by what it can reveal."""
    still = stand_histories(draw_laboratory(seed))
    told, moves, axes = Counter[str](), {}, {}
    for number, history in enumerate(still):
        found = detectable(history)
        sizes = (found.level_east, found.level_north, found.azimuth)
        axis = (number + seed) % 3
        turn = [0.0, 0.0, 0.0]
        turn[axis] = sizes[axis]
        axes[number] = DIRECTIONS[axis]
        moves[number] = [Move(float(history.time[found.session]) - 1.0, (turn[0], turn[1], turn[2]))]
        told[f"{DIRECTIONS[axis]} in 0.01″"] += round(sizes[axis] / ARCMIN * 6000)
    for number, history in enumerate(stand_histories(draw_laboratory(seed, moves=moves))):
        hit = any(finding.verdict == "stand" for finding in attribute(history))
        told[f"detectable: {axes[number]} of the computed size found"] += hit
        told[f"detectable: {axes[number]} of the computed size found/of"] += 1
    return told


def charts(seed: int) -> Counts:
    """Values in control, judged by a baseline of the first."""
    told: Counts = Counter()
    for _, history in gyros_of(draw_laboratory(seed)):
        baseline = freeze(history[:BASELINE], "paule-mandel")
        judged = np.arange(len(history)) >= BASELINE
        found = individuals(history, baseline, judged=judged)
        told["chart: values beyond 3 standard deviations"] += len(found.violations)
        told["chart: values beyond 3 standard deviations/of"] += int(judged.sum())
        told["chart stated, per million"] = round(1e6 * expected(baseline, rules=("nelson-1",)).rate)
    return told


TASKS: tuple[Callable[[int], Counts], ...] = (
    steps, forecasts, moved_stands, own_changes, still_stands, detectable_turns, charts,
)  # fmt: skip


def run(task: Callable[[int], Counts], seed: int) -> Counts:
    """One laboratory."""
    return task(seed)


def bounds(stated: float) -> dict[str, tuple[float, float]]:
    """Lowest and highest share that each line may have."""
    never = Belief().false_alarm_bound(YEARS * YEAR)
    attributed = {f"stand: {axis} 1′ attributed to the stand": (0.95, 1.0) for axis in DIRECTIONS}
    revealed = {f"detectable: {axis} of the computed size found": (0.95, 1.0) for axis in DIRECTIONS}
    return {
        "step dated to its session": (0.95, 1.0),
        "drift: next value outside the 95 % band": (0.05, 0.05),
        **attributed,
        "gyro: own change called the stand's": (0.0, 0.02),
        "gyro: called the stand's when three months old": (0.0, 0.02),
        "nothing: azimuth or level about north ever found": (0.0, never),
        "nothing: level about east ever found": (0.0, never),
        **revealed,
        "chart: values beyond 3 standard deviations": (0.0, stated),
    }


def main() -> int:
    """Print the table; 1 when a bound is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--laboratories", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    told: Counts = Counter()
    with ProcessPoolExecutor(2) as pool:
        for number, task in enumerate(TASKS):
            first = 100_000 * asked.seed + 10_000 * number
            for one in pool.map(run, repeat(task), range(first, first + asked.laboratories)):
                stated = one.pop("chart stated, per million", 0)
                told.update(one)
                told["stated"] = max(told["stated"], stated)
    limits, failed = bounds(told["stated"] / 1e6), False
    print(
        f"{asked.laboratories} laboratories for each line: 20 gyros, 3 stands, {YEARS:g} years, monthly sessions\n"
    )
    print(f"{'':52}{'share':>8}{'± s.d.':>8}{'cases':>8}   asked for")
    for name in [key.removesuffix("/of") for key in told if key.endswith("/of")]:
        cases = told[f"{name}/of"]
        share = told[name] / cases
        low, high = limits.get(name, (0.0, 1.0))
        deviation = [float(np.sqrt(p * (1 - p) / cases)) for p in (share, low, high)]
        missed = share < low - 2 * deviation[1] or share > high + 2 * deviation[2]
        failed |= missed
        wanted = "" if name not in limits else f"{low:.2%} to {high:.2%}" + (" MISSED" if missed else "")
        print(f"{name:52}{share:8.2%}{deviation[0]:8.2%}{cases:8d}   {wanted}")
    print("\nSmallest turn that a stand's sessions reveal with 95 % (mean):")
    for axis in DIRECTIONS:
        cases = told[f"detectable: {axis} of the computed size found/of"]
        print(f"  {axis:12} {told[f'{axis} in 0.01″'] / max(1, cases) / 100:5.1f}″")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
