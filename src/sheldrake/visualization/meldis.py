"""Shows in a page what simulations in other processes publish: `python -m sheldrake.visualization.meldis`.

They publish with `DrakeVisualizer`, or with `ApplyVisualizationConfig(..., lcm=DrakeLcm())`.
"""

from __future__ import annotations

import argparse
import sys
import webbrowser

from sheldrake.geometry import MeshcatParams
from sheldrake.visualization._meldis import Meldis

__all__: list[str] = []


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host", help="what the page's server listens on (default localhost)")
    parser.add_argument("-p", "--port", type=int, metavar="NUM", help="its port (default: a free one from 7000 on)")
    opening = parser.add_mutually_exclusive_group()
    opening.add_argument("-t", "--open-tab", dest="new", action="store_const", const=2, help="open a browser tab")
    opening.add_argument("-w", "--open-window", dest="new", action="store_const", const=1, help="open a window")
    parser.add_argument("--browser", metavar="NAME", help="which browser opens it")
    parser.add_argument(
        "--idle-timeout",
        type=float,
        default=900.0,
        metavar="TIME",
        help="end after so long without a page [s]; 0: stay",
    )
    parser.add_argument("--meshcat-params", metavar="PATH", help="a YAML file with MeshcatParams")
    parser.add_argument("--environment_map", metavar="PATH", help="an image for reflections")
    return parser


def _main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    params = None
    if options.meshcat_params is not None:
        from sheldrake.common.yaml import yaml_load_typed

        params = yaml_load_typed(schema=MeshcatParams, filename=options.meshcat_params)
    meldis = Meldis(
        meshcat_host=options.host,
        meshcat_port=options.port,
        meshcat_params=params,
        environment_map=options.environment_map,
    )
    if options.new is not None or options.browser is not None:
        webbrowser.get(options.browser).open(meldis.meshcat.web_url(), new=options.new or 1)
    try:
        meldis.serve_forever(idle_timeout=options.idle_timeout)
    except KeyboardInterrupt:
        print()
    return 0


if __name__ == "__main__":
    sys.exit(_main())
