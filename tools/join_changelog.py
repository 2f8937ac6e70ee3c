"""Joins the fragments of changelog/ to the text of a release: `python tools/join_changelog.py [VERSION]`.

Prints it; at a release it goes on top of CHANGELOG.md, and the fragments go. `tools/make_docs.py` shows it as the page
of what is coming. A fragment that no area names comes last.
"""

from __future__ import annotations

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
AREAS = {
    "Getting started": "alias-and-cli docs examples-gallery cameras-guide soft-ball examples retired-names "
    "prebuilt-all compile-time foreign-platforms",
    "Systems and simulation": "framework saved-contexts python-callbacks integrators controllers estimators "
    "trajectories answers-of-systems lcm image-messages regions-and-pictures",
    "Bodies and joints": "multibody-plant tree-kernels spatial-algebra bushings force-systems dry-friction loops "
    "plant-constraints plant-forces-and-constraints continuous-constraints random-positions queries queries-2 arms "
    "real-robots benchmark-mechanisms known-motions",
    "Contact": "contact-solvers plant-step contact-islands many-contacts contact-margin contact-answers solver-failure "
    "explain-contact hydroelastic-meshes hydroelastic-surfaces hydroelastic-step",
    "Geometry": "geometry-scene-graph geometry-values geometry-contacts geometry-meshes geometry-in-contexts ray-casts "
    "refine-volume-mesh obj-quadrilaterals convex-sets graphs-of-convex-sets",
    "Models": "urdf sdformat mjcf model-directives package-map mesh2urdf doctor convert",
    "Looking at it": "meshcat meshcat-visualizer meshcat-page multibody-meshcat model-visualizer show-hydroelastic "
    "block-diagram planar-visualizer logs plot-log report rendering cameras images-and-video perception",
    "Planning and optimization": "solvers inverse-kinematics planning gcs-trajectories multibody-optimization "
    "manipulation",
    "Derivatives and symbols": "autodiff symbolic dual-queries dual-plant-ports query-derivatives symbolic-plants",
    "Mathematics and values": "math rotations common common-value yaml-and-schema nan arguments-of-wrong-types",
}
"""Of each area: the fragments, in the order in which they read best."""


def entries(fragment: str) -> list[str]:
    """Returns the entries of a fragment, each one a list item; text without items is one."""
    text = fragment.strip()
    items = re.split(r"^- ", text, flags=re.MULTILINE)
    items = [items[0].strip(), *(item.strip() for item in items[1:])] if text.startswith("- ") else [text]
    return ["- " + re.sub(r"\n *", "\n  ", item) for item in items if item]


def join(folder: pathlib.Path, version: str) -> str:
    """Returns the text of a release.

    Raises:
        ValueError: when a fragment is empty.
    """
    fragments = {path.stem: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.md"))}
    fragments.pop("README", None)
    empty = [name for name, text in fragments.items() if not text.strip()]
    if empty:
        raise ValueError(f"join(): fragments {empty} in {folder} are empty.")
    areas = {area: [name for name in names.split() if name in fragments] for area, names in AREAS.items()}
    named = {name for names in areas.values() for name in names}
    areas["Also"] = [name for name in fragments if name not in named]
    lines = [f"## {version}"]
    for area, names in areas.items():
        if names:
            lines += ["", f"### {area}", ""]
            lines += [item for name in names for item in entries(fragments[name])]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(join(ROOT / "changelog", sys.argv[1] if len(sys.argv) > 1 else "To come"), end="")
