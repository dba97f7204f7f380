"""Names of things in words: parameters and their symbols, units, verdicts, states, roles."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Final

from markupsafe import Markup

from app.i18n import LOCALE, gettext, marked, translate
from app.services.views import JobView, ResultSummary, SessionView

VEGA_VERSION: Final = version("vl-convert-python")
"""Of the wheel that carries the Vega bundle."""

_SYMBOLS: Final = {
    "kx": ("K", "x"), "ky": ("K", "y"), "kxy": ("K", "xy"), "kyx": ("K", "yx"),
    "w0x": ("ω", "0x"), "w0y": ("ω", "0y"), "wg": ("ω", "g"), "wk": ("ω", "k"), "wn": ("ω", "n"),
    "jx": ("J", "x"), "jy": ("J", "y"), "theta": ("θ", ""), "psi": ("ψ", ""),
    "alpha": ("α", ""), "beta": ("β", ""), "gamma": ("γ", ""), "u": ("u", ""), "U": ("U", ""),
    "k": ("k", ""), "nu": ("ν", ""), "chi2": ("χ", "²"), "p": ("p", ""), "phi": ("φ", ""),
    "wh": ("ω", "h"), "wv": ("ω", "v"), "nx": ("n", "x"), "ny": ("n", "y"), "nz": ("n", "z"),
}  # fmt: skip
_RUSSIAN_INDEX: Final = {"wk": "к", "wn": "н", "wh": "г", "wv": "в"}

PARAMETER_NAMES: Final = {
    "kx": marked("Scale factor, x"), "ky": marked("Scale factor, y"),
    "kxy": marked("Cross-coupling, y into x"), "kyx": marked("Cross-coupling, x into y"),
    "w0x": marked("Fixed drift, x"), "w0y": marked("Fixed drift, y"),
    "wg": marked("g-drift, direct"), "wk": marked("g-drift, quadrature"),
}  # fmt: skip
"""The eight parameters in words; pass through `parameter`."""

PARAMETER_UNITS: Final = {
    **dict.fromkeys(("kx", "ky", "kxy", "kyx"), "deg/h/mA"), **dict.fromkeys(("w0x", "w0y"), "deg/h"),
    **dict.fromkeys(("wg", "wk"), "deg/h/g"),
}  # fmt: skip
"""Unit of each parameter; pass through `unit`."""

_SUFFIXES: Final = {
    **dict.fromkeys(("kx", "ky", "kxy", "kyx"), "deg_per_h_per_ma"),
    **dict.fromkeys(("w0x", "w0y"), "deg_per_h"), **dict.fromkeys(("wg", "wk"), "deg_per_h_per_g"),
}  # fmt: skip

_UNITS: Final = {
    "deg/h/mA": marked("°/h/mA"), "deg/h": marked("°/h"), "deg/h/g": marked("°/h/g"),
    "deg/h/g2": marked("°/h/g²"), "mA": marked("mA"),
    "µA": marked("µA"), "nA": marked("nA"), "s": marked("s"), "Hz": marked("Hz"), "arcsec": "″",
    "deg": "°", "°C": "°C", "ppm": marked("ppm"), "K": marked("K"),
}  # fmt: skip

_ROLES: Final = {
    "technician": marked("technician"), "metrologist": marked("metrologist"),
    "quality": marked("quality manager"), "automation": marked("automation"),
    "designer": marked("design engineer"), "admin": marked("administrator"),
}  # fmt: skip

_METHODS: Final = {
    "least-squares": marked("Least squares"), "paper": marked("Paper’s iteration"),
    "both": marked("Both methods"), "generalised": marked("Generalised least squares"),
    "robust": marked("Robust (Huber)"),
}  # fmt: skip

_ORIGINS: Final = {
    "typed": marked("by hand"), "pasted": marked("pasted"), "upload": marked("from files"),
    "api": marked("by interface"), "simulation": marked("simulated"), "withdrawn": marked("withdrawn"),
}  # fmt: skip

_KINDS: Final = {
    "calibrate": marked("Calibration"), "import": marked("Reading of records"),
    "simulate": marked("Simulation"), "validate": marked("Validation"),
    "follow": marked("Study of drift"),
}  # fmt: skip

_PHASES: Final = {
    "": "", "solving": marked("solving"), "simulating": marked("simulating"), "reading": marked("reading"),
    "keeping": marked("keeping the records"), "drawing": marked("drawing"), "studying": marked("studying the drift"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Mark:
    """A status: class of its shape, and the word."""

    shape: str
    word: str


def vega_address() -> str:
    """Where the Vega bundle is; the version makes it cacheable for ever."""
    return f"/lib/vega.js?v={VEGA_VERSION}"


def symbol(name: str) -> Markup:
    """A quantity's symbol: italic letter, upright index; ωк in Russian as in the paper."""
    letter, index = _index(name)
    sub = Markup("<sub>{}</sub>").format(index) if index else ""
    return Markup('<span class="q">{}{}</span>').format(letter, sub)


