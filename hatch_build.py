"""Build hook of the wheel: brings the prebuilt kernels of a platform, so that users need no compiler.

SHELDRAKE_WHEEL_PLATFORM names the platform (default: this machine); SHELDRAKE_NO_PREBUILT=1 makes a plain wheel.
An editable install gets no library: its sources may change.
"""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


def _environment(root: pathlib.Path) -> dict[str, str]:
    """This process's environment with our sources in front; pip's isolated builds live in PYTHONPATH, so it stays."""
    paths = [str(root / "src"), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


class PrebuiltKernels(BuildHookInterface):
    """Puts kernels.<ending> and kernels.json into sheldrake/_prebuilt and gives the wheel its platform tag."""

    def initialize(self, version: str, build_data: dict) -> None:
        """Called by hatchling before a wheel is put together."""
        if version == "editable" or self.target_name != "wheel" or os.environ.get("SHELDRAKE_NO_PREBUILT"):
            return
        root = pathlib.Path(self.root)
        out = pathlib.Path(os.environ.get("SHELDRAKE_PREBUILT_DIR", root / "build" / "prebuilt"))
        name = os.environ.get("SHELDRAKE_WHEEL_PLATFORM", "")
        try:
            sys.path.insert(0, str(root / "src"))
            from sheldrake.common._native import build

            name = name or build.host_platform()
            if not self._is_current(out / name):
                self.app.display_info(f"compiling the kernels for {name}: about a minute a level")
                command = [sys.executable, "-m", "sheldrake.common._native.build", str(out), name]
                subprocess.run(command, check=True, env=_environment(root))
        except (ImportError, OSError, RuntimeError, subprocess.CalledProcessError) as error:
            if os.environ.get("SHELDRAKE_WHEEL_PLATFORM"):
                raise
            self.app.display_warning(f"a plain wheel, without prebuilt kernels (they compile at first use): {error}")
            return
        target = build.PLATFORMS[name]
        for file in (f"kernels{target.ending}", "kernels.json", "wasm32.zip"):
            if not (out / name / file).exists():
                self.app.display_warning(
                    f"no {file}: this wheel writes pages only where a compiler is (ziglang made none)"
                )
                continue
            build_data["force_include"][str(out / name / file)] = f"sheldrake/_prebuilt/{file}"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{target.wheel_tag}"

    @staticmethod
    def _is_current(folder: pathlib.Path) -> bool:
        from sheldrake.common._native.source import source_hashes

        try:
            manifest = json.loads((folder / "kernels.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return False
        return manifest.get("sources") == source_hashes()
