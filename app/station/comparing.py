"""The takes that count, beside each other: a position that does not fit the others is measured anew, then refused."""

from app.station.contracts import Currents, Place
from app.station.keeping.entries import Compared, Doubt, Said, Target
from app.station.keeping.history import History
from app.station.workplace import Workplace


def compare(at: Workplace) -> None:
    """Write down whom the comparison makes doubtful, and who is refuted after all.

    Which of two partners is wrong their sum does not tell, so both are measured anew, once. When nothing more is
    to be measured and they still do not fit, neither can be relied on.
    """
    history = at.history
    doubted: list[Doubt] = []
    refuted: list[Doubt] = []
    at_rest = not any(history.wanted(target) for target in history.targets)
    for message, places in at.judge.odd(means(history), history):
        pair = [Doubt(Target(*place), Said.of(message)) for place in places]
        new = [doubt for doubt in pair if doubt.target not in history.doubted]
        if new:
            doubted += new
        elif at_rest:
            refuted += pair
    at.spool.add(Compared(tuple(doubted), tuple(refuted)))


def means(history: History) -> dict[Place, Currents]:
    """Mean currents of the first measurements that count."""
    found = {}
    for target in history.targets:
        take = history.candidate(target)
        if target.repeat == 0 and take is not None and take.judged is not None:
            jx_ma, jy_ma = take.judged.jx_ma, take.judged.jy_ma
            if jx_ma is not None and jy_ma is not None:
                found[target.place] = Currents(jx_ma, jy_ma)
    return found