def symbol_text(name: str) -> str:
    """A quantity's symbol where no markup can stand: ``ω0x``."""
    return "".join(_index(name))


def _index(name: str) -> tuple[str, str]:
    letter, index = _SYMBOLS[name]
    return letter, _RUSSIAN_INDEX.get(name, index) if LOCALE.get() == "ru" else index


def parameter(name: str) -> str:
    """A parameter in words."""
    return gettext(PARAMETER_NAMES[name])


def field(name: str) -> str:
    """Name of a parameter's column or field, with its unit: ``w0x_deg_per_h``."""
    return f"{name}_{_SUFFIXES[name]}"


def unit(name: str) -> str:
    """A unit as it is printed."""
    return gettext(_UNITS[name])


def role(name: str) -> str:
    """A role in words."""
    return gettext(_ROLES.get(name, name))


def method(name: str) -> str:
    """A method in words."""
    return gettext(_METHODS.get(name, name))


def origin(name: str) -> str:
    """How a session or a measurement came in."""
    return gettext(_ORIGINS.get(name, name))


def job_kind(name: str) -> str:
    """What a job does."""
    return gettext(_KINDS.get(name, name))


def job_phase(name: str) -> str:
    """What a job is doing."""
    return gettext(_PHASES.get(name, name))


_VERDICTS: Final = {
    "conforms": Mark("ok", marked("Within limits")),
    "conditional": Mark("attention", marked("Conditional")),
    "fails": Mark("out", marked("Out of limits")),
    "no-limit": Mark("todo", marked("No limits set")),
    "undetermined": Mark("attention", marked("Not determined")),
    "none": Mark("todo", marked("Not calibrated")),
}

_ONE: Final = {
    "conforms": Mark("ok", marked("Conforms")), "conditional": Mark("attention", marked("Conditional")),
    "fails": Mark("out", marked("Out of limits")), "no-limit": Mark("todo", marked("No limit")),
    "undetermined": Mark("attention", marked("Not determined")),
}  # fmt: skip


def verdict(name: str) -> Mark:
    """Verdict on a whole result."""
    return _said(_VERDICTS[name])


def parameter_verdict(name: str) -> Mark:
    """Verdict on one parameter."""
    return _said(_ONE[name])


def result_status(result: ResultSummary | None) -> str:
    """Key of a gyro's status: its latest verdict, ``none`` without a result."""
    return result.verdict if result else "none"


def session_mark(session: SessionView) -> Mark:
    """What state a session is in."""
    if session.state == "solved" and session.result:
        return verdict(session.result.verdict)
    job = session.job
    if session.state == "solving" and job:
        return job_mark(job)
    if session.state == "failed":
        return Mark("out", gettext("Not solved"))
    if session.state == "ready":
        return Mark("due", gettext("Ready to solve"))
    if session.positions_measured == 0:
        return Mark("todo", gettext("To be measured"))
    return Mark("running", gettext("Measuring"))


_JOBS: Final = {
    "queued": Mark("todo", marked("Waiting")), "running": Mark("running", marked("Running")),
    "succeeded": Mark("ok", marked("Done")), "failed": Mark("out", marked("Failed")),
    "cancelled": Mark("excluded", marked("Cancelled")),
}  # fmt: skip


def job_mark(job: JobView) -> Mark:
    """What state a job is in."""
    return _said(_JOBS[job.state])


def problem_texts(job: JobView) -> Sequence[str]:
    """Why a job failed, in the current language."""
    return [translate(item) for item in job.problems]


_DUE: Final = {
    "overdue": Mark("overdue", marked("Overdue")), "never": Mark("todo", marked("Never calibrated")),
    "due-soon": Mark("due", marked("Due soon")), "valid": Mark("ok", marked("In time")),
    "no-interval": Mark("todo", marked("No interval set")),
}  # fmt: skip


def due(state: str) -> Mark:
    """Whether a gyro has to be calibrated again."""
    return _said(_DUE[state])


def _said(mark: Mark) -> Mark:
    return Mark(mark.shape, gettext(mark.word))
