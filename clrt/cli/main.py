"""The command `clrt`. A first argument that is no command is a scene to render."""

from __future__ import annotations

import importlib
import sys
from collections.abc import MutableMapping, Sequence
from pathlib import Path
from typing import Any

import click

from clrt import __version__
from clrt.cli import failure, interrupt, streams
from clrt.cli.paths import DEFAULT_SCENE

#: a command and the module that has it, in the order of the help; imported when called for, so that `clrt --help` is quick
_COMMANDS = {"render": "render", "explain": "explain", "study": "study", "devices": "devices", "verify": "verify", "convert": "scenes",
             "make": "scenes"}  # fmt: skip

_HELP = """Render a scene text or a glTF model to a picture.

    \b
    clrt scene.txt                     writes scene.png into the current folder
    clrt scene.txt -o picture.ppm --size 640x480
    clrt model.glb --size 800x600      a glTF scene, with its own cameras and lights
    clrt ./devices                     a scene that is called like a command

Without any argument, input.txt of the current folder is rendered. Exit codes: 0 done, 1 a fault of clrt, 2 something to mend,
130 interrupted.
"""


class _RenderByDefault(click.Group):
    """A group whose first argument may be a scene instead of a command."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        command = getattr(importlib.import_module(f"clrt.cli.{_COMMANDS[cmd_name]}"), cmd_name)
        assert isinstance(command, click.Command)
        return command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args:
            args = ["render"] if Path(DEFAULT_SCENE).exists() else ["--help"]
        elif args[0] not in {*_COMMANDS, *ctx.help_option_names, "--version"}:
            args = ["render", *args]
        return super().parse_args(ctx, args)

    def collect_usage_pieces(self, ctx: click.Context) -> list[str]:
        return ["[OPTIONS] [SCENE] | COMMAND ..."]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options of `render`, then the other commands: the word `render` is never needed."""
        render = self.get_command(ctx, "render")
        assert render is not None
        options = [param for param in (*render.params, *self.params) if isinstance(param, click.Option)]
        rows = [record for option in options if (record := option.get_help_record(ctx)) is not None]
        rows.append(("-h, --help", "Show this message and exit."))
        with formatter.section("Options"):
            formatter.write_dl(rows)
        with formatter.section("Commands"):
            names = [name for name in _COMMANDS if name != "render"]
            commands = {name: self.get_command(ctx, name) for name in names}
            formatter.write_dl([(name, command.get_short_help_str(100)) for name, command in commands.items() if command])

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: Any,
    ) -> Any:
        """As click's, but every failure becomes one line of text and an exit code (see failure.py)."""
        name = prog_name or "clrt"
        if not standalone_mode:
            return super().main(args, name, complete_var, standalone_mode=False, **extra)
        interrupt.advise(str)
        try:
            result = super().main(args, name, complete_var, standalone_mode=False, **extra)
        except (Exception, KeyboardInterrupt) as error:
            result = failure.report(error)
        except SystemExit as end:  # click's way for EPIPE: from a file that was written to, or else from standard output
            broken = end.__context__
            result = failure.report(broken) if isinstance(broken, OSError) and broken.filename else 0
        streams.settle()
        sys.exit(result if isinstance(result, int) else 0)


_SETTINGS: MutableMapping[str, Any] = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


@click.group("clrt", cls=_RenderByDefault, help=_HELP, context_settings=_SETTINGS, no_args_is_help=False)
@click.version_option(__version__, prog_name="clrt", message="%(prog)s %(version)s")
def cli() -> None:
    """The help is `_HELP`."""


def main() -> None:
    """The console script: the command under a guard that lets Ctrl-C end it within a second."""
    import atexit
    import os

    from clrt.cli import clock

    clock.begin()
    interrupt.watch()
    try:
        cli.main(prog_name="clrt")
    except SystemExit as end:
        if end.code == interrupt.EXIT_CODE:
            interrupt.leave()
        # Everything is written; freeing all objects one by one, and the compiler with them, would take another tenth of a second.
        atexit._run_exitfuncs()
        streams.settle()
        os._exit(end.code if isinstance(end.code, int) else 0)
