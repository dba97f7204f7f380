"""The year of the demonstration laboratory, from an empty book."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from typing import Final

from app.services import access
from app.services.demonstration import judging
from app.services.demonstration.equipment import SEED, equip, era_of, register
from app.services.demonstration.measuring import leave_one_open, measure
from app.services.demonstration.visits import visits
from app.services.drift import studying
from app.services.lab import Lab
from simdevice.fleet import demonstration_fleet

DEMO_ACCOUNT: Final = "sokolov"
_PEOPLE: Final = (("petrova", "I. Petrova", "technician"), (DEMO_ACCOUNT, "A. Sokolov", "metrologist"),
                  ("orlova", "N. Orlova", "quality"))  # fmt: skip


def build(lab: Lab, now: datetime | None = None) -> None:
    """Fill an empty laboratory; one transaction, so that an interrupted build leaves nothing."""
    now = (now or datetime.now(UTC)).replace(microsecond=0)
    fleet = demonstration_fleet(SEED)
    with lab.write(access.SYSTEM) as work:
        work.queue = studying.NoJobs()
        for name, full_name, role in _PEOPLE:
            access.add_account(work, name, role, full_name=full_name)
        register(work, fleet)
        eras = equip(work, now)
        with ThreadPoolExecutor(2) as aside:
            measured = [
                measure(work, visit, era_of(eras, visit.at), aside) for visit in visits(fleet, now, SEED)
            ]
            for solution in measured:
                if solution is not None:
                    solution.store(work)
        judging.enter_the_repair(work, now)
        judging.freeze_baselines(work, fleet, now)
        work.now, work.person = now, access.SYSTEM
        studying.follow_all_now(work)
        judging.acknowledge_the_jump(work, now)
        leave_one_open(work, fleet[2], eras[-1], now)
