"""A real service, a real Chromium, and what no page may do: break the policy or shut people out."""

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, sync_playwright


@dataclass(frozen=True)
class Running:
    """A service on a data folder, and how to sign in."""

    url: str
    link: str = ""
    name: str = ""
    password: str = ""


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "app", *arguments]


def started(arguments: list[str], last_word: str, log: Path) -> tuple[subprocess.Popen[str], list[str]]:
    """Start a command and read what it prints until the line that says it is ready."""
    with log.open("w") as errors:
        process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=errors, text=True)
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        lines.append(line.strip())
        if last_word in line:
            return process, lines
    process.wait()
    raise AssertionError(f"{arguments} ended: {lines} {log.read_text()}")


def stopped(process: subprocess.Popen[str], log: Path) -> None:
    """Stop it; the service must not have met anything unforeseen."""
    process.terminate()
    process.wait(20)
    assert process.stdout is not None
    process.stdout.close()
    assert "Traceback" not in log.read_text()


@pytest.fixture(scope="session")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """An empty laboratory with one account."""
    folder = tmp_path_factory.mktemp("empty")
    data, log = str(folder / "data"), folder / "log"
    add = command(
        "user", "add", "petrova", "--role", "technician", "--full-name", "I. Petrova", "--data", data
    )
    password = subprocess.run(add, check=True, capture_output=True, text=True).stdout.strip()
    process, lines = started(command("serve", "--port", "0", "--data", data), "Driftbook is on", log)
    yield Running(lines[-1].rsplit(" ", 1)[1], name="petrova", password=password)
    stopped(process, log)


@pytest.fixture(scope="session")
def demonstration(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """The demonstration laboratory."""
    folder = tmp_path_factory.mktemp("demo")
    data, log = str(folder / "data"), folder / "log"
    process, lines = started(command("demo", "--port", "0", "--data", data), "Sign in:", log)
    link = lines[-1].rsplit(" ", 1)[1]
    yield Running(link.partition("/sign-in")[0], link=link)
    stopped(process, log)


@pytest.fixture(scope="module")
def serve(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Callable[..., tuple[subprocess.Popen[str], str]]]:
    """Starts a service on a data folder, on a free port or the one given; gives its process and address."""
    folder, processes = tmp_path_factory.mktemp("served"), []

    def start(data: Path, port: int = 0) -> tuple[subprocess.Popen[str], str]:
        log = folder / f"log-{len(processes)}"
        process, lines = started(
            command("serve", "--port", str(port), "--data", str(data)), "Driftbook is on", log
        )
        processes.append((process, log))
        return process, lines[-1].rsplit(" ", 1)[1]

    yield start
    for process, log in processes:
        stopped(process, log)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    path = shutil.which("chromium")
    assert path, "install Debian's package chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path)
        yield browser
        browser.close()


@pytest.fixture
def complaints() -> Iterator[list[str]]:
    """What the browser complained of: broken policy, failed scripts. It must stay empty."""
    found: list[str] = []
    yield found
    assert found == []


@pytest.fixture
def open_context(chromium: Browser, complaints: list[str]) -> Iterator[Callable[..., BrowserContext]]:
    """Opens browser windows that report every violation of the policy."""
    contexts = []

    def note(message: ConsoleMessage) -> None:
        if message.type == "error" and "status of 4" not in message.text:
            complaints.append(message.text)

    def make(**options: object) -> BrowserContext:
        context = chromium.new_context(
            **({"viewport": {"width": 1280, "height": 720}, "locale": "en-GB"} | options)
        )
        context.set_default_timeout(20_000)
        context.on("console", note)
        context.on("weberror", lambda error: complaints.append(str(error.error)))
        context.expose_binding("reportViolation", lambda _source, text: complaints.append(text))
        context.add_init_script(
            "addEventListener('securitypolicyviolation',"
            " event => reportViolation(event.violatedDirective + ' ' + event.blockedURI))"
        )
        contexts.append(context)
        return context

    yield make
    for context in contexts:
        context.close()


# Nine tenths of axe's work is the contrast of every text with what is behind it, again for every cell of a table.
# It follows from the computed styles of the text and of what it lies in: three of each kind on a page are looked at.
_EXAMINE = """async () => {
  const kinds = new Map(), numbers = new Map(), looks = [
    "color", "fill", "backgroundColor", "backgroundImage", "opacity", "filter", "mixBlendMode", "textShadow",
    "fontSize", "fontWeight", "position", "clipPath", "overflowX", "overflowY",
  ];
  const kind = (element) => {  // a number for its styles and those of everything around it
    if (!element) return 0;
    if (!kinds.has(element)) {
      const style = getComputedStyle(element);
      const key = JSON.stringify([kind(element.parentElement), ...looks.map((name) => style[name])]);
      if (!numbers.has(key)) numbers.set(key, numbers.size + 1);
      kinds.set(element, numbers.get(key));
    }
    return kinds.get(element);
  };
  const written = (element) => element.matches("input, select, textarea")
    || (element.textContent.trim().length > 1  // axe passes no judgement on a single character
      && [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.data.trim()));
  const counts = new Map(), chosen = [];
  for (const element of document.body.querySelectorAll("*")) {
    if (!written(element) || !element.checkVisibility({visibilityProperty: true})) continue;
    const count = (counts.get(kind(element)) ?? 0) + 1;
    counts.set(kind(element), count);
    if (count <= 3) chosen.push(element);
  }
  const asked = {resultTypes: ["violations"], preload: false};
  const whole = await axe.run(document, {...asked, rules: {"color-contrast": {enabled: false}}});
  const contrast = await axe.run({include: chosen}, {...asked, runOnly: ["color-contrast"]});
  return [...whole.violations, ...contrast.violations];
}"""


@pytest.fixture(scope="session")
def accessible() -> Callable[[Page], None]:
    """Asserts that axe finds nothing serious on the page as it stands."""
    axe = Axe()

    def check(page: Page) -> None:
        page.evaluate(axe.axe_script)
        serious = [
            f"{page.url}: {item['id']}: {node['html'][:160]}"
            for item in page.evaluate(_EXAMINE)
            if item["impact"] in ("serious", "critical")
            for node in item["nodes"][:3]
        ]
        assert serious == []

    return check


@pytest.fixture
def screenshot(request: pytest.FixtureRequest) -> Callable[[Page, str], None]:
    """Keeps a picture when the folder ``screenshots`` is there, for a person to look at."""
    folder = Path(request.config.rootpath) / "screenshots"

    def take(page: Page, name: str) -> None:
        if folder.is_dir():
            page.screenshot(path=folder / f"{name}.png", full_page=True)

    return take
