"""`sheldrake completion`: commands and options that the Tab key completes.

source <(sheldrake completion bash)                  in ~/.bashrc
source <(sheldrake completion zsh)                   in ~/.zshrc, after compinit
sheldrake completion fish > ~/.config/fish/completions/sheldrake.fish
"""

from __future__ import annotations

import argparse

SHELLS = ("bash", "zsh", "fish")

_BASH = """\
_sheldrake() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} words=""
    if [ "$COMP_CWORD" -eq 1 ]; then
        words="{commands}"
    else
        case "${{COMP_WORDS[1]}}" in
{cases}
        esac
        case "$word" in -*) ;; *) words="" ;; esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
    if [ "$COMP_CWORD" -gt 1 ] && [ "${{#COMPREPLY[@]}}" -eq 0 ]; then COMPREPLY=($(compgen -f -- "$word")); fi
}}
complete -o filenames -F _sheldrake sheldrake
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake completion` takes."""
    parser.add_argument("shell", choices=SHELLS, help="for which shell")


def run(options: argparse.Namespace) -> int:
    """Prints the script for a shell."""
    from ._main import _parser

    print(script(_parser(), options.shell), end="")
    return 0


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The script of a shell for a parser with commands; `shell` is one of SHELLS."""
    actions = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    (commands,) = actions
    about = {choice.dest: str(choice.help) for choice in commands._choices_actions}
    options = {name: _options(command) for name, command in commands.choices.items()}
    if shell == "fish":
        return _fish(about, options)
    cases = "\n".join(f'            {n}) words="{" ".join(found)}" ;;' for n, found in options.items())
    text = _BASH.format(commands=" ".join([*options, "--version", "--help"]), cases=cases)
    return text if shell == "bash" else f"autoload -U +X bashcompinit && bashcompinit\n{text}"


def _options(command: argparse.ArgumentParser) -> dict[str, str]:
    """Every option of a command, and what it is for."""
    return {name: str(action.help or "") for action in command._actions for name in action.option_strings}


def _fish(about: dict[str, str], options: dict[str, dict[str, str]]) -> str:
    lines = []
    for name, text in about.items():
        lines.append(f"complete -c sheldrake -n __fish_use_subcommand -f -a {name} -d {_quoted(text)}")
    for command, found in options.items():
        for option, text in found.items():
            kind = "-l" if option.startswith("--") else "-s"
            where = f"'__fish_seen_subcommand_from {command}'"
            lines.append(f"complete -c sheldrake -n {where} {kind} {option.lstrip('-')} -d {_quoted(text)}")
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
