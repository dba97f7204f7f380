"""How a job ends badly, in plain words."""

import signal

from app.errors import Problem, problem


def internal_error(reference: str) -> Problem:
    """Nobody foresaw it; `reference` finds its traceback in the log."""
    return problem(
        "internal-error",
        "Driftbook made a mistake while computing. Your data are stored and unchanged; "
        "report the mistake with the reference %(reference)s.",
        reference=reference,
    )


def crashed(times: int, exit_code: int) -> Problem:
    """The computing process died `times` times, the last time with `exit_code` (negative: a signal)."""
    if exit_code == -getattr(signal, "SIGKILL", 9):
        return problem(
            "computation-killed",
            "The operating system ended the computing process %(times)s times, most likely because "
            "memory ran out. Free some memory or give it less to compute, then start it again.",
            times=times,
        )
    return problem(
        "computation-crashed",
        "The computing process broke down %(times)s times (%(how)s). Start it again; "
        "if it breaks down again, report it.",
        times=times,
        how=_how(exit_code),
    )


def timed_out(limit_s: float) -> Problem:
    """One attempt took longer than its task allows."""
    return problem(
        "computation-timeout",
        "The computation was stopped because it took longer than %(limit_s)g s. Give it less to compute.",
        limit_s=limit_s,
    )


def given_up(attempts: int) -> Problem:
    """It was begun again and again and never ended: the service itself was stopped each time."""
    return problem(
        "attempts-exhausted",
        "The computation was started %(attempts)s times and interrupted each time, so it was given up. "
        "Start it again when the service runs undisturbed.",
        attempts=attempts,
    )


def _how(exit_code: int) -> str:
    try:
        return signal.Signals(-exit_code).name
    except ValueError:
        return f"exit code {exit_code}"
