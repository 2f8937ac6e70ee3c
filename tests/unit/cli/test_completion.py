"""`sheldrake completion`: what the scripts complete, asked of the shells themselves where they are installed."""

import shutil
import subprocess

import pytest

from sheldrake.cli import main


@pytest.fixture
def script(capsys):
    def printed(shell):
        assert main(["completion", shell]) == 0
        return capsys.readouterr().out

    return printed


def completed(script, *words):
    """What bash would offer for the last word."""
    call = f"COMP_WORDS=({' '.join(repr(w) for w in words)}); COMP_CWORD={len(words) - 1}; _sheldrake"
    text = f'{script}\n{call}\nprintf "%s\\n" "${{COMPREPLY[@]}}"\n'
    done = subprocess.run(["bash", "-c", text], capture_output=True, text=True, check=True)
    return done.stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_options_and_files(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.urdf").write_text("")
    text = script("bash")
    assert completed(text, "sheldrake", "co") == ["convert", "completion"]
    assert completed(text, "sheldrake", "convert", "--s") == ["--strict"]
    assert completed(text, "sheldrake", "convert", "--strict", "rob") == ["robot.urdf"]


def test_other_shells_name_every_command(script):
    zsh, fish = script("zsh"), script("fish")
    assert zsh.startswith("autoload") and "bashcompinit" in zsh
    for command in ("run", "info", "view", "doctor", "guide"):
        assert f"-a {command} " in fish and f"{command})" in zsh
    assert "__fish_seen_subcommand_from doctor' -l json" in fish


@pytest.mark.skipif(shutil.which("fish") is None, reason="there is no fish")
def test_fish_takes_the_script(script, tmp_path):
    path = tmp_path / "sheldrake.fish"
    path.write_text(script("fish"))
    subprocess.run(["fish", "--no-execute", str(path)], check=True)
