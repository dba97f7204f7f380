"""The command ``driftbook``: one module per group of commands.

Exit codes: 0 done, 2 wrong usage or bad input (one line on standard error says what, where and
what to do), 1 anything else.
"""

import sys

import typer

from app.cli import accounts, demo, service, simulate, solve, upload
from app.errors import AppError

commands = typer.Typer(
    name="driftbook",
    help="Calibration book of dynamically tuned gyroscopes.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
commands.command("demo")(demo.demo)
commands.command("serve")(service.serve)
commands.command("migrate")(service.migrate)
commands.command("solve")(solve.solve)
commands.command("simulate")(simulate.simulate)
commands.command("upload")(upload.upload)
commands.add_typer(accounts.users, name="user")
commands.add_typer(accounts.tokens, name="token")


def main() -> None:
    """Run the command line and exit."""
    try:
        commands()
    except AppError as error:
        first, more = error.problems[0].text, len(error.problems) - 1
        print(f"driftbook: {first}" + (f" (and {more} more)" if more else ""), file=sys.stderr)
        sys.exit(2)
