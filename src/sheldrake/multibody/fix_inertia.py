"""Puts inertias of the geometry in the place of impossible ones in a URDF or SDFormat file.

    python -m sheldrake.multibody.fix_inertia robot.urdf better.urdf

Takes the words of Drake's tool of this name. Only what stands in `<inertial>` changes; without an output file the
result goes to the standard output. `sheldrake doctor` finds more, and inertias that are possible but do not fit the
geometry.
"""

from __future__ import annotations

import argparse

_NAMES = ("proximity", "illustration", "perception")


def main(argv: list[str] | None = None) -> int:
    """Runs the tool on the words of a command line; by default the process's own.

    Returns:
        The exit status, 0.

    Raises:
        SystemExit: The words make no sense.
        RuntimeError: The file can not be read.
    """
    from ._inertia_fixer import _ROLES, InertiaFixer

    options = _parser().parse_args(argv)
    by_name = {name: role for role, name in _ROLES.items()}
    options.geom_inertia_role_order = [by_name[name] for name in options.geom_inertia_role_order]
    InertiaFixer(**vars(options)).fix_inertia()
    return 0


def _parser() -> argparse.ArgumentParser:
    assert __doc__ is not None
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="fix_inertia", description=__doc__, formatter_class=formatter)
    parser.add_argument("input_file", help="URDF or SDFormat file")
    parser.add_argument("output_file", nargs="?", help="file to write (default: standard output)")
    parser.add_argument("--in_place", action="store_true", help="change the input file; no output file is written")
    parser.add_argument(
        "--geom_inertia_role_order",
        nargs="+",
        choices=_NAMES,
        default=list(_NAMES),
        help="the first of these roles for which a link has geometry gives its inertia",
    )
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
