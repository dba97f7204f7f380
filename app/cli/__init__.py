"""The command ``driftbook``: one module per command, loaded when it is asked for.

Exit codes: 0 done, 2 wrong usage or bad input (one line on standard error says what, where and
what to do), 1 anything else.
"""

import importlib
import sys
from typing import Final, NoReturn

import typer
from typer._click.core import Command, Context
from typer._click.exceptions import ClickException, NoArgsIsHelpError
from typer.core import TyperGroup
from typer.main import get_command

from app import logs
from app.errors import AppError

_WHERE: Final = {
    "demo": "demo:demo",
    "serve": "service:serve",
    "migrate": "service:migrate",
    "solve": "solve:solve",
    "plan": "plan:plan",
    "simulate": "simulate:simulate",
    "simdevice": "simdevice:simdevice",
    "upload": "upload:upload",
    "user": "accounts:users",
    "token": "accounts:tokens",
    "station": "station:station",
    "validate": "validate:validate",
}


class _Commands(TyperGroup):
    """Imports a command's module when the command is used: solving a file loads no web server."""

    def list_commands(self, ctx: Context) -> list[str]:
        return list(_WHERE)

    def get_command(self, ctx: Context, cmd_name: str) -> Command | None:
        if cmd_name not in _WHERE:
            return None
        module, _, function = _WHERE[cmd_name].partition(":")
        found = getattr(importlib.import_module(f"app.cli.{module}"), function)
        if not isinstance(found, typer.Typer):
            alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
            alone.command(cmd_name)(found)
            found = alone
        command = get_command(found)
        command.name = cmd_name  # a group has none of its own, and the help lists commands by it
        return command


commands = typer.Typer(
    cls=_Commands,
    name="driftbook",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@commands.callback()
def _driftbook() -> None:
    """Calibration book of dynamically tuned gyroscopes."""


def main() -> None:
    """Run the command line and exit."""
    logs.configure()
    try:
        sys.exit(commands(standalone_mode=False))
    except AppError as error:
        first, more = error.problems[0].text, len(error.problems) - 1
        _refuse(first + (f" (and {more} more)" if more else ""))
    except NoArgsIsHelpError:  # the help has been shown
        sys.exit(2)
    except ClickException as error:
        _refuse(error.format_message())
    except OSError as error:
        if error.filename is None:
            raise
        _refuse(f"{error.filename}: {error.strerror}. Check the path and who may write there.")


def _refuse(sentence: str) -> NoReturn:
    typer.echo(f"driftbook: {sentence}", err=True)
    sys.exit(2)
